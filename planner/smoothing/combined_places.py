"""Places on a run at which the limits of its motion are kept (combined.py), what the motion does there, and
what a step of path and feed together minimises and gains.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER, derivatives
from planner.smoothing.combined_matrix import add_objective, blocks_of, scatter
from planner.smoothing.forms import time_derivatives

SLOWER = 10.0  # how much theta counts beside jerks in the pull [-]
HELD = 0.8  # of the programmed feed: from there on the feed is held [-]


@njit(cache=True, error_model="numpy")
def sideways(places, p):
    """The cost of a square of the velocity across the path at a place [s3/mm2] (combined.py): where the feed
    is held."""
    axes = places.jet.shape[2]
    share = places.share[p, 3 * axes]
    return places.weight[p] / (share * places.limit[p, 3 * axes]) ** 2 if share > HELD else 0.0


@njit(cache=True, error_model="numpy")
def objective_of_window(places, window, pull, pulled, band, linear):
    """Add to the matrix `band` and to linear (n, A+1) the objective of combined.py.

    window       : first and last + 1 of the places, and the control point from which they count
    pull, pulled : as there, and the jerks (A,) that it counts in
    """
    axes, (first, last, lo) = len(pulled), window
    values, source, target = blocks_of(axes + 1)
    basis, of_axes = places.basis.reshape(-1, 4 * ORDER), np.empty(axes)
    for p in range(first, last):
        time = places.weight[p]
        for k in range(axes):
            of_axes[k] = pull * time / pulled[k] ** 2
        add_objective(values, basis, places.along, p, of_axes, SLOWER * pull * time, sideways(places, p))
        i = places.span[p] - lo
        for b in range(ORDER):
            linear[i + b, axes] += time * basis[p, b]
        if p + 1 == last or places.span[p + 1] != places.span[p]:
            scatter(values, source, target, i, axes + 1, band)


@njit(cache=True, error_model="numpy")
def gain_of_step(places, y):
    """By how much the step y (n, A+1) shortens the time (combined.py) [s]."""
    axes = places.jet.shape[2]
    gain = 0.0
    for p in range(len(places.span)):
        i, basis = places.span[p], places.basis[p]
        theta, square, along = 0.0, 0.0, 0.0
        for b in range(ORDER):
            theta += basis[0, b] * y[i + b, axes]
        for k in range(axes):
            step = 0.0
            for b in range(ORDER):
                step += basis[1, b] * y[i + b, k]
            square += step * step
            along += step * places.along[p, 0, k]
        gain -= places.weight[p] * theta + 0.5 * sideways(places, p) * (square - along * along)
    return gain


NONE = 1e12  # stands for a bound that there is none of
# Places at which the limits are kept: so many in each interval of the grid at least, and in each span.
PER_INTERVAL, PER_SPAN = 2, 5.0
EDGE = 0.5 - np.sqrt(3.0) / 6.0  # of them from the ends of the interval [-]: Gauss's rule of two points


class Places(NamedTuple):
    """P places on a run, some inside each interval of the grid, and the motion there. Its R limits are
    velocity, acceleration and jerk of each axis, the feed, and the acceleration across the path."""

    span: Array  # (P,)
    weight: FloatArray  # (P,) time that each stands for [s]
    basis: FloatArray  # (P, 4, 6) basis functions of the span, and their first three time derivatives along the motion
    jet: FloatArray  # (P, 3, A) velocity, acceleration and jerk of the axes
    along: FloatArray  # (P, 2, A) directions of the velocity and of the acceleration across it
    share: FloatArray  # (P, R) of its limit that the motion uses
    least: FloatArray  # (P, R) smallest share in the interval, at its ends or inside
    most: FloatArray  # (P, R) and the largest
    limit: FloatArray  # (P, R)


@njit(cache=True, error_model="numpy")
def _put_shares(jet, tangent, acc, limits, bound, along, share, limit):
    """Directions along (2, A), shares (R,) and limits (R,) of a place with `jet` (3, A), the curve's tangent
    (A,) of length 1, and acc along the path; limits (3, A), bound (2,) of feed and of acceleration across the
    path."""
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
    """The `Places` of the grid intervals first .. last - 1 of a `SplineMotion` that is given at both ends of
    each; bound (I, 2) of feed and of acceleration across the path, limits (3, A)."""
    axes = control.shape[1]
    kinds = 3 * axes + 2
    count = 0
    for n in range(first, last):
        count += _count(motion, n)
    span, weight = np.empty(count, np.int64), np.empty(count)
    basis, jet = np.empty((count, 4, ORDER)), np.empty((count, 3, axes))
    along, limit = np.empty((count, 2, axes)), np.empty((count, kinds))
    share, least, most = np.empty((count, kinds)), np.empty((count, kinds)), np.empty((count, kinds))
    rows, edge = np.empty((4, ORDER)), np.empty((4, ORDER))
    tangent, unit = np.empty((3, axes)), np.empty(axes)
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
