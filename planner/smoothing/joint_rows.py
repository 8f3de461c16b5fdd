"""Limits of a motion along a spline, linear in its control points and in its time (joint.py): their rows, and what is done with them.

A row depends on the six control points of a span: of one axis and of theta, or of all axes and theta.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER, derivatives
from planner.smoothing.joint_matrix import EVERY, SQUARE, add_outer, pattern, scatter

NONE = 1e12  # stands for a bound that there is none of
# Rows of which the motion uses less than this share are left out [-]: velocities of the axes, accelerations, jerks, and the last two of
# `Places.bound`. All rows cost three times as much, and eight rounds on the bracket end at the same time to 1e-4; without the jerks
# below 0.4 they end 1e-3 later.
NEAR = np.array([0.8, 0.6, 0.2, 0.8])


class Places(NamedTuple):
    """P places on a run, two inside each interval of the grid, and the motion there. Its R limits are velocity, acceleration and jerk of
    each axis, the feed, and the acceleration across the path."""

    span: Array  # (P,)
    weight: FloatArray  # (P,) time that each stands for [s]
    basis: FloatArray  # (P, 4, 6) basis functions of the span, and their first three time derivatives along the motion
    jet: FloatArray  # (P, 3, A) velocity, acceleration and jerk of the axes
    along: FloatArray  # (P, 2, A) directions of the velocity and of the acceleration across it
    share: FloatArray  # (P, R) of its limit that the motion uses
    least: FloatArray  # (P, R) smallest share in the interval, at its ends or inside
    most: FloatArray  # (P, R) and the largest
    limit: FloatArray  # (P, R)


class Rows(NamedTuple):
    """R rows of a window, ascending by their spans."""

    span: Array  # (R,) counted from the first control point of the window
    axis: Array  # (R,) the axis, or EVERY
    factor: FloatArray  # (R, A+1, 6) of each control point; for one axis only its own and the last, those of theta
    lower: FloatArray  # (R,) how far the row may go down: what the limit leaves in the interval of the grid
    upper: FloatArray  # (R,) and up


@njit(cache=True, error_model="numpy")
def time_derivatives(rows, tangent, feed, acc, jerk, out):
    """out (4, 6) = the basis functions and their time derivatives, from their derivatives `rows` (4, 6) and those of the curve `tangent`
    (3, A) by the spline's parameter, for a motion with feed, acc and jerk along the path (forms.py); returns the speed of the curve."""
    square, along2, along3, bend = 0.0, 0.0, 0.0, 0.0
    for k in range(tangent.shape[1]):
        square += tangent[0, k] * tangent[0, k]
        along2 += tangent[0, k] * tangent[1, k]
        along3 += tangent[0, k] * tangent[2, k]
        bend += tangent[1, k] * tangent[1, k]
    speed = np.sqrt(square)
    grows = along2 / speed  # d|p'|/du, and then its derivative
    grows2 = along3 / speed + (bend - grows * grows) / speed
    du = feed / speed
    ddu = (acc - grows * du * du) / speed
    dddu = (jerk - grows2 * du * du * du - 3.0 * grows * du * ddu) / speed
    for b in range(ORDER):
        out[0, b] = rows[0, b]
        out[1, b] = rows[1, b] * du
        out[2, b] = rows[2, b] * du * du + rows[1, b] * ddu
        out[3, b] = rows[3, b] * du * du * du + 3.0 * rows[2, b] * du * ddu + rows[1, b] * dddu
    return speed


@njit(cache=True, error_model="numpy")
def _put_shares(jet, tangent, acc, limits, bound, along, share, limit):
    """Directions along (2, A), shares (R,) and limits (R,) of a place with `jet` (3, A), the curve's tangent (A,) of length 1, and acc
    along the path; limits (3, A), bound (2,) of feed and of acceleration across the path."""
    axes = len(tangent)
    feed, across = 0.0, 0.0
    for k in range(axes):
        for m in range(3):
            limit[m * axes + k] = limits[m, k]
            share[m * axes + k] = jet[m, k] / limits[m, k]
        along[0, k] = tangent[k]
        along[1, k] = jet[1, k] - acc * tangent[k]
        feed += tangent[k] * jet[0, k]
        across += along[1, k] * along[1, k]
    across = np.sqrt(across)
    for k in range(axes):
        along[1, k] /= max(across, 1.0 / NONE)
    limit[3 * axes], limit[3 * axes + 1] = bound
    share[3 * axes], share[3 * axes + 1] = feed / bound[0], across / bound[1]


@njit(cache=True, error_model="numpy")
def places_of_run(knots, control, motion, bound, limits, first, last):
    """The `Places` of the grid intervals first .. last - 1 of a `SplineMotion` that has four places for each, both ends and what
    counts inside; bound (I, 2) of feed and of acceleration across the path, limits (3, A)."""
    axes, seen = control.shape[1], motion.tau.shape[1]
    kinds = 3 * axes + 2
    inside = seen - 2
    count = inside * (last - first)
    span, weight = np.empty(count, np.int64), np.empty(count)
    basis, jet = np.empty((count, 4, ORDER)), np.empty((count, 3, axes))
    along, limit = np.empty((count, 2, axes)), np.empty((count, kinds))
    share, least, most = np.empty((count, kinds)), np.empty((count, kinds)), np.empty((count, kinds))
    rows, tangent, unit, here = (
        np.empty((4, ORDER)),
        np.empty((3, axes)),
        np.empty(axes),
        np.empty((seen, 4, ORDER)),
    )
    jets, shares, ways = np.empty((seen, 3, axes)), np.empty((seen, kinds)), np.empty((seen, 2, axes))
    limit_here = np.empty(kinds)
    for n in range(first, last):
        i = motion.span[n]
        for side in range(seen):
            derivatives(knots.basis[i], motion.tau[n, side], knots.breaks[i + 1] - knots.breaks[i], rows)
            _products(rows, control, i, tangent)
            acc = motion.acc[n, side]
            speed = time_derivatives(rows, tangent, motion.feed[n, side], acc, motion.jerk[n], here[side])
            _products(here[side], control, i, jets[side])
            for k in range(axes):
                unit[k] = tangent[0, k] / speed
            _put_shares(jets[side], unit, acc, limits, bound[n], ways[side], shares[side], limit_here)
        for side in range(1, seen - 1):
            p = inside * (n - first) + side - 1
            span[p], weight[p] = i, motion.duration[n] / inside
            basis[p], jet[p], along[p] = here[side], jets[side], ways[side]
            share[p], limit[p] = shares[side], limit_here
            for kind in range(kinds):
                low = high = shares[0, kind]
                for other in range(1, seen):
                    low, high = min(low, shares[other, kind]), max(high, shares[other, kind])
                least[p, kind], most[p, kind] = low, high
    return Places(span, weight, basis, jet, along, share, least, most, limit)


@njit(cache=True, error_model="numpy")
def _products(rows, control, i, out):
    """out (3, A) = the last three of `rows` (4, 6) times the control points of span i."""
    for m in range(3):
        for k in range(control.shape[1]):
            out[m, k] = 0.0
            for b in range(ORDER):
                out[m, k] += rows[m + 1, b] * control[i + b, k]


@njit(cache=True, error_model="numpy")
def _put_row(places, p, kind, factor):
    """Row `kind` of a place into factor (A+1, 6) (joint.py)."""
    axes = places.jet.shape[2]
    basis, jet, limit = places.basis[p], places.jet[p], places.limit[p, kind]
    factor[:] = 0.0
    if kind >= 3 * axes:
        m = kind - 3 * axes
        for b in range(ORDER):
            for k in range(axes):
                factor[k, b] = places.along[p, m, k] * basis[m + 1, b] / limit
            factor[axes, b] = -(m + 1.0) * places.share[p, kind] * basis[0, b]
        return
    m, k = kind // axes, kind % axes
    for b in range(ORDER):
        slower = jet[0, k] * basis[m, b]
        if m == 1:
            slower += 2.0 * jet[1, k] * basis[0, b]
        elif m == 2:
            slower += 3.0 * jet[1, k] * basis[1, b] + 3.0 * jet[2, k] * basis[0, b]
        factor[k, b], factor[axes, b] = basis[m + 1, b] / limit, -slower / limit


@njit(cache=True, error_model="numpy")
def rows_of_window(places, first, last, lo):
    """The `Rows` of the places first .. last - 1 of which the motion uses more than `NEAR`; control points count from `lo`."""
    axes, kinds = places.jet.shape[2], places.share.shape[1]
    used = np.zeros((last - first, kinds), np.bool_)
    for kind in range(kinds):
        near = NEAR[min(kind // axes, len(NEAR) - 1)]
        for p in range(first, last):
            used[p - first, kind] = max(places.most[p, kind], -places.least[p, kind]) > near
    count = used.sum()
    span, axis = np.empty(count, np.int64), np.empty(count, np.int64)
    factor, lower, upper = np.empty((count, axes + 1, ORDER)), np.empty(count), np.empty(count)
    r = 0
    for p in range(first, last):
        for kind in range(kinds):
            if not used[p - first, kind]:
                continue
            span[r], axis[r] = places.span[p] - lo, kind % axes if kind < 3 * axes else EVERY
            _put_row(places, p, kind, factor[r])
            lower[r] = max(1.0 + places.least[p, kind], 0.0)
            upper[r] = max(1.0 - places.most[p, kind], 0.0)
            r += 1
    return Rows(span, axis, factor, lower, upper)


@njit(cache=True, error_model="numpy")
def row_values(rows, y, out):
    """out (R,) = rows times the step y (n, A+1)."""
    axes = y.shape[1] - 1
    turned = y.T.copy()
    for r in range(len(out)):
        i, k, factor = rows.span[r], rows.axis[r], rows.factor[r]
        total = 0.0
        for b in range(ORDER):
            total += factor[axes, b] * turned[axes, i + b]
        if k != EVERY:
            for b in range(ORDER):
                total += factor[k, b] * turned[k, i + b]
        else:
            for m in range(axes):
                for b in range(ORDER):
                    total += factor[m, b] * turned[m, i + b]
        out[r] = total


@njit(cache=True, error_model="numpy")
def add_rows(rows, q, out):
    """out (n, A+1) += rows, each times its q (R,)."""
    n, axes = out.shape[0], out.shape[1] - 1
    turned = np.zeros((axes + 1, n))
    for r in range(len(q)):
        i, k, factor = rows.span[r], rows.axis[r], rows.factor[r]
        for b in range(ORDER):
            turned[axes, i + b] += factor[axes, b] * q[r]
        if k != EVERY:
            for b in range(ORDER):
                turned[k, i + b] += factor[k, b] * q[r]
        else:
            for m in range(axes):
                for b in range(ORDER):
                    turned[m, i + b] += factor[m, b] * q[r]
    for i in range(n):
        for k in range(axes + 1):
            out[i, k] += turned[k, i]


@njit(cache=True, error_model="numpy")
def pull_of_window(places, first, last, pulled, slower, lo, band, linear):
    """Add to band the pull of the places first .. last - 1, slower theta^2 + sum of the squared changes of the jerks over `pulled`
    (A,), each times the time of the place, and to linear (n, A+1) the time itself; control points count from `lo`."""
    axes = len(pulled)
    blocks, where = np.zeros((axes + 1, axes + 1, SQUARE)), pattern(axes + 1)
    for p in range(first, last):
        i, basis, own = places.span[p] - lo, places.basis[p], places.weight[p]
        for k in range(axes):
            add_outer(blocks[k, k], basis[3], basis[3], own / pulled[k] ** 2)
        add_outer(blocks[axes, axes], basis[0], basis[0], slower * own)
        for b in range(ORDER):
            linear[i + b, axes] += own * basis[0, b]
        if p + 1 == last or places.span[p + 1] != places.span[p]:
            scatter(blocks, i, where, band)
