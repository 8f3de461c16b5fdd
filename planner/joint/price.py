"""The prices of limits and tolerance along the free optimum: the multipliers of the search, sorted by what
they price.

At its end the Lagrangian T + sum z g is stationary in everything but the limits, so that dT/d(ln limit) = sum
of z dg/d(ln limit). The rows (rows.py) are shares of limits, g = y/limit - 1 of one axis and g =
(|y|^2/limit^2 - 1)/2 of a ball. Where z > 0 both are 0 and have the slope -1: a price is minus a sum of
multipliers. Of the feed this lets the radii of its inner rows go with F.

All limits together fix the time. In k times it, along the same path, velocities are 1/k, accelerations 1/k^2
and jerks 1/k^3 of what they were, whence (Euler)

    sum of velocities and feed  +  2 sum of accelerations and of the normal one  +  3 sum of jerks   =   -T

but for the pull on durations (nlp.py) and the rows in `OTHER`, which are no limits: bounds of durations, the
order along the leg, the largest length of a step on an arc, the place of a change of the feed.

The tolerance is priced as the room of every leg and of every vertex, for setpoints and chords together.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limits import FEED as FEED_LIMIT
from planner.joint import row_kinds as rows
from planner.joint.problem import StepWindow
from planner.joint.run import TubeRun

# Columns behind those of the axes (jerk, acceleration, velocity) of the prices of a step; those of the run's
# laws from `LAWS` on.
FEED, NORMAL, ROOM, VERTEX, OTHER, LAWS = range(6)


def columns(run: TubeRun) -> int:
    """How many prices a step has."""
    return 3 * len(run.axis) + LAWS + len(run.laws)


def step_prices(run: TubeRun, window: StepWindow, z: FloatArray) -> FloatArray:
    """(N, 3 A + 5 + M) dT/d(ln limit) of the limits at each step [s], from the multipliers z (N, R) of a
    window: jerk, acceleration and velocity of each axis, then the feed, the normal acceleration, the room of
    the leg and that of the vertex that the step begins at, what bounds only the steps themselves, and the M
    laws; a feed that is a law counts as the feed."""
    axes = window.limits.box.shape[1]
    box, more = z[:, : 8 * axes].reshape(-1, 4, 2, axes).sum(axis=2), z[:, 8 * axes :]
    at_vertex = window.limits.at_vertex
    tube = more[:, rows.TUBE_NODE : rows.ORDER_NODE].reshape(len(z), rows.SETS, 3).sum(axis=1)
    node = tube[:, 0]
    none = np.zeros(len(z))
    price = np.column_stack(
        [
            box[:, 0],
            box[:, 1],
            box[:, 2] + box[:, 3],
            more[:, rows.FEED_NODE : rows.TUBE_NODE].sum(axis=1),
            more[:, rows.NORMAL_NODE] + more[:, rows.NORMAL_ROWS : rows.LAW_ROWS].sum(axis=1),
            tube[:, 1:].sum(axis=1) + np.where(at_vertex, none, node),
            np.where(at_vertex, node, none),
            more[
                :, [rows.H_MAX, rows.H_MIN, rows.ORDER_NODE, rows.ORDER_MID, rows.ARC, rows.SWITCH, rows.SIDE]
            ].sum(axis=1),
            np.zeros((len(z), len(run.laws))),
        ]
    )
    first = rows.LAW_ROWS + window.limits.laws.first
    for m, law in enumerate(window.which):
        column = FEED if run.laws.laws[law].name == FEED_LIMIT.name else LAWS + law
        price[:, 3 * axes + column] += more[:, first[m] : first[m + 1]].sum(axis=1)
    return -window.second * price
