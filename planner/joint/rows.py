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
from planner.joint.laws import LawRows, put_law_rows
from planner.joint.legs import Foot, Slopes, nearest_point, off_tangent, put_places
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


class Linear(NamedTuple):
    """The rows of N steps at a motion."""

    g: FloatArray  # (N, R)
    n: FloatArray  # (N, R, A) dg/dy
    node: FloatArray  # (N, 3, A) dg/dy by the second vectors of rows that have one
    alpha: FloatArray  # (N, 13, 4)
    e: FloatArray  # (N, 13, A)
    tangent: FloatArray  # (N, 3, A) of the leg at the node and both inner control points; 0 where nearest is an end of the leg
    place: FloatArray  # (N, 3) of those along the leg
    radius: FloatArray  # (N, 3) of the rows of the feed
    own: FloatArray  # (N, .., 4 A + 1) derivatives of the rows from `NORMAL_ROWS` on


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def count(axes):
    """How many rows a step of so many axes has, without those of the laws."""
    return 8 * axes + MORE_ROWS


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def vectors_of_step(x, u, axes, y, alpha, e):
    """y (13, A), alpha (13, 4) and e (13, A) of a step with the node x (3 A,) and the controls u (A+1,)."""
    h = u[axes]
    alpha[:] = 0.0
    vv, va = 0.0, 0.0
    for k in range(axes):
        vv, va = vv + x[axes + k] ** 2, va + x[axes + k] * x[2 * axes + k]
    u0 = va / max(vv, 1e-30)
    for k in range(axes):
        p, v, a, j = x[k], x[axes + k], x[2 * axes + k], u[k]
        y[P, k], y[V, k], y[A, k], y[J, k] = p, v, a, j
        y[MID, k], e[MID, k] = v + 0.5 * h * a, 0.5 * a
        y[FEED_1, k], e[FEED_1, k] = v + 0.25 * h * a, 0.25 * a
        y[FEED_2, k], e[FEED_2, k] = v + h * (0.5 * a + h * j / 12.0), 0.5 * a + h * j / 6.0
        y[FEED_3, k], e[FEED_3, k] = v + h * (0.75 * a + 0.25 * h * j), 0.75 * a + 0.5 * h * j
        y[C1, k], e[C1, k] = p + h * v / 3.0, v / 3.0
        y[C2, k], e[C2, k] = p + h * (2.0 * v / 3.0 + h * a / 6.0), 2.0 * v / 3.0 + h * a / 3.0
        y[ACROSS, k] = a - u0 * v
        e[P, k], e[V, k], e[A, k], e[J, k], e[ACROSS, k] = 0.0, 0.0, 0.0, 0.0, 0.0
        y[LONG, k], e[LONG, k] = h * (v + 0.5 * h * a), v + h * a
        y[NEXT, k] = p + h * (v + h * (0.5 * a + h * j / 6.0))
        e[NEXT, k] = v + h * (a + 0.5 * h * j)
    alpha[P, 0], alpha[V, 1], alpha[A, 2], alpha[J, 3] = 1.0, 1.0, 1.0, 1.0
    alpha[MID, 1], alpha[MID, 2] = 1.0, 0.5 * h
    for m in range(3):
        alpha[FEED_1 + m, 1], alpha[FEED_1 + m, 2] = 1.0, 0.25 * (m + 1) * h
    alpha[FEED_2, 3], alpha[FEED_3, 3] = h * h / 12.0, 0.25 * h * h
    alpha[C1, 0], alpha[C1, 1] = 1.0, h / 3.0
    alpha[C2, 0], alpha[C2, 1], alpha[C2, 2] = 1.0, 2.0 * h / 3.0, h * h / 6.0
    alpha[ACROSS, 1], alpha[ACROSS, 2] = -u0, 1.0
    alpha[LONG, 1], alpha[LONG, 2] = h, 0.5 * h * h
    alpha[NEXT, 0], alpha[NEXT, 1], alpha[NEXT, 2], alpha[NEXT, 3] = 1.0, h, 0.5 * h * h, h**3 / 6.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_radii(x, u, axes, feed, radius):
    """radius (3,) of the rows of the feed (module text)."""
    h, first, last, jerk, change = u[axes], 0.0, 0.0, 0.0, 0.0
    for k in range(axes):
        a, j = x[2 * axes + k], u[k]
        first += (0.25 * h * a) ** 2
        last += (0.25 * h * (a + h * j)) ** 2
        jerk += (h * h * j) ** 2
        change += (h * (a + 0.5 * h * j)) ** 2
    radius[0], radius[2] = np.sqrt(feed * feed + first), np.sqrt(feed * feed + last)
    radius[1] = np.sqrt(max(feed * feed + change / 12.0 - jerk / 72.0, 0.01 * feed * feed))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _ball(y, vector, limit, row, g, n):
    """The row |y| <= limit."""
    square = 0.0
    for k in range(y.shape[1]):
        square += y[vector, k] * y[vector, k]
        n[row, k] = y[vector, k] / (limit * limit)
    g[row] = 0.5 * (square / (limit * limit) - 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_switch(legs, limits, i, y, lin):
    """The row of a node at a vertex where the feed changes, or beside it (module text)."""
    row, by = 8 * y.shape[1] + SWITCH, limits.switch[i] / (limits.room_node[i] * limits.pace[i])
    lin.g[i, row], r = limits.aside, limits.switch_leg[i]
    for k in range(y.shape[1]):
        off = y[P, k] - legs.base[r, k] - legs.radius[r] * legs.e1[r, k]
        lin.n[i, row, k], lin.node[i, 2, k] = by * y[V, k], by * off
        lin.g[i, row] += lin.n[i, row, k] * off


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_rows(legs, limits, x, u, lin):
    """Put the rows at the nodes x (N+1, 3 A) and the controls u (N, A+1) into `lin`; its places are where the
    search on arcs begins."""
    N, axes = len(u), u.shape[1] - 1
    y, point = np.empty((VECTORS, axes)), np.empty(axes)
    more, stays = 8 * axes, np.zeros((N, 3), np.bool_)
    put_places(legs, limits.leg, limits.at_vertex[0], x, u[:, axes], lin.place, stays)
    for i in range(N):
        g, n = lin.g[i], lin.n[i]
        vectors_of_step(x[i], u[i], axes, y, lin.alpha[i], lin.e[i])
        for m in range(4):
            vector = VECTOR_OF_BOX[m]
            for k in range(axes):
                share, up, down = (
                    y[vector, k] / limits.box[m, k],
                    2 * m * axes + k,
                    (2 * m + 1) * axes + k,
                )
                g[up], g[down] = share - 1.0, -share - 1.0
                n[up, k], n[down, k] = 1.0 / limits.box[m, k], -1.0 / limits.box[m, k]
        h = u[i, axes]
        g[more + H_MAX], g[more + H_MIN] = (
            (h - limits.h_max[i]) / limits.h[i],
            (limits.h_min[i] - h) / limits.h[i],
        )
        _ball(y, V, limits.feed_node[i], more + FEED_NODE, g, n)
        put_radii(x[i], u[i], axes, limits.feed[i], lin.radius[i])
        for m in range(3):
            _ball(y, FEED_1 + m, lin.radius[i, m], more + FEED_ROWS + m, g, n)
        r, at_vertex, passed = limits.leg[i], limits.at_vertex[i], limits.passed[i]
        curved = legs.radius[r] > 0.0 and not passed
        lin.node[i] = 0.0
        for c in range(1 if curved else 3):
            vector, row = (P, C1, C2)[c], more + TUBE_NODE + c
            room = limits.room_node[i] if c == 0 else limits.room[i]
            place = lin.place[i, c]
            if passed:
                lin.tangent[i, c], point[:] = 0.0, limits.target[i, c]
            elif curved:
                place = nearest_point(legs, r, y[vector], place, point, lin.tangent[i, c])
            else:
                for k in range(axes):
                    lin.tangent[i, c, k] = 0.0 if stays[i, c] else legs.drift[r, k]
                    point[k] = legs.base[r, k] + place * legs.drift[r, k]
            if c == 0 and at_vertex:
                for k in range(axes):
                    point[k] = legs.base[r, k] + legs.radius[r] * legs.e1[r, k]
            lin.place[i, c], square = place, 0.0
            for k in range(axes):
                off = y[vector, k] - point[k]
                square += off * off
                n[row, k] = off / (room * room)
            g[row] = 0.5 * (square / (room * room) - 1.0)
        if limits.on[i, more + SWITCH]:
            _put_switch(legs, limits, i, y, lin)
        if curved:
            ends = i < N - 1 and limits.leg[i + 1] != r
            for c in range(1, 3):
                if c == 1:
                    place, vector, other = 0.0 if at_vertex else lin.place[i, 0], C1, P
                else:
                    place, vector, other = legs.length[r], C2, NEXT
                    if not ends:
                        place = nearest_point(legs, r, y[NEXT], lin.place[i, 2], point, lin.tangent[i, 2])
                fixed = (ends if c == 2 else at_vertex) or place <= 0.0 or place >= legs.length[r]
                row = more + TUBE_NODE + c
                foot, slopes_of = (
                    Foot(place, fixed, c == 1),
                    Slopes(n[row], lin.node[i, c - 1], lin.tangent[i, c]),
                )
                found = off_tangent(legs, r, y[vector], y[other], foot, limits.room[i], slopes_of)
                g[row], lin.place[i, c] = found
        order_node, order_mid, arc = 0.0, 0.0, 0.0
        for k in range(axes):
            n[more + ORDER_NODE, k] = -lin.tangent[i, 0, k] / limits.pace[i]
            n[more + ORDER_MID, k] = -lin.tangent[i, 1, k] / limits.pace[i]
            n[more + ARC, k] = lin.tangent[i, 1, k] / limits.step_max[i]
            order_node += n[more + ORDER_NODE, k] * y[V, k]
            order_mid += n[more + ORDER_MID, k] * y[MID, k]
            arc += n[more + ARC, k] * y[LONG, k]
        g[more + ORDER_NODE], g[more + ORDER_MID], g[more + ARC] = order_node, order_mid, arc - 1.0
        _ball(y, ACROSS, limits.normal_node[i], more + NORMAL_NODE, g, n)
        if limits.on[i, more + NORMAL_ROWS]:
            between = g[more + NORMAL_ROWS : more + LAW_ROWS]
            put_normal_rows(
                limits.normal[i], limits.pace[i], limits.turns[i], x[i], u[i], between, lin.own[i]
            )
        put_law_rows(limits, i, x[i], u[i], g[more + LAW_ROWS :], lin.own[i, BETWEEN:])
        for c in range(3):
            place = lin.place[i, c]
            if (c == 0 and limits.at_vertex[i]) or place <= 0.0 or place >= legs.length[limits.leg[i]]:
                lin.tangent[i, c] = 0.0  # the nearest point stays where it is


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def vector_of(row, axes):
    """The vector y that a row depends on; -1 for those of h alone, -2 for those with derivatives of their own."""
    if row < 8 * axes:
        return VECTOR_OF_BOX[row // (2 * axes)]
    more = row - 8 * axes
    if more <= H_MIN:
        return -1
    if more >= NORMAL_ROWS:
        return -2
    return (V, FEED_1, FEED_2, FEED_3, P, C1, C2, V, MID, ACROSS, LONG, P)[more - FEED_NODE]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def second_of(kind):
    """Which second vector (`VECTOR_OF_NODE`) a row behind those of the axes depends on; -1 for none."""
    if kind == SWITCH:
        return 2
    return kind - TUBE_NODE - 1 if TUBE_NODE < kind < ORDER_NODE else -1


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def slopes(limits, lin, dx, du, out):
    """out (N, R) = the change of every row in a step dx (N+1, 3 A), du (N, A+1)."""
    N, axes = len(du), du.shape[1] - 1
    R, more = lin.g.shape[1], 8 * axes
    dy = np.empty((VECTORS, axes))
    of = np.array([vector_of(r, axes) for r in range(R)])
    for i in range(N):
        dh = du[i, axes]
        for m in range(VECTORS):
            alpha = lin.alpha[i, m]
            for k in range(axes):
                dy[m, k] = (
                    alpha[0] * dx[i, k]
                    + alpha[1] * dx[i, axes + k]
                    + alpha[2] * dx[i, 2 * axes + k]
                    + alpha[3] * du[i, k]
                    + lin.e[i, m, k] * dh
                )
        for r in range(R):
            if not limits.on[i, r]:
                continue
            if of[r] == -2:
                row, total = lin.own[i, r - more - NORMAL_ROWS], 0.0
                for k in range(3 * axes):
                    total += row[k] * dx[i, k]
                for k in range(axes + 1):
                    total += row[3 * axes + k] * du[i, k]
                out[i, r] = total
                continue
            if of[r] < 0:
                out[i, r] = dh / limits.h[i] * (1.0 if r == more + H_MAX else -1.0)
                continue
            total = 0.0
            for k in range(axes):
                total += lin.n[i, r, k] * dy[of[r], k]
            c = second_of(r - more)
            if c >= 0:
                for k in range(axes):
                    total += lin.node[i, c, k] * dy[VECTOR_OF_NODE[c], k]
            out[i, r] = total
