"""The convex problem of combined.py in one window, by a primal-dual interior-point method with slacks
(Mehrotra 1992).

Over the step y (n, A+1) of control points and theta,

    minimise    1/2 y'Hy + linear.y
    subject to  -lower <= row.y <= upper for every row, with slacks s- and s+
                g_j(c + y) <= 0         for every site, g_j = (|e_j|^2/r_j^2 - 1)/2 (interior_point.py), with a slack too

Limits and sites need not hold at the start, nor on the way: what is missing shrinks with every step. H, the
rows and the sites couple six neighbouring control points only, so that the Newton matrix

    H + sum z G + sum (z/s) grad g grad g'

is banded, and everything is linear in n. The passes over the sites, inside whose balls a spline stays
(sites.py), are those over the rows (combined_rows.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER
from planner.smoothing.combined_matrix import CONTRACT, SQUARE, STRIDE, Balls
from planner.smoothing.combined_rows import LEAST_SLACK, Rows, first_state, move, predict, weigh
from planner.smoothing.interior_point import factorise, solve
from planner.smoothing.sites import Sites


@njit(cache=True, error_model="numpy")
def balls_of(sites, control, y, product):
    """`Balls` of the sites around the control points (n, A) plus the step y (n, A+1), with this product of
    slacks and multipliers."""
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
    """Take the last step, to y (n, A+1), of `lengths` of slacks and of multipliers; then add the sites to
    `residual` and to `push` (n, A+1) (combined_rows.py). Returns sum(s z) and the most that is missing."""
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


FIRST_GAP = 0.3  # complementarity of the start, share of the window's time [-]
TO_BOUNDARY = 0.995  # of the way to the nearest bound that a step may go [-]
MISSED = (
    1e-4  # by how much a limit or a site may be missed at the end [-]: sites are 5e-4 inside the tolerance
)
AIM = 0.1  # of the gap that is asked for: multipliers are not driven below what that needs
ROUNDING = 1e-12  # share of the diagonal that is added to it [-]
THETA = 0.1  # what theta may be from its optimum, about [-], for the gap that the residual makes


class CombinedProblem(NamedTuple):
    """A window's problem over n control points (module text)."""

    H: FloatArray  # (n (A+1), 6 (A+1)) banded (interior_point.py)
    linear: FloatArray  # (n, A+1)
    free: Array  # (n, A+1) False for what stays
    rows: Rows
    control: FloatArray  # (n, A) where the step begins
    sites: Sites  # (J, ..), their spans counted from the first of these control points


@njit(cache=True, error_model="numpy")
def _add_product(band, x, out):
    """out (n,) += the banded matrix times x (n,)."""
    n, width = band.shape
    for i in range(n):
        total, value = band[i, 0] * x[i], x[i]
        for d in range(1, min(width, n - i)):
            total += band[i, d] * x[i + d]
            out[i + d] += band[i, d] * value
        out[i] += total


@njit(cache=True, error_model="numpy")
def _hold(band, free):
    """Unit rows and columns for what is not free."""
    n, columns = free.shape
    width = band.shape[1]
    for i in range(n):
        for k in range(columns):
            at = i * columns + k
            if free[i, k]:
                band[at, 0] *= 1.0 + ROUNDING
                continue
            for d in range(width):
                band[at, d] = 0.0
            for row in range(max(at - width + 1, 0), at):
                band[row, at - row] = 0.0
            band[at, 0] = 1.0


@njit(cache=True, error_model="numpy")
def _stays(free, step):
    """step (n, A+1) = 0 for what is not free."""
    for i in range(step.shape[0]):
        for k in range(step.shape[1]):
            if not free[i, k]:
                step[i, k] = 0.0


@njit(cache=True, error_model="numpy")
def _reach(most):
    """The length of a step that takes at most the share `most` of something positive away: at most 1."""
    return min(1.0, TO_BOUNDARY / most) if most > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def _left_over(problem, residual, reach):
    """By how much the gap may be too small for a residual (n, A+1), if control points are `reach` [mm] from
    their optimum [s]."""
    total, (n, columns) = 0.0, residual.shape
    for i in range(n):
        for k in range(columns):
            if problem.free[i, k]:
                total += abs(residual[i, k]) * (THETA if k == columns - 1 else reach)
    return total


@njit(cache=True, error_model="numpy")
def improve_window(problem, start, time, gap, iterations):
    """The optimum y (n, A+1) of a `CombinedProblem` from `start`, to a gap [s], or what so many iterations
    reach; `time` of the motion in the window [s]. Also the iterations."""
    rows, free = problem.rows, problem.free
    m = 2 * len(rows.kind) + len(problem.sites.span)  # upper bounds of the rows, lower bounds, sites
    y, (n, columns) = start.copy(), start.shape
    gradient, residual, push = np.empty((n, columns)), np.empty((n, columns)), np.empty((n, columns))
    barrier, bent, step = np.empty((n, columns)), np.empty((n, columns)), np.zeros((n, columns))
    band, seen = np.empty_like(problem.H), np.empty(5)
    product = FIRST_GAP * time / max(m, 1)
    state, balls = first_state(rows, y, product), balls_of(problem.sites, problem.control, y, product)
    reach = balls.radius.max() if len(balls.radius) else 0.0
    lengths = 0.0, 0.0
    for iteration in range(iterations):
        gradient[:] = problem.linear
        _add_product(problem.H, y.reshape(-1), gradient.reshape(-1))
        residual[:], push[:], band[:] = gradient, -gradient, problem.H
        products, missed = weigh_sites(balls, y, lengths, residual, push)
        of_rows, missed_rows = weigh(rows, state, lengths, balls, band, residual, push)
        products, missed = products + of_rows, max(missed, missed_rows)
        if products + _left_over(problem, residual, reach) <= gap and missed <= MISSED:
            return y, iteration
        _hold(band, free)
        if not factorise(band):
            return y, iteration

        # predictor: towards no gap at all
        step[:] = push
        _stays(free, step)
        solve(band, step.reshape(-1))
        seen[:], seen[1], barrier[:], bent[:] = 0.0, -1.0, 0.0, 0.0
        predict_sites(balls, step, barrier, bent, seen)
        predict(rows, state, step, barrier, bent, seen)
        least, most, plain, once, twice = seen
        along, dual = _reach(-least), _reach(1.0 + most)
        after = plain * (1.0 - dual) + once * (along * (1.0 - dual) - dual) - twice * along * dual

        # the cube of what the predictor leaves of the gap; its products are what the first order leaves out
        aim = max((after / products) ** 3 * products, AIM * gap) / m
        step[:] = push + bent + aim * barrier
        _stays(free, step)
        solve(band, step.reshape(-1))
        most, most_dual = move_sites(balls, step, aim)
        of_rows, of_rows_dual = move(rows, state, step, aim)
        along, dual = _reach(max(most, of_rows)), _reach(max(most_dual, of_rows_dual))
        y += along * step
        lengths = along, dual
    return y, iterations
