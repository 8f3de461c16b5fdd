"""The Newton matrix of joint_solver.py, put together span by span.

What a span adds couples its six control points: blocks (k, m) of 6 x 6 for every two columns k <= m of the step y (n, A+1). They are
summed for a whole span before they go into the banded matrix.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import ORDER

EVERY = -1  # axis of a row that depends on all axes
SQUARE = ORDER * ORDER


@njit(cache=True, error_model="numpy")
def pattern(columns):
    """Where the entries of the blocks (columns, columns, 36) of one span go: their places (T,) in the blocks and (T,) in the banded
    matrix (banded.py) from the first row of the span on."""
    width = ORDER * columns
    count = width * (width + 1) // 2
    source, target = np.empty(count, np.int64), np.empty(count, np.int64)
    t = 0
    for own in range(width):
        a, k = own // columns, own % columns
        for other in range(own, width):
            b, m = other // columns, other % columns
            block = (k * columns + m) * SQUARE + a * ORDER + b
            if k > m:
                block = (m * columns + k) * SQUARE + b * ORDER + a
            source[t], target[t] = block, own * width + other - own
            t += 1
    return source, target


@njit(cache=True, error_model="numpy")
def scatter(blocks, i, where, band):
    """Add the blocks (columns, columns, 36) of span i to the banded matrix, and clear them."""
    source, target = where
    columns = blocks.shape[0]
    flat, values = band.reshape(-1), blocks.reshape(-1)
    begin = i * columns * band.shape[1]
    for t in range(len(source)):
        flat[begin + target[t]] += values[source[t]]
    values[:] = 0.0


@njit(cache=True, error_model="numpy")
def add_outer(block, left, right, weight):
    """block (36,) += weight left right' of two vectors (6,)."""
    r0, r1, r2, r3, r4, r5 = right[0], right[1], right[2], right[3], right[4], right[5]
    for a in range(ORDER):  # without a loop over b: nothing is read twice, and vector instructions do it
        value, at = weight * left[a], a * ORDER
        block[at] += value * r0
        block[at + 1] += value * r1
        block[at + 2] += value * r2
        block[at + 3] += value * r3
        block[at + 4] += value * r4
        block[at + 5] += value * r5


@njit(cache=True, error_model="numpy")
def _add_row(blocks, axis, factor, weight):
    """Add weight row row' of a row with `factor` (A+1, 6)."""
    last = factor.shape[0] - 1
    if axis != EVERY:
        add_outer(blocks[axis, axis], factor[axis], factor[axis], weight)
        add_outer(blocks[axis, last], factor[axis], factor[last], weight)
        add_outer(blocks[last, last], factor[last], factor[last], weight)
        return
    for k in range(last + 1):
        for m in range(k, last + 1):
            add_outer(blocks[k, m], factor[k], factor[m], weight)


@njit(cache=True, error_model="numpy")
def _add_site(blocks, sites, j, normal, z, ratio, square):
    """Add z G + ratio grad g grad g' of site j (joint_solver.py), `normal` (A,) as there; square (36,) is overwritten."""
    axes = len(normal)
    flat = z / (sites.radius[j] * sites.radius[j])
    loose = flat * (1.0 - sites.slide[j] * sites.slide[j])
    for a in range(ORDER):
        for b in range(ORDER):
            square[a * ORDER + b] = sites.weights[j, a] * sites.weights[j, b]
    for k in range(axes):
        for m in range(k, axes):
            value = ratio * normal[k] * normal[m] - loose * sites.along[j, k] * sites.along[j, m]
            value += flat if k == m else 0.0
            for t in range(SQUARE):
                blocks[k, m, t] += value * square[t]


@njit(cache=True, error_model="numpy")
def add_constraints(rows, weight, sites, normal, z, ratio, where, band):
    """band += the sum of weight (R,) row row' and of z G + ratio grad g grad g' of the sites (J,); `normal` (J, A), `where` from
    `pattern`."""
    columns = rows.factor.shape[1]
    blocks, square = np.zeros((columns, columns, SQUARE)), np.empty(SQUARE)
    r, j, R, J = 0, 0, len(weight), len(z)
    while r < R or j < J:
        span = rows.span[r] if r < R else sites.span[j]
        if j < J:
            span = min(span, sites.span[j])
        while r < R and rows.span[r] == span:
            _add_row(blocks, rows.axis[r], rows.factor[r], weight[r])
            r += 1
        while j < J and sites.span[j] == span:
            _add_site(blocks, sites, j, normal[j], z[j], ratio[j], square)
            j += 1
        scatter(blocks, span, where, band)
