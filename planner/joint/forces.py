"""What the rows of a step (rows.py) push by in a Newton step, the sum of q grad g, and what they change by in it. Both go
through the vectors of the rows (curvature.py, tube_curvature.py).
"""

from planner.base.kernels import CONTRACT, njit
from planner.joint.curvature import spread
from planner.joint.row_kinds import (
    ARC,
    FEED_NODE,
    FEED_ROWS,
    H_MAX,
    H_MIN,
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
from planner.joint.tube_curvature import of_state


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def push_of(rows, i, r, first, aim, second):
    """What a row's gradient counts with in the `first` step, towards s z = 0, and in the one towards s z = aim, less the
    product of the steps before as far as `second` is 1."""
    if first:
        return rows.q[i, r]
    return rows.q[i, r] + (aim - second * rows.ds[i, r]) * rows.per_s[i, r]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_force(sizes, group, rows, i, x, u, first, aim, second, w):
    """w (4 A + 1,) = the sum of q grad g of step i with the node x (3 A,) and the controls u (A+1,); q as in `push_of`."""
    axes = len(sizes.axes)
    more, h, none = 8 * axes, u[axes], 0.0 * u[axes]
    bent = bent_at(sizes, group, i)
    q_v = push_of(rows, i, more + FEED_NODE, first, aim, second) * group.feed_node[i]
    q_1 = push_of(rows, i, more + FEED_ROWS, first, aim, second) * rows.per_radius[i, 0]
    q_2 = push_of(rows, i, more + FEED_ROWS + 1, first, aim, second) * rows.per_radius[i, 1]
    q_3 = push_of(rows, i, more + FEED_ROWS + 2, first, aim, second) * rows.per_radius[i, 2]
    longer = push_of(rows, i, more + H_MAX, first, aim, second)
    total = (longer - push_of(rows, i, more + H_MIN, first, aim, second)) * group.per_h[i]
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        f_j = _pushed(sizes, group, rows, i, 0, k, first, aim, second)
        f_a = _pushed(sizes, group, rows, i, 1, k, first, aim, second)
        f_mid = _pushed(sizes, group, rows, i, 2, k, first, aim, second)
        f_v = _pushed(sizes, group, rows, i, 3, k, first, aim, second) + q_v * v
        (v_1, v_2, v_3), (e_mid, e_1, e_2, e_3) = of_axis(h, v, a, j)
        f_1, f_2, f_3 = q_1 * v_1, q_2 * v_2, q_3 * v_3
        by_v, by_a, by_j = spread(h, f_mid, f_1, f_2, f_3)
        w[k], w[axes + k], w[2 * axes + k], w[3 * axes + k] = none, by_v + f_v, by_a + f_a, by_j + f_j
        total += e_mid * f_mid + e_1 * f_1 + e_2 * f_2 + e_3 * f_3
    for m in range(SETS):
        total += _add_tube(sizes, group, rows, i, m, x, u, bent, first, aim, second, w)
    if sizes.any_normal:
        q = push_of(rows, i, more + NORMAL_NODE, first, aim, second) * group.normal_node[i]
        turn = turn_of(axes, x)
        for k in range(axes):
            f = q * (x[2 * axes + k] - turn * x[axes + k])
            w[axes + k] -= turn * f
            w[2 * axes + k] += f
    if bent:
        node = push_of(rows, i, more + ORDER_NODE, first, aim, second) / group.pace[i]
        mid = push_of(rows, i, more + ORDER_MID, first, aim, second) / group.pace[i]
        arc = push_of(rows, i, more + ARC, first, aim, second) * group.per_step[i]
        for k in range(axes):
            v, a, j = x[axes + k], x[2 * axes + k], u[k]
            at_mid = tangent_of(sizes, rows, i, 1, k)
            w[axes + k] += (h * arc - mid) * at_mid - node * tangent_of(sizes, rows, i, 0, k)
            w[2 * axes + k] += 0.5 * h * (h * arc - mid) * at_mid
            total += ((v + h * a) * arc - 0.5 * a * mid) * at_mid
    if sizes.any_switch:
        q = push_of(rows, i, more + SWITCH, first, aim, second) * group.switch[i]
        beyond = push_of(rows, i, more + SIDE, first, aim, second)
        for k in range(axes):
            w[k] += q * x[axes + k] + beyond * group.side[i, k]
            w[axes + k] += q * (x[k] - group.switch_at[i, k])
    w[4 * axes] = total
    if sizes.any_own:
        for r in range(sizes.rows - more - NORMAL_ROWS):
            q = push_of(rows, i, more + NORMAL_ROWS + r, first, aim, second)
            for k in range(len(sizes.step)):
                w[k] += q * rows.own[i, r, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_tube(sizes, group, rows, i, m, x, u, bent, first, aim, second, w):
    """w += what the rows of a set push by, but for what they push h by, which is returned."""
    axes, h, sag, c = len(sizes.axes), u[len(sizes.axes)], group.sag[m], 3 * m
    row, total = 8 * axes + TUBE_NODE + c, 0.0 * h
    q_0 = push_of(rows, i, row, first, aim, second) + (group.centre[i] if m == 0 else 0.0 * h)
    q_1, q_2 = push_of(rows, i, row + 1, first, aim, second), push_of(rows, i, row + 2, first, aim, second)
    for k in range(axes):
        a, j = x[2 * axes + k], u[k]
        w_k = x[axes + k] + sag * j
        f_1, f_2 = q_1 * rows.n[i, c + 1, k], q_2 * rows.n[i, c + 2, k]
        by_q, by_w = f_1 + f_2 + q_0 * rows.n[i, c, k], THIRD * h * (f_1 + 2.0 * f_2)
        by_a, by_j = SIXTH * h * h * f_2, 0.0 * h
        total += THIRD * (w_k * f_1 + (2.0 * w_k + h * a) * f_2)
        if bent:
            following = q_2 * rows.by_node[i, c + 2] * tangent_of(sizes, rows, i, c + 2, k)
            by_q += q_1 * rows.by_node[i, c + 1] * tangent_of(sizes, rows, i, c + 1, k) + following
            by_w += h * following
            by_a, by_j = by_a + 0.5 * h * h * following, h * h * h * SIXTH * following
            total += (w_k + h * (a + 0.5 * h * j)) * following
        by_p, by_v, by_a, by_j = of_state(sag, by_q, by_w, by_a, by_j)
        w[k], w[axes + k] = w[k] + by_p, w[axes + k] + by_v
        w[2 * axes + k], w[3 * axes + k] = w[2 * axes + k] + by_a, w[3 * axes + k] + by_j
    return total


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _tube_slopes(sizes, group, rows, i, m, x, u, d, bent):
    """The changes of the three rows of a set."""
    axes, h, dh, sag, c = len(sizes.axes), u[len(sizes.axes)], d[4 * len(sizes.axes)], group.sag[m], 3 * m
    by_0, by_1, by_2 = 0.0 * dh, 0.0 * dh, 0.0 * dh
    for k in range(axes):
        a, da, j, dj = x[2 * axes + k], d[2 * axes + k], u[k], d[3 * axes + k]
        w, dq, dw = x[axes + k] + sag * j, d[k] + sag * da, d[axes + k] + sag * dj
        by_0 += rows.n[i, c, k] * dq
        by_1 += rows.n[i, c + 1, k] * (dq + THIRD * (h * dw + w * dh))
        by_2 += rows.n[i, c + 2, k] * (dq + THIRD * (h * (2.0 * dw + 0.5 * h * da) + (2.0 * w + h * a) * dh))
        if bent:
            by_1 += rows.by_node[i, c + 1] * tangent_of(sizes, rows, i, c + 1, k) * dq
            following = dq + h * (dw + h * (0.5 * da + h * SIXTH * dj)) + (w + h * (a + 0.5 * h * j)) * dh
            by_2 += rows.by_node[i, c + 2] * tangent_of(sizes, rows, i, c + 2, k) * following
    return by_0, by_1, by_2


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _pushed(sizes, group, rows, i, m, k, first, aim, second):
    """What the two rows of an axis push its number of that vector by."""
    axes = len(sizes.axes)
    up = push_of(rows, i, 2 * m * axes + k, first, aim, second)
    return (up - push_of(rows, i, (2 * m + 1) * axes + k, first, aim, second)) * group.per_box[m, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_slopes(sizes, group, rows, i, x, u, d, out):
    """out (R,) = the change of every row of step i in a step d (4 A + 1,) of p, v, a, j and h."""
    axes = len(sizes.axes)
    more, h, dh = 8 * axes, u[axes], d[4 * axes]
    bent = bent_at(sizes, group, i)
    none = 0.0 * dh
    by_v, by_1, by_2, by_3 = none, none, none, none
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        dv, da, dj = d[axes + k], d[2 * axes + k], d[3 * axes + k]
        (v_1, v_2, v_3), (e_mid, e_1, e_2, e_3) = of_axis(h, v, a, j)
        changes = dj, da, dv + 0.5 * h * da + e_mid * dh, dv
        for m in range(4):
            share = changes[m] * group.per_box[m, k]
            out[2 * m * axes + k], out[(2 * m + 1) * axes + k] = share, -share
        by_v += v * dv
        by_1 += v_1 * (dv + 0.25 * h * da + e_1 * dh)
        by_2 += v_2 * (dv + h * (0.5 * da + h * TWELFTH * dj) + e_2 * dh)
        by_3 += v_3 * (dv + h * (0.75 * da + 0.25 * h * dj) + e_3 * dh)
    for r in range(more + ORDER_NODE, sizes.rows):
        out[r] = 0.0
    if bent:
        node, mid, arc = none, none, none
        for k in range(axes):
            v, a, dv, da = x[axes + k], x[2 * axes + k], d[axes + k], d[2 * axes + k]
            at_mid = tangent_of(sizes, rows, i, 1, k)
            node += tangent_of(sizes, rows, i, 0, k) * dv
            mid += at_mid * (dv + 0.5 * (h * da + a * dh))
            arc += at_mid * (h * (dv + 0.5 * h * da) + (v + h * a) * dh)
        out[more + ORDER_NODE], out[more + ORDER_MID] = -node / group.pace[i], -mid / group.pace[i]
        out[more + ARC] = arc * group.per_step[i]
    out[more + H_MAX], out[more + H_MIN] = dh * group.per_h[i], -dh * group.per_h[i]
    out[more + FEED_NODE] = by_v * group.feed_node[i]
    out[more + FEED_ROWS] = by_1 * rows.per_radius[i, 0]
    out[more + FEED_ROWS + 1] = by_2 * rows.per_radius[i, 1]
    out[more + FEED_ROWS + 2] = by_3 * rows.per_radius[i, 2]
    for m in range(SETS):
        row = more + TUBE_NODE + 3 * m
        out[row], out[row + 1], out[row + 2] = _tube_slopes(sizes, group, rows, i, m, x, u, d, bent)
    if sizes.any_normal:
        turn, total = turn_of(axes, x), none
        for k in range(axes):
            y = x[2 * axes + k] - turn * x[axes + k]
            total += y * (d[2 * axes + k] - turn * d[axes + k])
        out[more + NORMAL_NODE] = total * group.normal_node[i]
    if sizes.any_switch:
        total, beyond = none, none
        for k in range(axes):
            total += x[axes + k] * d[k] + (x[k] - group.switch_at[i, k]) * d[axes + k]
            beyond += group.side[i, k] * d[k]
        out[more + SWITCH], out[more + SIDE] = total * group.switch[i], beyond
    if sizes.any_own:
        for r in range(sizes.rows - more - NORMAL_ROWS):
            total = none
            for k in range(len(sizes.step)):
                total += rows.own[i, r, k] * d[k]
            out[more + NORMAL_ROWS + r] = total
