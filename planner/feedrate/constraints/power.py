"""The limit of the power of each drive: |v a| <= P of an axis, P in W for each kg that it moves.

1 W/kg is 1 m2/s3, 1e6 mm2/s3; of rotary axes it is W for each kg m2 of their moment of inertia, rad2/s3. The
product of speed and acceleration is no row of a solver along a path, whose unknowns are the square of the feed
and its slope: the joint search keeps it (joint/laws.py), and what does not, is refused.

An axis cannot exceed what its velocity times its acceleration is: a limit above that is none.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limit import AxisLimit
from planner.machine import Machine

REACHABLE = 1.0 - 1e-12  # of velocity times acceleration: rounding [-]


class DrivePower(AxisLimit):
    """|v a| <= P, on machines that name P."""

    name, unit, order = "power", "W/kg", 3

    @classmethod
    def of(cls, machine: Machine, axes: tuple[str, ...]) -> FloatArray:
        """(A,) the limits of the axes [mm2/s3]; inf where none is named, and where none can be reached."""
        most = machine.limits("velocity", axes) * machine.limits("acceleration", axes)
        named = machine.powers(axes)
        return np.where(named < most * REACHABLE, named, np.inf)
