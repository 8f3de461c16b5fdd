"""Quadratic forms of the control points: third derivatives along the path."""

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import ORDER, derivatives

# Gauss-Legendre rule of three points on [0, 1], exact for squares of third derivatives, degree 4.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, NODE_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


@njit(cache=True, error_model="numpy")
def add_third_derivatives(knots, weights, H):
    """Add the integral of the squared third derivatives times weights (A,) along one run to its bands H (A,
    n, 6)."""
    rows = np.empty((4, ORDER))
    for i in range(len(knots.breaks) - 1):
        h = knots.breaks[i + 1] - knots.breaks[i]
        for node in range(len(NODES)):
            derivatives(knots.basis[i], NODES[node], h, rows)
            for k in range(len(weights)):
                add_square(H[k], i, rows[3], weights[k] * NODE_WEIGHTS[node] * h)


@njit(cache=True, error_model="numpy")
def third_derivative_energy(knots, weights, c, first, last):
    """Integral of the squared third derivatives times weights (A,) over the spans first .. last - 1 [1/mm3],
    from the control points c (n, A) [mm] of the run."""
    cut, basis = knots
    total = 0.0
    rows = np.empty((4, ORDER))
    for i in range(first, last):
        h = cut[i + 1] - cut[i]
        for q in range(len(NODES)):
            derivatives(basis[i], NODES[q], h, rows)
            for k in range(c.shape[1]):
                value = 0.0
                for d in range(ORDER):
                    value += rows[3, d] * (c[i + d, k] - c[i, k])
                total += weights[k] * NODE_WEIGHTS[q] * h * value * value
    return total


@njit(cache=True, error_model="numpy")
def add_square(band, i, row, weight):
    """Add weight (row . c_i..i+5)^2 to a band (n, 6), so that it counts 1/2 c'Hc."""
    for b in range(ORDER):
        value = 2.0 * weight * row[b]
        for a in range(b + 1):
            band[i + b, ORDER - 1 - b + a] += value * row[a]
