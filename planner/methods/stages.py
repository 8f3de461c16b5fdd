"""What every method shares: the clock over the stages, and the last stages of all, sampling and verification."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from planner.feedrate.rest_to_rest import block_limits, rest_to_rest_times
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.timing import MotionInTime, dense_motion, sample_motion
from planner.trajectory import Trajectory
from planner.verify import Verdict, verify

Progress = Callable[[str, float], None]


class Stages:
    """Times the stages of a job and tells the caller which one is running."""

    def __init__(self, progress: Progress | None = None):
        self.timings: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Run a stage; yields a function that takes the fraction done."""
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


def deliver(
    motion: MotionInTime,
    toolpath: Toolpath,
    machine: Machine,
    stages: Stages,
    not_limited: tuple[str, ...] = (),
) -> tuple[Trajectory, Verdict]:
    """Sample a motion at the interpolation period and have it judged, between the samples too."""
    with stages.stage("sample"):
        trajectory = sample_motion(motion, machine.dt)
    with stages.stage("verify") as progress:
        verdict = verify(
            trajectory,
            toolpath,
            machine,
            dense=dense_motion(motion, machine.dt),
            not_limited=not_limited,
            progress=progress,
        )
    return trajectory, verdict


def stop_time(toolpath: Toolpath, machine: Machine) -> float:
    """Time if every block ran from rest to rest [s], dwells included: what the plan is compared with."""
    times = rest_to_rest_times(toolpath.length, *block_limits(toolpath, machine))
    return float(times.sum() + np.sum(toolpath.dwell))
