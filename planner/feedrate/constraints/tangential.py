"""The limit of the tangential acceleration: |d feed/dt| <= A_t, the acceleration along the path of x, y and z
together.

With l the length run in x, y and z, l' = dl/ds = |(r'_x, r'_y, r'_z)|, it is a row like that of an axis,

    | l' u + l'' x | <= A_t,         l' = 1 and l'' = 0 where no other axes move,

and of a motion in time |a.t| <= A_t with t = v/|v| of x, y and z. Rotary axes and u, v, w do not count:
turning alone is not limited by it. No motion has more than the norm of what x, y and z accelerate with: a
limit above that is none, and nothing is done for it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.axis_acceleration import AxisAcceleration
from planner.feedrate.constraints.limit import Limit
from planner.machine import LINEAR_AXES, TANGENTIAL, Machine
from planner.machine.user_limit import PathLimit, Place

REACHABLE = 1.0 - 1e-12  # of the norm of the axes' accelerations: rounding [-]


def binding(machine: Machine, axes: tuple[str, ...], acceleration: FloatArray) -> float:
    """A_t [mm/s2]; inf where none is named, and where it is above what the axes give.

    acceleration : (A,) of the axes [mm/s2]
    """
    largest = machine.tangential_acceleration
    reached = float(np.linalg.norm(acceleration[np.isin(axes, LINEAR_AXES)]))
    return np.inf if largest is None or largest >= reached * REACHABLE else largest


class _Row(PathLimit):
    """The acceleration along the path of x, y and z, at most `largest` [mm/s2]."""

    name, counts, bounded = TANGENTIAL, LINEAR_AXES, ("acceleration",)

    def __init__(self, largest: float):
        self.largest = largest

    def acceleration(self, at: Place) -> Any:
        """The same everywhere [mm/s2]."""
        return self.largest


class TangentialAcceleration(Limit):
    """|l' u + l'' x| <= A_t, on machines that name A_t."""

    name, unit, order = AxisAcceleration.called(TANGENTIAL), "mm/s2", 2
    key = "tangential_acceleration"

    def along(self, machine: Machine, axes: tuple[str, ...]) -> PathLimit | None:
        largest = binding(machine, axes, machine.limits("acceleration", axes))
        return _Row(largest) if np.isfinite(largest) else None
