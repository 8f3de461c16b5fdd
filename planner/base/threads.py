"""How many threads the planner may use. What it finds does not depend on it."""

import functools
import os
from collections.abc import Callable, Sequence
from itertools import pairwise

PERIOD = 0.1  # [s]
_given: int | None = None


def use_threads(count: int | None) -> None:
    """Use so many threads from now on; None for one per core that this process may run on."""
    global _given
    if count is not None and count < 1:
        raise ValueError(f"{count} threads; there must be at least one")
    _given = count


def threads() -> int:
    """How many threads to use."""
    return cores() if _given is None else _given


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def side_by_side(
    work: Sequence[Callable[[], None]], stop: Callable[[], None], waiting: Callable[[], None]
) -> None:
    """Run all of `work` in as many threads as there may be, in this order; returns when all is done.

    stop    : called after an error or an interrupt, which is then raised: ends what still runs soon
    waiting : called in this thread, about once in `PERIOD`
    """
    # not loaded by commands that solve nothing
    from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait

    with ThreadPoolExecutor(max_workers=min(threads(), len(work))) as pool:
        running = [pool.submit(task) for task in work]
        try:
            pending = set(running)
            while pending:
                done, pending = wait(pending, timeout=PERIOD, return_when=FIRST_EXCEPTION)
                for future in done:
                    future.result()
                waiting()
        except BaseException:
            stop()
            for future in running:
                future.cancel()
            raise


def in_parts(count: int, least: int, work: Callable[[int, int], None]) -> None:
    """Call `work` for parts first, beyond of 0..count, side by side; all at once where there is one thread,
    or less than two parts of `least`. What is worked on may not depend on the parts."""
    parts = max(min(threads(), count // least), 1)
    if parts == 1:
        work(0, count)
        return
    ends = [count * k // parts for k in range(parts + 1)]
    tasks = [functools.partial(work, *own) for own in pairwise(ends)]
    side_by_side(tasks, lambda: None, lambda: None)
