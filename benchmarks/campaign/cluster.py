"""Jobs of the campaign on the workers of a Dask cluster, in parts, each in a process that is ended if a job takes too long.

    dask scheduler                                        # on one machine
    dask worker ADDRESS --no-nanny --nthreads 4           # on each, in a checkout of the same commit
    python -m benchmarks campaign --count 10000 --cluster ADDRESS

A worker under a nanny is a process that may have no processes of its own, and a worker at another commit would mix commits: both are
refused before a job is planned there. What was done when the campaign ends in any way is kept, and the same command goes on with it.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError
from typing import Any

from benchmarks.record import planner_state
from planner.base.errors import InputError, NotSolvedError

PART = 10  # jobs of a task: what the end of a campaign loses of each worker
WAIT = 30  # for a scheduler [s]
Row = dict[str, Any]


def rows_on_cluster(address: str, seeds: list[int], seconds: float, limit: float) -> Iterator[Row]:
    """The rows of jobs as their parts are done, each with `limit` CPU s; no part is begun after so many seconds.

    Raises InputError where no scheduler answers, where it has no workers, and for a worker that cannot take part; NotSolvedError where
    the scheduler goes away.
    """
    import distributed

    try:
        client = distributed.Client(address, timeout=WAIT, set_as_default=False)
    except (OSError, ValueError) as fault:
        raise InputError(f"--cluster {address}: no scheduler answers there ({fault})") from None
    commit, end = planner_state(), time.monotonic() + seconds
    parts = [seeds[first : first + PART] for first in range(0, len(seeds), PART)]
    with client:
        places = sum(worker["nthreads"] for worker in client.scheduler_info()["workers"].values())
        if not places:
            raise InputError(
                f"--cluster {address}: its scheduler has no workers; start some with: dask worker {address} --no-nanny"
            )
        # no more tasks than workers take at once: those that wait would be begun although the time is over
        running = distributed.as_completed(
            [
                client.submit(part, parts.pop(0), limit, commit, pure=False)
                for _ in range(min(places, len(parts)))
            ],
            loop=client.loop,
        )
        for done in running:
            try:
                yield from done.result()
            except (CancelledError, distributed.comm.CommClosedError, distributed.KilledWorker) as fault:
                raise NotSolvedError(
                    f"--cluster {address}: the scheduler has gone, or workers died over one part ({fault})"
                ) from None
            if parts and time.monotonic() < end:
                running.add(client.submit(part, parts.pop(0), limit, commit, pure=False))


def part(seeds: list[int], limit: float, commit: str) -> list[Row]:
    """The rows of some jobs, in a worker. Raises InputError where it cannot have processes or has another planner."""
    from benchmarks.campaign import rows_of

    if multiprocessing.current_process().daemon:
        raise InputError(
            "a worker has a nanny, and may have no processes of its own: dask worker ADDRESS --no-nanny"
        )
    here = planner_state()
    if here != commit:
        raise InputError(
            f"a worker has the planner of {here or 'no commit'} where the campaign has that of {commit}"
        )
    return list(rows_of(seeds, 1, float("inf"), limit))
