"""What limits and tolerance cost along the free optimum: the multipliers of the search, sorted by what they price.

At its end the Lagrangian T + sum z g is stationary in everything but the limits, so that dT/d(ln limit) = sum of z dg/d(ln limit). The
rows (rows.py) are shares of limits, g = y/limit - 1 of one axis and g = (|y|^2/limit^2 - 1)/2 of a ball. Where z > 0 both are 0 and both
have the slope -1, so that a price is minus a sum of multipliers. Of the feed this takes r, the limit of its inner rows, to go with F.

All limits together fix the time. In 1/k of it, along the same path, velocities are k times, accelerations k^2 times and jerks k^3
times as large, whence (Euler)

    sum of velocities and feed  +  2 sum of accelerations and of the normal one  +  3 sum of jerks   =   -T

but for the rows that are no limits: `OTHER` holds them, order and the largest length of a step on an arc, which do not depend on time.

The tolerance acts through what eq. (20) leaves of it for the path (run.py), where it prices the room of every leg and vertex.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.tube import rows
from planner.tube.problem import Window
from planner.tube.run import TubeRun

# Columns behind those of the axes (jerk, acceleration, velocity) of the prices of a step.
FEED, NORMAL, ROOM, VERTEX, OTHER = range(5)
# Time that rows which hold the durations of steps to those of the guess may cost, as a share of all [-].
HELD_BACK = 1e-3


def columns(axes: int) -> int:
    """How many prices a step has."""
    return 3 * axes + 5


def step_prices(window: Window, z: FloatArray) -> FloatArray:
    """(N, 3 A + 5) dT/d(ln limit) of the limits at each step [s], from the multipliers z (N, R) of a window: jerk, acceleration and
    velocity of each axis, then the feed, the normal acceleration, the room of the leg and that of the vertex that the step begins at,
    and what bounds only the steps themselves."""
    axes = window.limits.box.shape[1]
    box, more = z[:, : 8 * axes].reshape(-1, 4, 2, axes).sum(axis=2), z[:, 8 * axes :]
    at_vertex = window.limits.at_vertex
    node = more[:, rows.TUBE_NODE]
    price = np.column_stack(
        [
            box[:, 0],
            box[:, 1],
            box[:, 2] + box[:, 3],
            more[:, rows.FEED_NODE : rows.TUBE_NODE].sum(axis=1),
            more[:, rows.NORMAL_NODE] + more[:, rows.NORMAL_MID],
            more[:, rows.TUBE_NODE + 1 : rows.ORDER_NODE].sum(axis=1) + np.where(at_vertex, 0.0, node),
            np.where(at_vertex, node, 0.0),
            more[:, [rows.H_MAX, rows.H_MIN, rows.ORDER_NODE, rows.ORDER_MID, rows.ARC]].sum(axis=1),
        ]
    )
    return -window.second * price
