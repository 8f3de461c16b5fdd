"""The convex problem of a spline in a corridor, by an interior-point method that never leaves it.

Over control points c (n, A), a quadratic form, a banded matrix H_k per axis, sites j inside balls:

    minimise    1/2 sum_k c_k' H_k c_k
    subject to  g_j = (|e_j|^2 / r_j^2 - 1)/2 <= 0,     e_j = d_j - (1 - slide_j) t_j (t_j . d_j),     d_j = p(u_j) - q_j

(sites.py). With z_j >= 0 for g_j, a Newton step of z_j g_j = -mu and stationarity solves

    (H + sum z_j G_j + sum z_j/(-g_j) grad g_j grad g_j') dc = -(H c + sum mu/(-g_j) grad g_j),

block-banded with blocks of A: linear in n. Steps keep every g_j < 0, so that any iterate is a path inside the
corridor; where the method ends early, the path is less smooth than it could be and no less inside.

Row i of a symmetric banded matrix holds the entries of the upper triangle within `width` of the diagonal, the
diagonal first: band[i, d] is the entry (i, i + d). Inner loops run along whole rows, zeros included, for vector
instructions.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER, put_rows
from planner.smoothing.sites import Sites, site_distance


@njit(cache=True, error_model="numpy")
def factorise(band):
    """band (n, width) becomes its factor R with R'R = band, the diagonal inverted; False where it is not
    positive definite."""
    n, width = band.shape
    row = np.zeros(2 * width)  # the second half stays 0
    for i in range(n):
        if not band[i, 0] > 0.0:
            return False
        inverse = 1.0 / np.sqrt(band[i, 0])
        band[i, 0] = inverse
        for d in range(1, width):
            band[i, d] *= inverse
            row[d] = band[i, d]
        for d in range(1, min(width, n - i)):
            value = row[d]
            for k in range(width):
                band[i + d, k] -= value * row[d + k]
    return True


@njit(cache=True, error_model="numpy")
def solve(band, x):
    """x (n,) becomes the solution for the right-hand side x, with the factor of `factorise`."""
    n, width = band.shape
    for i in range(n):
        x[i] *= band[i, 0]
        value = x[i]
        for d in range(1, min(width, n - i)):
            x[i + d] -= band[i, d] * value
    for i in range(n - 1, -1, -1):
        total = x[i]
        for d in range(1, min(width, n - i)):
            total -= band[i, d] * x[i + d]
        x[i] = total * band[i, 0]


TO_BOUNDARY = 0.95  # of the way to the nearest bound that a step may go [-]: usual are 0.9 to 0.995
CENTRING = 3.0  # a short step is followed by one towards the middle, with up to so much of the gap [-]; 0 takes twice the iterations
STALLED = 1e-6  # a step shorter than this ends the search [-]: rounding of the Newton matrix, no way forward
AIM = 0.1  # of the gap that is asked for: multipliers are not driven below what that needs, which keeps the matrix well conditioned


class Problem(NamedTuple):
    """A convex problem over n control points and m sites (module text)"""

    H: FloatArray  # (A, n, 6) lower bands
    free: Array  # (n,) False for control points that stay
    sites: Sites  # (m, ..), their spans counted from the first of these control points


class Accuracy(NamedTuple):
    """Where the search ends, gap <= last + relative * objective, and where it begins."""

    value: float  # of the objective at the start, in as far as it matters
    first: float  # guess of the gap there, for the first multipliers
    last: float
    relative: float


class Optimum(NamedTuple):
    """The result of a search: control points (n, A), multipliers (m,) of g, the gap, and the iterations."""

    control: FloatArray
    multiplier: FloatArray
    gap: float
    iterations: int


@njit(cache=True, error_model="numpy")
def _constraint(sites, c, g, e):
    """g (m,) and the weighted distances e (m, A) over their radii."""
    for site in range(len(g)):
        radius = sites.radius[site]
        ratio = site_distance(sites, site, c, 0, e[site]) / radius
        for k in range(e.shape[1]):
            e[site, k] /= radius
        g[site] = 0.5 * (ratio * ratio - 1.0)


@njit(cache=True, error_model="numpy")
def _objective(problem, c, gradient):
    """1/2 c'Hc and its gradient (n, A)."""
    H = problem.H
    axes, n, width = H.shape
    total = 0.0
    for k in range(axes):
        for i in range(n):
            gradient[i, k] = 0.0
        for i in range(n):
            for d in range(min(i, width - 1) + 1):
                value = H[k, i, width - 1 - d]
                gradient[i, k] += value * c[i - d, k]
                if d > 0:
                    gradient[i - d, k] += value * c[i, k]
        for i in range(n):
            total += 0.5 * gradient[i, k] * c[i, k]
    return total


@njit(cache=True, error_model="numpy")
def _assemble(problem, z, g, e, band):
    """The Newton matrix (banded), with unit rows for control points that stay."""
    H, free = problem.H, problem.free
    first, _, values, _, along, slide, radius = problem.sites
    axes, n, width = H.shape
    full = band.shape[1]
    band[:] = 0.0
    for i in range(n):
        for k in range(axes):
            for d in range(min(i, width - 1) + 1):
                band[(i - d) * axes + k, d * axes] = H[k, i, width - 1 - d]
    normal = np.empty(axes)
    spread = np.zeros((axes, 2 * full))  # of a site: what its control points get for each axis; then zeros
    for site in range(len(first)):
        # M'M = 1 - (1 - slide^2) t t'; grad g = N (x) M e / r^2, where e is already over r
        dot = 0.0
        for k in range(axes):
            dot += e[site, k] * along[site, k]
        for k in range(axes):
            normal[k] = (e[site, k] - (1.0 - slide[site]) * dot * along[site, k]) / radius[site]
        flat = z[site] / (radius[site] * radius[site])
        steep = z[site] / -g[site]
        loose = 1.0 - slide[site] * slide[site]
        for k in range(axes):
            for m in range(axes):
                block = steep * normal[k] * normal[m] - flat * loose * along[site, k] * along[site, m]
                if k == m:
                    block += flat
                for b in range(ORDER):
                    spread[k, b * axes + m] = values[site, b] * block
        for a in range(ORDER):
            value = values[site, a]
            for k in range(axes):
                begin = a * axes + k
                into = band[first[site] * axes + begin]
                for d in range(full):
                    into[d] += value * spread[k, begin + d]
    for i in range(n):
        if not free[i]:
            for column in range(i * axes, (i + 1) * axes):
                for d in range(full):
                    band[column, d] = 0.0
                for row in range(max(column - full + 1, 0), column):
                    band[row, column - row] = 0.0
                band[column, 0] = 1.0


@njit(cache=True, error_model="numpy")
def _add_gradient(sites, e, factor, out):
    """out (n, A) += sum_j factor_j grad g_j."""
    first, _, values, _, along, slide, radius = sites
    axes = out.shape[1]
    for site in range(len(first)):
        dot = 0.0
        for k in range(axes):
            dot += e[site, k] * along[site, k]
        for k in range(axes):
            normal = (e[site, k] - (1.0 - slide[site]) * dot * along[site, k]) * factor[site] / radius[site]
            for b in range(ORDER):
                out[first[site] + b, k] += values[site, b] * normal


@njit(cache=True, error_model="numpy")
def _step_length(sites, step, g, e, slope):
    """Largest step <= 1/TO_BOUNDARY that keeps every g <= 0; also slope (m,) = grad g . dc."""
    first, _, values, _, along, slide, radius = sites
    axes = step.shape[1]
    longest = 1.0 / TO_BOUNDARY
    move = np.empty(axes)
    for site in range(len(first)):
        dot = 0.0
        for k in range(axes):
            total = 0.0
            for b in range(ORDER):
                total += values[site, b] * step[first[site] + b, k]
            move[k] = total / radius[site]
            dot += move[k] * along[site, k]
        square, product = 0.0, 0.0
        for k in range(axes):
            move[k] -= (1.0 - slide[site]) * dot * along[site, k]
            square += move[k] * move[k]
            product += move[k] * e[site, k]
        slope[site] = product
        # g + product t + square t^2 / 2 = 0
        if square > 0.0:
            root = np.sqrt(product * product - 2.0 * square * g[site])
            reach = -2.0 * g[site] / (product + root) if product > 0.0 else (root - product) / square
            longest = min(longest, reach)
    return longest


@njit(cache=True, error_model="numpy")
def minimise_in_corridor(problem, start, accuracy, iterations):
    """The optimum of a `Problem` from control points (n, A) strictly inside the corridor, to an `Accuracy`;
    the last iterate, which is inside, where `iterations` are too few or rounding stops the search."""
    sites, free = problem.sites, problem.free
    axes, n, _ = problem.H.shape
    m = len(sites.span)
    c, z = start.copy(), np.empty(m)
    g, e = np.empty(m), np.empty((m, axes))
    gradient = np.empty((n, axes))
    band = np.empty((n * axes, ORDER * axes))
    slope, slope_1, factor = np.empty(m), np.empty(m), np.empty(m)
    step, step_1 = np.empty((n, axes)), np.empty((n, axes))
    _constraint(sites, c, g, e)
    for site in range(m):
        z[site] = accuracy.first / m / -g[site]
    reach = np.max(sites.radius) if m else 0.0  # what a control point may be from its optimum, about
    at_start = _objective(problem, c, gradient)
    gap = np.inf
    went = 1.0
    for iteration in range(iterations):
        value = accuracy.value + _objective(problem, c, gradient) - at_start
        small = accuracy.last + accuracy.relative * max(value, 0.0)
        complementarity = 0.0
        for site in range(m):
            complementarity += z[site] * -g[site]
        residual = 0.0
        put_rows(step_1, 0, gradient)
        _add_gradient(sites, e, z, step_1)
        for i in range(n):
            if free[i]:
                for k in range(axes):
                    residual += abs(step_1[i, k])
        gap = complementarity + residual * reach
        if gap <= small:
            return Optimum(c, z, gap, iteration)
        _assemble(problem, z, g, e, band)
        if not factorise(band):
            return Optimum(c, z, gap, iteration)
        # predictor: mu = 0
        for i in range(n):
            for k in range(axes):
                step_1[i, k] = -gradient[i, k] if free[i] else 0.0
        solve(band, step_1.reshape(-1))
        longest = min(1.0, _step_length(sites, step_1, g, e, slope_1))
        dual = 1.0
        for site in range(m):
            dz = -z[site] + z[site] / -g[site] * slope_1[site]
            if dz < 0.0:
                dual = min(dual, -z[site] / dz)
        after = 0.0
        for site in range(m):
            dz = -z[site] + z[site] / -g[site] * slope_1[site]
            after += (z[site] + dual * dz) * max(-(g[site] + longest * slope_1[site]), 0.0)
        # the cube of what the predictor leaves of the gap (Mehrotra 1992)
        mu = max((after / complementarity) ** 3, CENTRING * (1.0 - went)) * complementarity / m
        mu = max(mu, AIM * small / m)
        put_rows(step, 0, -gradient)
        for site in range(m):
            # second order: z (g + slope + curvature) with the predictor's products
            dz = -z[site] + z[site] / -g[site] * slope_1[site]
            factor[site] = -(mu + dz * slope_1[site] * dual * longest) / -g[site]
        _add_gradient(sites, e, factor, step)
        for i in range(n):
            if not free[i]:
                for k in range(axes):
                    step[i, k] = 0.0
        solve(band, step.reshape(-1))
        longest = _step_length(sites, step, g, e, slope)
        longest = min(1.0, TO_BOUNDARY * longest)
        went = longest
        dual = 1.0
        for site in range(m):
            dz = -factor[site] - z[site] + z[site] / -g[site] * slope[site]
            if dz < 0.0:
                dual = min(dual, TO_BOUNDARY * -z[site] / dz)
            slope_1[site] = dz
        c += longest * step
        z += dual * slope_1
        _constraint(sites, c, g, e)
        if longest < STALLED:
            return Optimum(c, z, gap, iteration)
    return Optimum(c, z, gap, iterations)
