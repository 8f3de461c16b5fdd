"""Is the motion that was asked the delivered one? It has to end with the samples and to go through them."""

from __future__ import annotations

import numpy as np

from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, Kind
from planner.verifier.findings import Look, measured
from planner.verifier.limits import ACCELERATION
from planner.verifier.pieces import PERIOD_ROUNDING, PLACE_ROUNDING, RATIO_ROUNDING
from planner.verifier.records import Limits


class Comparison:
    """Looks at the asked motion beside the delivered samples; `end` is where it ends [s].

    Between two of its times h apart the motion is within a h^2 / 8 of the chord, where the delivered sample must be.
    """

    def __init__(self, axes: tuple[str, ...], end: float):
        self.axes, self.end = axes, end
        self.excess = np.zeros(len(axes))  # per axis: largest deviation from the chord over h^2 / 8
        self.time = np.zeros(len(axes))
        self.begin()

    def begin(self) -> None:
        """From the start of the motion."""
        nothing = np.empty(0), np.empty((0, len(self.axes)))
        self._sample_t, self._sample = nothing  # those that are still to be compared
        self._last_t, self._last = nothing
        self.first = self.last = np.nan  # times of the first and the last sample

    def deliver(self, chunk: Trajectory) -> None:
        """The next delivered samples."""
        self.first = float(chunk.t[0]) if np.isnan(self.first) else self.first
        self.last = float(chunk.t[-1])
        self._sample_t = np.concatenate([self._sample_t, chunk.t])
        self._sample = np.concatenate([self._sample, chunk.position])

    def compare(self, chunk: Trajectory) -> None:
        """The next part of the motion; the samples until its end are delivered."""
        seen_t = np.concatenate([self._last_t, chunk.t])
        position = np.concatenate([self._last, chunk.position])
        self._last_t, self._last = seen_t[-1:].copy(), position[-1:].copy()
        t, low = self._sample_t, int(np.searchsorted(self._sample_t, seen_t[0]))
        at = slice(low, int(np.searchsorted(t, seen_t[-1], side="right")))
        if at.start < at.stop:
            bow = np.diff(seen_t).max(initial=PERIOD_ROUNDING) ** 2 / 8.0
            for axis in range(len(self.excess)):
                there = np.interp(t[at], seen_t, position[:, axis])
                off = np.maximum(np.abs(there - self._sample[at, axis]) - PLACE_ROUNDING, 0.0) / bow
                k = int(off.argmax())
                if off[k] > self.excess[axis]:
                    self.excess[axis], self.time[axis] = off[k], t[at][k]
        left = slice(int(np.searchsorted(t, seen_t[-1])), None)
        self._sample_t, self._sample = t[left].copy(), self._sample[left].copy()

    def faults(self, limits: Limits, looks: list[Look]) -> list[Fault]:
        """What differs."""
        said = []
        if abs(self.first) > PERIOD_ROUNDING or abs(self.end - self.last) > PERIOD_ROUNDING:
            found = (
                f"it lasts from 0 to {self.end:.9g} s, its samples from {self.first:.9g} to {self.last:.9g} s"
            )
            said.append(Fault(kind=Kind.SAMPLES, name="motion", found=found))
        bound = limits.per_axis[1] * np.maximum(1.0, measured(looks, ACCELERATION)) * (1 + RATIO_ROUNDING)
        for axis in np.flatnonzero(self.excess > bound):
            time = float(self.time[axis])
            found = f"not the delivered one: {self.axes[axis]} differs at t = {time:.6g} s"
            said.append(Fault(kind=Kind.SAMPLES, name="motion", found=found, time=time))
        return said
