"""Symmetric banded matrices: Cholesky factorisation and solution, in time linear in their size.

Row i holds the entries of the lower triangle within `width` of the diagonal, the diagonal last: band[i, width - 1 - d] is the
entry (i, i - d).
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def factorise(band):
    """band (n, width) becomes its Cholesky factor, the diagonal inverted; False where it is not positive definite."""
    n, width = band.shape
    for i in range(n):
        first = max(i - width + 1, 0)
        row = band[i]
        for j in range(first, i):
            other = band[j]
            begin = max(first, j - width + 1)
            shift_i, shift_j = width - 1 - i, width - 1 - j
            total = row[shift_i + j]
            for k in range(begin, j):
                total -= row[shift_i + k] * other[shift_j + k]
            row[shift_i + j] = total * other[width - 1]
        total = row[width - 1]
        for k in range(width - 1 - (i - first), width - 1):
            total -= row[k] * row[k]
        if not total > 0.0:
            return False
        row[width - 1] = 1.0 / np.sqrt(total)
    return True


@njit(cache=True, error_model="numpy")
def solve(band, x):
    """x (n,) becomes the solution for the right-hand side x, with the factor of `factorise`."""
    n, width = band.shape
    for i in range(n):
        total = x[i]
        for d in range(1, min(i, width - 1) + 1):
            total -= band[i, width - 1 - d] * x[i - d]
        x[i] = total * band[i, width - 1]
    for i in range(n - 1, -1, -1):
        x[i] *= band[i, width - 1]
        value = x[i]
        for d in range(1, min(i, width - 1) + 1):
            x[i - d] -= band[i, width - 1 - d] * value
