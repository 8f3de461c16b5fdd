"""The Newton matrix of combined_solver.py, put together span by span.

What a span adds couples its six control points: blocks (k, m) of 6 x 6 for every two columns k <= m of the
step y (n, A+1), of which those with k = m are only kept above their diagonal. They are summed for a whole
span before they go into the banded matrix.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER

STRIDE = 8  # of the rows of a block, so that it is a whole number of vectors
SQUARE = ORDER * STRIDE
CONTRACT = {"contract"}  # the compiler may multiply and add in one instruction


class Balls(NamedTuple):
    """J sites of a window (sites.py) as the interior-point method sees them: g = (|e|^2/r^2 - 1)/2 <= 0 with
    a slack s and a multiplier z each. At first they miss it, with g + s > 0."""

    span: Array  # (J,) counted from the first control point of the window, like the next of `Sites`
    weights: FloatArray  # (J, 6)
    from_target: FloatArray  # (J, A) of the curve where the step begins [mm]
    way: FloatArray  # (J, A) direction of the chord
    slide: FloatArray  # (J,)
    radius: FloatArray  # (J,) [mm]
    g: FloatArray  # (J,)
    normal: FloatArray  # (J, A): grad g = N (x) normal
    s: FloatArray  # (J,)
    z: FloatArray  # (J,)
    ds: FloatArray  # (J,) first the predicted share of s, then the step
    dz: FloatArray  # (J,)
    second: FloatArray  # (J,) what the predictor leaves out, over s
    q: FloatArray  # (J,) room
    square: FloatArray  # (J, 48) block of the weights with themselves


class SpanBlocks(NamedTuple):
    """The sum over one span, and where it goes in the banded matrix (interior_point.py) from the first row of
    the span on."""

    values: FloatArray  # (pairs of columns, 6, 8) one after the other, the last two columns of each 0
    source: Array  # (T,) places in `values`
    target: Array  # (T,) places in the matrix


@njit(cache=True, error_model="numpy")
def block_of(k, m, columns):
    """Where the block of the columns k <= m begins in `SpanBlocks.values`."""
    return (k * columns - k * (k - 1) // 2 + m - k) * SQUARE


@njit(cache=True, error_model="numpy")
def blocks_of(columns):
    """`SpanBlocks` of a step with so many columns, all 0."""
    width = ORDER * columns
    count = width * (width + 1) // 2
    source, target = np.empty(count, np.int64), np.empty(count, np.int64)
    t = 0
    for own in range(width):
        a, k = own // columns, own % columns
        for other in range(own, width):
            b, m = other // columns, other % columns
            at = block_of(k, m, columns) + a * STRIDE + b
            if k > m:
                at = block_of(m, k, columns) + b * STRIDE + a
            source[t], target[t] = at, own * width + other - own
            t += 1
    return SpanBlocks(np.zeros(columns * (columns + 1) // 2 * SQUARE), source, target)


@njit(cache=True, error_model="numpy")
def scatter(values, source, target, i, columns, band):
    """Add the `SpanBlocks` of span i to the banded matrix, and clear them."""
    flat = band.reshape(-1)
    begin = i * columns * band.shape[1]
    for t in range(len(source)):
        flat[begin + target[t]] += values[source[t]]
    values[:] = 0.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_outer(values, at, left, right, weight):
    """The block values[at :] += weight times the outer product of two vectors (6,)."""
    r0, r1, r2, r3, r4, r5 = right[0], right[1], right[2], right[3], right[4], right[5]
    for a in range(ORDER):
        value, to = weight * left[a], at + a * STRIDE
        values[to] += value * r0
        values[to + 1] += value * r1
        values[to + 2] += value * r2
        values[to + 3] += value * r3
        values[to + 4] += value * r4
        values[to + 5] += value * r5


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_square(values, at, row, weight):
    """The same of one vector with itself, the upper half only."""
    r0, r1, r2, r3, r4, r5 = row[0], row[1], row[2], row[3], row[4], row[5]
    w0, w1, w2, w3, w4 = weight * r0, weight * r1, weight * r2, weight * r3, weight * r4
    values[at] += w0 * r0
    values[at + 1] += w0 * r1
    values[at + 2] += w0 * r2
    values[at + 3] += w0 * r3
    values[at + 4] += w0 * r4
    values[at + 5] += w0 * r5
    values[at + 9] += w1 * r1
    values[at + 10] += w1 * r2
    values[at + 11] += w1 * r3
    values[at + 12] += w1 * r4
    values[at + 13] += w1 * r5
    values[at + 18] += w2 * r2
    values[at + 19] += w2 * r3
    values[at + 20] += w2 * r4
    values[at + 21] += w2 * r5
    values[at + 27] += w3 * r3
    values[at + 28] += w3 * r4
    values[at + 29] += w3 * r5
    values[at + 36] += w4 * r4
    values[at + 37] += w4 * r5
    values[at + 45] += weight * r5 * r5


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_scaled(values, at, block, weight):
    """The block values[at :] += weight times a block (48,)."""
    part = values[at : at + len(block)]
    for t in range(len(block)):
        part[t] += weight * block[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_products(basis, p, order, theta, products):
    """Into products (2, 48) the blocks of the basis functions of this order with themselves, and with theta
    (6,)."""
    for a in range(ORDER):
        for b in range(ORDER):
            of_order = basis[p, order * ORDER + a]
            products[0, a * STRIDE + b] = of_order * basis[p, order * ORDER + b]
            products[1, a * STRIDE + b] = of_order * theta[b]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_row(values, along, p, kind, weight, theta, products):
    """Add the square of a row of place p, of this kind, times its weight to `SpanBlocks`; its theta (6,) and
    `put_products`, all over its factor."""
    axes = along.shape[2]
    columns = axes + 1
    _add_square(values, block_of(axes, axes, columns), theta, weight)
    if kind < 3 * axes:
        k = kind % axes
        _add_scaled(values, block_of(k, k, columns), products[0], weight)
        _add_scaled(values, block_of(k, axes, columns), products[1], weight)
        return
    for k in range(axes):
        mine = weight * along[p, kind - 3 * axes, k]
        _add_scaled(values, block_of(k, axes, columns), products[1], mine)
        for m in range(k, axes):
            _add_scaled(values, block_of(k, m, columns), products[0], mine * along[p, kind - 3 * axes, m])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_objective(values, basis, along, p, pull, own, cost):
    """Add the objective's part of place p to `SpanBlocks`: `pull` (A,) of the squared jerks, `own` of theta
    squared, and `cost` of what the velocity has across the path, squared."""
    axes, of_place = along.shape[2], basis[p]
    columns, first, third = axes + 1, of_place[ORDER : 2 * ORDER], of_place[3 * ORDER :]
    _add_square(values, block_of(axes, axes, columns), of_place[:ORDER], own)
    for k in range(axes):
        _add_square(values, block_of(k, k, columns), third, pull[k])
        if cost == 0.0:
            continue
        _add_square(values, block_of(k, k, columns), first, cost * (1.0 - along[p, 0, k] * along[p, 0, k]))
        for m in range(k + 1, axes):
            across = -along[p, 0, k] * along[p, 0, m]
            _add_outer(values, block_of(k, m, columns), first, first, cost * across)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_balls(balls, j, i, values):
    """Add z G + z/s grad g grad g' of the sites of `Balls` from j on that are on span i, or before it, to
    `SpanBlocks`; the next j."""
    span, _, _, way, slide, radius, _, normal, slack, multiplier = balls[:10]
    axes, square = normal.shape[1], balls.square
    while j < len(span) and span[j] <= i:
        steep = multiplier[j] / slack[j]
        flat = multiplier[j] / (radius[j] * radius[j])
        loose = flat * (1.0 - slide[j] * slide[j])
        for k in range(axes):
            for m in range(k, axes):
                both = steep * normal[j, k] * normal[j, m] - loose * way[j, k] * way[j, m]
                both += flat if k == m else 0.0
                at = block_of(k, m, axes + 1)
                _add_scaled(values, at, square[j], both)
        j += 1
    return j
