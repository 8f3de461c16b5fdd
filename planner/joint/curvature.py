"""What the rows of a step (rows.py) add to a Newton step: their second-order model, the sum of z d2g + (z/s) grad g
grad g' (recursion.py); forces.py has the sum of q grad g, and what they change by.

All three go through the vectors y of the rows, which are linear in p, v, a, j for a given h (rows.py). What is f by the
vectors is, by p, v, a, j and h, for every axis (`spread`)

    v   f_V + f_MID + f_1 + f_2 + f_3
    a   f_A + h f_MID/2 + h f_1/4 + h f_2/2 + 3 h f_3/4
    j   f_J + h2 f_2/12 + h2 f_3/4
    h   e.f,   e = a/2, a/4, a/2 + h j/6, 3 a/4 + h j/2 of MID, 1, 2, 3

and so are the blocks of the model, of what G is between the vectors. Sets of the tolerance are in tube_curvature.py.
"""

from planner.base.kernels import CONTRACT, njit
from planner.base.views import clear
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
    SETS,
    SIDE,
    SIXTH,
    SWITCH,
    THIRD,
    TUBE_NODE,
    TWELFTH,
)
from planner.joint.rows import bent_at, of_axis, tangent_of, turn_of
from planner.joint.single_rows import copy_step
from planner.joint.tube_curvature import of_state, tube_block, tube_by_h, tube_weights


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def spread(h, f_mid, f_1, f_2, f_3):
    """By v, a and j what is f by the vectors that are of several of them (module text)."""
    by_a = h * (0.5 * (f_mid + f_2) + 0.25 * f_1 + 0.75 * f_3)
    return f_mid + f_1 + f_2 + f_3, by_a, h * h * (TWELFTH * f_2 + 0.25 * f_3)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_square(sizes, W, row, by):
    """W += by row row', row (4 A + 1,)."""
    for s in range(len(sizes.step)):
        one = by * row[s]
        for t in range(s + 1):
            W[s, t] += one * row[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_bent_row(sizes, group, rows, i, which, m, x, u, row):
    """row (4 A + 1,) = the derivative of a row on an arc: of the inner control points (1 and 2) of set m, of ORDER_NODE,
    ORDER_MID and ARC (3 to 5)."""
    axes = len(sizes.axes)
    h = u[axes]
    by_h = 0.0 * h
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        by_p, by_v, by_a, by_j = 0.0 * h, 0.0 * h, 0.0 * h, 0.0 * h
        if which <= 2:
            c = 3 * m + which
            n, f = rows.n[i, c, k], rows.by_node[i, c] * tangent_of(sizes, rows, i, c, k)
            w = v + group.sag[m] * j
            if which == 1:  # and the node
                by_p, by_v, by_h = n + f, THIRD * h * n, by_h + THIRD * w * n
            else:  # and the next one
                by_p, by_v = n + f, h * (2.0 * THIRD * n + f)
                by_a, by_j = h * h * (SIXTH * n + 0.5 * f), h * h * h * SIXTH * f
                by_h += THIRD * (2.0 * w + h * a) * n + (w + h * (a + 0.5 * h * j)) * f
            by_p, by_v, by_a, by_j = of_state(group.sag[m], by_p, by_v, by_a, by_j)
        elif which == 3:
            by_v = -tangent_of(sizes, rows, i, 0, k) / group.pace[i]
        elif which == 4:
            by_v = -tangent_of(sizes, rows, i, 1, k) / group.pace[i]
            by_a, by_h = 0.5 * h * by_v, by_h + 0.5 * a * by_v
        else:
            n = tangent_of(sizes, rows, i, 1, k) * group.per_step[i]
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
    square = h * h
    s_v = _weight(rows, i, more + FEED_NODE, group.feed_node[i])
    s_1 = _weight(rows, i, more + FEED_ROWS, rows.per_radius[i, 0])
    s_2 = _weight(rows, i, more + FEED_ROWS + 1, rows.per_radius[i, 1])
    s_3 = _weight(rows, i, more + FEED_ROWS + 2, rows.per_radius[i, 2])
    flat_v = z[more + FEED_NODE] * group.feed_node[i]
    flat_1 = z[more + FEED_ROWS] * rows.per_radius[i, 0]
    flat_2 = z[more + FEED_ROWS + 1] * rows.per_radius[i, 1]
    flat_3 = z[more + FEED_ROWS + 2] * rows.per_radius[i, 2]
    of_0 = tube_weights(sizes, group, rows, i, 0, x, u, bent)
    of_1 = tube_weights(sizes, group, rows, i, 1, x, u, bent)
    y_1, y_2, y_3 = 0.0 * h, 0.0 * h, 0.0 * h  # products with e
    for k in range(axes):
        (v_1, v_2, v_3), (_, e_1, e_2, e_3) = of_axis(h, x[axes + k], x[2 * axes + k], u[k])
        y_1, y_2, y_3 = y_1 + v_1 * e_1, y_2 + v_2 * e_2, y_3 + v_3 * e_3
    total = (z[more + H_MAX] * per_s[more + H_MAX] + z[more + H_MIN] * per_s[more + H_MIN]) * (
        group.per_h[i] * group.per_h[i]
    )
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        (v_1, v_2, v_3), (e_mid, e_1, e_2, e_3) = of_axis(h, v, a, j)
        box_j, box_a = _box(sizes, group, rows, i, 0, k), _box(sizes, group, rows, i, 1, k)
        box_mid, box_v = _box(sizes, group, rows, i, 2, k), _box(sizes, group, rows, i, 3, k)
        for t in range(k + 1):
            (w_1, w_2, w_3), _ = of_axis(h, x[axes + t], x[2 * axes + t], u[t])
            g_v = s_v * v * x[axes + t]
            g_1, g_2, g_3 = s_1 * v_1 * w_1, s_2 * v_2 * w_2, s_3 * v_3 * w_3
            if t == k:
                g_v, g_1, g_2, g_3 = g_v + flat_v + box_v, g_1 + flat_1, g_2 + flat_2, g_3 + flat_3
            vv = g_v + g_1 + g_2 + g_3
            av = h * (0.25 * g_1 + 0.5 * g_2 + 0.75 * g_3)
            aa = square * (0.0625 * g_1 + 0.25 * g_2 + 0.5625 * g_3)
            jv = square * (TWELFTH * g_2 + 0.25 * g_3)
            ja = square * h * (0.5 * TWELFTH * g_2 + 0.1875 * g_3)
            jj = square * square * (TWELFTH * TWELFTH * g_2 + 0.0625 * g_3)
            if t == k:
                vv, av = vv + box_mid, av + 0.5 * h * box_mid
                aa, jj = aa + box_a + 0.25 * square * box_mid, jj + box_j
            b, d = (
                tube_block(sizes, group, rows, i, 0, of_0, h, k, t),
                tube_block(sizes, group, rows, i, 1, of_1, h, k, t),
            )
            pp, vp, ap, jp = b[0] + d[0], b[1] + d[1], b[2] + d[2], b[3] + d[3]
            vv, av, jv = vv + b[4] + d[4], av + b[5] + d[5], jv + b[6] + d[6]
            aa, ja, jj = aa + b[7] + d[7], ja + b[8] + d[8], jj + b[9] + d[9]
            for row_of, column in ((k, t), (t, k)):
                W[axes + row_of, column], W[2 * axes + row_of, column] = vp, ap
                W[3 * axes + row_of, column] = jp
                W[2 * axes + row_of, axes + column], W[3 * axes + row_of, axes + column] = av, jv
                W[3 * axes + row_of, 2 * axes + column] = ja
            W[k, t], W[axes + k, axes + t] = pp, vv
            W[2 * axes + k, 2 * axes + t], W[3 * axes + k, 3 * axes + t] = aa, jj
        f_mid, f_1 = box_mid * e_mid, s_1 * y_1 * v_1 + flat_1 * e_1
        f_2, f_3 = s_2 * y_2 * v_2 + flat_2 * e_2, s_3 * y_3 * v_3 + flat_3 * e_3
        by_v, by_a, by_j = spread(h, f_mid, f_1, f_2, f_3)
        b, of_b = tube_by_h(sizes, group, rows, i, 0, of_0, x, u, k)
        d, of_d = tube_by_h(sizes, group, rows, i, 1, of_1, x, u, k)
        total += e_mid * f_mid + e_1 * f_1 + e_2 * f_2 + e_3 * f_3 + of_b + of_d
        W[at, k], W[at, axes + k] = b[0] + d[0], by_v + b[1] + d[1]
        W[at, 2 * axes + k], W[at, 3 * axes + k] = by_a + b[2] + d[2], by_j + b[3] + d[3]
    W[at, at] = total
    if sizes.any_normal:
        _add_across(sizes, group, rows, i, x, W)
    if bent:
        for m in range(SETS):
            for which in range(1, 3):
                _put_bent_row(sizes, group, rows, i, which, m, x, u, row)
                of = more + TUBE_NODE + 3 * m + which
                _add_square(sizes, W, row, group.bent[i] * z[of] * per_s[of])
        for which in range(3, 6):
            _put_bent_row(sizes, group, rows, i, which, 0, x, u, row)
            of = more + (ORDER_NODE, ORDER_MID, ARC)[which - 3]
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
def add_laws(sizes, group, held, rows, i, x, u, W, scratch):
    """W += the curvature of the rows of the laws."""
    more = 8 * len(sizes.axes) + LAW_ROWS
    copy_step(sizes, held.at, x[i], u[i], scratch)
    for r in range(sizes.rows - more):
        scratch.g[r] = rows.z[i, more + r]
    scratch.W[:] = 0.0
    add_law_curvature(scratch.W, held.laws, i, group.pace[i], scratch.x, scratch.u, scratch.g)
    for s in range(len(held.at)):
        for t in range(s + 1):
            W[held.at[s], held.at[t]] += scratch.W[s, t]
