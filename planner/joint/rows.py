"""The inequalities of one step of a motion in time, and what they add to a Newton step (interior_point.py).

A step begins at a node with position p, velocity v, acceleration a, has the jerk j and lasts h. Every row g
<= 0 depends on it through one vector that is linear in p, v, a and j for a given h,

    y = alpha_p p + alpha_v v + alpha_a a + alpha_j j,      dy = alpha . d(p, v, a, j) + e dh,      g = g(y) with dg/dy = n,

so that all rows of one y add up to one small matrix G = sum of z d2g/dy2 + (z/s) n n' and one vector:

    y                                          rows
    p                at the node               the tolerance
    v, a             at the node               limits of the axes; feed; normal acceleration; on arcs: order
    j                                          limits of the axes
    v + a h/2        Bezier ordinate           limits of the axes; order, on arcs: not backwards along the leg
    v + a h/4, v + a h/2 + j h2/12,            feed
    v + 3 a h/4 + j h2/4
    p + h v/3, p + 2 h v/3 + h2 a/6            the tolerance: inner control points of the cubic
    a - u v                                    normal acceleration, u = v.a/v.v kept: the smallest |a - u v| is what it is about
    h (v + a h/2)                              largest length of a step on an arc
    p, v             at a vertex               the feed of each leg as far as the motion is nearest to the vertex
    p + h v + h2 a/2 + h3 j/6                  the next node's position, for the tolerance on arcs

The square of the feed has degree 4. With the Bezier ordinates w0, w1, w2 of the velocity its own are w0.w0,
w0.w1, (2 w1.w1 + w0.w2)/3, w1.w2 and w2.w2; none above the square of the limit F is enough for the whole
step, and on a circle at constant feed all are equal. w0.w1 = |y|^2 - |a h/4|^2 with y = v + a h/4, so that
the row is |y| <= r, r^2 = F^2 + |a h/4|^2 kept, and the other two likewise.

The tolerance is g = (d2/room2 - 1)/2 with the distance d to the nearest point of the leg (at a vertex: to the
vertex), along which n = (y - nearest)/room2 holds whether or not the nearest point moves. On a line that is
convex, and a motion may go back along it: its points belong to places in order (`put_places`), which are not
the nearest ones where it does, and are taken as fixed. On an arc the inner control points belong to the
tangents at the places of the step's nodes (run.py), which move with them: those rows depend on a second
vector, p or the next node's, through `lin.node`. On an arc that is passed (run.py) places are fixed.

Other limits (laws.py) have rows of another kind, with their derivatives by p, v, a, j and h, behind all
others where a window needs them.

Where legs of different feeds meet at a vertex V the node may not be on the slower one's side of the place
that is nearest to V: with m = 1 where the feed falls, -1 where it rises, m (p - V).v <= 0. This row depends
on p and, through `lin.node`, on v; its own curvature is left out, as that of the kinematics is. Where a motion
comes nearer to V once more on the other side, nodes there have the row too (checks.py).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, pick, put, smaller, where
from planner.joint.laws import LawRows, put_law_rows
from planner.joint.legs import Foot, Slopes, nearest_point, off_tangent
from planner.joint.normal_rows import BETWEEN, put_normal_rows

# Vectors y, in this order.
P, V, A, J, MID, FEED_1, FEED_2, FEED_3, C1, C2, ACROSS, LONG, NEXT = range(13)
VECTORS = 13
VECTOR_OF_NODE = (
    P,
    NEXT,
    V,
)  # second vectors: of the first and of the second inner control point on arcs, and of `SWITCH`
# Rows behind those of the axes (jerk, acceleration, velocity in the middle and at the node, upper before
# lower), in this order.
H_MAX, H_MIN, FEED_NODE, FEED_ROWS, TUBE_NODE = 0, 1, 2, 3, 6  # three of the feed, three of the tolerance
ORDER_NODE, ORDER_MID, NORMAL_NODE, ARC, SWITCH = range(9, 14)
# Rows with derivatives of their own: of the normal acceleration between nodes, and the laws.
NORMAL_ROWS, LAW_ROWS = 14, 14 + BETWEEN
MORE_ROWS = LAW_ROWS
VECTOR_OF_BOX = (J, A, MID, V)
THIRD, SIXTH, TWELFTH = 1.0 / 3.0, 1.0 / 6.0, 1.0 / 12.0


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
    switch_leg: Array  # (N,) the leg that begins at that vertex
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
    place: FloatArray  # (N, 3) of the node and the inner control points along the leg
    moves: FloatArray  # (N, 3) 1 where these move with the point
    per_radius: FloatArray  # (N, 3) 1/r^2 of the rows of the feed
    n: FloatArray  # (N, 3, A) derivatives of the rows of the tolerance by y
    node: FloatArray  # (N or 0, 3, A) on arcs by the second vectors
    tangent: FloatArray  # (N or 0, 3, A) of the leg, on arcs
    own: FloatArray  # (N or 0, .., 4 A + 1) derivatives of the rows from `NORMAL_ROWS` on
    between: FloatArray  # (2,) for the rows of the normal acceleration of a step


class Scratch(NamedTuple):
    """Of one lane, for what is worked out for one after the other."""

    x: FloatArray  # (S,)
    u: FloatArray  # (C,)
    y: FloatArray  # (3, A)
    point: FloatArray  # (A,)
    n: FloatArray  # (A,)
    node: FloatArray  # (A,)
    tangent: FloatArray  # (A,)
    g: FloatArray  # (L,)
    slope: FloatArray  # (L, 4 A + 1)
    W: FloatArray  # (4 A + 1, 4 A + 1)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def count(axes):
    """How many rows a step of so many axes has, without those of the laws."""
    return 8 * axes + MORE_ROWS


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def of_axis(h, v, a, j):
    """Of an axis the numbers of FEED_1 to FEED_3, and the derivatives of those of MID and of these by h."""
    hj = h * j
    values = v + 0.25 * h * a, v + h * (0.5 * a + TWELFTH * hj), v + h * (0.75 * a + 0.25 * hj)
    return values, (0.5 * a, 0.25 * a, 0.5 * a + SIXTH * hj, 0.75 * a + 0.5 * hj)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def turn_of(axes, x):
    """u of the module text, of the node x (3 A,)."""
    vv, va = 0.0 * x[0], 0.0 * x[0]
    for k in range(axes):
        vv, va = vv + x[axes + k] * x[axes + k], va + x[axes + k] * x[2 * axes + k]
    return va / larger(vv, 1e-30)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_vectors(axes, x, u, y):
    """y (13, A) of a step with the node x (3 A,) and the controls u (A+1,)."""
    h, turn = u[axes], turn_of(axes, x)
    for k in range(axes):
        p, v, a, j = x[k], x[axes + k], x[2 * axes + k], u[k]
        y[P, k], y[V, k], y[A, k], y[J, k] = p, v, a, j
        y[MID, k] = v + 0.5 * h * a
        (y[FEED_1, k], y[FEED_2, k], y[FEED_3, k]), _ = of_axis(h, v, a, j)
        y[C1, k], y[C2, k] = p + h * v * THIRD, p + h * THIRD * (2.0 * v + 0.5 * h * a)
        y[ACROSS, k], y[LONG, k] = a - turn * v, h * (v + 0.5 * h * a)
        y[NEXT, k] = p + h * (v + h * (0.5 * a + h * j * SIXTH))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _ball(axes, y, vector, per, row, g):
    """The row |y|^2 <= 1/per."""
    square = 0.0 * per
    for k in range(axes):
        square += y[vector, k] * y[vector, k]
    g[row] = 0.5 * (square * per - 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_radii(axes, x, u, square, per_radius):
    """1/r^2 of the rows of the feed (module text); `square` of its limit."""
    h = u[axes]
    first, last, jerk, change = square, square, 0.0 * h, 0.0 * h
    for k in range(axes):
        a, j = x[2 * axes + k], u[k]
        ha, hj = 0.25 * h * a, 0.25 * h * h * j
        first, last = first + ha * ha, last + (ha + hj) * (ha + hj)
        jerk, change = jerk + hj * hj, change + (ha + 0.5 * hj) * (ha + 0.5 * hj)
    per_radius[0], per_radius[2] = 1.0 / first, 1.0 / last
    per_radius[1] = 1.0 / larger(square + 16.0 / 12.0 * change - 16.0 / 72.0 * jerk, 0.01 * square)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _place_on_line(axes, group, i, x, h, part):
    """The place on the leg of step i that is nearest to its node, first or second inner control point (0 to 2), or its
    end, the node x (3)."""
    along = 0.0 * h
    for k in range(axes):
        c = x[k]
        if part == 1:
            c = c + THIRD * h * x[axes + k]
        elif part == 2:
            c = c + h * THIRD * (2.0 * x[axes + k] + 0.5 * h * x[2 * axes + k])
        along += (c - group.base[i, k]) * group.drift[i, k]
    return smaller(larger(along * group.per_drift[i], 0.0), group.length[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_places(sizes, group, x, u, rows, nearest, top):
    """The places of the nodes and the inner control points that are on lines, in order along each leg: a motion may go
    back as far as one place is near enough to what it passes twice. They are halfway between the largest nearest place
    before and the smallest one behind, so that the farthest is moved by as little as can be; nearest (N, 3) and
    top (N,) are overwritten."""
    axes, N = len(sizes.axes), sizes.steps
    low, end = 0.0 * u[0, axes], 0.0 * u[0, axes]
    for i in range(N):
        h = u[i, axes]
        for m in range(3):
            nearest[i, m] = _place_on_line(axes, group, i, x[i], h, m)
        begins = group.begins[i] > 0.0
        nearest[i, 0] = where(begins, where(group.at_vertex[i] > 0.0, 0.0 * h, nearest[i, 0]), nearest[i, 0])
        low = where(begins, nearest[i, 0], low)
        last = group.last[i] > 0.0
        if anywhere(last):
            end = where(last, larger(_place_on_line(axes, group, i, x[i + 1], h, 3), low), end)
    behind = end
    for i in range(N - 1, -1, -1):
        ends = group.ends[i] > 0.0
        high = where(group.last[i] > 0.0, end, group.length[i])
        top[i] = where(ends, high, top[i + 1 if i + 1 < N else i])
        behind = where(ends, high, behind)
        for m in range(2, -1, -1):
            behind = smaller(behind, nearest[i, m])
            rows.moves[i, m] = behind
    before = low
    for i in range(N):
        begins, length = group.begins[i] > 0.0, group.length[i]
        low = where(begins, nearest[i, 0], low)
        before = where(begins, low, before)
        for m in range(3):
            before = larger(before, nearest[i, m])
            place = smaller(larger(0.5 * (before + rows.moves[i, m]), low), top[i])
            there = where(magnitude(place - nearest[i, m]) > 0.0, 0.0, 1.0 + 0.0 * place)
            there = where(place <= 0.0, 0.0, where(place >= length, 0.0, there))
            rows.moves[i, m] = there
            rows.place[i, m] = where(group.line[i] > 0.0, place, rows.place[i, m])
        rows.moves[i, 0] *= 1.0 - group.at_vertex[i]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_passed(axes, bends, i, lane, group, y, rows):
    """The rows of the tolerance of a step on a leg that is passed: its places are fixed."""
    for c in range(3):
        per = pick(group.room_node[i] if c == 0 else group.room[i], lane)
        square = 0.0
        for k in range(bends.target.shape[2]):
            target = bends.target[i, c, k, lane]
            if c == 0 and pick(group.at_vertex[i], lane) > 0.0:
                target = pick(group.start[i, k], lane)
            off = pick(y[(P, C1, C2)[c], k], lane) - target
            square += off * off
            rows.n[i, c, k] = put(rows.n[i, c, k], lane, off * per)
        row = 8 * axes + TUBE_NODE + c
        rows.g[i, row] = put(rows.g[i, row], lane, 0.5 * (square * per - 1.0))
        rows.moves[i, c] = put(rows.moves[i, c], lane, 0.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_bent(axes, bends, i, lane, group, y, rows, scratch):
    """The rows of the tolerance of a step on an arc or a curve."""
    legs, r, length = bends.legs, bends.leg[i, lane], bends.legs.length[bends.leg[i, lane]]
    at_vertex = pick(group.at_vertex[i], lane) > 0.0
    ends = pick(group.ends[i], lane) > 0.0 and pick(group.last[i], lane) == 0.0
    point, c_of, of = scratch.point, scratch.y, len(scratch.point)
    slopes = Slopes(scratch.n, scratch.node, scratch.tangent)
    for k in range(of):
        c_of[0, k], c_of[1, k], c_of[2, k] = (
            pick(y[P, k], lane),
            pick(y[C1, k], lane),
            pick(y[C2, k], lane),
        )
        scratch.x[k] = pick(y[NEXT, k], lane)
    for c in range(3):
        room = 1.0 / np.sqrt(pick(group.room_node[i] if c == 0 else group.room[i], lane))
        place = pick(rows.place[i, c], lane)
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
                place = 0.0 if at_vertex else pick(rows.place[i, 0], lane)
            elif ends:
                place = length
            else:
                place = nearest_point(legs, r, scratch.x[:of], place, point, scratch.tangent)
            fixed = (ends if c == 2 else at_vertex) or place <= 0.0 or place >= length
            other = c_of[0] if c == 1 else scratch.x[:of]
            value, place = off_tangent(legs, r, c_of[c], other, Foot(place, fixed, c == 1), room, slopes)
        for k in range(of):
            rows.n[i, c, k] = put(rows.n[i, c, k], lane, scratch.n[k])
            rows.node[i, c, k] = put(rows.node[i, c, k], lane, scratch.node[k])
            rows.tangent[i, c, k] = put(rows.tangent[i, c, k], lane, scratch.tangent[k])
        rows.place[i, c] = put(rows.place[i, c], lane, place)
        row = 8 * axes + TUBE_NODE + c
        rows.g[i, row] = put(rows.g[i, row], lane, value)
        stays = (c == 0 and at_vertex) or place <= 0.0 or place >= length
        rows.moves[i, c] = put(rows.moves[i, c], lane, 0.0 if stays else 1.0)


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
def _put_laws(sizes, bends, i, lane, group, x, u, rows, scratch):
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


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def bent_at(sizes, group, i):
    """Whether a window has a leg that is no line, or is passed, at step i."""
    return sizes.any_bent and anywhere(group.line[i] < group.real[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tangent_of(sizes, group, rows, i, c, k):
    """Of the leg at the node (c = 0) or an inner control point."""
    if sizes.any_bent:
        return where(group.line[i] > 0.0, group.drift[i, k], rows.tangent[i, c, k])
    return group.drift[i, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_rows(sizes, group, bends, x, u, rows, along, dual, room, scratch):
    """Put the rows at the nodes x (N+1, 3 A) and the controls u (N, A+1) into `rows`, whose places are where the search
    on arcs begins, and slacks and multipliers after the shares `along` and `dual` of their steps. Returns the sum of s z,
    the largest row, and the most that is missing of g + s = 0 of active ones (z > s). A row that is not there is -1.
    room: y (13, A), nearest (N, 3) and top (N,)."""
    axes, N, R = len(sizes.axes), sizes.steps, sizes.rows
    y, nearest, top = room
    more = 8 * axes
    put_places(sizes, group, x, u, rows, nearest, top)
    products, broken, missed = 0.0 * along, 0.0 * along, 0.0 * along
    for i in range(N):
        g, h = rows.g[i], u[i, axes]
        bent = bent_at(sizes, group, i)
        _put_vectors(axes, x[i], u[i], y)
        for m in range(4):
            for k in range(axes):
                share = y[VECTOR_OF_BOX[m], k] * group.per_box[m, k]
                g[2 * m * axes + k], g[(2 * m + 1) * axes + k] = share - 1.0, -share - 1.0
        g[more + H_MAX] = (h - group.h_max[i]) * group.per_h[i]
        g[more + H_MIN] = (group.h_min[i] - h) * group.per_h[i]
        _ball(axes, y, V, group.feed_node[i], more + FEED_NODE, g)
        _put_radii(axes, x[i], u[i], group.feed[i], rows.per_radius[i])
        for m in range(3):
            _ball(axes, y, FEED_1 + m, rows.per_radius[i, m], more + FEED_ROWS + m, g)
        for c in range(3):
            per = group.room_node[i] if c == 0 else group.room[i]
            square, place = 0.0 * h, rows.place[i, c]
            for k in range(axes):
                point = group.base[i, k] + place * group.drift[i, k]
                if c == 0:
                    point = where(group.at_vertex[i] > 0.0, group.start[i, k], point)
                off = y[(P, C1, C2)[c], k] - point
                square += off * off
                if bent:
                    rows.n[i, c, k] = where(group.line[i] > 0.0, off * per, rows.n[i, c, k])
                else:
                    rows.n[i, c, k] = off * per
            g[more + TUBE_NODE + c] = 0.5 * (square * per - 1.0)
        if bent:
            for lane in range(len(sizes.width)):
                if bends.passed[i, lane]:
                    _put_passed(axes, bends, i, lane, group, y, rows)
                elif bends.bent[i, lane]:
                    _put_bent(axes, bends, i, lane, group, y, rows, scratch)
            order_node, order_mid, arc = 0.0 * h, 0.0 * h, 0.0 * h
            for k in range(axes):
                at_node = tangent_of(sizes, group, rows, i, 0, k)
                at_mid = tangent_of(sizes, group, rows, i, 1, k)
                order_node, order_mid = order_node - at_node * y[V, k], order_mid - at_mid * y[MID, k]
                arc += at_mid * y[LONG, k]
            g[more + ORDER_NODE], g[more + ORDER_MID] = order_node / group.pace[i], order_mid / group.pace[i]
            g[more + ARC] = arc * group.per_step[i] - 1.0
        if sizes.any_switch:
            square = group.aside[0]
            for k in range(axes):
                square += group.switch[i] * y[V, k] * (y[P, k] - group.switch_at[i, k])
            g[more + SWITCH] = square
        if sizes.any_normal:
            _ball(axes, y, ACROSS, group.normal_node[i], more + NORMAL_NODE, g)
        if sizes.any_normal:
            put_normal_rows(
                sizes, group.normal[i], group.pace[i], group.turns[i], x[i], u[i], rows.between, rows.own[i]
            )
            g[more + NORMAL_ROWS], g[more + NORMAL_ROWS + 1] = rows.between[0], rows.between[1]
        if sizes.any_laws:
            for lane in range(len(sizes.width)):
                if i < bends.steps[lane]:
                    _put_laws(sizes, bends, i, lane, group, x, u, rows, scratch)
        for r in range(R):
            there = rows.per_s[i, r] > 0.0
            g_r = where(there, g[r], -1.0)
            s_r, z_r = rows.s[i, r] + along * rows.ds[i, r], rows.z[i, r] + dual * rows.dz[i, r]
            per = where(there, 1.0 / s_r, 0.0)
            g[r], rows.s[i, r], rows.z[i, r], rows.per_s[i, r] = g_r, s_r, z_r, per
            rows.q[i, r] = z_r * (g_r + s_r) * per
            products += s_r * z_r
            broken = larger(g_r, broken)
            missed = larger(where(z_r > s_r, g_r + s_r, 0.0), missed)
    return products, broken, missed
