"""The limits of the tangential acceleration and of the tangential jerk: |d feed/dt| <= A_t, the acceleration
along the path of x, y and z together, and |d2 feed/dt2| <= J_t, how fast that changes.

With l the length run in x, y and z, l' = dl/ds = |(r'_x, r'_y, r'_z)|, they are rows like those of an axis,

    | l' u + l'' x | <= A_t,     | l' j + 3 l'' feed u + l''' feed^3 | <= J_t,

where l' = 1 and the others are 0 if no other axes move, and of a motion in time with t = v/|v| of x, y and z

    | a.t | <= A_t,              | j.t + |a - (a.t) t|^2/|v| | <= J_t.

Rotary axes and u, v, w do not count: turning alone is not limited by them. No motion has more acceleration
than the norm of what x, y and z accelerate with: a limit above that is none, and nothing is done for it. The
jerk along a path that turns may be more than that of the axes together.
"""

from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.axis_limits import AxisAcceleration, AxisJerk
from planner.feedrate.constraints.limit import Limit
from planner.machine import LINEAR_AXES, TANGENTIAL, Machine
from planner.machine.user_limit import PathLimit, Place

REACHABLE = 1.0 - 1e-12  # of the norm of the axes' accelerations: rounding [-]


def binding(machine: Machine, axes: tuple[str, ...], acceleration: FloatArray) -> tuple[float, float]:
    """A_t [mm/s2] and J_t [mm/s3]; inf where none is named, and A_t where it is above what the axes give.

    acceleration : (A,) of the axes [mm/s2]
    """
    largest = machine.tangential_acceleration or np.inf
    reached = float(np.linalg.norm(acceleration[np.isin(axes, LINEAR_AXES)]))
    return np.inf if largest >= reached * REACHABLE else largest, machine.tangential_jerk or np.inf


class _Row(PathLimit):
    """Acceleration and jerk along the path of x, y and z, at most `largest` [mm/s2] and `fastest` [mm/s3]."""

    name, counts = TANGENTIAL, LINEAR_AXES

    def __init__(self, largest: float, fastest: float):
        self.largest, self.fastest = largest, fastest
        both = (AxisAcceleration.name, largest), (AxisJerk.name, fastest)
        self.bounded = tuple(name for name, bound in both if np.isfinite(bound))

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """The same everywhere [mm/s2], [mm/s3]."""
        return np.inf, self.largest, self.fastest


class TangentialAcceleration(Limit):
    """|l' u + l'' x| <= A_t, on machines that name A_t; `along` has the row of the jerk too."""

    name, unit, order = AxisAcceleration.called(TANGENTIAL), "mm/s2", 2
    key = "tangential_acceleration"

    def along(self, machine: Machine, axes: tuple[str, ...]) -> PathLimit | None:
        bounds = binding(machine, axes, machine.limits("acceleration", axes))
        return _Row(*bounds) if np.isfinite(bounds).any() else None


class TangentialJerk(Limit):
    """|l' j + 3 l'' feed u + l''' feed^3| <= J_t, on machines that name J_t."""

    name, unit, order = AxisJerk.called(TANGENTIAL), "mm/s3", 3
    key = "tangential_jerk"
