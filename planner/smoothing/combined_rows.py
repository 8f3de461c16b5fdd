"""Limits of a motion along a spline, linear in its control points and in its time (combined.py): the rows of
combined_solver.py.

A row is a number times what one axis does at a place, or what happens along or across the path there (a
kind), plus three numbers times theta and its derivatives. `weigh`, `predict` and `move` are the three passes
of an iteration over all rows. With both slacks s and multipliers z of a row, value + s = upper and s - value
= lower up to what is missing, they are those of Mehrotra (1992):

    ds = -missing -+ slope,      dz = (aim - ds_predicted dz_predicted - z ds)/s - z.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER
from planner.smoothing.combined_matrix import (
    CONTRACT,
    SQUARE,
    add_balls,
    add_row,
    blocks_of,
    put_products,
    scatter,
)

# Rows of which the motion uses less than this share are left out [-]: velocities of the axes, accelerations,
# jerks, and the last two of `Places.bound`. Others do not become active in a step.
NEAR = np.array([0.8, 0.6, 0.2, 0.8])
LEAST_SLACK = 0.05  # of a start [-]

OWN, T0, T1, T2, LOWER, UPPER = range(6)  # columns of `Rows.factor`
VALUE, SLOPE, S_UP, Z_UP, S_LOW, Z_LOW, DS_UP, DZ_UP, DS_LOW, DZ_LOW = range(10)  # columns of a state


class Rows(NamedTuple):
    """R rows of the P places of a window, those of place p are first[p] : first[p+1]."""

    first: Array  # (P+1,)
    span: Array  # (P,) counted from the first control point of the window
    basis: FloatArray  # (P, 24) and
    along: FloatArray  # (P, 2, A) of `Places`
    kind: Array  # (R,) velocity, acceleration and jerk of each axis, velocity along the path, acceleration across
    factor: (
        FloatArray  # (R, 6) of the kind, of theta and its derivatives; how far the row may go down, and up
    )
    theta: FloatArray  # (R, 6) what the row has of theta's control points, over its first factor
    products: FloatArray  # (R, 2, 48) `put_products`


class RowState(NamedTuple):
    """Where an iteration is."""

    sides: FloatArray  # (R, 10) value, slope, and slack, multiplier and their steps of the upper and of the lower side
    moves: FloatArray  # (P, K + 3) for `_put_moves`
    force: FloatArray  # (P, K + 3) zeros, for `_add_forces`
    force_too: FloatArray  # (P, K + 3) likewise


@njit(cache=True, error_model="numpy")
def rows_of_window(places, first, last, lo):
    """The `Rows` of the places first .. last - 1 of which the motion uses more than `NEAR`; control points
    count from `lo`."""
    axes, kinds = places.jet.shape[2], places.share.shape[1]
    begin, kind = np.zeros(last - first + 1, np.int64), np.empty((last - first) * kinds, np.int64)
    factor = np.empty((len(kind), 6))
    span = np.empty(last - first, np.int64)
    r = 0
    for p in range(first, last):
        for own in range(kinds):
            least, most = places.least[p, own], places.most[p, own]
            if max(most, -least) > NEAR[min(own // axes, 3)]:
                kind[r], factor[r, LOWER], factor[r, UPPER] = own, max(1.0 + least, 0.0), max(1.0 - most, 0.0)
                _put_row(places, p, own, factor[r])
                r += 1
        begin[p - first + 1], span[p - first] = r, places.span[p] - lo
    basis, kind, factor = places.basis.reshape(-1, 4 * ORDER)[first:last], kind[:r].copy(), factor[:r].copy()
    theta, products = np.empty((r, ORDER)), np.zeros((r, 2, SQUARE))
    for p in range(last - first):
        for r in range(begin[p], begin[p + 1]):
            for b in range(ORDER):
                of_theta = factor[r, T0] * basis[p, b] + factor[r, T1] * basis[p, ORDER + b]
                theta[r, b] = (of_theta + factor[r, T2] * basis[p, 2 * ORDER + b]) / factor[r, OWN]
            way = kind[r] - 3 * axes
            put_products(basis, p, (way if way >= 0 else kind[r] // axes) + 1, theta[r], products[r])
    return Rows(begin, span, basis, places.along[first:last], kind, factor, theta, products)


@njit(cache=True, error_model="numpy")
def _put_row(places, p, kind, factor):
    """Row `kind` of a place into the first four of factor (6,) (combined.py)."""
    axes = places.jet.shape[2]
    jet, limit = places.jet[p], places.limit[p, kind]
    m, k = kind // axes, kind % axes
    factor[OWN], factor[T1], factor[T2] = 1.0 / limit, 0.0, 0.0
    if kind >= 3 * axes:
        factor[T0] = -(kind - 3 * axes + 1.0) * places.share[p, kind]
    elif m == 0:
        factor[T0] = -jet[0, k] / limit
    elif m == 1:
        factor[T0], factor[T1] = -2.0 * jet[1, k] / limit, -jet[0, k] / limit
    else:
        factor[T0], factor[T1] = -3.0 * jet[2, k] / limit, -3.0 * jet[1, k] / limit
        factor[T2] = -jet[0, k] / limit


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_moves(span, basis, along, y, moves):
    """The step y (n, A+1) at the places (P,) of `Rows`, into moves (P, K + 3): all kinds of rows, and theta
    with its derivatives."""
    axes = along.shape[2]
    at = 3 * axes
    for p in range(len(span)):
        i = span[p]
        t0, t1, t2, feed, across = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(axes):
            d1, d2, d3 = 0.0, 0.0, 0.0
            for b in range(ORDER):
                value = y[i + b, k]
                d1 += basis[p, ORDER + b] * value
                d2 += basis[p, 2 * ORDER + b] * value
                d3 += basis[p, 3 * ORDER + b] * value
            moves[p, k], moves[p, axes + k], moves[p, 2 * axes + k] = d1, d2, d3
            feed += along[p, 0, k] * d1
            across += along[p, 1, k] * d2
        for b in range(ORDER):
            value = y[i + b, axes]
            t0 += basis[p, b] * value
            t1 += basis[p, ORDER + b] * value
            t2 += basis[p, 2 * ORDER + b] * value
        moves[p, at], moves[p, at + 1] = feed, across
        moves[p, at + 2], moves[p, at + 3], moves[p, at + 4] = t0, t1, t2


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_forces(span, basis, along, force, out):
    """out (n, A+1) += the derivative by the step of the sum of force (P, K + 3) times `_put_moves`; the force
    becomes 0."""
    axes = along.shape[2]
    at = 3 * axes
    for p in range(len(span)):
        i = span[p]
        feed, across = force[p, at], force[p, at + 1]
        t0, t1, t2 = force[p, at + 2], force[p, at + 3], force[p, at + 4]
        for k in range(axes):
            d1, d2, d3 = (
                force[p, k] + feed * along[p, 0, k],
                force[p, axes + k] + across * along[p, 1, k],
                force[p, 2 * axes + k],
            )
            for b in range(ORDER):
                out[i + b, k] += (
                    d1 * basis[p, ORDER + b] + d2 * basis[p, 2 * ORDER + b] + d3 * basis[p, 3 * ORDER + b]
                )
        for b in range(ORDER):
            out[i + b, axes] += t0 * basis[p, b] + t1 * basis[p, ORDER + b] + t2 * basis[p, 2 * ORDER + b]
    force[:] = 0.0


@njit(cache=True, error_model="numpy")
def first_state(rows, y, product):
    """The `RowState` at the step y (n, A+1): slacks that are at least `LEAST_SLACK`, and multipliers with
    this product with them."""
    factor, kinds, P = rows.factor, 3 * rows.along.shape[2] + 2, len(rows.span)
    sides, moves = np.zeros((len(factor), 10)), np.empty((P, kinds + 3))
    _put_moves(rows.span, rows.basis, rows.along, y, moves)
    for p in range(P):
        for r in range(rows.first[p], rows.first[p + 1]):
            value = factor[r, OWN] * moves[p, rows.kind[r]]
            for m in range(3):
                value += factor[r, T0 + m] * moves[p, kinds + m]
            up, low = max(factor[r, UPPER] - value, LEAST_SLACK), max(factor[r, LOWER] + value, LEAST_SLACK)
            sides[r, VALUE], sides[r, S_UP], sides[r, S_LOW] = value, up, low
            sides[r, Z_UP], sides[r, Z_LOW] = product / up, product / low
    return RowState(sides, moves, np.zeros((P, kinds + 3)), np.zeros((P, kinds + 3)))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def weigh(rows, state, lengths, balls, band, residual, push):
    """Take the last step, of `lengths` of slacks and of multipliers; then add rows and the sites of `balls`
    (combined_solver.py) to the matrix `band`, and the rows to `residual` (n, A+1), what multipliers pull, and
    to `push`, what drives a step without a barrier. Returns sum(s z) and the most that is missing."""
    first, span, basis, along, kinds_of, factor, theta, products = rows
    sides, _, pull, ahead = state
    (primal, dual), axes = lengths, along.shape[2]
    kinds = 3 * axes + 2
    total, missed, j = 0.0, 0.0, 0
    values, source, target = blocks_of(axes + 1)
    for p in range(len(span)):
        for r in range(first[p], first[p + 1]):
            value = sides[r, VALUE] + primal * sides[r, SLOPE]
            up, low = sides[r, S_UP] + primal * sides[r, DS_UP], sides[r, S_LOW] + primal * sides[r, DS_LOW]
            z_up, z_low = sides[r, Z_UP] + dual * sides[r, DZ_UP], sides[r, Z_LOW] + dual * sides[r, DZ_LOW]
            sides[r, VALUE], sides[r, S_UP], sides[r, S_LOW] = value, up, low
            sides[r, Z_UP], sides[r, Z_LOW] = z_up, z_low
            miss_up, miss_low = value + up - factor[r, UPPER], low - value - factor[r, LOWER]
            total += up * z_up + low * z_low
            missed = max(missed, max(miss_up, miss_low))
            per_up, per_low = z_up / up, z_low / low
            kind, weight = kinds_of[r], per_up + per_low
            q, q_ahead = z_up - z_low, per_low * miss_low - per_up * miss_up
            add_row(values, along, p, kind, weight * factor[r, OWN] ** 2, theta[r], products[r])
            pull[p, kind], ahead[p, kind] = q * factor[r, OWN], q_ahead * factor[r, OWN]
            for m in range(3):
                pull[p, kinds + m] += q * factor[r, T0 + m]
                ahead[p, kinds + m] += q_ahead * factor[r, T0 + m]
        if p + 1 == len(span) or span[p + 1] != span[p]:
            j = add_balls(balls, j, span[p], values)
            scatter(values, source, target, span[p], axes + 1, band)
    _add_forces(span, basis, along, pull, residual)
    _add_forces(span, basis, along, ahead, push)
    return total, missed


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def predict(rows, state, step, barrier, bent, seen):
    """The predictor's `step` (n, A+1): into `barrier` and `bent` (n, A+1) the forces of a barrier of 1 and of
    the terms of second order, into seen (5,) of all constraints the smallest and the largest share of a slack
    that the step adds, the sums of s z, of it times the share, and times its square."""
    first, span, basis, along, kinds_of, factor = rows[:6]
    sides, moves, of_barrier, of_bent = state
    kinds = 3 * along.shape[2] + 2
    least, most, plain, once, twice = seen[0], seen[1], seen[2], seen[3], seen[4]
    _put_moves(span, basis, along, step, moves)
    for p in range(len(span)):
        for r in range(first[p], first[p + 1]):
            kind = kinds_of[r]
            slope = factor[r, OWN] * moves[p, kind]
            for m in range(3):
                slope += factor[r, T0 + m] * moves[p, kinds + m]
            value, up, low = sides[r, VALUE], sides[r, S_UP], sides[r, S_LOW]
            z_up, z_low = sides[r, Z_UP], sides[r, Z_LOW]
            inverse = 1.0 / (up * low)
            per_up, per_low = inverse * low, inverse * up
            share = (factor[r, UPPER] - value - up - slope) * per_up
            share_low = (factor[r, LOWER] + value - low + slope) * per_low
            sides[r, DS_UP], sides[r, DS_LOW] = share, share_low
            least, most = min(least, min(share, share_low)), max(most, max(share, share_low))
            gap, gap_low = up * z_up, low * z_low
            plain += gap + gap_low
            once += gap * share + gap_low * share_low
            twice += gap * share * share + gap_low * share_low * share_low
            q = per_low - per_up
            second = z_low * share_low * (1.0 + share_low) - z_up * share * (1.0 + share)
            of_barrier[p, kind], of_bent[p, kind] = q * factor[r, OWN], second * factor[r, OWN]
            for m in range(3):
                of_barrier[p, kinds + m] += q * factor[r, T0 + m]
                of_bent[p, kinds + m] += second * factor[r, T0 + m]
    _add_forces(span, basis, along, of_barrier, barrier)
    _add_forces(span, basis, along, of_bent, bent)
    seen[0], seen[1], seen[2], seen[3], seen[4] = least, most, plain, once, twice


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def move(rows, state, step, aim):
    """The corrector's `step` (n, A+1) to s z = aim for slacks and multipliers, into the state; the largest
    share of slacks, and of multipliers, that it takes away."""
    first, span, basis, along, kinds_of, factor = rows[:6]
    sides, moves, _, _ = state
    kinds = 3 * along.shape[2] + 2
    most, most_dual = 0.0, 0.0
    _put_moves(span, basis, along, step, moves)
    for p in range(len(span)):
        for r in range(first[p], first[p + 1]):
            slope = factor[r, OWN] * moves[p, kinds_of[r]]
            for m in range(3):
                slope += factor[r, T0 + m] * moves[p, kinds + m]
            value, up, low = sides[r, VALUE], sides[r, S_UP], sides[r, S_LOW]
            z_up, z_low = sides[r, Z_UP], sides[r, Z_LOW]
            inverse = 1.0 / (up * low)
            per_up, per_low = inverse * low, inverse * up
            ds, ds_low = factor[r, UPPER] - value - up - slope, factor[r, LOWER] + value - low + slope
            share, share_low = sides[r, DS_UP], sides[r, DS_LOW]
            dz = (aim - z_up * ds) * per_up + z_up * share * (1.0 + share) - z_up
            dz_low = (aim - z_low * ds_low) * per_low + z_low * share_low * (1.0 + share_low) - z_low
            sides[r, SLOPE], sides[r, DS_UP], sides[r, DZ_UP] = slope, ds, dz
            sides[r, DS_LOW], sides[r, DZ_LOW] = ds_low, dz_low
            most = max(most, max(-ds * per_up, -ds_low * per_low))
            most_dual = max(most_dual, max(-dz / z_up, -dz_low / z_low))
    return most, most_dual
