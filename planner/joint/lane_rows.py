"""Rows of a step that are worked out for one lane after the other: those of legs that are no lines, and of laws."""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import pick, put
from planner.joint.laws import put_law_rows
from planner.joint.legs import Foot, Slopes, nearest_point, off_tangent
from planner.joint.normal_rows import BETWEEN
from planner.joint.row_kinds import LAW_ROWS, OF_SET, SETS, TUBE, TUBE_NODE


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_passed(axes, bends, i, lane, group, y, rows):
    """The rows of the tolerance of a step on a leg that is passed: its places are fixed."""
    for c in range(3 * SETS):
        of_node, vector = c % 3 == 0, TUBE + OF_SET * (c // 3) + c % 3
        per = pick(group.room_node[i] if of_node else group.room[i], lane)
        square = 0.0
        for k in range(bends.target.shape[2]):
            target = bends.target[i, c % 3, k, lane]
            if of_node and pick(group.at_vertex[i], lane) > 0.0:
                target = pick(group.start[i, k], lane)
            off = pick(y[vector, k], lane) - target
            square += off * off
            rows.n[i, c, k] = put(rows.n[i, c, k], lane, off * per)
        row = 8 * axes + TUBE_NODE + c
        rows.g[i, row] = put(rows.g[i, row], lane, 0.5 * (square * per - 1.0))
        rows.moves[i, c] = put(rows.moves[i, c], lane, 0.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_bent(axes, bends, i, lane, group, y, rows, scratch):
    """The rows of the tolerance of a step on an arc or a curve."""
    for m in range(SETS):
        _put_bent(axes, bends, i, lane, group, m, y, rows, scratch)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_bent(axes, bends, i, lane, group, m, y, rows, scratch):
    """Those of a set."""
    at = TUBE + OF_SET * m
    legs, r, length = bends.legs, bends.leg[i, lane], bends.legs.length[bends.leg[i, lane]]
    at_vertex = pick(group.at_vertex[i], lane) > 0.0
    ends = pick(group.ends[i], lane) > 0.0 and pick(group.last[i], lane) == 0.0
    point, c_of, of = scratch.point, scratch.y, len(scratch.point)
    slopes = Slopes(scratch.n, scratch.node, scratch.tangent)
    for k in range(of):
        c_of[0, k], c_of[1, k], c_of[2, k] = (
            pick(y[at, k], lane),
            pick(y[at + 1, k], lane),
            pick(y[at + 2, k], lane),
        )
        scratch.x[k] = pick(y[at + 3, k], lane)
    for c in range(3):
        room = 1.0 / np.sqrt(pick(group.room_node[i] if c == 0 else group.room[i], lane))
        place, column = pick(rows.place[i, 3 * m + c], lane), 3 * m + c
        scratch.node[:] = 0.0
        if c == 0:
            place, value = nearest_point(legs, r, c_of[0], place, point, scratch.tangent), 0.0
            for k in range(of):
                if at_vertex:
                    point[k] = pick(group.start[i, k], lane)
                off = c_of[0, k] - point[k]
                value += off * off
                scratch.n[k] = off / (room * room)
            value = 0.5 * (value / (room * room) - 1.0)
        else:
            if c == 1:
                place = 0.0 if at_vertex else pick(rows.place[i, 3 * m], lane)
            elif ends:
                place = length
            else:
                place = nearest_point(legs, r, scratch.x[:of], place, point, scratch.tangent)
            fixed = (ends if c == 2 else at_vertex) or place <= 0.0 or place >= length
            other = c_of[0] if c == 1 else scratch.x[:of]
            value, place = off_tangent(legs, r, c_of[c], other, Foot(place, fixed, c == 1), room, slopes)
        for k in range(of):
            rows.n[i, column, k] = put(rows.n[i, column, k], lane, scratch.n[k])
            rows.node[i, column, k] = put(rows.node[i, column, k], lane, scratch.node[k])
            rows.tangent[i, column, k] = put(rows.tangent[i, column, k], lane, scratch.tangent[k])
        rows.place[i, column] = put(rows.place[i, column], lane, place)
        row = 8 * axes + TUBE_NODE + column
        rows.g[i, row] = put(rows.g[i, row], lane, value)
        stays = (c == 0 and at_vertex) or place <= 0.0 or place >= length
        rows.moves[i, column] = put(rows.moves[i, column], lane, 0.0 if stays else 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def copy_lane(sizes, at, lane, x, u, scratch):
    """The node x (S,) and the controls u (C,) of one lane into the scratch, which has only the axes of the window; at as of
    `Bends`."""
    states = len(scratch.x)
    for k in range(states):
        scratch.x[k] = pick(x[at[k]], lane)
    for k in range(len(scratch.u)):
        scratch.u[k] = pick(u[at[states + k] - len(sizes.state)], lane)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_laws(sizes, bends, i, lane, group, x, u, rows, scratch):
    """The rows of the laws of one lane."""
    laws, more = bends.laws[lane], 8 * len(sizes.axes) + LAW_ROWS
    copy_lane(sizes, bends.at, lane, x[i], u[i], scratch)
    pace, room = pick(group.pace[i], lane), 1.0 / np.sqrt(pick(group.room_node[i], lane))
    aside = pick(group.aside[0], lane)
    put_law_rows(laws, i, pace, room, aside, scratch.x, scratch.u, scratch.g, scratch.slope)
    for r in range(laws.first[-1]):
        rows.g[i, more + r] = put(rows.g[i, more + r], lane, scratch.g[r])
        for k in range(len(bends.at)):
            to = bends.at[k]
            rows.own[i, BETWEEN + r, to] = put(rows.own[i, BETWEEN + r, to], lane, scratch.slope[r, k])
