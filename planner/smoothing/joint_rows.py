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


# Places at which the limits are kept: so many in each interval of the grid at least, and in each span.
PER_INTERVAL, PER_SPAN = 2, 5.0
EDGE = 0.5 - np.sqrt(3.0) / 6.0  # of them from the ends of the interval [-]: Gauss's rule of two points


SLOWER = 10.0  # how much theta counts beside jerks in the pull [-]


class Places(NamedTuple):
    """P places on a run, some inside each interval of the grid, and the motion there. Its R limits are velocity, acceleration and
    jerk of each axis, the feed, and the acceleration across the path."""

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
    """out (4, 6) = the basis functions and their time derivatives in a motion with feed, acc and jerk along the path (forms.py),
    from the derivatives by the spline's parameter, `rows` (4, 6) of the basis functions and `tangent` (3, A) of the curve; returns
    |p_u|."""
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
def _count(motion, n):
    """How many places interval n gets."""
    return max(int(np.ceil(PER_SPAN * (motion.tau[n, 1] - motion.tau[n, 0]))), PER_INTERVAL)


@njit(cache=True, error_model="numpy")
def places_of_run(knots, control, motion, bound, limits, first, last):
    """The `Places` of the grid intervals first .. last - 1 of a `SplineMotion` that is given at both ends of each; bound (I, 2) of feed
    and of acceleration across the path, limits (3, A)."""
    axes = control.shape[1]
    kinds = 3 * axes + 2
    count = 0
    for n in range(first, last):
        count += _count(motion, n)
    span, weight = np.empty(count, np.int64), np.empty(count)
    basis, jet = np.empty((count, 4, ORDER)), np.empty((count, 3, axes))
    along, limit = np.empty((count, 2, axes)), np.empty((count, kinds))
    share, least, most = np.empty((count, kinds)), np.empty((count, kinds)), np.empty((count, kinds))
    rows, tangent, unit, edge = (
        np.empty((4, ORDER)),
        np.empty((3, axes)),
        np.empty(axes),
        np.empty((4, ORDER)),
    )
    edge_jet, edge_share = np.empty((3, axes)), np.empty((2, kinds))
    edge_way, edge_limit = np.empty((2, axes)), np.empty(kinds)
    begin = 0
    for n in range(first, last):
        i, inside = motion.span[n], _count(motion, n)
        h = knots.breaks[i + 1] - knots.breaks[i]
        for side in range(inside + 2):  # the places inside, and then both ends
            at = EDGE + side * (1.0 - 2.0 * EDGE) / (inside - 1.0) if side < inside else side - inside * 1.0
            tau = motion.tau[n, 0] + at * (motion.tau[n, 1] - motion.tau[n, 0])
            v0, v1 = motion.feed[n, 0], motion.feed[n, 1]
            feed = np.sqrt(v0 * v0 + at * (v1 * v1 - v0 * v0))
            acc = motion.acc[n, 0] + at * (motion.acc[n, 1] - motion.acc[n, 0])
            derivatives(knots.basis[i], tau, h, rows)
            _products(rows, control, i, tangent)
            p, end = begin + side, side - inside
            here = basis[p] if end < 0 else edge
            speed = time_derivatives(rows, tangent, feed, acc, motion.jerk[n], here)
            for k in range(axes):
                unit[k] = tangent[0, k] / speed
            if end < 0:
                span[p], weight[p] = i, motion.duration[n] / inside
                _products(here, control, i, jet[p])
                _put_shares(jet[p], unit, acc, limits, bound[n], along[p], share[p], limit[p])
            else:
                _products(here, control, i, edge_jet)
                _put_shares(edge_jet, unit, acc, limits, bound[n], edge_way, edge_share[end], edge_limit)
        for kind in range(kinds):
            low = min(edge_share[0, kind], edge_share[1, kind])
            high = max(edge_share[0, kind], edge_share[1, kind])
            for p in range(begin, begin + inside):
                low, high = min(low, share[p, kind]), max(high, share[p, kind])
            for p in range(begin, begin + inside):
                least[p, kind], most[p, kind] = low, high
        begin += inside
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
def sideways(places, p):
    """What a square of the velocity across the path costs at a place [s3/mm2] (joint.py): where the feed is held."""
    axes = places.jet.shape[2]
    share = places.share[p, 3 * axes]
    return places.weight[p] / (share * places.limit[p, 3 * axes]) ** 2 if share > NEAR[3] else 0.0


@njit(cache=True, error_model="numpy")
def pull_of_window(places, first, last, pull, pulled, lo, band, linear):
    """Add to band and linear (n, A+1) the objective of joint.py at the places first .. last - 1; control points count from `lo`.

    pull, pulled : as there, and the jerks (A,) that it counts in
    """
    axes = len(pulled)
    blocks, where = np.zeros((axes + 1, axes + 1, SQUARE)), pattern(axes + 1)
    for p in range(first, last):
        i, basis, own = places.span[p] - lo, places.basis[p], places.weight[p]
        for k in range(axes):
            add_outer(blocks[k, k], basis[3], basis[3], pull * own / pulled[k] ** 2)
        add_outer(blocks[axes, axes], basis[0], basis[0], SLOWER * pull * own)
        cost = sideways(places, p)
        if cost > 0.0:
            for k in range(axes):
                for m in range(k, axes):
                    across = (1.0 if k == m else 0.0) - places.along[p, 0, k] * places.along[p, 0, m]
                    add_outer(blocks[k, m], basis[1], basis[1], cost * across)
        for b in range(ORDER):
            linear[i + b, axes] += own * basis[0, b]
        if p + 1 == last or places.span[p + 1] != places.span[p]:
            scatter(blocks, i, where, band)


@njit(cache=True, error_model="numpy")
def gain_of_step(places, y):
    """By how much the step y (n, A+1) shortens the time (joint.py) [s]."""
    axes = places.jet.shape[2]
    gain = 0.0
    for p in range(len(places.span)):
        i, basis = places.span[p], places.basis[p]
        theta, square, along = 0.0, 0.0, 0.0
        for b in range(ORDER):
            theta += basis[0, b] * y[i + b, axes]
        for k in range(axes):
            move = 0.0
            for b in range(ORDER):
                move += basis[1, b] * y[i + b, k]
            square += move * move
            along += move * places.along[p, 0, k]
        gain -= places.weight[p] * theta + 0.5 * sideways(places, p) * (square - along * along)
    return gain
