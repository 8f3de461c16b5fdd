"""What the rows of a set of the tolerance (rows.py) add to the model of a Newton step (curvature.py).

They are of the state q = p + k a, w = v + k j, a, with the sag k of the set: what is f by its node and its inner control
points is, by p, v, a, j and h, for every axis (`of_state`)

    p   f_q                        f_q = f_P + f_C1 + f_C2
    v   f_w                        f_w = h f_C1/3 + 2 h f_C2/3
    a   h2 f_C2/6 + k f_q
    j   k f_w
    h   (w f_C1 + (2 w + h a) f_C2)/3
"""

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import where
from planner.joint.row_kinds import SIXTH, THIRD, TUBE_NODE
from planner.joint.rows import tangent_of


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def of_state(sag, by_q, by_w, by_a, by_j):
    """By p, v, a and j what is that by the state of a set (module text)."""
    return by_q, by_w, by_a + sag * by_q, by_j + sag * by_w


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tube_weights(sizes, group, rows, i, m, x, u, bent):
    """Of the three rows of a set, the node, and the inner control points: the weights of n n', of the identity and, taken
    off, of tt' with the leg's tangent t, as the nearest place moves along that; n.e and t.e of the inner ones."""
    axes, z, per_s = len(sizes.axes), rows.z[i], rows.per_s[i]
    h, row, sag = u[axes], 8 * axes + TUBE_NODE + 3 * m, group.sag[m]
    pull = group.centre[i] if m == 0 else 0.0 * h
    flat_0, flat_1, flat_2 = (
        (z[row] + pull) * group.room_node[i],
        z[row + 1] * group.room[i],
        z[row + 2] * group.room[i],
    )
    s_0, s_1, s_2 = z[row] * per_s[row], z[row + 1] * per_s[row + 1], z[row + 2] * per_s[row + 2]
    if bent:  # rows of two vectors are added by themselves
        alone = where(group.bent[i] > 0.0, 0.0, 1.0 + 0.0 * h)
        s_1, s_2 = s_1 * alone, s_2 * alone
    long_0, long_1, long_2 = 0.0 * h, 0.0 * h, 0.0 * h  # |t|^2
    n_1, n_2, t_1, t_2 = 0.0 * h, 0.0 * h, 0.0 * h, 0.0 * h
    for k in range(axes):
        at_0, at_1 = (
            tangent_of(sizes, rows, i, 3 * m, k),
            tangent_of(sizes, rows, i, 3 * m + 1, k),
        )
        at_2 = tangent_of(sizes, rows, i, 3 * m + 2, k)
        long_0, long_1, long_2 = long_0 + at_0 * at_0, long_1 + at_1 * at_1, long_2 + at_2 * at_2
        w = x[axes + k] + sag * u[k]
        e_1, e_2 = THIRD * w, THIRD * (2.0 * w + h * x[2 * axes + k])
        n_1, n_2 = n_1 + rows.n[i, 3 * m + 1, k] * e_1, n_2 + rows.n[i, 3 * m + 2, k] * e_2
        t_1, t_2 = t_1 + at_1 * e_1, t_2 + at_2 * e_2
    one = 1.0 + 0.0 * h
    slide_0 = flat_0 * rows.moves[i, 3 * m] / where(long_0 > 0.0, long_0, one)
    slide_1 = flat_1 * rows.moves[i, 3 * m + 1] / where(long_1 > 0.0, long_1, one)
    slide_2 = flat_2 * rows.moves[i, 3 * m + 2] / where(long_2 > 0.0, long_2, one)
    return (s_0, s_1, s_2), (flat_0, flat_1, flat_2), (slide_0, slide_1, slide_2), (n_1, n_2), (t_1, t_2)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tube_block(sizes, group, rows, i, m, weights, h, k, t):
    """The second derivatives of a set's rows by axes k and t of p, v, a and j: pp, vp, ap, jp, vv, av, jv, aa, ja, jj."""
    s, flat, slide, _, _ = weights
    sag, c = group.sag[m], 3 * m
    at_k, at_t = tangent_of(sizes, rows, i, c, k), tangent_of(sizes, rows, i, c, t)
    g_0 = s[0] * rows.n[i, c, k] * rows.n[i, c, t] - slide[0] * at_k * at_t
    at_k, at_t = tangent_of(sizes, rows, i, c + 1, k), tangent_of(sizes, rows, i, c + 1, t)
    g_1 = s[1] * rows.n[i, c + 1, k] * rows.n[i, c + 1, t] - slide[1] * at_k * at_t
    at_k, at_t = tangent_of(sizes, rows, i, c + 2, k), tangent_of(sizes, rows, i, c + 2, t)
    g_2 = s[2] * rows.n[i, c + 2, k] * rows.n[i, c + 2, t] - slide[2] * at_k * at_t
    if t == k:
        g_0, g_1, g_2 = g_0 + flat[0], g_1 + flat[1], g_2 + flat[2]
    third, sixth = THIRD * h, SIXTH * h * h
    qq, wq, aq = g_0 + g_1 + g_2, third * (g_1 + 2.0 * g_2), sixth * g_2
    ww, aw, aa = third * third * (g_1 + 4.0 * g_2), 2.0 * third * sixth * g_2, sixth * sixth * g_2
    av = aw + sag * wq
    return (
        qq,
        wq,
        aq + sag * qq,
        sag * wq,
        ww,
        av,
        sag * ww,
        aa + sag * (2.0 * aq + sag * qq),
        sag * av,
        sag * sag * ww,
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tube_by_h(sizes, group, rows, i, m, weights, x, u, k):
    """The second derivatives of a set's rows by h and axis k of p, v, a and j, and what that adds to the one by h."""
    axes, sag, c = len(sizes.axes), group.sag[m], 3 * m
    _, flat, slide, n_e, t_e = weights
    s = weights[0]
    h, w, none = u[axes], x[axes + k] + sag * u[k], 0.0 * u[axes]
    e_1, e_2 = THIRD * w, THIRD * (2.0 * w + h * x[2 * axes + k])
    f_1 = s[1] * n_e[0] * rows.n[i, c + 1, k] + flat[1] * e_1
    f_1 -= slide[1] * t_e[0] * tangent_of(sizes, rows, i, c + 1, k)
    f_2 = s[2] * n_e[1] * rows.n[i, c + 2, k] + flat[2] * e_2
    f_2 -= slide[2] * t_e[1] * tangent_of(sizes, rows, i, c + 2, k)
    by = of_state(sag, f_1 + f_2, THIRD * h * (f_1 + 2.0 * f_2), SIXTH * h * h * f_2, none)
    return by, e_1 * f_1 + e_2 * f_2
