"""Rows of a step that no window in lanes has (window_solver.py): those of laws."""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.joint.laws import put_law_rows
from planner.joint.normal_rows import BETWEEN
from planner.joint.row_kinds import LAW_ROWS


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def copy_step(sizes, at, x, u, scratch):
    """The node x (S,) and the controls u (C,) of a step into the scratch, which has only the axes of the window; at as of
    `Held`."""
    states = len(scratch.x)
    for k in range(states):
        scratch.x[k] = x[at[k]]
    for k in range(len(scratch.u)):
        scratch.u[k] = u[at[states + k] - len(sizes.state)]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_laws(sizes, held, i, group, x, u, rows, scratch):
    """The rows of the laws."""
    laws, more = held.laws, 8 * len(sizes.axes) + LAW_ROWS
    copy_step(sizes, held.at, x[i], u[i], scratch)
    pace, room = group.pace[i], 1.0 / np.sqrt(group.room_node[i])
    aside = group.aside[0]
    put_law_rows(laws, i, pace, room, aside, scratch.x, scratch.u, scratch.g, scratch.slope)
    for r in range(laws.first[-1]):
        rows.g[i, more + r] = scratch.g[r]
        for k in range(len(held.at)):
            to = held.at[k]
            rows.own[i, BETWEEN + r, to] = scratch.slope[r, k]
