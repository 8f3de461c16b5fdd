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
    p + h v/3, p + 2 h v/3 + h2 a/6            the tolerance: inner control points of the cubic, of two of them (below)
    a - u v                                    normal acceleration, u = v.a/v.v kept: the smallest |a - u v| is what it is about
    h (v + a h/2)                              largest length of a step on an arc
    p, v             at a vertex               the feed of each leg as far as the motion is nearest to the vertex
    p + h v + h2 a/2 + h3 j/6                  the next node's position, for the tolerance on arcs

The square of the feed has degree 4. With the Bezier ordinates w0, w1, w2 of the velocity its own are w0.w0,
w0.w1, (2 w1.w1 + w0.w2)/3, w1.w2 and w2.w2; none above the square of the limit F is enough for the whole
step, and on a circle at constant feed all are equal. w0.w1 = |y|^2 - |a h/4|^2 with y = v + a h/4, so that
the row is |y| <= r, r^2 = F^2 + |a h/4|^2 kept, and the other two likewise.

Between two setpoints the motion is their chord, in the middle of a period (p(t-) + p(t+))/2 = p + dt2/8 a of a cubic, and
behind filters with the time constants T it is p + sum T2/24 a. So there are two sets of rows of the tolerance, of p + k a:
of the setpoints, k = 0, and of the middles of chords behind filters, k = `TubeRun.sag`; all else lies between them. Each is
a cubic with the state p + k a, v + k j, a. Of chords and filters longer than steps, what is found is looked at (checks.py),
and rows are told the rest that they are off at the nodes, linear in between.

The tolerance is g = (d2/room2 - 1)/2 with the distance d to the nearest point of the leg (at a vertex: to the
vertex), along which n = (y - nearest)/room2 holds whether or not the nearest point moves. On a line that is
convex, and a motion may go back along it: its points belong to places in order (`put_places`), which are not
the nearest ones where it does, and are taken as fixed. On an arc the inner control points belong to the
tangents at the places of the step's nodes (bends.py), which move with them: those rows depend on a second
vector, p or the next node's, through `Rows.by_node`. On an arc that is passed (run.py) places are fixed.

Other limits (laws.py) have rows of another kind, with their derivatives by p, v, a, j and h, behind all
others where a window needs them.

Where legs of different feeds meet at a vertex V the node may not be on the slower one's side of the place
that is nearest to V: with m = 1 where the feed falls, -1 where it rises, m (p - V).v <= 0. This row depends
on p and on v; its own curvature is left out, as that of the kinematics is. Where a motion
comes nearer to V once more on the other side, nodes there have the row too, about a place further on (switches.py).
Round V, at one distance, v is across p - V everywhere: so where that is not enough those nodes may not be beyond the
plane through V either that is across the direction t of the start, m (p - V).t <= 0.
"""

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, smaller, where
from planner.joint.bends import put_bent, tangent_at
from planner.joint.normal_rows import put_normal_rows
from planner.joint.row_kinds import (
    ACROSS,
    ARC,
    FEED_1,
    FEED_2,
    FEED_3,
    FEED_NODE,
    FEED_ROWS,
    H_MAX,
    H_MIN,
    LONG,
    MID,
    NORMAL_NODE,
    NORMAL_ROWS,
    OF_SET,
    ORDER_MID,
    ORDER_NODE,
    SETS,
    SIDE,
    SIXTH,
    SWITCH,
    THIRD,
    TUBE,
    TUBE_NODE,
    TWELFTH,
    VECTOR_OF_BOX,
    A,
    J,
    P,
    V,
)
from planner.joint.single_rows import put_laws


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def rest_of(rest, of, part, k):
    """Of an axis, what the rest (2, A) of a step adds to its node, inner control points or end (0 to 3) of a set."""
    return of * (rest[0, k] + part * THIRD * (rest[1, k] - rest[0, k]))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _place_on_line(axes, group, i, of, x, u, part):
    """The place on the leg of step i that is nearest to its node, first or second inner control point (0 to 2), or its
    end, the node x (3), of a set."""
    h, sag = u[axes], group.sag[of]
    along = 0.0 * h
    for k in range(axes):
        a = x[2 * axes + k]
        c, v = x[k] + sag * a + rest_of(group.rest[i], of, part, k), x[axes + k] + sag * u[k]
        if part == 1:
            c = c + THIRD * h * v
        elif part == 2:
            c = c + h * THIRD * (2.0 * v + 0.5 * h * a)
        along += (c - group.base[i, k]) * group.drift[i, k]
    return smaller(larger(along * group.per_drift[i], 0.0), group.length[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_places(sizes, group, x, u, rows, nearest, top):
    """The places of the nodes and the inner control points of both sets that are on lines (`_put_places`)."""
    for m in range(SETS):
        _put_places(sizes, group, m, x, u, rows, nearest, top)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_places(sizes, group, of, x, u, rows, nearest, top):
    """The places of a set, in order along each leg: a motion may go
    back as far as one place is near enough to what it passes twice. They are halfway between the largest nearest place
    before and the smallest one behind, so that the farthest is moved by as little as can be; nearest (N, 3) and
    top (N,) are overwritten."""
    axes, N, column = len(sizes.axes), sizes.steps, 3 * of
    low, end = 0.0 * u[0, axes], 0.0 * u[0, axes]
    for i in range(N):
        h = u[i, axes]
        for m in range(3):
            nearest[i, m] = _place_on_line(axes, group, i, of, x[i], u[i], m)
        begins = group.begins[i] > 0.0
        nearest[i, 0] = where(begins, where(group.at_vertex[i] > 0.0, 0.0 * h, nearest[i, 0]), nearest[i, 0])
        low = where(begins, nearest[i, 0], low)
        last = group.last[i] > 0.0
        if anywhere(last):
            end = where(last, larger(_place_on_line(axes, group, i, of, x[i + 1], u[i], 3), low), end)
    behind = end
    for i in range(N - 1, -1, -1):
        ends = group.ends[i] > 0.0
        high = where(group.last[i] > 0.0, end, group.length[i])
        top[i] = where(ends, high, top[i + 1 if i + 1 < N else i])
        behind = where(ends, high, behind)
        for m in range(2, -1, -1):
            behind = smaller(behind, nearest[i, m])
            rows.moves[i, column + m] = behind
    before = low
    for i in range(N):
        begins, length = group.begins[i] > 0.0, group.length[i]
        low = where(begins, nearest[i, 0], low)
        before = where(begins, low, before)
        for m in range(3):
            before = larger(before, nearest[i, m])
            place = smaller(larger(0.5 * (before + rows.moves[i, column + m]), low), top[i])
            there = where(magnitude(place - nearest[i, m]) > 0.0, 0.0, 1.0 + 0.0 * place)
            there = where(place <= 0.0, 0.0, where(place >= length, 0.0, there))
            rows.moves[i, column + m] = there
            rows.place[i, column + m] = where(group.line[i] > 0.0, place, rows.place[i, column + m])
        rows.moves[i, column] *= 1.0 - group.at_vertex[i]


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
def _put_vectors(axes, sag, rest, x, u, y):
    """y (18, A) of a step with the node x (3 A,) and the controls u (A+1,)."""
    h, turn = u[axes], turn_of(axes, x)
    for k in range(axes):
        p, v, a, j = x[k], x[axes + k], x[2 * axes + k], u[k]
        y[P, k], y[V, k], y[A, k], y[J, k] = p, v, a, j
        y[MID, k] = v + 0.5 * h * a
        (y[FEED_1, k], y[FEED_2, k], y[FEED_3, k]), _ = of_axis(h, v, a, j)
        y[ACROSS, k], y[LONG, k] = a - turn * v, h * (v + 0.5 * h * a)
        for m in range(SETS):
            at, q, w = TUBE + OF_SET * m, p + sag[m] * a, v + sag[m] * j
            y[at, k], y[at + 1, k] = q, q + h * w * THIRD
            y[at + 2, k] = q + h * THIRD * (2.0 * w + 0.5 * h * a)
            y[at + 3, k] = q + h * (w + h * (0.5 * a + h * j * SIXTH))
            for part in range(OF_SET):
                y[at + part, k] += rest_of(rest, m, part, k)


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
def bent_at(sizes, group, i):
    """Whether any window has a leg that is no line, or is passed, at step i."""
    return sizes.bends > 0 and anywhere(group.line[i] < group.real[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tangent_of(sizes, rows, i, c, k):
    """Of the leg at a node or an inner control point, c as of `Rows.place`."""
    return rows.tangent[tangent_at(sizes, i, c), k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_rows(sizes, group, held, x, u, rows, along, dual, least, room, scratch):
    """Put the rows at the nodes x (N+1, 3 A) and the controls u (N, A+1) into `rows`, whose places are where the search
    on arcs begins, and slacks and multipliers after the shares `along` and `dual` of their steps, their product `least` at
    least. Returns the sum of s z, the largest row, and the sum of z |g + s|: in units of time, what rows are off their slacks.
    A row that is not there is -1.
    room: y (18, A), nearest (N, 3) and top (N,)."""
    axes, N, R = len(sizes.axes), sizes.steps, sizes.rows
    y, nearest, top = room
    more = 8 * axes
    put_places(sizes, group, x, u, rows, nearest, top)
    products, broken, owed = 0.0 * along, 0.0 * along, 0.0 * along
    for i in range(N):
        g, h = rows.g[i], u[i, axes]
        bent = bent_at(sizes, group, i)
        _put_vectors(axes, group.sag, group.rest[i], x[i], u[i], y)
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
        for c in range(3 * SETS):
            of_node, vector = c % 3 == 0, TUBE + OF_SET * (c // 3) + c % 3
            per = group.room_node[i] if of_node else group.room[i]
            square, place = 0.0 * h, rows.place[i, c]
            for k in range(axes):
                point = group.base[i, k] + place * group.drift[i, k]
                if bent:
                    point = where(group.passed[i] > 0.0, group.target[i, c % 3, k], point)
                if of_node:
                    point = where(group.at_vertex[i] > 0.0, group.start[i, k], point)
                off = y[vector, k] - point
                square += off * off
                rows.n[i, c, k] = off * per
            g[more + TUBE_NODE + c] = 0.5 * (square * per - 1.0)
        if bent:
            put_bent(sizes, group, i, y, rows)
            order_node, order_mid, arc = 0.0 * h, 0.0 * h, 0.0 * h
            for k in range(axes):
                at_node, at_mid = tangent_of(sizes, rows, i, 0, k), tangent_of(sizes, rows, i, 1, k)
                order_node, order_mid = order_node - at_node * y[V, k], order_mid - at_mid * y[MID, k]
                arc += at_mid * y[LONG, k]
            g[more + ORDER_NODE], g[more + ORDER_MID] = order_node / group.pace[i], order_mid / group.pace[i]
            g[more + ARC] = arc * group.per_step[i] - 1.0
        if sizes.any_switch:
            square, beyond = group.aside[0], 0.0 * h
            for k in range(axes):
                off = y[P, k] - group.switch_at[i, k]
                square += group.switch[i] * y[V, k] * off
                beyond += group.side[i, k] * off
            g[more + SWITCH], g[more + SIDE] = square, beyond
        if sizes.any_normal:
            _ball(axes, y, ACROSS, group.normal_node[i], more + NORMAL_NODE, g)
        if sizes.any_normal:
            put_normal_rows(
                sizes, group.normal[i], group.pace[i], group.turns[i], x[i], u[i], rows.between, rows.own[i]
            )
            g[more + NORMAL_ROWS], g[more + NORMAL_ROWS + 1] = rows.between[0], rows.between[1]
        if held is not None and sizes.any_laws:
            put_laws(sizes, held, i, group, x, u, rows, scratch)
        for r in range(R):
            there = rows.per_s[i, r] > 0.0
            g_r = where(there, g[r], -1.0)
            s_r, z_r = rows.s[i, r] + along * rows.ds[i, r], rows.z[i, r] + dual * rows.dz[i, r]
            per = where(there, 1.0 / s_r, 0.0)
            z_r = larger(z_r, least * per)
            g[r], rows.s[i, r], rows.z[i, r], rows.per_s[i, r] = g_r, s_r, z_r, per
            rows.q[i, r] = z_r * (g_r + s_r) * per
            products += s_r * z_r
            broken = larger(g_r, broken)
            owed += z_r * magnitude(g_r + s_r)
    return products, broken, owed
