"""Trajectories of long motions: samples that are evaluated when they are asked for.

What goes through all samples (the verifier, the files) takes them chunk by chunk (`Trajectory.chunks`); the
same chunk gives the same bytes each time. Whoever asks for a whole column gets all of them, kept from then
on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.motion.trajectory import COLUMNS, AnyMotion, Trajectory, joined

CHUNK = SIZES.samples_at_once
_Places = tuple[Array, Array, Array]  # first, block and line (R,) of `at_places`


class TrajectoryOnDemand(Trajectory):
    """A `Trajectory` of a motion at 0, dt, 2 dt, ... and its end, evaluated when it is asked for."""

    def __new__(cls, *given: Any, **fields: Any) -> Any:
        """With the fields of a `Trajectory`, as from `dataclasses.replace`, such a one."""
        return Trajectory(**fields) if "position" in fields else super().__new__(cls)

    def __init__(self, motion: AnyMotion, dt: float, count: int, places: _Places | None = None):
        first = motion.at(np.zeros(1), dt)
        values: dict[str, Any] = {"axes": first.axes, "radius": first.radius, "dt": dt}
        values |= {"_motion": motion, "_count": count, "_places": places}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        count: int = self._count
        return count

    @property
    def cycle_time(self) -> float:
        """Duration of the motion [s]."""
        return float(self._motion.end)

    def at_places(self, first: Array, block: Array, line: Array) -> TrajectoryOnDemand:
        """The same with other places: sample first[n] is the first of those at block[n], line[n] (R,)."""
        return TrajectoryOnDemand(self._motion, self.dt, len(self), (first, block, line))

    def heard_by(self, take: Callable[[Trajectory], object]) -> TrajectoryOnDemand:
        """The same; whoever first goes through its chunks lets `take` have them too."""
        heard = TrajectoryOnDemand(self._motion, self.dt, len(self), self._places)
        object.__setattr__(heard, "_take", take)
        return heard

    def through(self, change: Callable[[Trajectory], Trajectory]) -> TrajectoryOnDemand:
        """The motion with other positions and derivatives: `change` gives those of samples, one by one."""
        return TrajectoryOnDemand(_Changed(self._motion, change), self.dt, len(self), self._places)

    def chunks(self) -> Iterator[Trajectory]:
        """All samples in order, `CHUNK` at a time."""
        if "_whole" in vars(self):
            yield self._whole
            return
        take = vars(self).pop("_take", None)
        for first in range(0, len(self), CHUNK):
            chunk = self.rows(np.arange(first, min(first + CHUNK, len(self))))
            if take is not None:
                take(chunk)
            yield chunk

    def rows(self, k: Array) -> Trajectory:
        """The samples with the ascending indices k (n,)."""
        found: Trajectory = self._motion.at(self._times(k), self.dt)
        if self._places is not None:
            first, block, line = self._places
            run = np.searchsorted(first, k, side="right") - 1
            object.__setattr__(found, "block", block[run])
            object.__setattr__(found, "line", line[run])
        return found

    def first_not_before(self, times: FloatArray) -> Array:
        """(n,) index of the first sample at or after each of the times (n,) [s]; T where there is none."""
        k = np.clip(np.ceil(np.asarray(times) / self.dt), 0, len(self) - 1).astype(np.int64)
        early = (k > 0) & (self._times(np.maximum(k - 1, 0)) >= times)  # the quotient is rounded
        k = np.where(early, k - 1, k)
        return np.asarray(np.where(self._times(k) < times, k + 1, k))

    def _times(self, k: Array) -> FloatArray:
        times: FloatArray = k * self.dt
        times[k == len(self) - 1] = self._motion.end
        return times

    def __getattr__(self, name: str) -> Any:
        if name not in (*COLUMNS, "extruder"):
            raise AttributeError(name)
        if "_whole" not in vars(self):
            object.__setattr__(self, "_whole", joined(list(self.chunks())))
        return getattr(self._whole, name)


class _Changed:
    """A motion whose samples are changed one by one."""

    def __init__(self, motion: AnyMotion, change: Callable[[Trajectory], Trajectory]):
        self.motion, self.change = motion, change

    @property
    def t(self) -> FloatArray:
        return self.motion.t

    @property
    def end(self) -> float:
        return self.motion.end

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        return self.change(self.motion.at(times, dt))
