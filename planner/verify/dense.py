"""Is the dense motion the delivered one? It has to cover it and to go through its samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from planner.trajectory import Trajectory
from planner.verify.findings import Look, measured
from planner.verify.limits import ACCELERATION
from planner.verify.pieces import PLACE_ROUNDING, RATIO_ROUNDING
from planner.verify.stream import Limits

PERIOD_ROUNDING = 1e-9  # [s] of a sample's time: the least digit that files print; float64 has it up to 1e6 s


class Comparison:
    """Looks at the dense chunks in passing.

    Between dense samples h apart the motion is within a h^2 / 8 of the chord, where the delivered sample must be.
    """

    def __init__(self, trajectory: Trajectory, progress: Callable[[float], None]):
        self.trajectory, self.progress = trajectory, progress
        self.begin, self.end = np.inf, -np.inf
        self.excess = np.zeros(
            len(trajectory.axes)
        )  # per axis: largest deviation from the chord over h^2 / 8
        self.time = np.zeros(len(trajectory.axes))

    def pass_on(self, chunks: Iterable[Trajectory]) -> Iterator[Trajectory]:
        for chunk in chunks:
            if len(chunk):
                self._compare(chunk)
                yield chunk
                self.progress(min(1.0, self.end / max(self.trajectory.t[-1], PERIOD_ROUNDING)))

    def _compare(self, chunk: Trajectory) -> None:
        self.begin, self.end = min(self.begin, float(chunk.t[0])), float(chunk.t[-1])
        t = self.trajectory.t
        low, high = np.searchsorted(t, [chunk.t[0], chunk.t[-1]])
        at = slice(
            int(low), min(int(high) + 1, len(t)) if high < len(t) and t[high] == chunk.t[-1] else int(high)
        )
        if at.start >= at.stop:
            return
        bow = np.diff(chunk.t).max(initial=PERIOD_ROUNDING) ** 2 / 8.0
        for axis in range(len(self.excess)):
            there = np.interp(t[at], chunk.t, chunk.position[:, axis])
            off = np.maximum(np.abs(there - self.trajectory.position[at, axis]) - PLACE_ROUNDING, 0.0) / bow
            k = int(off.argmax())
            if off[k] > self.excess[axis]:
                self.excess[axis], self.time[axis] = off[k], t[at][k]

    def faults(self, limits: Limits, looks: list[Look]) -> list[str]:
        t, axes = self.trajectory.t, self.trajectory.axes
        said = []
        if self.begin > t[0] + PERIOD_ROUNDING or self.end < t[-1] - PERIOD_ROUNDING:
            said.append(
                f"dense: covers {self.begin:.6g} to {self.end:.6g} s, the samples {t[0]:.6g} to {t[-1]:.6g} s"
            )
        elif len(looks) > 1 and looks[-1].seen.gap_max > self.trajectory.dt + PERIOD_ROUNDING:
            said.append(
                f"dense: a gap of {looks[-1].seen.gap_max:.6g} s, longer than dt = {self.trajectory.dt:.6g} s"
            )
        bound = limits.per_axis[1] * np.maximum(1.0, measured(looks, ACCELERATION)) * (1 + RATIO_ROUNDING)
        for axis in np.flatnonzero(self.excess > bound):
            said.append(
                f"dense: not the delivered motion: {axes[axis]} differs at t = {self.time[axis]:.6g} s"
            )
        return said
