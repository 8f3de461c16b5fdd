"""What motions are judged by: samples, and the limits that they are measured against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Limits:
    """What the motion is measured against: (3, A) velocity, acceleration, jerk; and the rest.

    linear        : (A,) True on x, y and z, of which the normal acceleration is
    judged        : (3,) True for the columns velocity, acceleration, jerk that were delivered
    rounding      : (A,) largest error of a position by its digits [mm]
    time_rounding : the same of a time [s]
    normal        : of the normal acceleration [mm/s2], or inf
    acceleration_at_stop : (A,) inf where acceleration is not limited [mm/s2]
    user          : the user's limits (user_limits.py)
    """

    axes: tuple[str, ...]
    per_axis: FloatArray
    linear: Array
    judged: Array
    rounding: FloatArray
    time_rounding: float
    normal: float
    acceleration_at_stop: FloatArray
    jerk_limited: bool
    user: tuple[Any, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class SampleBlock:
    """Samples n of a motion, those before `skip` for the differences only.

    t         : (n,) [s]; position, velocity, acceleration, jerk: (n, A), zeros where they were not delivered
    piece     : (n,) the piece of the path that each is on
    travelled : path length run before [mm]
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    piece: Array
    skip: int = 0
    travelled: float = 0.0

    def travelled_to(self) -> FloatArray:
        """(n,) path length run at each sample [mm]."""
        step = np.linalg.norm(np.diff(self.position, axis=0, prepend=self.position[:1]), axis=1)
        step[: max(self.skip, 1)] = 0.0
        return self.travelled + np.cumsum(step)
