"""Limits of the search that are functions of a motion's velocity v and acceleration a.

The tangential acceleration: |a.t| <= A_t with t = v/|v|, of x, y and z alone. On a step a is linear and v a
parabola, with the Bezier ordinates b0, b1 and w0, w1, w2. With the directions e0, e1 of the velocity at its
ends e(q) = (1-q) e0 + q e1 is no longer than 1, so that a.v <= A_t v.e(q) is enough for the whole step. Both
sides are cubics with the ordinates

    a.v     b0.w0,   (b1.w0 + 2 b0.w1)/3,   (2 b1.w1 + b0.w2)/3,   b1.w2
    v.e     w0.e0,   (w0.e1 + 2 w1.e0)/3,   (2 w1.e1 + w2.e0)/3,   w2.e1

and a row of each, for both signs, holds it: exact at the nodes, and less by the cosine of half the turn
between them. (Rows at places instead are made use of between them, by a motion that weaves inside the
tolerance.) The last ordinate is the first one of the next step. From rest and to rest the others are 0 for
every motion, and are no rows.

A row is (a.v - A_t v.e)/(A_t d), with v.e kept in d: the share of the limit, less 1. Of its curvature the
model has what is positive of that of the products b.w: without it windows take many more iterations, or do
not converge.

The feed in the axes that F goes by, where others move with them: |v| <= F in x, y and z (or u, v and w, or
the rotary axes alone), beside that in all axes of the rows of the feed (rows.py). It has the ordinates of
|v|^2 as rows,

    w0.w0 where a leg begins,   w0.w1,   (2 w1.w1 + w0.w2)/3,   w1.w2,   w2.w2,        over F^2, half of it, less 1/2.

Another limit of the first kind is one of `STATE_LIMITS`, a bound in `bounds_of` and a branch of `_ordinates`,
`used` and `formula`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.limit import Limit
from planner.feedrate.constraints.limits import TANGENTIAL, Limits
from planner.machine import LINEAR_AXES

STATE_LIMITS: tuple[Limit, ...] = (TANGENTIAL,)
ROWS = 6  # of a limit: three ordinates, upper before lower
WORD_ROWS = 5  # of the feed in the axes that F goes by
# Of the curvature of those: weight, and the shares of w0, w1 and w2 in the vector that it is of.
_CURVED = np.array(
    [
        (0, 1.0, 1.0, 0.0, 0.0),
        (1, 1.0, 0.5, 0.5, 0.0),
        (2, 2.0 / 3.0, 0.0, 1.0, 0.0),
        (2, 1.0 / 3.0, 0.5, 0.0, 0.5),
        (3, 1.0, 0.0, 0.5, 0.5),
        (4, 1.0, 0.0, 0.0, 1.0),
    ]
)
REST = 1e-3  # of a step's pace: below that the direction of a velocity counts less and less [-]


def bounds_of(limits: Limits, moves: Array) -> FloatArray:
    """(K,) bounds of `STATE_LIMITS` on a run on which some of the axes move, `moves` (A,), inf for one that
    nothing can reach; (0,) where that is so for all of them."""
    reached = np.linalg.norm(limits.acceleration[moves & np.isin(limits.axes, LINEAR_AXES)])
    bounds = np.array([limits.tangential if limits.tangential < reached else np.inf])
    return bounds if np.isfinite(bounds).any() else bounds[:0]


def formula(ca: Any, kind: int, w: Any, b: Any, linear: FloatArray, rest: Any) -> list[tuple[Any, Any]]:
    """Pairs (a.v, v.e) of all four ordinates of a limit of `STATE_LIMITS` in symbols of casadi, given as
    `ca`.

    w, b   : ordinates of the velocity (3) and of the acceleration (2) of a step
    linear : (A,) 1 for x, y and z, else 0
    rest   : speed to which directions are smoothed
    """
    w, b = [linear * one for one in w], [linear * one for one in b]
    e0, e1 = (one / ca.sqrt(ca.sumsqr(one) + rest**2) for one in (w[0], w[2]))
    return [
        (ca.dot(b[0], w[0]), ca.dot(w[0], e0)),
        ((ca.dot(b[1], w[0]) + 2 * ca.dot(b[0], w[1])) / 3, (ca.dot(w[0], e1) + 2 * ca.dot(w[1], e0)) / 3),
        ((2 * ca.dot(b[1], w[1]) + ca.dot(b[0], w[2])) / 3, (2 * ca.dot(w[1], e1) + ca.dot(w[2], e0)) / 3),
        (ca.dot(b[1], w[2]), ca.dot(w[2], e1)),
    ]


@njit(cache=True, error_model="numpy")
def _ordinates(x, u, linear, rest, work, value, slope):
    """The first three ordinates of a.v and of v.e of a step with the node x (3 A,) and the controls u (A+1,),
    value (2, 3), and their derivatives by p, v, a, j and h, slope (2, 3, 4 A + 1). work (5, A)."""
    axes = len(u) - 1
    h, (e0, e1, w0, w1, w2) = u[axes], work
    square0, square1 = rest * rest, rest * rest
    for k in range(axes):
        v, a, j = linear[k] * x[axes + k], linear[k] * x[2 * axes + k], linear[k] * u[k]
        w0[k], w1[k], w2[k] = v, v + 0.5 * h * a, v + h * (a + 0.5 * h * j)
        square0, square1 = square0 + w0[k] * w0[k], square1 + w2[k] * w2[k]
    size0, size1 = np.sqrt(square0), np.sqrt(square1)
    value[:] = 0.0
    for k in range(axes):
        e0[k], e1[k] = w0[k] / size0, w2[k] / size1
        b0, b1 = linear[k] * x[2 * axes + k], linear[k] * (x[2 * axes + k] + h * u[k])
        value[0, 0] += b0 * w0[k]
        value[0, 1] += (b1 * w0[k] + 2.0 * b0 * w1[k]) / 3.0
        value[0, 2] += (2.0 * b1 * w1[k] + b0 * w2[k]) / 3.0
        value[1, 0] += w0[k] * e0[k]
        value[1, 1] += (w0[k] * e1[k] + 2.0 * w1[k] * e0[k]) / 3.0
        value[1, 2] += (2.0 * w1[k] * e1[k] + w2[k] * e0[k]) / 3.0
    slope[:] = 0.0
    for r in range(3):
        # what turns with e0 and with e1: the ordinates that they are multiplied by
        along0, along1 = 0.0, 0.0
        for k in range(axes):
            by0 = w0[k] if r == 0 else 2.0 / 3.0 * w1[k] if r == 1 else w2[k] / 3.0
            by1 = 0.0 if r == 0 else w0[k] / 3.0 if r == 1 else 2.0 / 3.0 * w1[k]
            along0, along1 = along0 + by0 * e0[k], along1 + by1 * e1[k]
        for k in range(axes):
            a, j = linear[k] * x[2 * axes + k], linear[k] * u[k]
            b0, b1 = a, a + h * j
            by0 = w0[k] if r == 0 else 2.0 / 3.0 * w1[k] if r == 1 else w2[k] / 3.0
            by1 = 0.0 if r == 0 else w0[k] / 3.0 if r == 1 else 2.0 / 3.0 * w1[k]
            for side in range(2):
                n0, n1, n2, m0, m1 = 0.0, 0.0, 0.0, 0.0, 0.0
                if side == 0:
                    if r == 0:
                        n0, m0 = b0, w0[k]
                    elif r == 1:
                        n0, n1, m0, m1 = b1 / 3.0, 2.0 * b0 / 3.0, 2.0 * w1[k] / 3.0, w0[k] / 3.0
                    else:
                        n1, n2, m0, m1 = 2.0 * b1 / 3.0, b0 / 3.0, w2[k] / 3.0, 2.0 * w1[k] / 3.0
                else:
                    n0 = e0[k] if r == 0 else e1[k] / 3.0 if r == 1 else 0.0
                    n1 = 0.0 if r == 0 else 2.0 / 3.0 * (e0[k] if r == 1 else e1[k])
                    n2 = e0[k] / 3.0 if r == 2 else 0.0
                    n0 += (by0 - along0 * e0[k]) / size0
                    n2 += (by1 - along1 * e1[k]) / size1
                row = slope[side, r]
                row[axes + k] = linear[k] * (n0 + n1 + n2)
                row[2 * axes + k] = linear[k] * (h * (0.5 * n1 + n2) + m0 + m1)
                row[3 * axes + k] = linear[k] * h * (0.5 * h * n2 + m1)
                row[4 * axes] += 0.5 * n1 * a + n2 * (a + h * j) + m1 * j


@njit(cache=True, error_model="numpy")
def _put_word_rows(limits, i, x, u, g, out):
    """The rows of the feed in the axes that F goes by of step i, as `put_state_rows`."""
    axes, per = len(u) - 1, 0.5 / limits.word[i, 0] ** 2
    h = u[axes]
    g[:], out[:] = -0.5, 0.0
    for k in range(axes):
        a, j, counts = x[2 * axes + k], u[k], limits.counts[k]
        w0, w1 = x[axes + k], x[axes + k] + 0.5 * h * a
        w2 = w0 + h * (a + 0.5 * h * j)
        for r in range(WORD_ROWS):
            n0 = 2.0 * w0 if r == 0 else w1 if r == 1 else w2 / 3.0 if r == 2 else 0.0
            n1 = w0 if r == 1 else 4.0 / 3.0 * w1 if r == 2 else w2 if r == 3 else 0.0
            n2 = w0 / 3.0 if r == 2 else w1 if r == 3 else 2.0 * w2 if r == 4 else 0.0
            g[r] += 0.5 * per * counts * (n0 * w0 + n1 * w1 + n2 * w2)
            out[r, axes + k] = per * counts * (n0 + n1 + n2)
            out[r, 2 * axes + k] = per * counts * h * (0.5 * n1 + n2)
            out[r, 3 * axes + k] = per * counts * 0.5 * h * h * n2
            out[r, 4 * axes] += per * counts * (0.5 * n1 * a + n2 * (a + h * j))


@njit(cache=True, error_model="numpy")
def put_state_rows(limits, i, x, u, g, out):
    """The rows of step i with the node x (3 A,) and the controls u (A+1,) into g (6 K + 5 W,), and their
    derivatives by p, v, a, j and h into out (6 K + 5 W, 4 A + 1)."""
    axes = len(u) - 1
    if limits.word.shape[1]:
        first = ROWS * limits.state.shape[1]
        _put_word_rows(limits, i, x, u, g[first:], out[first:])
    work, value, slope = np.empty((5, axes)), np.empty((2, 3)), np.empty((2, 3, 4 * axes + 1))
    for kind in range(limits.state.shape[1]):
        rest = REST * limits.pace[i]
        _ordinates(x, u, limits.linear, rest, work, value, slope)
        for r in range(3):
            bound = limits.state_node[i, kind] if r == 0 else limits.state[i, kind]
            per = 1.0 / (bound * max(value[1, r], rest))
            for side in range(2):
                row, sign = ROWS * kind + 3 * side + r, 1.0 - 2.0 * side
                g[row] = per * (sign * value[0, r] - bound * value[1, r])
                for k in range(4 * axes + 1):
                    out[row, k] = per * (sign * slope[0, r, k] - bound * slope[1, r, k])


@njit(cache=True, error_model="numpy")
def add_state_curvature(W, limits, i, x, u, z):
    """W (4 A + 1, 4 A + 1), lower triangle, += the positive part of the curvature of the rows of step i
    across the motion: of b.w, which is (|b + w/time|^2 - |b - w/time|^2) time/4, the first square. z (6 K,):
    multipliers."""
    axes = len(u) - 1
    h, w, square = u[axes], np.empty((3, axes)), np.zeros(3)
    first = ROWS * limits.state.shape[1]
    for m in range(len(_CURVED) if limits.word.shape[1] else 0):
        row, share, c0, c1, c2 = _CURVED[m]
        by, of_v, of_a, of_j = (
            z[first + int(row)] * share / limits.word[i, 0] ** 2,
            c0 + c1 + c2,
            h * (0.5 * c1 + c2),
            0.5 * h * h * c2,
        )
        for k in range(axes):
            weight, a = by * limits.counts[k], x[2 * axes + k]
            of_h = 0.5 * c1 * a + c2 * (a + h * u[k])
            v, b, j, last = axes + k, 2 * axes + k, 3 * axes + k, 4 * axes
            W[v, v] += weight * of_v * of_v
            W[b, v] += weight * of_a * of_v
            W[b, b] += weight * of_a * of_a
            W[j, v] += weight * of_j * of_v
            W[j, b] += weight * of_j * of_a
            W[j, j] += weight * of_j * of_j
            W[last, v] += weight * of_h * of_v
            W[last, b] += weight * of_h * of_a
            W[last, j] += weight * of_h * of_j
            W[last, last] += weight * of_h * of_h
    alpha, e, across = np.zeros(4), np.empty(axes), np.empty((axes, axes))
    for k in range(axes):
        v, a = limits.linear[k] * x[axes + k], limits.linear[k] * x[2 * axes + k]
        w[0, k], w[1, k], w[2, k] = v, v + 0.5 * h * a, v + h * (a + 0.5 * h * limits.linear[k] * u[k])
        for m in range(3):
            square[m] += w[m, k] ** 2
    for pair in range(5 * limits.state.shape[1]):
        kind, which = pair // 5, pair % 5
        r, m, n = (
            (0, 1, 1, 2, 2)[which],
            (0, 0, 1, 1, 2)[which],
            (0, 1, 0, 1, 0)[which],
        )  # of the row, w and b
        share = (1.0, 1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0)[which]
        bound, moving = limits.state[i, kind], square[m] + (REST * limits.pace[i]) ** 2
        time = np.sqrt(moving) / bound
        for side in range(2):
            by = 0.5 * share * z[ROWS * kind + 3 * side + r] / (bound * bound)
            per, of_j = (1.0 - 2.0 * side) / time, 0.5 * h * h if m == 2 else 0.0
            alpha[1], alpha[2], alpha[3] = per, 1.0 + 0.5 * per * m * h, n * h + per * of_j
            for k in range(axes):
                a, j = x[2 * axes + k], u[k]
                e[k] = n * j + per * (0.5 * a if m == 1 else a + h * j if m == 2 else 0.0)
                for c in range(axes):
                    one = limits.linear[k] if c == k else 0.0
                    across[k, c] = by * (one - w[m, k] * w[m, c] / moving)
            for k in range(axes):
                along = 0.0
                for c in range(axes):
                    along += across[k, c] * e[c]
                W[4 * axes, 4 * axes] += e[k] * along
                for s in range(1, 4):
                    W[4 * axes, s * axes + k] += alpha[s] * along
                    for t in range(1, s + 1):
                        for c in range(axes):
                            W[s * axes + k, t * axes + c] += alpha[s] * alpha[t] * across[k, c]


@njit(cache=True, error_model="numpy")
def used(kind, v, a, linear):
    """|f(v, a)| of a limit of `STATE_LIMITS`, for v, a (A,); 0 at rest. linear (A,) is 1 for x, y and z, else 0."""
    square, along = 0.0, 0.0
    for k in range(len(v)):
        square += linear[k] * v[k] * v[k]
        along += linear[k] * v[k] * a[k]
    return abs(along) / np.sqrt(square) if square > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def state_shares(bounds, linear, v, a):
    """(N, K) shares of the limits (K,) that the velocities and accelerations v, a (N, A) use."""
    shares = np.zeros((len(v), len(bounds)))
    for i in range(len(v)):
        for kind in range(len(bounds)):
            shares[i, kind] = used(kind, v[i], a[i], linear) / bounds[kind]
    return shares
