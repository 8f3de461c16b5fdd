"""The convex problem of joint.py in one window, by a primal-dual interior-point method with slacks (Mehrotra 1992).

Over the step y (n, A+1) of control points and theta,

    minimise    1/2 y'Hy + linear.y
    subject to  -lower <= row.y <= upper for every row, with slacks s- and s+
                g_j(c + y) <= 0         for every site, g_j = (|e_j|^2/r_j^2 - 1)/2 (interior_point.py), with a slack too

Limits and sites need not hold at the start, nor on the way: what is missing shrinks with every step. H, the rows and the sites couple
six neighbouring control points only, so that the Newton matrix

    H + sum z G + sum (z/s) grad g grad g'

is banded, and everything is linear in n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.banded import factorise, solve
from planner.smoothing.basis import ORDER
from planner.smoothing.joint_matrix import add_constraints, pattern
from planner.smoothing.joint_rows import Rows, add_rows, row_values
from planner.smoothing.sites import Sites

LEAST_SLACK = 0.05  # of a start [-]
FIRST_GAP = 0.3  # complementarity of the start, share of the window's time [-]
TO_BOUNDARY = 0.995  # of the way to the nearest bound that a step may go [-]
MISSED = (
    1e-4  # by how much a limit or a site may be missed at the end [-]: sites are 5e-4 inside the tolerance
)
AIM = 0.1  # of the gap that is asked for: multipliers are not driven below what that needs
ROUNDING = 1e-12  # share of the diagonal that is added to it [-]
THETA = 0.1  # what theta may be from its optimum, about [-], for the gap that the residual makes


class JointProblem(NamedTuple):
    """A window's problem over n control points (module text)."""

    H: FloatArray  # (n (A+1), 6 (A+1)) banded (banded.py)
    linear: FloatArray  # (n, A+1)
    free: Array  # (n, A+1) False for what stays
    rows: Rows
    control: FloatArray  # (n, A) where the step begins
    sites: Sites  # (J, ..), their spans counted from the first of these control points


@njit(cache=True, error_model="numpy")
def _site_values(sites, control, y, normal, g):
    """g (J,) at the control points plus the step y, and normal (J, A) with grad g = N (x) normal (interior_point.py)."""
    axes = normal.shape[1]
    e = np.empty(axes)
    for j in range(len(g)):
        i, dot = sites.span[j], 0.0
        for k in range(axes):
            d = -sites.target[j, k]
            for b in range(ORDER):
                d += sites.weights[j, b] * (control[i + b, k] + y[i + b, k])
            e[k] = d
            dot += d * sites.along[j, k]
        square, radius, loose = 0.0, sites.radius[j], 1.0 - sites.slide[j]
        rest = sites.slide[j] * dot  # what is left of e along the path
        for k in range(axes):
            e[k] = (e[k] - loose * dot * sites.along[j, k]) / radius
            square += e[k] * e[k]
            normal[j, k] = (e[k] - loose * rest / radius * sites.along[j, k]) / radius
        g[j] = 0.5 * (square - 1.0)


@njit(cache=True, error_model="numpy")
def _site_slopes(sites, normal, y, out):
    """out (J,) = grad g . y."""
    axes = normal.shape[1]
    for j in range(len(out)):
        i, total = sites.span[j], 0.0
        for b in range(ORDER):
            move = 0.0
            for k in range(axes):
                move += y[i + b, k] * normal[j, k]
            total += sites.weights[j, b] * move
        out[j] = total


@njit(cache=True, error_model="numpy")
def _add_site_gradients(sites, normal, q, out):
    """out (n, A+1) += the sum of q (J,) grad g."""
    for j in range(len(q)):
        i = sites.span[j]
        for b in range(ORDER):
            value = q[j] * sites.weights[j, b]
            for k in range(normal.shape[1]):
                out[i + b, k] += value * normal[j, k]


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
def _reach(s, ds):
    """Share of a step ds (R,) that keeps s positive, at most 1."""
    most = 0.0
    for r in range(len(s)):
        most = max(most, -ds[r] / s[r])
    return min(1.0, TO_BOUNDARY / most) if most > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def _directions(s, z, missing, slope, aim, second, ds, dz):
    """Steps of the slacks s and multipliers z (R,), towards s z = aim - second, of constraints that grow by `slope`."""
    for r in range(len(s)):
        ds[r] = -missing[r] - slope[r]
        dz[r] = (aim - second[r] - z[r] * ds[r]) / s[r] - z[r]


@njit(cache=True, error_model="numpy")
def improve_window(problem, start, time, gap, iterations):
    """The optimum y (n, A+1) of a `JointProblem` from `start`, to a gap [s], or what is reached after so many iterations; `time` of the
    motion in the window [s]. Also the iterations."""
    rows, sites, free = problem.rows, problem.sites, problem.free
    R, J = len(rows.upper), len(sites.span)
    m = 2 * R + J  # upper bounds of the rows, lower bounds, sites
    (n, columns), axes = start.shape, start.shape[1] - 1
    y, step, gradient = start.copy(), np.empty((n, columns)), np.empty((n, columns))
    s, z, missing, second = np.empty(m), np.empty(m), np.empty(m), np.zeros(m)
    ds, dz, slope, value, q = np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    normal, band, where = np.empty((J, axes)), np.empty_like(problem.H), pattern(columns)
    row_values(rows, y, value[:R])
    for r in range(R):
        value[r], value[R + r] = value[r] - rows.upper[r], -value[r] - rows.lower[r]
    _site_values(sites, problem.control, y, normal, value[2 * R :])
    reach = 0.0
    for j in range(J):
        reach = max(reach, sites.radius[j])
    first = FIRST_GAP * time / max(m, 1)
    for c in range(m):
        s[c] = max(-value[c], LEAST_SLACK)
        z[c] = first / s[c]
        missing[c] = value[c] + s[c]
    for iteration in range(iterations):
        gradient[:] = problem.linear
        _add_product(problem.H, y.reshape(-1), gradient.reshape(-1))
        products, missed = 0.0, 0.0
        for c in range(m):
            products += s[c] * z[c]
            missed = max(missed, missing[c])
        step[:] = gradient
        for r in range(R):
            q[r] = z[r] - z[R + r]
        add_rows(rows, q[:R], step)
        _add_site_gradients(sites, normal, z[2 * R :], step)
        residual = 0.0
        for i in range(n):
            for k in range(columns):
                if free[i, k]:
                    residual += abs(step[i, k]) * (THETA if k == axes else reach)
        if products + residual <= gap and missed <= MISSED:
            return y, iteration
        band[:] = problem.H
        for c in range(m):
            slope[c] = z[c] / s[c]
        for r in range(R):
            q[r] = slope[r] + slope[R + r]
        add_constraints(rows, q[:R], sites, normal, z[2 * R :], slope[2 * R :], where, band)
        _hold(band, free)
        if not factorise(band):
            return y, iteration
        aim, along, dual = 0.0, 1.0, 1.0
        for phase in range(2):
            if phase == 1:
                # the cube of what the predictor leaves of the gap; its products are what the first order leaves out
                after = 0.0
                for c in range(m):
                    after += (s[c] + along * ds[c]) * (z[c] + dual * dz[c])
                    second[c] = ds[c] * dz[c]
                aim = max((after / products) ** 3 * products, AIM * gap) / m
            else:
                second[:] = 0.0
            step[:] = -gradient
            for c in range(m):
                q[c] = -(aim - second[c] + z[c] * missing[c]) / s[c]
            for r in range(R):
                q[r] -= q[R + r]
            add_rows(rows, q[:R], step)
            _add_site_gradients(sites, normal, q[2 * R :], step)
            for i in range(n):
                for k in range(columns):
                    if not free[i, k]:
                        step[i, k] = 0.0
            solve(band, step.reshape(-1))
            row_values(rows, step, slope[:R])
            for r in range(R):
                slope[R + r] = -slope[r]
            _site_slopes(sites, normal, step, slope[2 * R :])
            _directions(s, z, missing, slope, aim, second, ds, dz)
            along, dual = _reach(s, ds), _reach(z, dz)
        for i in range(n):
            for k in range(columns):
                y[i, k] += along * step[i, k]
        for c in range(m):
            s[c] += along * ds[c]
            z[c] += dual * dz[c]
            missing[c] *= 1.0 - along
        _site_values(sites, problem.control, y, normal, value[2 * R :])
        for c in range(2 * R, m):
            missing[c] = value[c] + s[c]
    return y, iterations
