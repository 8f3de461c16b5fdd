"""What motions are judged by: samples, and the limits that they are measured against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from planner.base.arrays import Array, FloatArray


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What the motion is measured against: (3, A) velocity, acceleration, jerk; and the rest.

    judged        : (3,) True for the columns velocity, acceleration, jerk that were delivered
    rounding      : (A,) largest error of a position by its digits [mm]
    time_rounding : the same of a time [s]
    """

    per_axis: FloatArray
    linear: Array
    judged: Array
    rounding: FloatArray
    time_rounding: float
    normal: float  # normal acceleration [mm/s2]
    acceleration_at_stop: FloatArray  # (A,) inf where acceleration is not limited
    jerk_limited: bool
    axes: tuple[str, ...] = ()
    own: tuple[Any, ...] = ()  # limits of one's own (own.py)


@dataclass(frozen=True, eq=False, kw_only=True)
class SampleBlock:
    """Samples n of a motion, those before `skip` for the differences only.

    travelled : path length run before [mm]
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    piece: Array
    skip: int
    travelled: float
