"""What the rows of a step (rows.py) add to a Newton step: their second-order model, the sum of z d2g + (z/s) grad g
grad g' (recursion.py), the sum of q grad g, and what they change by.
"""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import clear, pick, put, where
from planner.joint.law_curvature import add_law_curvature
from planner.joint.normal_rows import add_normal_curvature, stay_of
from planner.joint.rows import (
    ACROSS,
    ARC,
    C1,
    C2,
    FEED_1,
    FEED_NODE,
    FEED_ROWS,
    H_MAX,
    H_MIN,
    LAW_ROWS,
    LONG,
    MID,
    NEXT,
    NORMAL_NODE,
    NORMAL_ROWS,
    ORDER_MID,
    ORDER_NODE,
    SWITCH,
    TUBE_NODE,
    VECTOR_OF_BOX,
    VECTORS,
    P,
    V,
    bent_at,
    copy_lane,
    tangent_of,
)

TUBE_VECTOR = (P, C1, C2)
TUBE_SECOND = (P, P, NEXT)  # second vectors of the rows of the tolerance on arcs


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_vector(sizes, W, alpha, e, m, G):
    """W += J'GJ for the vector m with dy = J d."""
    axes = len(sizes.axes)
    h = 4 * axes
    for k in range(axes):
        along = 0.0 * G[0, 0]
        for t in range(axes):
            along += G[k, t] * e[m, t]
        W[h, h] += e[m, k] * along
        for a in range(FIRST_BLOCK[m], LAST_BLOCK[m] + 1):
            W[h, a * axes + k] += alpha[m, a] * along
            for b in range(FIRST_BLOCK[m], a + 1):
                both = alpha[m, a] * alpha[m, b]
                for t in range(axes):
                    W[a * axes + k, b * axes + t] += both * G[k, t]


# The first and the last of p, v, a, j that a vector depends on.
FIRST_BLOCK = np.array([0, 1, 2, 3, 1, 1, 1, 1, 0, 0, 1, 1, 0])
LAST_BLOCK = np.array([0, 1, 2, 3, 2, 2, 3, 3, 1, 2, 2, 2, 3])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_square(sizes, W, row, by):
    """W += by row row', row (4 A + 1,)."""
    for s in range(len(sizes.step)):
        one = by * row[s]
        for t in range(s + 1):
            W[s, t] += one * row[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _add_to_row(sizes, row, alpha, e, m, k, by):
    """row (4 A + 1,) += what a derivative `by` by the k-th number of the vector m is by p, v, a, j and h."""
    axes = len(sizes.axes)
    for a in range(FIRST_BLOCK[m], LAST_BLOCK[m] + 1):
        row[a * axes + k] += alpha[m, a] * by
    row[4 * axes] += e[m, k] * by


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_second_row(sizes, group, rows, i, c, y, alpha, e, row):
    """row (4 A + 1,) = the derivative of the row of the inner control point c on an arc, or of SWITCH (c = 0)."""
    clear(row)
    for k in range(len(sizes.axes)):
        if c > 0:
            _add_to_row(sizes, row, alpha, e, TUBE_VECTOR[c], k, rows.n[i, c, k])
            _add_to_row(sizes, row, alpha, e, TUBE_SECOND[c], k, rows.node[i, c, k])
        else:
            _add_to_row(sizes, row, alpha, e, P, k, group.switch[i] * y[V, k])
            _add_to_row(sizes, row, alpha, e, V, k, group.switch[i] * (y[P, k] - group.switch_at[i, k]))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_ball(axes, G, y, m, square, flat):
    """G = square y y' + flat."""
    for k in range(axes):
        one = square * y[m, k]
        for t in range(axes):
            G[k, t] = one * y[m, t]
        G[k, k] += flat


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_model(sizes, group, rows, i, motion, room, W):
    """W (4 A + 1, 4 A + 1), lower triangle, of the rows of step i. motion: y, alpha and e of it; room: G (A, A) and a
    row (4 A + 1,)."""
    y, alpha, e = motion
    G, row = room
    axes, z, per_s = len(sizes.axes), rows.z[i], rows.per_s[i]
    more = 8 * axes
    bent = bent_at(sizes, group, i)
    clear(W)
    for m in range(4):
        vector = VECTOR_OF_BOX[m]
        if m < 3:  # that of the velocity at the node has rows beside
            for k in range(axes):
                up, down = 2 * m * axes + k, (2 * m + 1) * axes + k
                flat = (z[up] * per_s[up] + z[down] * per_s[down]) * (
                    group.per_box[m, k] * group.per_box[m, k]
                )
                along = flat * e[vector, k]
                W[4 * axes, 4 * axes] += along * e[vector, k]
                for a in range(FIRST_BLOCK[vector], LAST_BLOCK[vector] + 1):
                    W[4 * axes, a * axes + k] += alpha[vector, a] * along
                    for b in range(FIRST_BLOCK[vector], a + 1):
                        W[a * axes + k, b * axes + k] += alpha[vector, a] * alpha[vector, b] * flat
    per = group.feed_node[i]
    of = more + FEED_NODE
    _put_ball(axes, G, y, V, z[of] * per_s[of] * per * per, z[of] * per)
    for k in range(axes):
        up, down, by = 6 * axes + k, 7 * axes + k, group.per_box[3, k]
        G[k, k] += (z[up] * per_s[up] + z[down] * per_s[down]) * by * by
    _add_vector(sizes, W, alpha, e, V, G)
    for m in range(3):
        of, per = more + FEED_ROWS + m, rows.per_radius[i, m]
        _put_ball(axes, G, y, FEED_1 + m, z[of] * per_s[of] * per * per, z[of] * per)
        _add_vector(sizes, W, alpha, e, FEED_1 + m, G)
    if sizes.any_normal:
        of, per = more + NORMAL_NODE, group.normal_node[i]
        _put_ball(axes, G, y, ACROSS, z[of] * per_s[of] * per * per, z[of] * per)
        _add_vector(sizes, W, alpha, e, ACROSS, G)
    for c in range(3):
        of = more + TUBE_NODE + c
        price = z[of] + group.centre[i] if c == 0 else z[of]
        flat = price * (group.room_node[i] if c == 0 else group.room[i])
        square, moving = z[of] * per_s[of], 0.0 * flat
        for k in range(axes):
            tangent = tangent_of(sizes, group, rows, i, c, k)
            moving += tangent * tangent
        slides = flat * rows.moves[i, c] / where(moving > 0.0, moving, 1.0)
        one_vector = square
        if bent and c > 0:
            one_vector = where(group.bent[i] > 0.0, 0.0, square)
            put_second_row(sizes, group, rows, i, c, y, alpha, e, row)
            _add_square(sizes, W, row, square - one_vector)
        for k in range(axes):
            along = one_vector * rows.n[i, c, k]
            slide = slides * tangent_of(sizes, group, rows, i, c, k)
            for t in range(axes):
                G[k, t] = along * rows.n[i, c, t] - slide * tangent_of(sizes, group, rows, i, c, t)
            G[k, k] += flat
        _add_vector(sizes, W, alpha, e, TUBE_VECTOR[c], G)
    for r in (more + H_MAX, more + H_MIN):
        W[4 * axes, 4 * axes] += z[r] * per_s[r] * group.per_h[i] * group.per_h[i]
    if bent:
        for m in range(3):
            vector, c, of = (
                (V, 0, more + ORDER_NODE),
                (MID, 1, more + ORDER_MID),
                (LONG, 1, more + ARC),
            )[m]
            per = group.per_step[i] if m == 2 else 1.0 / group.pace[i]
            clear(row)
            for k in range(axes):
                _add_to_row(sizes, row, alpha, e, vector, k, per * tangent_of(sizes, group, rows, i, c, k))
            _add_square(sizes, W, row, z[of] * per_s[of])
    if sizes.any_switch:
        put_second_row(sizes, group, rows, i, 0, y, alpha, e, row)
        _add_square(sizes, W, row, z[more + SWITCH] * per_s[more + SWITCH])
    if sizes.any_own:
        for r in range(sizes.rows - 8 * len(sizes.axes) - NORMAL_ROWS):
            of = more + NORMAL_ROWS + r
            _add_square(sizes, W, rows.own[i, r], z[of] * per_s[of])


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


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def push_of(group, rows, i, r, aim, second):
    """What a row's gradient counts with in the step towards s z = aim, less the product of the steps before as far as
    `second` is 1."""
    left = aim - second * rows.ds[i, r] * rows.dz[i, r]
    return group.on[i, r] * (left + rows.z[i, r] * (rows.g[i, r] + rows.s[i, r])) * rows.per_s[i, r]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_force(sizes, group, rows, i, motion, aim, second, F, w):
    """w (4 A + 1,) = the sum of q grad g of step i; motion: y, alpha and e of it, F (13, A) is overwritten."""
    y, alpha, e = motion
    axes = len(sizes.axes)
    more = 8 * axes
    bent = bent_at(sizes, group, i)
    clear(w)
    clear(F)
    for m in range(4):
        for k in range(axes):
            up = push_of(group, rows, i, 2 * m * axes + k, aim, second)
            down = push_of(group, rows, i, (2 * m + 1) * axes + k, aim, second)
            F[VECTOR_OF_BOX[m], k] += (up - down) * group.per_box[m, k]
    q = push_of(group, rows, i, more + FEED_NODE, aim, second) * group.feed_node[i]
    for k in range(axes):
        F[V, k] += q * y[V, k]
    for m in range(3):
        q = push_of(group, rows, i, more + FEED_ROWS + m, aim, second) * rows.per_radius[i, m]
        for k in range(axes):
            F[FEED_1 + m, k] += q * y[FEED_1 + m, k]
    if sizes.any_normal:
        q = push_of(group, rows, i, more + NORMAL_NODE, aim, second) * group.normal_node[i]
        for k in range(axes):
            F[ACROSS, k] += q * y[ACROSS, k]
    for c in range(3):
        q = push_of(group, rows, i, more + TUBE_NODE + c, aim, second)
        if c == 0:
            q += group.centre[i]
        for k in range(axes):
            F[TUBE_VECTOR[c], k] += q * rows.n[i, c, k]
            if bent and c > 0:
                F[TUBE_SECOND[c], k] += q * rows.node[i, c, k]
    if bent:
        node = push_of(group, rows, i, more + ORDER_NODE, aim, second) / group.pace[i]
        mid = push_of(group, rows, i, more + ORDER_MID, aim, second) / group.pace[i]
        arc = push_of(group, rows, i, more + ARC, aim, second) * group.per_step[i]
        for k in range(axes):
            F[V, k] -= node * tangent_of(sizes, group, rows, i, 0, k)
            F[MID, k] -= mid * tangent_of(sizes, group, rows, i, 1, k)
            F[LONG, k] += arc * tangent_of(sizes, group, rows, i, 1, k)
    if sizes.any_switch:
        q = push_of(group, rows, i, more + SWITCH, aim, second) * group.switch[i]
        for k in range(axes):
            F[P, k] += q * y[V, k]
            F[V, k] += q * (y[P, k] - group.switch_at[i, k])
    for m in range(VECTORS):
        for k in range(axes):
            _add_to_row(sizes, w, alpha, e, m, k, F[m, k])
    longer = push_of(group, rows, i, more + H_MAX, aim, second)
    shorter = push_of(group, rows, i, more + H_MIN, aim, second)
    w[4 * axes] += (longer - shorter) * group.per_h[i]
    if sizes.any_own:
        for r in range(sizes.rows - 8 * len(sizes.axes) - NORMAL_ROWS):
            q = push_of(group, rows, i, more + NORMAL_ROWS + r, aim, second)
            for k in range(len(sizes.step)):
                w[k] += q * rows.own[i, r, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def put_slopes(sizes, group, rows, i, motion, d, dy, out):
    """out (R,) = the change of every row of step i in a step d (4 A + 1,) of p, v, a, j and h; motion: y, alpha and e of
    it, dy (13, A) is overwritten."""
    y, alpha, e = motion
    axes = len(sizes.axes)
    more, dh = 8 * axes, d[4 * axes]
    bent = bent_at(sizes, group, i)
    for m in range(VECTORS):
        for k in range(axes):
            total = e[m, k] * dh
            for a in range(FIRST_BLOCK[m], LAST_BLOCK[m] + 1):
                total += alpha[m, a] * d[a * axes + k]
            dy[m, k] = total
    for m in range(4):
        for k in range(axes):
            share = dy[VECTOR_OF_BOX[m], k] * group.per_box[m, k]
            out[2 * m * axes + k], out[(2 * m + 1) * axes + k] = share, -share
    out[more + H_MAX], out[more + H_MIN] = dh * group.per_h[i], -dh * group.per_h[i]
    total = 0.0 * dh
    for k in range(axes):
        total += y[V, k] * dy[V, k]
    out[more + FEED_NODE] = total * group.feed_node[i]
    for m in range(3):
        total = 0.0 * dh
        for k in range(axes):
            total += y[FEED_1 + m, k] * dy[FEED_1 + m, k]
        out[more + FEED_ROWS + m] = total * rows.per_radius[i, m]
    for c in range(3):
        total = 0.0 * dh
        for k in range(axes):
            total += rows.n[i, c, k] * dy[TUBE_VECTOR[c], k]
            if bent and c > 0:
                total += rows.node[i, c, k] * dy[TUBE_SECOND[c], k]
        out[more + TUBE_NODE + c] = total
    for r in range(more + ORDER_NODE, sizes.rows):
        out[r] = 0.0
    if bent:
        node, mid, arc = 0.0 * dh, 0.0 * dh, 0.0 * dh
        for k in range(axes):
            at_mid = tangent_of(sizes, group, rows, i, 1, k)
            node += tangent_of(sizes, group, rows, i, 0, k) * dy[V, k]
            mid, arc = mid + at_mid * dy[MID, k], arc + at_mid * dy[LONG, k]
        out[more + ORDER_NODE], out[more + ORDER_MID] = -node / group.pace[i], -mid / group.pace[i]
        out[more + ARC] = arc * group.per_step[i]
    if sizes.any_normal:
        total = 0.0 * dh
        for k in range(axes):
            total += y[ACROSS, k] * dy[ACROSS, k]
        out[more + NORMAL_NODE] = total * group.normal_node[i]
    if sizes.any_switch:
        total = 0.0 * dh
        for k in range(axes):
            total += y[V, k] * dy[P, k] + (y[P, k] - group.switch_at[i, k]) * dy[V, k]
        out[more + SWITCH] = total * group.switch[i]
    if sizes.any_own:
        for r in range(sizes.rows - 8 * len(sizes.axes) - NORMAL_ROWS):
            total = 0.0 * dh
            for k in range(len(sizes.step)):
                total += rows.own[i, r, k] * d[k]
            out[more + NORMAL_ROWS + r] = total
