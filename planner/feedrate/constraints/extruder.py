"""The extruder's limits of acceleration and jerk along the path: one limit more where they may hold it.

Where the extruder feeds r mm of filament per mm of way (geometry/extrusion.py), its limits v, a, j are v/r,
a/r and j/r along the path. That of the velocity is a feed (geometry/build.py). The others are limits of their
own (own.py), but only where they can matter: the axes keep the acceleration along the path below |a|, and its
jerk below |j| but for what the path turns, which is allowed as much again.
"""

from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine
from planner.machine.user_limit import PathLimit, Place

TURNING = 2.0  # times |j|, for the jerk along the path that comes of its turning [-]


class ExtruderLimit(PathLimit):
    """Velocity, acceleration and jerk of the extruder, as limits along the path.

    limits : (3,) velocity [mm/s], acceleration [mm/s2] and jerk [mm/s3] of the extruder
    ratio  : (B,) mm of filament per mm of way on each block of the program [-]
    """

    name = "extruder"
    of_extruder = True  # judged by what the extruder does, not by this bound
    searched = False  # the extruder follows the programmed path, not the way inside the tolerance

    def __init__(self, limits: FloatArray, ratio: FloatArray):
        with np.errstate(divide="ignore"):
            self._bounds = limits[:, None] / ratio

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """Largest speed, acceleration and jerk along the path (n,) on the blocks of the places [mm/s, mm/s2, mm/s3]."""
        velocity, acceleration, jerk = self._bounds[:, at.block]
        return velocity, acceleration, jerk


def with_extruder_limit(
    machine: Machine, axes: tuple[str, ...], limits: FloatArray, ratio: FloatArray, block: Array
) -> Machine:
    """The machine, with the limit of its extruder where that may hold a motion.

    limits : (3,) of the extruder
    ratio  : (M,) mm of filament per mm of way on each segment [-]
    block  : (M,) of each segment
    """
    own: list[Any] = [limit for limit in machine.own if not isinstance(limit, ExtruderLimit)]
    strongest, sharpest = (np.linalg.norm(machine.limits(q, axes)) for q in ("acceleration", "jerk"))
    most = float(ratio.max(initial=0.0))
    if most * strongest > limits[1] or most * TURNING * sharpest > limits[2]:
        of_block = np.zeros(int(block[-1]) + 1)
        of_block[block] = ratio
        own.append(ExtruderLimit(limits, of_block))
    return machine.with_own(own) if own or machine.own else machine
