"""The clock over the stages of a job, and who is told of its steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from planner.planning.job.trace import Log, Tell, Teller, tell_nobody

Progress = Callable[[str, float], None]


class Stages:
    """Measures the time of the stages of a job, and tells the caller which stage is running.

    timings  : seconds by stage; a stage that runs several times is summed up
    progress : called with the stage's name and the fraction done
    log      : called with every step (planning/job/trace.py)
    """

    def __init__(self, progress: Progress | None = None, log: Log | None = None):
        self.timings: dict[str, float] = {}
        self.tell: Tell = tell_nobody if log is None else Teller(log)
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Run a stage under the clock. Yields a function to call with the fraction done (0 to 1)."""
        self._tell(name, 0.0)
        began = time.perf_counter()
        try:
            yield lambda fraction: self._tell(name, fraction)
        finally:
            self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - began
        self._tell(name, 1.0)

    def _tell(self, name: str, fraction: float) -> None:
        if self._progress is not None:
            self._progress(name, fraction)
