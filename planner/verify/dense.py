"""Is the motion that was asked the delivered one? It has to end with the samples and to go through them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from planner.motion.trajectory import Trajectory
from planner.verify.findings import Look, measured
from planner.verify.limits import ACCELERATION
from planner.verify.pieces import PERIOD_ROUNDING, PLACE_ROUNDING, RATIO_ROUNDING
from planner.verify.stream import Limits


class Comparison:
    """Looks at the chunks of the asked motion in passing; `end` is where it ends [s].

    Between two of its times h apart the motion is within a h^2 / 8 of the chord, where the delivered sample must be.
    """

    def __init__(self, trajectory: Trajectory, end: float):
        self.trajectory, self.end = trajectory, end
        axes = len(trajectory.axes)
        self.excess = np.zeros(axes)  # per axis: largest deviation from the chord over h^2 / 8
        self.time = np.zeros(axes)

    def pass_on(
        self, chunks: Iterable[Trajectory], progress: Callable[[float], None]
    ) -> Iterator[Trajectory]:
        """The chunks themselves, compared as they pass; `progress` is told the fraction done."""
        self.last_t, self.last_position = np.empty(0), np.empty((0, len(self.excess)))
        for chunk in chunks:
            self._compare(chunk)
            yield chunk
            progress(min(1.0, float(chunk.t[-1]) / max(self.end, PERIOD_ROUNDING)))

    def _compare(self, chunk: Trajectory) -> None:
        seen_t = np.concatenate([self.last_t, chunk.t])
        position = np.concatenate([self.last_position, chunk.position])
        self.last_t, self.last_position = seen_t[-1:], position[-1:]
        t = self.trajectory.t
        low, high = np.searchsorted(t, [seen_t[0], seen_t[-1]])
        at = slice(
            int(low), min(int(high) + 1, len(t)) if high < len(t) and t[high] == seen_t[-1] else int(high)
        )
        if at.start >= at.stop:
            return
        bow = np.diff(seen_t).max(initial=PERIOD_ROUNDING) ** 2 / 8.0
        for axis in range(len(self.excess)):
            there = np.interp(t[at], seen_t, position[:, axis])
            off = np.maximum(np.abs(there - self.trajectory.position[at, axis]) - PLACE_ROUNDING, 0.0) / bow
            k = int(off.argmax())
            if off[k] > self.excess[axis]:
                self.excess[axis], self.time[axis] = off[k], t[at][k]

    def faults(self, limits: Limits, looks: list[Look]) -> list[str]:
        """What differs, in sentences."""
        t, axes = self.trajectory.t, self.trajectory.axes
        said = []
        if abs(t[0]) > PERIOD_ROUNDING or abs(self.end - t[-1]) > PERIOD_ROUNDING:
            said.append(
                f"motion: it lasts from 0 to {self.end:.9g} s, its samples from {t[0]:.9g} to {t[-1]:.9g} s"
            )
        bound = limits.per_axis[1] * np.maximum(1.0, measured(looks, ACCELERATION)) * (1 + RATIO_ROUNDING)
        for axis in np.flatnonzero(self.excess > bound):
            said.append(f"motion: not the delivered one: {axes[axis]} differs at t = {self.time[axis]:.6g} s")
        return said
