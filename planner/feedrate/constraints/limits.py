"""All limits of the planner, in the order in which they are asked: of equal caps the first gives its name.

A limit that is to be built in is a file like the ones imported here and a line in `LIMITS`; the judge needs code of its own for it
(verifier/limits.py), and tests/verifier/test_laws_of_limits.py a motion on which the two agree. One of a user's own needs none of
that: own.py, docs/extending.md.
"""

from __future__ import annotations

from planner.feedrate.constraints.axis_acceleration import AxisAcceleration
from planner.feedrate.constraints.axis_jerk import AxisJerk
from planner.feedrate.constraints.axis_velocity import AxisVelocity
from planner.feedrate.constraints.chord_error import ChordError
from planner.feedrate.constraints.filter_error import FilterError
from planner.feedrate.constraints.limit import AxisLimit, Limit, RowLimit
from planner.feedrate.constraints.normal_limit import NormalAcceleration
from planner.feedrate.constraints.phase_lag import PhaseLag
from planner.feedrate.constraints.programmed_feed import ProgrammedFeed

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
