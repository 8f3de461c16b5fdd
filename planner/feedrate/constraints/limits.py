"""All limits of the planner, in the order in which they are asked: of equal caps the first gives its name.

A limit that is to be built in is a class like the ones imported here and a line in `LIMITS`; the judge needs
code of its own for it (verifier/limits.py), and tests/verifier/test_laws_of_limits.py a motion on which the
two agree. One of a user's own needs none of that: machine/user_limit.py, docs/extending.md.

`Limits` is what they are on a machine: grid, solvers, joint search and prices take them from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.budget import largest_normal
from planner.feedrate.constraints.built_in import (
    AxisAcceleration,
    AxisJerk,
    AxisVelocity,
    ChordError,
    DrivePower,
    FilterError,
    NormalAcceleration,
    PhaseLag,
    ProgrammedFeed,
    TangentialAcceleration,
    TangentialJerk,
    binding,
)
from planner.feedrate.constraints.limit import AxisLimit, Limit, RowLimit
from planner.machine import Machine
from planner.machine.user_limit import OwnLimit

FEED, VELOCITY = ProgrammedFeed(), AxisVelocity()
ACCELERATION, JERK = AxisAcceleration(), AxisJerk()
CHORD_ERROR, FILTER_ERROR = ChordError(), FilterError()
NORMAL = NormalAcceleration()
TANGENTIAL, TANGENTIAL_JERK = TangentialAcceleration(), TangentialJerk()
POWER = DrivePower()
LIMITS: tuple[Limit, ...] = (
    FEED,
    VELOCITY,
    NORMAL,
    CHORD_ERROR,
    FILTER_ERROR,
    PhaseLag(),
    ACCELERATION,
    JERK,
    TANGENTIAL,
    TANGENTIAL_JERK,
    POWER,
)
ROWS: tuple[RowLimit, ...] = (ACCELERATION, JERK)  # as rows of the problem, in the order of their indices
OF_AXES: tuple[AxisLimit, ...] = (VELOCITY, ACCELERATION, JERK)  # with a limit for every axis


@dataclass(frozen=True, eq=False, kw_only=True)
class Limits:
    """The bounds of a motion over A axes on a machine, beside its feed and its tolerance.

    axes                         : their letters
    velocity, acceleration, jerk : (A,) of the axes, in mm or rad
    normal, tangential           : normal and tangential acceleration [mm/s2]; inf where nothing limits them
    tangential_jerk              : how fast the latter changes [mm/s3]; inf where nothing limits it
    power                        : (A,) of the drives [mm2/s3]; inf where nothing limits it
    along                        : those with rows like an axis: built-in ones that can bind, and the user's
    """

    axes: tuple[str, ...]
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    normal: float
    tangential: float
    tangential_jerk: float
    power: FloatArray
    along: tuple[OwnLimit, ...]

    @classmethod
    def of(cls, machine: Machine, axes: tuple[str, ...]) -> Limits:
        """All of them. Raises InputError if the machine lacks one of the axes."""
        built_in = [row for limit in LIMITS if (row := limit.along(machine, axes)) is not None]
        acceleration = ACCELERATION.of(machine, axes)
        tangential, tangential_jerk = binding(machine, axes, acceleration)
        return cls(
            axes=axes,
            velocity=VELOCITY.of(machine, axes),
            acceleration=acceleration,
            jerk=JERK.of(machine, axes),
            normal=largest_normal(machine),
            tangential=tangential,
            tangential_jerk=tangential_jerk,
            power=POWER.of(machine, axes),
            along=(*built_in, *machine.own),
        )

    @property
    def of_axes(self) -> FloatArray:
        """(3, A) velocity, acceleration and jerk."""
        return np.stack([self.velocity, self.acceleration, self.jerk])
