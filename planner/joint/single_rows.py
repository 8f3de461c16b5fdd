"""Rows of a step that no window in lanes has (window_solver.py): those of legs that are no lines, and of laws."""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.joint.laws import put_law_rows
from planner.joint.legs import Foot, Slopes, nearest_point, off_tangent
from planner.joint.normal_rows import BETWEEN
from planner.joint.row_kinds import LAW_ROWS, OF_SET, SETS, TUBE, TUBE_NODE


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_passed(axes, bends, i, group, y, rows):
    """The rows of the tolerance of a step on a leg that is passed: its places are fixed."""
    for c in range(3 * SETS):
        of_node, vector = c % 3 == 0, TUBE + OF_SET * (c // 3) + c % 3
        per = group.room_node[i] if of_node else group.room[i]
        square = 0.0
        for k in range(bends.target.shape[2]):
            target = bends.target[i, c % 3, k]
            if of_node and group.at_vertex[i] > 0.0:
                target = group.start[i, k]
            off = y[vector, k] - target
            square += off * off
            rows.n[i, c, k] = off * per
        row = 8 * axes + TUBE_NODE + c
        rows.g[i, row] = 0.5 * (square * per - 1.0)
        rows.moves[i, c] = 0.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_bent(axes, bends, i, group, y, rows, scratch):
    """The rows of the tolerance of a step on an arc or a curve."""
    for m in range(SETS):
        _put_bent(axes, bends, i, group, m, y, rows, scratch)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_bent(axes, bends, i, group, m, y, rows, scratch):
    """Those of a set."""
    at = TUBE + OF_SET * m
    legs, r, length = bends.legs, bends.leg[i], bends.legs.length[bends.leg[i]]
    at_vertex = group.at_vertex[i] > 0.0
    ends = group.ends[i] > 0.0 and group.last[i] == 0.0
    point, c_of, of = scratch.point, scratch.y, len(scratch.point)
    slopes = Slopes(scratch.n, scratch.node, scratch.tangent)
    for k in range(of):
        c_of[0, k], c_of[1, k], c_of[2, k] = y[at, k], y[at + 1, k], y[at + 2, k]
        scratch.x[k] = y[at + 3, k]
    for c in range(3):
        room = 1.0 / np.sqrt(group.room_node[i] if c == 0 else group.room[i])
        place, column = rows.place[i, 3 * m + c], 3 * m + c
        scratch.node[:] = 0.0
        if c == 0:
            place, value = nearest_point(legs, r, c_of[0], place, point, scratch.tangent), 0.0
            for k in range(of):
                if at_vertex:
                    point[k] = group.start[i, k]
                off = c_of[0, k] - point[k]
                value += off * off
                scratch.n[k] = off / (room * room)
            value = 0.5 * (value / (room * room) - 1.0)
        else:
            if c == 1:
                place = 0.0 if at_vertex else rows.place[i, 3 * m]
            elif ends:
                place = length
            else:
                place = nearest_point(legs, r, scratch.x[:of], place, point, scratch.tangent)
            fixed = (ends if c == 2 else at_vertex) or place <= 0.0 or place >= length
            other = c_of[0] if c == 1 else scratch.x[:of]
            value, place = off_tangent(legs, r, c_of[c], other, Foot(place, fixed, c == 1), room, slopes)
        for k in range(of):
            rows.n[i, column, k] = scratch.n[k]
            rows.node[i, column, k] = scratch.node[k]
            rows.tangent[i, column, k] = scratch.tangent[k]
        rows.place[i, column] = place
        row = 8 * axes + TUBE_NODE + column
        rows.g[i, row] = value
        stays = (c == 0 and at_vertex) or place <= 0.0 or place >= length
        rows.moves[i, column] = 0.0 if stays else 1.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def copy_step(sizes, at, x, u, scratch):
    """The node x (S,) and the controls u (C,) of a step into the scratch, which has only the axes of the window; at as of
    `Bends`."""
    states = len(scratch.x)
    for k in range(states):
        scratch.x[k] = x[at[k]]
    for k in range(len(scratch.u)):
        scratch.u[k] = u[at[states + k] - len(sizes.state)]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_laws(sizes, bends, i, group, x, u, rows, scratch):
    """The rows of the laws."""
    laws, more = bends.laws, 8 * len(sizes.axes) + LAW_ROWS
    copy_step(sizes, bends.at, x[i], u[i], scratch)
    pace, room = group.pace[i], 1.0 / np.sqrt(group.room_node[i])
    aside = group.aside[0]
    put_law_rows(laws, i, pace, room, aside, scratch.x, scratch.u, scratch.g, scratch.slope)
    for r in range(laws.first[-1]):
        rows.g[i, more + r] = scratch.g[r]
        for k in range(len(bends.at)):
            to = bends.at[k]
            rows.own[i, BETWEEN + r, to] = scratch.slope[r, k]
