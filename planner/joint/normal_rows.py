"""The rows of the normal acceleration of a step between its nodes: |a x v| <= X |v| at every time.

On a step a is linear and v a parabola, with the Bezier ordinates b0, b1 and w0, w1, w2, so that c = a x v (of
more than three axes the matrix a v' - v a') is a cubic with the ordinates

    b0 x w0,   (b1 x w0 + 2 b0 x w1)/3,   (2 b1 x w1 + b0 x w2)/3,   b1 x w2.

With the directions e0, e1 of the velocity at the ends e(q) = (1-q) e0 + q e1 is no longer than 1, so that
d = v.e <= |v| is a cubic too (laws.py), and |c_i| <= X d_i of all ordinates is enough: exact at the nodes,
where the row is a ball (rows.py), and less by the cosine of half the turn between them. (Rows at places
instead are made use of between them, by a motion that weaves inside the tolerance or nearly turns back.) A row
of one of the two ordinates between is

    (|c|^2 - X^2 d |d|)/(2 s^2)        with s = X d kept.

From rest and to rest they are 0 for every motion, and are no rows. On a step that turns far, as where a
motion nearly turns back, d is no bound to go by: there |a| <= X at both nodes is enough, the rows
(|a|^2/X^2 - 1)/2, and the row of the nodes is none.

Directions change by as much as they are where a velocity does: a change of v costs `STAY` (dv/v)^2 in every
iteration, so that steps stay where the linear model holds.
"""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, root, where
from planner.base.views import matrix, size
from planner.joint.laws import REST

BETWEEN = 2  # ordinates between the nodes
_TWO, _THREE, _FOUR = size(2), size(3), size(4)
THIRD = 1.0 / 3.0
# What a change of the velocity by itself costs in one iteration: this, and so many times the multipliers of the
# rows that it is in [-]. Without it windows go on to the last iteration at corners that are passed slowly.
STAY, STAY_PRICED = 0.1, 0.3
SLOW = 0.1  # of what a step changes the velocity by: no speed counts as less there [-]
TURNED = 1.0  # turn from which on a step turns far [rad]
COS_TURNED = float(np.cos(TURNED))
LEAST = (
    0.1  # of the speeds at the ends: less is not kept of d, which falls below 0 where a step turns back [-]
)


@njit(cache=True, error_model="numpy")
def turns_far(velocity):
    """(N,) whether steps turn far, by the `velocity` (N+1, A) at the nodes; at rest the direction is the last one
    before."""
    far, last = np.zeros(len(velocity) - 1, np.bool_), 0
    for i in range(1, len(velocity)):
        before, last = last, i if (velocity[i] != 0.0).any() else last
        along, square, next_square = 0.0, 0.0, 0.0
        for k in range(velocity.shape[1]):
            v, w = velocity[before, k], velocity[last, k]
            along, square, next_square = along + v * w, square + v * v, next_square + w * w
        far[i - 1] = square > 0.0 and along < COS_TURNED * np.sqrt(square) * np.sqrt(next_square)
    return far


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_factors(axes, x, u, w, by_b, by_w):
    """Of a step with the node x (3 A,) and the controls u (A+1,) the ordinates w (3, A), and what c of both rows is: the sum
    of b_m x by_b[2 r + m] and of by_w[2 r + n] x w_(r + n), by_b and by_w (4, A)."""
    h = u[axes]
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        end = a + h * j
        w[0, k], w[1, k], w[2, k] = v, v + 0.5 * h * a, v + 0.5 * h * (a + end)
        by_b[0, k], by_b[1, k] = 2.0 * THIRD * w[1, k], THIRD * w[0, k]
        by_b[2, k], by_b[3, k] = THIRD * w[2, k], 2.0 * THIRD * w[1, k]
        by_w[0, k], by_w[1, k] = THIRD * end, 2.0 * THIRD * a
        by_w[2, k], by_w[3, k] = 2.0 * THIRD * end, THIRD * a


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _along(axes, w, rest):
    """Ordinates of v.e between the nodes, with the directions e of w0 and w2; the speeds there, and the products
    w_m.e that they are made of."""
    first, last = rest * rest, rest * rest
    for k in range(axes):
        first, last = first + w[0, k] * w[0, k], last + w[2, k] * w[2, k]
    first, last = root(first), root(last)
    per, per_last, zero = 1.0 / first, 1.0 / last, 0.0 * first
    w1_e0, w2_e0, w0_e1, w1_e1 = zero, zero, zero, zero
    for k in range(axes):
        e0, e1 = w[0, k] * per, w[2, k] * per_last
        w1_e0, w2_e0 = w1_e0 + w[1, k] * e0, w2_e0 + w[2, k] * e0
        w0_e1, w1_e1 = w0_e1 + w[0, k] * e1, w1_e1 + w[1, k] * e1
    d = THIRD * (w0_e1 + 2.0 * w1_e0), THIRD * (2.0 * w1_e1 + w2_e0)
    return d, (first, last), (w1_e0, w2_e0, w0_e1, w1_e1)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_normal_rows(sizes, bound, pace, turns, x, u, g, out):
    """The rows of a step with the node x (3 A,) and the controls u (A+1,), whose normal acceleration is at most
    `bound`, into g (2,), and their derivatives by p, v, a, j and h into out (2, 4 A + 1); `turns`: 1 where it turns far."""
    axes = len(sizes.axes)
    h = u[axes]
    w, by_b, by_w = matrix(x, _THREE, sizes.axes), matrix(x, _FOUR, sizes.axes), matrix(x, _FOUR, sizes.axes)
    _put_factors(axes, x, u, w, by_b, by_w)
    d, (first, last), (w1_e0, w2_e0, w0_e1, w1_e1) = _along(axes, w, REST * pace)
    least, far = LEAST * (first + last), turns > 0.0
    at_node = 1.0 / (bound * bound)
    for r in range(BETWEEN):
        of_d = d[r]
        kept = bound * larger(of_d, least)
        per, square, by_h = 1.0 / (kept * kept), 0.0 * h, 0.0 * h
        push = per * bound * bound * magnitude(of_d)
        turned = -0.5 + 0.0 * h
        for k in range(axes):
            a, j, e0, e1 = x[2 * axes + k], u[k], w[0, k] / first, w[2, k] / last
            b = a, a + h * j
            if r == 0:
                of_w0, of_w1 = (
                    THIRD * (e1 + 2.0 * (w[1, k] - w1_e0 * e0) / first),
                    2.0 * THIRD * e0,
                )
                of_w2 = THIRD * (w[0, k] - w0_e1 * e1) / last
            else:
                of_w0, of_w1 = THIRD * (w[2, k] - w2_e0 * e0) / first, 2.0 * THIRD * e1
                of_w2 = THIRD * (e0 + 2.0 * (w[1, k] - w1_e1 * e1) / last)
            of_w0, of_w1, of_w2 = -push * of_w0, -push * of_w1, -push * of_w2
            of_b0, of_b1 = 0.0 * h, 0.0 * h
            for n in range(axes):
                b_n = x[2 * axes + n], x[2 * axes + n] + h * u[n]
                c = b[0] * by_b[2 * r, n] - by_b[2 * r, k] * b_n[0]
                c += b[1] * by_b[2 * r + 1, n] - by_b[2 * r + 1, k] * b_n[1]
                square += 0.5 * c * c
                c = per * c
                of_b0, of_b1 = of_b0 + c * by_b[2 * r, n], of_b1 + c * by_b[2 * r + 1, n]
                if r == 0:
                    of_w0, of_w1 = of_w0 - c * by_w[0, n], of_w1 - c * by_w[1, n]
                else:
                    of_w1, of_w2 = of_w1 - c * by_w[2, n], of_w2 - c * by_w[3, n]
            out[r, k] = 0.0
            out[r, axes + k] = where(far, 0.0, of_w0 + of_w1 + of_w2)
            # where the step turns far: |a| <= bound at its node, at its end
            of_a = at_node * b[r]
            turned += 0.5 * of_a * b[r]
            out[r, 2 * axes + k] = where(far, of_a, h * (0.5 * of_w1 + of_w2) + of_b0 + of_b1)
            out[r, 3 * axes + k] = where(far, r * h * of_a, h * (0.5 * h * of_w2 + of_b1))
            by_h += where(far, r * j * of_a, 0.5 * of_w1 * a + of_w2 * b[1] + of_b1 * j)
        out[r, 4 * axes] = by_h
        g[r] = where(far, turned, 0.5 * (per * square - push * of_d))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_normal_curvature(sizes, W, bound, pace, turns, x, u, z0, z1):
    """W (4 A + 1, 4 A + 1), lower triangle, += what is surely positive of the curvature of the rows: that of
    |c|^2 as if c were linear. z0 and z1: multipliers."""
    axes = len(sizes.axes)
    h, at = u[axes], 4 * axes
    w, by_b, by_w = matrix(x, _THREE, sizes.axes), matrix(x, _FOUR, sizes.axes), matrix(x, _FOUR, sizes.axes)
    _put_factors(axes, x, u, w, by_b, by_w)
    d, (first, last), _ = _along(axes, w, REST * pace)
    least, far = LEAST * (first + last), turns > 0.0
    slope = matrix(x, _TWO, _THREE)  # the derivatives of c[k, m] by v, a and j of both axes
    for r in range(BETWEEN):
        price = z1 if r else z0
        kept = bound * larger(d[r], least)
        by = where(far, 0.0, price / (kept * kept))
        for k in range(axes):
            for m in range(k):  # c[k, m]
                of_h = 0.0 * h
                for s in range(2):
                    own, other, sign = (k, m, -1.0) if s else (m, k, 1.0)
                    a, j = x[2 * axes + own], u[own]
                    w0, w1, w2 = 0.0 * h, by_w[1 + r, other], 0.0 * h
                    if r == 0:
                        w0 = by_w[0, other]
                    else:
                        w2 = by_w[3, other]
                    b0, b1 = -by_b[2 * r, other], -by_b[2 * r + 1, other]
                    slope[s, 0] = sign * (w0 + w1 + w2)
                    slope[s, 1] = sign * (h * (0.5 * w1 + w2) + b0 + b1)
                    slope[s, 2] = sign * h * (0.5 * h * w2 + b1)
                    of_h += sign * (0.5 * w1 * a + w2 * (a + h * j) + b1 * j)
                W[at, at] += by * of_h * of_h
                for s in range(2):
                    column = m if s == 0 else k
                    for n in range(3):
                        one = by * slope[s, n]
                        W[at, (1 + n) * axes + column] += one * of_h
                        for t in range(2):
                            other = m if t == 0 else k
                            for q in range(n + 1):
                                if q < n or other <= column:
                                    W[(1 + n) * axes + column, (1 + q) * axes + other] += one * slope[t, q]
    if anywhere(far):
        for r in range(BETWEEN):
            by = where(far, (z1 if r else z0) / (bound * bound), 0.0)
            for k in range(axes):
                a, j = 2 * axes + k, 3 * axes + k
                W[a, a] += by
                W[j, a] += by * (r * h)
                W[j, j] += by * (r * h * h)
                W[at, a] += by * (r * u[k])
                W[at, j] += by * (r * h * u[k])
                W[at, at] += by * (r * u[k] * u[k])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def stay_of(sizes, bound, x, u, priced):
    """What (dv)^2 of the node x (3 A,) costs in one iteration, half of it; `priced`: the sum of the multipliers of the
    rows that its velocity is in."""
    axes = len(sizes.axes)
    slow = SLOW * bound * u[axes]
    square = slow * slow
    for k in range(axes):
        square += x[axes + k] * x[axes + k]
    return (STAY + STAY_PRICED * priced) / square
