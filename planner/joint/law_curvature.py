"""The curvature of the rows of the laws (laws.py), what is positive of it, for the model of a step
(curvature.py)."""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.joint.laws import JOINT_PUSH, JOLT, POWER, PUSH, REST, SPEED, chained, seen_at, square_at

# Of the curvature of the rows of SPEED: row, weight, and the shares of w0, w1 and w2 in the vector that it is of.
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
SLOW = 0.1  # of a step's pace: below that the time over which power is squared out does not fall [-]


@njit(cache=True, error_model="numpy")
def add_law_curvature(W, limits, i, x, u, z):
    """W (4 A + 1, 4 A + 1), lower triangle, += the positive part of the curvature of the rows of step i;
    z: their multipliers."""
    laws = limits.laws
    for m in range(len(laws.kind)):
        own = z[laws.first[m] : laws.first[m + 1]]
        if not own.any():
            continue
        if laws.kind[m] == SPEED:
            _curve_speed(W, laws, i, m, x, u, own)
        elif laws.kind[m] == PUSH or laws.kind[m] == POWER:
            _curve_pushed(W, laws, i, m, x, u, REST * limits.pace[i], own)
        elif laws.kind[m] == JOLT:
            _curve_jolt(W, laws, i, m, x, u, REST * limits.pace[i], own)
        elif laws.kind[m] == JOINT_PUSH:
            _curve_joint(W, laws, i, m, u, own)


@njit(cache=True, error_model="numpy")
def _curve_speed(W, laws, i, m, x, u, z):
    """That of SPEED: squares of sums of ordinates."""
    axes = len(u) - 1
    h = u[axes]
    for term in range(len(_CURVED)):
        row, share, c0, c1, c2 = _CURVED[term]
        by, of_v, of_a, of_j = (
            z[int(row)] * share / square_at(laws.begin[i, m], laws.end[i, m], int(row)),
            c0 + c1 + c2,
            h * (0.5 * c1 + c2),
            0.5 * h * h * c2,
        )
        for k in range(axes):
            weight, a = by * laws.counts[m, k], x[2 * axes + k]
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


@njit(cache=True, error_model="numpy")
def _curve_pushed(W, laws, i, m, x, u, rest, z):
    """That of b.w, which is (|b + w/time|^2 - |b - w/time|^2) time/4: of PUSH across the motion, the first
    square."""
    axes = len(u) - 1
    h, w, square = u[axes], np.empty((3, axes)), np.zeros(3)
    alpha, e, across = np.zeros(4), np.empty(axes), np.empty((axes, axes))
    for k in range(axes):
        counts = laws.counts[m, k]
        v, a = counts * x[axes + k], counts * x[2 * axes + k]
        w[0, k], w[1, k], w[2, k] = v, v + 0.5 * h * a, v + h * (a + 0.5 * h * counts * u[k])
        for c in range(3):
            square[c] += w[c, k] ** 2
    for which in range(5):
        r, c, n = (
            (0, 1, 1, 2, 2)[which],
            (0, 0, 1, 1, 2)[which],
            (0, 1, 0, 1, 0)[which],
        )  # of the row, w and b
        share = (1.0, 1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0)[which]
        bound, pushed = laws.begin[i, m], laws.kind[m] == PUSH
        moving = square[c] + (rest * rest if pushed else (SLOW / REST * rest) ** 2)
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
                    turned = w[c, k] * w[c, s] / moving if pushed else 0.0
                    across[k, s] = by * (one - turned)
            for k in range(axes):
                along = 0.0
                for s in range(axes):
                    along += across[k, s] * e[s]
                W[4 * axes, 4 * axes] += e[k] * along
                for s in range(1, 4):
                    W[4 * axes, s * axes + k] += alpha[s] * along
                    for t in range(1, s + 1):
                        for s2 in range(axes):
                            W[s * axes + k, t * axes + s2] += alpha[s] * alpha[t] * across[k, s2]


@njit(cache=True, error_model="numpy")
def _curve_jolt(W, laws, i, m, x, u, rest, z):
    """That of |r|^2 with r = (a - (a.t) t)/|v|^(1/2), where it is in the upper rows, as if r were linear."""
    axes = len(u) - 1
    y, by, slope = np.empty((3, axes)), np.zeros((4, axes)), np.empty(4 * axes + 1)
    for place in range(2):
        if z[2 * place] == 0.0:
            continue
        t = u[axes] if place else 0.0
        seen_at(x, u, t, y)
        vv, av = rest * rest, 0.0
        for k in range(axes):
            y[1, k], y[2, k] = laws.counts[m, k] * y[1, k], laws.counts[m, k] * y[2, k]
            vv, av = vv + y[1, k] * y[1, k], av + y[2, k] * y[1, k]
        weight = 2.0 * z[2 * place] / (laws.end[i, m] if place else laws.begin[i, m]) / np.sqrt(vv)
        for row in range(axes):
            v = y[1, row]
            across = y[2, row] - av / vv * v
            for k in range(axes):
                by[1, k] = -v * y[2, k] / vv + (2.0 * av / vv * v - 0.5 * across) * y[1, k] / vv
                by[2, k] = -v * y[1, k] / vv
            by[1, row] -= laws.counts[m, row] * av / vv
            by[2, row] += laws.counts[m, row]
            slope[:] = 0.0
            chained(u, 1.0 * place, y, by, slope)
            for a in range(4 * axes + 1):
                for b in range(a + 1):
                    W[a, b] += weight * slope[a] * slope[b]


@njit(cache=True, error_model="numpy")
def _curve_joint(W, laws, i, m, u, z):
    """That of v.H v."""
    axes, q = len(u) - 1, laws.joint[m]
    for row in range(4):
        if z[row] == 0.0:
            continue
        place, t = row // 2, 0.5 * u[axes] * (row // 2)
        weight = 2.0 * z[row] / (laws.end[i, m] if place else laws.node[i, m])
        for k in range(axes):
            for c in range(axes):
                by = weight * laws.convex[i + place, row % 2, q, k, c]
                if c <= k:
                    W[axes + k, axes + c] += by
                    W[2 * axes + k, 2 * axes + c] += t * t * by
                    W[3 * axes + k, 3 * axes + c] += 0.25 * t**4 * by
                W[2 * axes + k, axes + c] += t * by
                W[3 * axes + k, axes + c] += 0.5 * t * t * by
                W[3 * axes + k, 2 * axes + c] += 0.5 * t**3 * by
