"""Symmetric banded matrices: Cholesky factorisation and solution, in time linear in their size.

Row i holds the entries of the upper triangle within `width` of the diagonal, the diagonal first: band[i, d] is the entry (i, i + d).
Inner loops run along whole rows, zeros included, so that a compiler makes vector instructions of them.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit


@njit(cache=True, error_model="numpy")
def factorise(band):
    """band (n, width) becomes its factor R with R'R = band, the diagonal inverted; False where it is not positive definite."""
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
