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

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint.laws import REST

BETWEEN = 2  # ordinates between the nodes
# What a change of the velocity by itself costs in one iteration: this, and so many times the multipliers of the
# rows that it is in [-]. Without it windows go on to the last iteration at corners that are passed slowly.
STAY, STAY_PRICED = 0.1, 0.3
SLOW = 0.1  # of what a step changes the velocity by: no speed counts as less there [-]
TURNED = 1.0  # turn from which on a step turns far [rad]
LEAST = (
    0.1  # of the speeds at the ends: less is not kept of d, which falls below 0 where a step turns back [-]
)


def turns_far(velocity: FloatArray) -> Array:
    """(N,) whether steps turn far, by the `velocity` (N+1, A) at the nodes; at rest the direction is the last one
    before."""
    moving = velocity.any(axis=1)
    last = np.maximum.accumulate(np.where(moving, np.arange(len(velocity)), 0))
    way = velocity[last]
    speed = np.linalg.norm(way, axis=1)
    along = (way[:-1] * way[1:]).sum(axis=1)
    far: Array = (speed[:-1] > 0.0) & (along < np.cos(TURNED) * speed[:-1] * speed[1:])
    return far


@njit(cache=True, error_model="numpy")
def _ordinates_of_step(x, u, b, w):
    """b (2, A) and w (3, A) of a step with the node x (3 A,) and the controls u (A+1,)."""
    axes = len(u) - 1
    h = u[axes]
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        b[0, k], b[1, k] = a, a + h * j
        w[0, k], w[1, k], w[2, k] = v, v + 0.5 * h * a, v + h * (a + 0.5 * h * j)


@njit(cache=True, error_model="numpy")
def _weighted(r, b, w, of_b, of_w):
    """What c_r is multiplied by: c = sum of b_m x of_w_m = sum of of_b_n x w_n, of_w (2, A), of_b (3, A)."""
    third, two = 1.0 / 3.0, 2.0 / 3.0
    for k in range(b.shape[1]):
        if r == 0:
            of_w[0, k], of_w[1, k] = two * w[1, k], third * w[0, k]
            of_b[0, k], of_b[1, k], of_b[2, k] = third * b[1, k], two * b[0, k], 0.0
        else:
            of_w[0, k], of_w[1, k] = third * w[2, k], two * w[1, k]
            of_b[0, k], of_b[1, k], of_b[2, k] = 0.0, two * b[1, k], third * b[0, k]


@njit(cache=True, error_model="numpy")
def _along(w, rest, e, size):
    """d (2,) of a step; e (2, A) and size (2,) become the directions and the speeds at its ends."""
    axes = w.shape[1]
    for end in range(2):
        size[end] = rest * rest
        for k in range(axes):
            size[end] += w[2 * end, k] ** 2
        size[end] = np.sqrt(size[end])
        for k in range(axes):
            e[end, k] = w[2 * end, k] / size[end]
    d0, d1 = 0.0, 0.0
    for k in range(axes):
        d0 += (w[0, k] * e[1, k] + 2.0 * w[1, k] * e[0, k]) / 3.0
        d1 += (2.0 * w[1, k] * e[1, k] + w[2, k] * e[0, k]) / 3.0
    return d0, d1


@njit(cache=True, error_model="numpy")
def _put_turning_rows(bound, x, u, g, out):
    """`put_normal_rows` of a step that turns far."""
    axes, per = len(u) - 1, 1.0 / (bound * bound)
    h = u[axes]
    out[:] = 0.0
    g[0], g[1] = -0.5, -0.5
    for k in range(axes):
        a, j = x[2 * axes + k], u[k]
        end = a + h * j
        g[0], g[1] = g[0] + 0.5 * per * a * a, g[1] + 0.5 * per * end * end
        out[0, 2 * axes + k] = per * a
        out[1, 2 * axes + k], out[1, 3 * axes + k] = per * end, per * end * h
        out[1, 4 * axes] += per * end * j


@njit(cache=True, error_model="numpy")
def put_normal_rows(bound, pace, turns, x, u, g, out):
    """The rows of a step with the node x (3 A,) and the controls u (A+1,), whose normal acceleration is at most
    `bound`, into g (2,), and their derivatives by p, v, a, j and h into out (2, 4 A + 1)."""
    if turns:
        _put_turning_rows(bound, x, u, g, out)
        return
    axes, rest = len(u) - 1, REST * pace
    b, w, c = np.empty((2, axes)), np.empty((3, axes)), np.empty((axes, axes))
    of_b, of_w, e, size = np.empty((3, axes)), np.empty((2, axes)), np.empty((2, axes)), np.empty(2)
    by_b, by_w = np.empty((2, axes)), np.empty((3, axes))
    _ordinates_of_step(x, u, b, w)
    ds = _along(w, rest, e, size)
    for r in range(BETWEEN):
        d, square = ds[r], 0.0
        _weighted(r, b, w, of_b, of_w)
        for k in range(axes):
            for m in range(axes):
                c[k, m] = b[0, k] * of_w[0, m] - of_w[0, k] * b[0, m]
                c[k, m] += b[1, k] * of_w[1, m] - of_w[1, k] * b[1, m]
                square += 0.5 * c[k, m] ** 2
        per = 1.0 / (bound * max(d, LEAST * (size[0] + size[1]))) ** 2
        g[r] = 0.5 * per * (square - bound * bound * d * abs(d))
        turned = (0.0, 0.0)  # w_1 and the far end along the direction of each end
        for k in range(axes):
            far = w[2, k] * e[0, k] if r else w[0, k] * e[1, k]
            near = w[1, k] * (e[1, k] if r else e[0, k])
            turned = (turned[0] + near, turned[1] + far)
        # w_1 counts along the direction at one end, that of it along the other
        at, other = (1, 0) if r else (0, 1)
        push = per * bound * bound * abs(d) / 3.0
        for k in range(axes):
            for m in range(2):
                by_b[m, k] = 0.0
                for n in range(axes):
                    by_b[m, k] += per * c[k, n] * of_w[m, n]
            for m in range(3):
                by_w[m, k] = 0.0
                for n in range(axes):
                    by_w[m, k] -= per * c[k, n] * of_b[m, n]
            by_w[1, k] -= push * 2.0 * e[at, k]
            by_w[2 * at, k] -= push * (e[other, k] + 2.0 * (w[1, k] - turned[0] * e[at, k]) / size[at])
            by_w[2 * other, k] -= push * (w[2 * at, k] - turned[1] * e[other, k]) / size[other]
        out[r] = 0.0
        for k in range(axes):
            _chain(out[r], axes, k, by_b, by_w, x, u)


@njit(cache=True, error_model="numpy")
def _chain(out, axes, k, by_b, by_w, x, u):
    """out (4 A + 1,) += what comes of the derivatives by_b (2, A) and by_w (3, A) by the ordinates of an axis."""
    h, a, j = u[axes], x[2 * axes + k], u[k]
    out[axes + k] = by_w[0, k] + by_w[1, k] + by_w[2, k]
    out[2 * axes + k] = by_b[0, k] + by_b[1, k] + h * (0.5 * by_w[1, k] + by_w[2, k])
    out[3 * axes + k] = h * (by_b[1, k] + 0.5 * h * by_w[2, k])
    out[4 * axes] += by_b[1, k] * j + 0.5 * by_w[1, k] * a + by_w[2, k] * (a + h * j)


@njit(cache=True, error_model="numpy")
def add_normal_curvature(W, bound, pace, turns, x, u, z):
    """W (4 A + 1, 4 A + 1), lower triangle, += what is surely positive of the curvature of the rows: that of
    |c|^2 as if c were linear. z (2,): multipliers."""
    if z[0] == 0.0 and z[1] == 0.0:
        return
    if turns:
        axes, per = len(u) - 1, 1.0 / (bound * bound)
        for k in range(axes):
            at = 2 * axes + k, 3 * axes + k, 4 * axes
            for r in range(2):
                by = 1.0, r * u[axes], r * u[k]
                for n in range(3):
                    for m in range(n + 1):
                        W[at[n], at[m]] += z[r] * per * by[n] * by[m]
        return
    axes, rest = len(u) - 1, REST * pace
    b, w, slope = np.empty((2, axes)), np.empty((3, axes)), np.empty(4 * axes + 1)
    of_b, of_w, e, size = np.empty((3, axes)), np.empty((2, axes)), np.empty((2, axes)), np.empty(2)
    by_b, by_w, index = np.empty((2, axes)), np.empty((3, axes)), np.empty(7, np.int64)
    _ordinates_of_step(x, u, b, w)
    ds = _along(w, rest, e, size)
    for r in range(BETWEEN):
        by = z[r] / (bound * max(ds[r], LEAST * (size[0] + size[1]))) ** 2
        _weighted(r, b, w, of_b, of_w)
        for k in range(axes):
            for m in range(k):  # c[k, m]
                slope[4 * axes] = 0.0
                for n in range(2):
                    by_b[n, k], by_b[n, m] = of_w[n, m], -of_w[n, k]
                for n in range(3):
                    by_w[n, k], by_w[n, m] = -of_b[n, m], of_b[n, k]
                _chain(slope, axes, k, by_b, by_w, x, u)
                _chain(slope, axes, m, by_b, by_w, x, u)
                for s in range(3):
                    index[2 * s], index[2 * s + 1] = (s + 1) * axes + m, (s + 1) * axes + k
                index[6] = 4 * axes
                for s in range(7):
                    for t in range(s + 1):
                        W[index[s], index[t]] += by * slope[index[s]] * slope[index[t]]


@njit(cache=True, error_model="numpy")
def stay_of(bound, x, u, priced):
    """What (dv)^2 of the node x (3 A,) costs in one iteration, half of it; `priced`: the sum of the multipliers of the
    rows that its velocity is in."""
    axes = len(u) - 1
    square = (SLOW * bound * u[axes]) ** 2
    for k in range(axes):
        square += x[axes + k] ** 2
    return (STAY + STAY_PRICED * priced) / square
