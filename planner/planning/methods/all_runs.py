"""The search for geometry and feed together along all runs of a job: long runs one after the other, the windows of each side by side,
then short ones side by side. What is found does not depend on the number of threads."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial

from planner.base.sizes import SIZES
from planner.base.threads import side_by_side
from planner.joint.parts import FoundRun
from planner.joint.run import TubeRun
from planner.planning.methods.free import Start, search, solver_of
from planner.planning.optimal.effort import Search

LONG = SIZES.searched_shared
# Runs that are not found are planned each by itself; with more than this share of the steps on them the job is, as a whole [-].
FAILED_MOST = 0.5


def searched_runs(
    runs: list[TubeRun], start: Start, dial: Search, report: Callable[[float], None], *, divide: bool
) -> list[FoundRun] | None:
    """What is found on each run; None where more than `FAILED_MOST` of the steps are on runs that are not found as a whole, unless
    `divide` is asked for.

    divide : divide windows that fail, and keep the guess where nothing faster is found (joint/own.py)
    """
    size = [len(start.guess(k, run)) for k, run in enumerate(runs)]
    found: list[FoundRun | None] = [None for _ in runs]
    stopped = threading.Event()

    def done() -> int:
        return sum(steps for steps, of_run in zip(size, found, strict=True) if of_run is not None)

    def lost() -> int:
        return sum(steps for steps, run in zip(size, found, strict=True) if run is not None and not run.whole)

    def one(k: int, tell: Callable[[float], None]) -> None:
        if stopped.is_set():
            return
        found[k] = search(k, runs[k], [start], solver_of(dial, tell, divide=divide))
        if not divide and lost() > FAILED_MOST * sum(size):
            stopped.set()

    def share(before: int, of_run: int, part: float) -> None:
        report((before + part * of_run) / sum(size))

    for k in range(len(runs)):
        if size[k] > LONG:
            one(k, partial(share, done(), size[k]))
    short = [k for k in range(len(runs)) if size[k] <= LONG]
    work = [partial(one, k, lambda _: None) for k in short]
    if sum(size[k] for k in short) > LONG:
        side_by_side(work, stopped.set, lambda: share(done(), 0, 0.0))
    else:
        for task in work:
            task()
    return None if stopped.is_set() else [of_run for of_run in found if of_run is not None]
