"""All limits of the planner, in the order in which they are asked: of equal caps the first gives its name.

A limit that is to be built in is a file like the ones imported here and a line in `LIMITS`; the judge needs code of its own for it
(verify/limits.py), and tests/verify/test_laws_of_limits.py a motion on which the two agree. One of a user's own needs none of
that: own.py, docs/extending.md.
"""

from __future__ import annotations

from planner.constraints.axis_acceleration import AxisAcceleration
from planner.constraints.axis_jerk import AxisJerk
from planner.constraints.axis_velocity import AxisVelocity
from planner.constraints.chord_error import ChordError
from planner.constraints.filter_error import FilterError
from planner.constraints.limit import AxisLimit, Limit, RowLimit
from planner.constraints.normal_limit import NormalAcceleration
from planner.constraints.phase_lag import PhaseLag
from planner.constraints.programmed_feed import ProgrammedFeed

FEED, VELOCITY = ProgrammedFeed(), AxisVelocity()
ACCELERATION, JERK = AxisAcceleration(), AxisJerk()
CHORD_ERROR, FILTER_ERROR = ChordError(), FilterError()
LIMITS: tuple[Limit, ...] = (
    FEED,
    VELOCITY,
    NormalAcceleration(),
    CHORD_ERROR,
    FILTER_ERROR,
    PhaseLag(),
    ACCELERATION,
    JERK,
)
ROWS: tuple[RowLimit, ...] = (ACCELERATION, JERK)  # as rows of the problem, in the order of their indices
OF_AXES: tuple[AxisLimit, ...] = (VELOCITY, ACCELERATION, JERK)  # with a limit for every axis
