"""The sites of combined_solver.py: a spline stays inside their balls (sites.py). The passes are those of combined_rows.py."""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import ORDER
from planner.smoothing.combined_matrix import CONTRACT, SQUARE, STRIDE, Balls
from planner.smoothing.combined_rows import LEAST_SLACK


@njit(cache=True, error_model="numpy")
def balls_of(sites, control, y, product):
    """`Balls` of the sites around the control points (n, A) plus the step y (n, A+1), with this product of slacks and multipliers."""
    J, axes = len(sites.span), control.shape[1]
    offset, none = np.empty((J, axes)), np.zeros(J)
    for j in range(J):
        for k in range(axes):
            offset[j, k] = -sites.target[j, k]
            for b in range(ORDER):
                offset[j, k] += sites.weights[j, b] * control[sites.span[j] + b, k]
    square = np.zeros((J, SQUARE))
    for j in range(J):
        for a in range(ORDER):
            for b in range(ORDER):
                square[j, a * STRIDE + b] = sites.weights[j, a] * sites.weights[j, b]
    balls = Balls(
        sites.span, sites.weights, offset, sites.along, sites.slide, sites.radius,
        none.copy(), np.zeros((J, axes)), none.copy(), none.copy(), none.copy(), none.copy(), none.copy(), none.copy(), square,
    )  # fmt: skip
    see_sites(balls, y)
    for j in range(J):
        balls.s[j] = max(-balls.g[j], LEAST_SLACK)
        balls.z[j] = product / balls.s[j]
    return balls


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def see_sites(balls, y):
    """Put what the sites are at the step y (n, A+1) into g and normal."""
    span, weights, from_target, way, slide, radii, g, normal = balls[:8]
    axes = normal.shape[1]
    e = np.empty(axes)
    for j in range(len(span)):
        i, dot = span[j], 0.0
        for k in range(axes):
            d = from_target[j, k]
            for b in range(ORDER):
                d += weights[j, b] * y[i + b, k]
            e[k] = d
            dot += d * way[j, k]
        square, radius, loose = 0.0, radii[j], 1.0 - slide[j]
        rest = slide[j] * dot  # what is left of e along the path
        for k in range(axes):
            e[k] = (e[k] - loose * dot * way[j, k]) / radius
            square += e[k] * e[k]
            normal[j, k] = (e[k] - loose * rest / radius * way[j, k]) / radius
        g[j] = 0.5 * (square - 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_gradients(span, weights, normal, q, out):
    """out (n, A+1) += the sum of q (J,) grad g."""
    for j in range(len(span)):
        i = span[j]
        for b in range(ORDER):
            value = q[j] * weights[j, b]
            for k in range(normal.shape[1]):
                out[i + b, k] += value * normal[j, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_slopes(span, weights, normal, y, out):
    """out (J,) = grad g . y."""
    for j in range(len(span)):
        i, total = span[j], 0.0
        for b in range(ORDER):
            turn = 0.0
            for k in range(normal.shape[1]):
                turn += y[i + b, k] * normal[j, k]
            total += weights[j, b] * turn
        out[j] = total


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def weigh_sites(balls, y, lengths, residual, push):
    """Take the last step, to y (n, A+1), of `lengths` of slacks and of multipliers; then add the sites to `residual` and to `push`
    (n, A+1) (combined_rows.py). Returns sum(s z) and the most that is missing."""
    along, dual = lengths
    s, z, q = balls.s, balls.z, balls.q
    see_sites(balls, y)
    products, missed = 0.0, 0.0
    for j in range(len(s)):
        s[j] += along * balls.ds[j]
        z[j] += dual * balls.dz[j]
        missing = balls.g[j] + s[j]
        products += s[j] * z[j]
        missed = max(missed, missing)
        q[j] = -z[j] * missing / s[j]
    _add_gradients(balls.span, balls.weights, balls.normal, z, residual)
    _add_gradients(balls.span, balls.weights, balls.normal, q, push)
    return products, missed


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def predict_sites(balls, step, barrier, bent, seen):
    """`predict` of combined_rows.py for the sites."""
    s, z, q, second = balls.s, balls.z, balls.q, balls.second
    _put_slopes(balls.span, balls.weights, balls.normal, step, q)
    for j in range(len(s)):
        share = (-(balls.g[j] + s[j]) - q[j]) / s[j]
        seen[0], seen[1] = min(seen[0], share), max(seen[1], share)
        gap = s[j] * z[j]
        seen[2] += gap
        seen[3] += gap * share
        seen[4] += gap * share * share
        second[j], q[j] = -z[j] * share * (1.0 + share), -1.0 / s[j]
    _add_gradients(balls.span, balls.weights, balls.normal, q, barrier)
    _add_gradients(balls.span, balls.weights, balls.normal, second, bent)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def move_sites(balls, step, aim):
    """`move` of combined_rows.py for the sites."""
    s, z, q = balls.s, balls.z, balls.q
    _put_slopes(balls.span, balls.weights, balls.normal, step, q)
    most, most_dual = 0.0, 0.0
    for j in range(len(s)):
        ds = -(balls.g[j] + s[j]) - q[j]
        dz = (aim - z[j] * ds) / s[j] - balls.second[j] - z[j]
        balls.ds[j], balls.dz[j] = ds, dz
        most, most_dual = max(most, -ds / s[j]), max(most_dual, -dz / z[j])
    return most, most_dual
