"""The curvature of the rows of the laws (laws.py), what is positive of it, for the model of a step
(curvature.py)."""

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.joint.laws import (
    JOINT_PUSH,
    JOLT,
    POWER,
    PRODUCT,
    PUSH,
    REST,
    ROWS_OF,
    SPEED,
    chained,
    ordinates,
    seen_at,
    square_at,
)

# w.w as squares: row, weight, and the shares of w0, w1 and w2 in the vector that is squared.
_SQUARES = np.array(
    [
        (0, 1, 1, 0, 0),
        (1, 1, 0.5, 0.5, 0),
        (2, 2 / 3, 0, 1, 0),
        (2, 1 / 3, 0.5, 0, 0.5),
        (3, 1, 0, 0.5, 0.5),
        (4, 1, 0, 0, 1),
    ]
)
SLOW = 0.1  # of a step's pace: below that the time over which power is squared out does not fall [-]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_vector(W, axes, alpha, e, G):
    """W += J'GJ for one vector y with dy = J d."""
    h = 4 * axes
    for k in range(axes):
        along = 0.0
        for m in range(axes):
            along += G[k, m] * e[m]
        W[h, h] += e[k] * along
        for a in range(4):
            if alpha[a] == 0.0:
                continue
            W[h, a * axes + k] += alpha[a] * along
            for b in range(a + 1):
                both = alpha[a] * alpha[b]
                if both != 0.0:
                    for m in range(axes):
                        W[a * axes + k, b * axes + m] += both * G[k, m]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_law_curvature(W, laws, i, pace, x, u, z):
    """W (4 A + 1, 4 A + 1), lower triangle, += the positive part of the curvature of the rows of step i;
    pace as of the limits (rows.py), z: their multipliers."""
    for m in range(len(laws.kind)):
        own = z[laws.first[m] : laws.first[m + 1]]
        if not own.any():
            continue
        if laws.kind[m] == SPEED:
            _curve_speed(W, laws, i, m, x, u, own)
        elif laws.kind[m] == PUSH or laws.kind[m] == POWER:
            _curve_pushed(W, laws, i, m, x, u, REST * pace, own)
        elif laws.kind[m] == JOLT:
            _curve_jolt(W, laws, i, m, x, u, REST * pace, own)
        elif laws.kind[m] == JOINT_PUSH:
            _curve_joint(W, laws, i, m, u, own)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _curve_speed(W, laws, i, m, x, u, z):
    """That of SPEED: squares of sums of ordinates."""
    axes = len(u) - 1
    h, alpha, e, square = u[axes], np.zeros(4), np.empty(axes), np.zeros((axes, axes))
    for term in range(len(_SQUARES)):
        row, share, c0, c1, c2 = _SQUARES[term]
        r = int(row)
        alpha[1], alpha[2], alpha[3] = c0 + c1 + c2, h * (0.5 * c1 + c2), 0.5 * h * h * c2
        for k in range(axes):
            a = x[2 * axes + k]
            e[k] = 0.5 * c1 * a + c2 * (a + h * u[k])
            square[k, k] = laws.counts[m, k] * z[r] * share / square_at(laws.begin[i, m], laws.end[i, m], r)
        _add_vector(W, axes, alpha, e, square)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _curve_pushed(W, laws, i, m, x, u, rest, z):
    """That of b.w, which is (|b + w/time|^2 - |b - w/time|^2) time/4: of PUSH across the motion, the first
    square."""
    axes = len(u) - 1
    h, w, b, bound, pushed = (
        u[axes],
        np.empty((3, axes)),
        np.empty((2, axes)),
        laws.begin[i, m],
        laws.kind[m] == PUSH,
    )
    alpha, e, across = np.zeros(4), np.empty(axes), np.empty((axes, axes))
    ordinates(x, u, laws.counts[m], w, b)
    for term in range(len(PRODUCT)):
        r, n, c, share = int(PRODUCT[term, 0]), int(PRODUCT[term, 1]), int(PRODUCT[term, 2]), PRODUCT[term, 3]
        moving = (w[c] ** 2).sum() + (rest * rest if pushed else (SLOW / REST * rest) ** 2)
        time = np.sqrt(moving) / bound if pushed else moving / bound
        for side in range(2):
            by = 0.5 * share * z[3 * side + r] / (bound * bound if pushed else bound / time)
            per, of_j = (1.0 - 2.0 * side) / time, 0.5 * h * h if c == 2 else 0.0
            alpha[1], alpha[2], alpha[3] = per, 1.0 + 0.5 * per * c * h, n * h + per * of_j
            for k in range(axes):
                a, j = x[2 * axes + k], u[k]
                e[k] = n * j + per * (0.5 * a if c == 1 else a + h * j if c == 2 else 0.0)
                for s in range(axes):
                    one = laws.counts[m, k] if s == k else 0.0
                    across[k, s] = by * (one - (w[c, k] * w[c, s] / moving if pushed else 0.0))
            _add_vector(W, axes, alpha, e, across)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _curve_jolt(W, laws, i, m, x, u, rest, z):
    """That of |r|^2 with r = (a - (a.t) t)/|v|^(1/2), where it is in the upper rows, as if r were linear."""
    axes = len(u) - 1
    y, by, slope = np.empty((3, axes)), np.zeros((4, axes)), np.empty(4 * axes + 1)
    for place in range(ROWS_OF[JOLT] // 2):
        if z[2 * place] == 0.0:
            continue
        part = place / (ROWS_OF[JOLT] // 2 - 1)
        seen_at(x, u, part * u[axes], y)
        vv, av = rest * rest, 0.0
        for k in range(axes):
            y[1, k], y[2, k] = laws.counts[m, k] * y[1, k], laws.counts[m, k] * y[2, k]
            vv, av = vv + y[1, k] * y[1, k], av + y[2, k] * y[1, k]
        bound = laws.begin[i, m] + part * (laws.end[i, m] - laws.begin[i, m])
        weight = 2.0 * z[2 * place] / bound / np.sqrt(vv)
        for row in range(axes):
            v = y[1, row]
            across = y[2, row] - av / vv * v
            for k in range(axes):
                by[1, k] = -v * y[2, k] / vv + (2.0 * av / vv * v - 0.5 * across) * y[1, k] / vv
                by[2, k] = -v * y[1, k] / vv
            by[1, row] -= laws.counts[m, row] * av / vv
            by[2, row] += laws.counts[m, row]
            slope[:] = 0.0
            chained(u, part, y, by, slope)
            for a in range(4 * axes + 1):
                for b in range(a + 1):
                    W[a, b] += weight * slope[a] * slope[b]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _curve_joint(W, laws, i, m, u, z):
    """That of v.H v."""
    axes, q = len(u) - 1, laws.joint[m]
    for row in range(4):
        if z[row] != 0.0:
            place, t = row // 2, 0.5 * u[axes] * (row // 2)
            weight = 2.0 * z[row] / (laws.end[i, m] if place else laws.node[i, m])
            alpha = np.array([0.0, 1.0, t, 0.5 * t * t])
            _add_vector(W, axes, alpha, np.zeros(axes), weight * laws.convex[i + place, row % 2, q])
