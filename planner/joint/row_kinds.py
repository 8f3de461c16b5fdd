"""The rows of a step of a motion in time (rows.py): which there are, in which order, and what they know."""

from typing import NamedTuple

from planner.base.arrays import Array, FloatArray
from planner.joint.laws import LawRows
from planner.joint.normal_rows import BETWEEN

# Vectors y, in this order.
P, V, A, J, MID, FEED_1, FEED_2, FEED_3, ACROSS, LONG, TUBE = range(11)
# From `TUBE` on those of the tolerance, of `SETS`: of the setpoints, and of the chords between them. Each has the node,
# two inner control points, and the next node.
SETS, OF_SET = 2, 4
VECTORS = TUBE + SETS * OF_SET
# Rows behind those of the axes (jerk, acceleration, velocity in the middle and at the node, upper before
# lower), in this order.
H_MAX, H_MIN, FEED_NODE, FEED_ROWS, TUBE_NODE = (
    0,
    1,
    2,
    3,
    6,
)  # three of the feed, three of the tolerance for each set
ORDER_NODE, ORDER_MID, NORMAL_NODE, ARC, SWITCH, SIDE = range(12, 18)
# Rows with derivatives of their own: of the normal acceleration between nodes, and the laws.
NORMAL_ROWS, LAW_ROWS = 18, 18 + BETWEEN
MORE_ROWS = LAW_ROWS
VECTOR_OF_BOX = (J, A, MID, V)
THIRD, SIXTH, TWELFTH = 1.0 / 3.0, 1.0 / 6.0, 1.0 / 12.0


def count(axes: int) -> int:
    """How many rows a step of so many axes has, without those of the laws."""
    return 8 * axes + MORE_ROWS


class StepLimits(NamedTuple):
    """The limits of N steps, in the units of the problem."""

    leg: Array  # (N,) of the window's legs (problem.py)
    passed: Array  # (N,) whether the step's leg is passed
    target: FloatArray  # (N, 3, A) where the node and the inner control points belong to there
    at_vertex: Array  # (N,) whether the step's node is where its leg begins
    on: Array  # (N, R) rows that there are
    box: FloatArray  # (4, A) jerk, acceleration, velocity, velocity
    room: FloatArray  # (N,) of inner control points
    room_node: FloatArray  # (N,) of the node
    sag: FloatArray  # (2,) of each set, in time^2: 0 of setpoints, `TubeRun.sag` of chords
    rest: FloatArray  # (N, 2, A) of chords, what they are off beside that, at both nodes
    feed: FloatArray  # (N,)
    feed_node: FloatArray  # (N,)
    normal: FloatArray  # (N,)
    normal_node: FloatArray  # (N,)
    turns: Array  # (N,) whether the step turns far (normal_rows.py)
    laws: LawRows
    step_max: FloatArray  # (N,)
    pace: FloatArray  # (N,) a speed like that of the step
    h: FloatArray  # (N,) duration that it is pulled to
    h_max: FloatArray  # (N,)
    h_min: FloatArray  # (N,)
    switch: FloatArray  # (N,) 1 at the vertex where the feed falls and before it, -1 where it rises and behind it; else 0
    switch_at: FloatArray  # (N, A) the place that stands for that vertex
    side: FloatArray  # (N, A) about the direction of the start there, with that sign, where a row was asked for twice; else 0
    smooth: FloatArray  # (N,) weight of (jerk/limit)^2 of every axis, against the step's time
    centre: FloatArray  # (N,) weight of the row of the node's tolerance, against the step's time
    aside: float  # how far inside its bound the row of that has to be [-]


class Rows(NamedTuple):
    """The rows g + s = 0 of N steps at a motion, with slacks s and multipliers z, and their steps."""

    g: FloatArray  # (N, R)
    s: FloatArray  # (N, R)
    z: FloatArray  # (N, R)
    per_s: FloatArray  # (N, R) 1/s; 0 for a row that is not there, whose z stays 0
    q: FloatArray  # (N, R) z (g + s)/s
    ds: FloatArray  # (N, R) after the predictor ds dz
    dz: FloatArray  # (N, R)
    place: FloatArray  # (N, 6) of the node and the inner control points along the leg, for one set after the other
    moves: FloatArray  # (N, 6) 1 where these move with the point
    per_radius: FloatArray  # (N, 3) 1/r^2 of the rows of the feed
    n: FloatArray  # (N, 6, A) derivatives of the rows of the tolerance by y
    by_node: FloatArray  # (N or 0, 6) on arcs and curves by the second vectors: so many times the tangent
    tangent: FloatArray  # (N or 6 N, A) of the leg, one for each place where any leg bends
    own: FloatArray  # (N or 0, .., 4 A + 1) derivatives of the rows from `NORMAL_ROWS` on
    between: FloatArray  # (2,) for the rows of the normal acceleration of a step


class Scratch(NamedTuple):
    """Of one lane, for what is worked out for one after the other."""

    x: FloatArray  # (S,)
    u: FloatArray  # (C,)
    g: FloatArray  # (L,)
    slope: FloatArray  # (L, 4 A + 1)
    W: FloatArray  # (4 A + 1, 4 A + 1)
