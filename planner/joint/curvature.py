"""What the rows of a step (rows.py) add to a Newton step: their second-order model, the sum of z d2g + (z/s) grad g
grad g' (recursion.py); forces.py has the sum of q grad g, and what they change by.

All three go through the vectors y of the rows, which are linear in p, v, a, j for a given h (rows.py). What is f by the
vectors is, by p, v, a, j and h, for every axis (`spread`)

    p   f_P + f_C1 + f_C2
    v   f_V + f_MID + f_1 + f_2 + f_3 + h f_C1/3 + 2 h f_C2/3
    a   f_A + h f_MID/2 + h f_1/4 + h f_2/2 + 3 h f_3/4 + h2 f_C2/6
    j   f_J + h2 f_2/12 + h2 f_3/4
    h   e.f,   e = a/2, a/4, a/2 + h j/6, 3 a/4 + h j/2 of MID, 1, 2, 3;  v/3, (2 v + h a)/3 of C1, C2

and so are the blocks of the model, of what G is between the vectors.
"""

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import pick, put, where
from planner.base.views import clear
from planner.joint.lane_rows import copy_lane
from planner.joint.law_curvature import add_law_curvature
from planner.joint.normal_rows import add_normal_curvature, stay_of
from planner.joint.row_kinds import (
    ARC,
    FEED_NODE,
    FEED_ROWS,
    H_MAX,
    H_MIN,
    LAW_ROWS,
    NORMAL_NODE,
    NORMAL_ROWS,
    ORDER_MID,
    ORDER_NODE,
    SIDE,
    SIXTH,
    SWITCH,
    THIRD,
    TUBE_NODE,
    TWELFTH,
)
from planner.joint.rows import bent_at, of_axis, tangent_of, turn_of


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def spread(h, f_mid, f_1, f_2, f_3, f_c1, f_c2):
    """By p, v, a and j what is f by the vectors that are of several of them (module text)."""
    by_v = f_mid + f_1 + f_2 + f_3 + THIRD * h * (f_c1 + 2.0 * f_c2)
    by_a = h * (0.5 * (f_mid + f_2) + 0.25 * f_1 + 0.75 * f_3) + SIXTH * h * h * f_c2
    return f_c1 + f_c2, by_v, by_a, h * h * (TWELFTH * f_2 + 0.25 * f_3)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_square(sizes, W, row, by):
    """W += by row row', row (4 A + 1,)."""
    for s in range(len(sizes.step)):
        one = by * row[s]
        for t in range(s + 1):
            W[s, t] += one * row[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_bent_row(sizes, group, rows, i, which, x, u, row):
    """row (4 A + 1,) = the derivative of a row on an arc: of the inner control points (1 and 2), of ORDER_NODE, ORDER_MID and
    ARC (3 to 5)."""
    axes = len(sizes.axes)
    h = u[axes]
    by_h = 0.0 * h
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        by_p, by_v, by_a, by_j = 0.0 * h, 0.0 * h, 0.0 * h, 0.0 * h
        if which == 1:  # C1 and P
            n = rows.n[i, 1, k]
            by_p, by_v, by_h = n + rows.node[i, 1, k], THIRD * h * n, by_h + THIRD * v * n
        elif which == 2:  # C2 and NEXT
            n, m = rows.n[i, 2, k], rows.node[i, 2, k]
            by_p, by_v = n + m, h * (2.0 * THIRD * n + m)
            by_a, by_j = h * h * (SIXTH * n + 0.5 * m), h * h * h * SIXTH * m
            by_h += THIRD * (2.0 * v + h * a) * n + (v + h * (a + 0.5 * h * j)) * m
        elif which == 3:
            by_v = -tangent_of(sizes, group, rows, i, 0, k) / group.pace[i]
        elif which == 4:
            by_v = -tangent_of(sizes, group, rows, i, 1, k) / group.pace[i]
            by_a, by_h = 0.5 * h * by_v, by_h + 0.5 * a * by_v
        else:
            n = tangent_of(sizes, group, rows, i, 1, k) * group.per_step[i]
            by_v, by_a, by_h = h * n, 0.5 * h * h * n, by_h + (v + h * a) * n
        row[k], row[axes + k], row[2 * axes + k], row[3 * axes + k] = by_p, by_v, by_a, by_j
    row[4 * axes] = by_h


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_switch_row(sizes, group, i, x, row):
    """row (4 A + 1,) = the derivative of SWITCH."""
    axes = len(sizes.axes)
    clear(row)
    for k in range(axes):
        row[k] = group.switch[i] * x[axes + k]
        row[axes + k] = group.switch[i] * (x[k] - group.switch_at[i, k])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_side_row(sizes, group, i, row):
    """row (4 A + 1,) = the derivative of SIDE."""
    clear(row)
    for k in range(len(sizes.axes)):
        row[k] = group.side[i, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _weight(rows, i, r, per):
    """z/s of a ball's row times what its derivative is of its vector, squared."""
    return rows.z[i, r] * rows.per_s[i, r] * per * per


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_model(sizes, group, rows, i, x, u, W, row):
    """W (4 A + 1, 4 A + 1), lower triangle, of the rows of step i with the node x (3 A,) and the controls u (A+1,); row
    (4 A + 1,) is overwritten."""
    axes, z, per_s = len(sizes.axes), rows.z[i], rows.per_s[i]
    more, at, h = 8 * axes, 4 * axes, u[axes]
    bent = bent_at(sizes, group, i)
    square, third, sixth = h * h, THIRD * h, SIXTH * h * h
    s_v = _weight(rows, i, more + FEED_NODE, group.feed_node[i])
    s_1 = _weight(rows, i, more + FEED_ROWS, rows.per_radius[i, 0])
    s_2 = _weight(rows, i, more + FEED_ROWS + 1, rows.per_radius[i, 1])
    s_3 = _weight(rows, i, more + FEED_ROWS + 2, rows.per_radius[i, 2])
    flat_v = z[more + FEED_NODE] * group.feed_node[i]
    flat_1 = z[more + FEED_ROWS] * rows.per_radius[i, 0]
    flat_2 = z[more + FEED_ROWS + 1] * rows.per_radius[i, 1]
    flat_3 = z[more + FEED_ROWS + 2] * rows.per_radius[i, 2]
    flat_p = (z[more + TUBE_NODE] + group.centre[i]) * group.room_node[i]
    flat_c1, flat_c2 = z[more + TUBE_NODE + 1] * group.room[i], z[more + TUBE_NODE + 2] * group.room[i]
    s_p = z[more + TUBE_NODE] * per_s[more + TUBE_NODE]
    s_c1 = z[more + TUBE_NODE + 1] * per_s[more + TUBE_NODE + 1]
    s_c2 = z[more + TUBE_NODE + 2] * per_s[more + TUBE_NODE + 2]
    if bent:  # rows of two vectors are added below
        alone = where(group.bent[i] > 0.0, 0.0, 1.0 + 0.0 * h)
        s_c1, s_c2 = s_c1 * alone, s_c2 * alone
    long_0, long_1, long_2 = 0.0 * h, 0.0 * h, 0.0 * h  # |tangent|^2
    y_1, y_2, y_3, n_1, n_2 = 0.0 * h, 0.0 * h, 0.0 * h, 0.0 * h, 0.0 * h  # products with e
    t_1, t_2 = 0.0 * h, 0.0 * h
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        at_0, at_1 = tangent_of(sizes, group, rows, i, 0, k), tangent_of(sizes, group, rows, i, 1, k)
        at_2 = tangent_of(sizes, group, rows, i, 2, k)
        long_0, long_1, long_2 = long_0 + at_0 * at_0, long_1 + at_1 * at_1, long_2 + at_2 * at_2
        (v_1, v_2, v_3), (_, e_1, e_2, e_3) = of_axis(h, v, a, j)
        e_c1, e_c2 = THIRD * v, THIRD * (2.0 * v + h * a)
        y_1, y_2, y_3 = y_1 + v_1 * e_1, y_2 + v_2 * e_2, y_3 + v_3 * e_3
        n_1, n_2 = n_1 + rows.n[i, 1, k] * e_c1, n_2 + rows.n[i, 2, k] * e_c2
        t_1, t_2 = t_1 + at_1 * e_c1, t_2 + at_2 * e_c2
    one = 1.0 + 0.0 * h
    slide_0 = flat_p * rows.moves[i, 0] / where(long_0 > 0.0, long_0, one)
    slide_1 = flat_c1 * rows.moves[i, 1] / where(long_1 > 0.0, long_1, one)
    slide_2 = flat_c2 * rows.moves[i, 2] / where(long_2 > 0.0, long_2, one)
    total = (z[more + H_MAX] * per_s[more + H_MAX] + z[more + H_MIN] * per_s[more + H_MIN]) * (
        group.per_h[i] * group.per_h[i]
    )
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        (v_1, v_2, v_3), (e_mid, e_1, e_2, e_3) = of_axis(h, v, a, j)
        n_0, n_c1, n_c2 = rows.n[i, 0, k], rows.n[i, 1, k], rows.n[i, 2, k]
        at_0, at_1 = tangent_of(sizes, group, rows, i, 0, k), tangent_of(sizes, group, rows, i, 1, k)
        at_2 = tangent_of(sizes, group, rows, i, 2, k)
        box_j, box_a = _box(sizes, group, rows, i, 0, k), _box(sizes, group, rows, i, 1, k)
        box_mid, box_v = _box(sizes, group, rows, i, 2, k), _box(sizes, group, rows, i, 3, k)
        for t in range(k + 1):
            (w_1, w_2, w_3), _ = of_axis(h, x[axes + t], x[2 * axes + t], u[t])
            g_v = s_v * v * x[axes + t]
            g_1, g_2, g_3 = s_1 * v_1 * w_1, s_2 * v_2 * w_2, s_3 * v_3 * w_3
            g_p = s_p * n_0 * rows.n[i, 0, t] - slide_0 * at_0 * tangent_of(sizes, group, rows, i, 0, t)
            g_c1 = s_c1 * n_c1 * rows.n[i, 1, t] - slide_1 * at_1 * tangent_of(sizes, group, rows, i, 1, t)
            g_c2 = s_c2 * n_c2 * rows.n[i, 2, t] - slide_2 * at_2 * tangent_of(sizes, group, rows, i, 2, t)
            if t == k:
                g_v, g_1, g_2, g_3 = g_v + flat_v + box_v, g_1 + flat_1, g_2 + flat_2, g_3 + flat_3
                g_p, g_c1, g_c2 = g_p + flat_p, g_c1 + flat_c1, g_c2 + flat_c2
            pp, vp, ap = g_p + g_c1 + g_c2, third * (g_c1 + 2.0 * g_c2), sixth * g_c2
            vv = g_v + g_1 + g_2 + g_3 + third * third * (g_c1 + 4.0 * g_c2)
            av = h * (0.25 * g_1 + 0.5 * g_2 + 0.75 * g_3) + 2.0 * third * sixth * g_c2
            aa = square * (0.0625 * g_1 + 0.25 * g_2 + 0.5625 * g_3) + sixth * sixth * g_c2
            jv = square * (TWELFTH * g_2 + 0.25 * g_3)
            ja = square * h * (0.5 * TWELFTH * g_2 + 0.1875 * g_3)
            jj = square * square * (TWELFTH * TWELFTH * g_2 + 0.0625 * g_3)
            if t == k:
                vv, av = vv + box_mid, av + 0.5 * h * box_mid
                aa, jj = aa + box_a + 0.25 * square * box_mid, jj + box_j
            for row_of, column in ((k, t), (t, k)):
                W[axes + row_of, column], W[2 * axes + row_of, column] = vp, ap
                W[3 * axes + row_of, column] = 0.0
                W[2 * axes + row_of, axes + column], W[3 * axes + row_of, axes + column] = av, jv
                W[3 * axes + row_of, 2 * axes + column] = ja
            W[k, t], W[axes + k, axes + t] = pp, vv
            W[2 * axes + k, 2 * axes + t], W[3 * axes + k, 3 * axes + t] = aa, jj
        e_c1, e_c2 = THIRD * v, THIRD * (2.0 * v + h * a)
        f_mid, f_1 = box_mid * e_mid, s_1 * y_1 * v_1 + flat_1 * e_1
        f_2, f_3 = s_2 * y_2 * v_2 + flat_2 * e_2, s_3 * y_3 * v_3 + flat_3 * e_3
        f_c1 = s_c1 * n_1 * n_c1 - slide_1 * t_1 * at_1 + flat_c1 * e_c1
        f_c2 = s_c2 * n_2 * n_c2 - slide_2 * t_2 * at_2 + flat_c2 * e_c2
        total += e_mid * f_mid + e_1 * f_1 + e_2 * f_2 + e_3 * f_3 + e_c1 * f_c1 + e_c2 * f_c2
        W[at, k], W[at, axes + k], W[at, 2 * axes + k], W[at, 3 * axes + k] = spread(
            h, f_mid, f_1, f_2, f_3, f_c1, f_c2
        )
    W[at, at] = total
    if sizes.any_normal:
        _add_across(sizes, group, rows, i, x, W)
    if bent:
        for which in range(1, 6):
            _put_bent_row(sizes, group, rows, i, which, x, u, row)
            of = more + (0, TUBE_NODE + 1, TUBE_NODE + 2, ORDER_NODE, ORDER_MID, ARC)[which]
            _add_square(sizes, W, row, group.bent[i] * z[of] * per_s[of])
    if sizes.any_switch:
        _put_switch_row(sizes, group, i, x, row)
        _add_square(sizes, W, row, z[more + SWITCH] * per_s[more + SWITCH])
        _put_side_row(sizes, group, i, row)
        _add_square(sizes, W, row, z[more + SIDE] * per_s[more + SIDE])
    if sizes.any_own:
        for r in range(sizes.rows - more - NORMAL_ROWS):
            of = more + NORMAL_ROWS + r
            _add_square(sizes, W, rows.own[i, r], z[of] * per_s[of])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _box(sizes, group, rows, i, m, k):
    """What the two rows of an axis add by its number of that vector."""
    up, down, per = 2 * m * len(sizes.axes) + k, (2 * m + 1) * len(sizes.axes) + k, group.per_box[m, k]
    z, per_s = rows.z[i], rows.per_s[i]
    return (z[up] * per_s[up] + z[down] * per_s[down]) * per * per


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_across(sizes, group, rows, i, x, W):
    """W += the model of the row of the normal acceleration at the node: of a - turn v, turn kept."""
    axes, per, of = len(sizes.axes), group.normal_node[i], 8 * len(sizes.axes) + NORMAL_NODE
    turn, weight, flat = turn_of(axes, x), _weight(rows, i, of, per), rows.z[i, of] * per
    for k in range(axes):
        one = weight * (x[2 * axes + k] - turn * x[axes + k])
        for t in range(axes):
            g = one * (x[2 * axes + t] - turn * x[axes + t])
            if t == k:
                g += flat
            W[2 * axes + k, axes + t] -= turn * g
            if t <= k:
                W[axes + k, axes + t] += turn * turn * g
                W[2 * axes + k, 2 * axes + t] += g


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_normal(sizes, group, rows, i, x, u, W):
    """W += the curvature of the rows of the normal acceleration, and what holds the velocity of nodes that have them."""
    axes = len(sizes.axes)
    more, priced = 8 * axes + NORMAL_ROWS, 0.0 * u[i, axes]
    z = rows.z[i]
    add_normal_curvature(
        sizes, W, group.normal[i], group.pace[i], group.turns[i], x[i], u[i], z[more], z[more + 1]
    )
    for row in (8 * axes + NORMAL_NODE, more, more + 1):
        priced += z[row]
        if i:
            priced += rows.z[i - 1, row]
    stay = group.bound[i] * stay_of(sizes, group.normal[i], x[i], u[i], priced)
    for k in range(axes, 2 * axes):
        W[k, k] += stay


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_laws(sizes, group, bends, rows, i, x, u, W, scratch):
    """W += the curvature of the rows of the laws, worked out for one lane after the other."""
    more = 8 * len(sizes.axes) + LAW_ROWS
    for lane in range(len(sizes.width)):
        if i >= bends.steps[lane]:
            continue
        copy_lane(sizes, bends.at, lane, x[i], u[i], scratch)
        for r in range(sizes.rows - more):
            scratch.g[r] = pick(rows.z[i, more + r], lane)
        scratch.W[:] = 0.0
        pace = pick(group.pace[i], lane)
        add_law_curvature(scratch.W, bends.laws[lane], i, pace, scratch.x, scratch.u, scratch.g)
        for s in range(len(bends.at)):
            for t in range(s + 1):
                row, column = bends.at[s], bends.at[t]
                W[row, column] = put(W[row, column], lane, pick(W[row, column], lane) + scratch.W[s, t])
