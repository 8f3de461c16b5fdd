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

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.joint.laws import REST, ordinates, put_along, through

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


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
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


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _factors(pace, x, u):
    """Of a step the ordinates b (2, A); d (2,) of the rows, its derivatives of_d (2, 3, A) by w, and what is kept of it
    at least; by_b (2, 2, A) and by_w (2, 3, A): c of a row is the sum of b_m x by_b_m, and of by_w_n x w_n."""
    axes = len(u) - 1
    room = np.zeros((26, axes))  # one piece of memory: asking for it takes as long as what is done with it
    w, b, by_b, by_w, of_d = room[:3], room[3:5], room[5:9], room[9:15], room[15:24].reshape((3, 3, axes))
    d, counts = np.zeros(3), room[24]
    counts[:] = 1.0
    ordinates(x, u, counts, w, b)
    least = LEAST * put_along(w, REST * pace, d, of_d)
    for k in range(axes):
        by_b[0, k], by_b[1, k] = 2.0 * w[1, k] / 3.0, w[0, k] / 3.0
        by_b[2, k], by_b[3, k] = w[2, k] / 3.0, 2.0 * w[1, k] / 3.0
        by_w[0, k], by_w[1, k] = b[1, k] / 3.0, 2.0 * b[0, k] / 3.0
        by_w[4, k], by_w[5, k] = 2.0 * b[1, k] / 3.0, b[0, k] / 3.0
    return b, d[1:], of_d[1:], least, by_b.reshape((2, 2, axes)), by_w.reshape((2, 3, axes))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_normal_rows(bound, pace, turns, x, u, g, out):
    """The rows of a step with the node x (3 A,) and the controls u (A+1,), whose normal acceleration is at most
    `bound`, into g (2,), and their derivatives by p, v, a, j and h into out (2, 4 A + 1)."""
    if turns:
        _put_turning_rows(bound, x, u, g, out)
        return
    axes = len(u) - 1
    b, d, of_d, least, times_b, times_w = _factors(pace, x, u)
    slopes = np.zeros((5, axes))
    by_w, by_b = slopes[:3], slopes[3:]
    out[:] = 0.0
    for r in range(BETWEEN):
        square = 0.0
        per = 1.0 / (bound * max(d[r], least)) ** 2
        push = per * bound * bound * abs(d[r])
        for k in range(axes):
            by_b[0, k], by_b[1, k] = 0.0, 0.0
            for m in range(3):
                by_w[m, k] = -push * of_d[r, m, k]
            for n in range(axes):
                c = b[0, k] * times_b[r, 0, n] - times_b[r, 0, k] * b[0, n]
                c += b[1, k] * times_b[r, 1, n] - times_b[r, 1, k] * b[1, n]
                square += 0.5 * c * c
                for m in range(2):
                    by_b[m, k] += per * c * times_b[r, m, n]
                for m in range(3):
                    by_w[m, k] -= per * c * times_w[r, m, n]
        g[r] = 0.5 * (per * square - push * d[r])
        through(x, u, by_w, by_b, 1.0, out[r])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
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
    axes, h = len(u) - 1, u[len(u) - 1]
    _, d, _, least, times_b, times_w = _factors(pace, x, u)
    slope = np.empty(7)  # the derivatives of c[k, m] by the axes m and k, and by h
    index = np.empty(7, np.int64)
    index[6] = 4 * axes
    for r in range(BETWEEN):
        by = z[r] / (bound * max(d[r], least)) ** 2
        for k in range(axes):
            for m in range(k):  # c[k, m]
                slope[6] = 0.0
                for s in range(2):
                    own, other, sign = (k, m, -1.0) if s else (m, k, 1.0)
                    a, j = x[2 * axes + own], u[own]
                    w0, w1, w2 = times_w[r, 0, other], times_w[r, 1, other], times_w[r, 2, other]
                    b0, b1 = -times_b[r, 0, other], -times_b[r, 1, other]
                    index[s], index[2 + s], index[4 + s] = axes + own, 2 * axes + own, 3 * axes + own
                    slope[s] = sign * (w0 + w1 + w2)
                    slope[2 + s] = sign * (h * (0.5 * w1 + w2) + b0 + b1)
                    slope[4 + s] = sign * h * (0.5 * h * w2 + b1)
                    slope[6] += sign * (0.5 * w1 * a + w2 * (a + h * j) + b1 * j)
                for s in range(7):
                    for t in range(s + 1):
                        W[index[s], index[t]] += by * slope[s] * slope[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def stay_of(bound, x, u, priced):
    """What (dv)^2 of the node x (3 A,) costs in one iteration, half of it; `priced`: the sum of the multipliers of the
    rows that its velocity is in."""
    axes = len(u) - 1
    square = (SLOW * bound * u[axes]) ** 2
    for k in range(axes):
        square += x[axes + k] ** 2
    return (STAY + STAY_PRICED * priced) / square
