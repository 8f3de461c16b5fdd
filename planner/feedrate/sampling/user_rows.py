"""The user's limits on the grid: rows, how far these are from linear, where more points are needed.

A limit (machine/user_limit.py) with the bounds v, a, j on velocity, acceleration and jerk of q(s) is an axis
more to a solver: the rows q', q'', q''' with the limits a, j, and the cap feed^2 <= (v/q')^2.

* Rows between grid points leave the chord of their end values by e as those of the axes do (samples.py); an
  interval is halved until e is below the resolution, and what remains adds to its margin.
* A bound that varies is asked for at both ends and in the middle of an interval. Where it is less in the
  middle than the mean of its ends both ends get that much less; the interval is halved until that is below
  `BOUND_SHARE` resolutions, or the bound jumps: where it changes by more than `JUMP` on an interval of the
  least length, both ends have the least of the three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.corners.elements import element_point, to_arc_length
from planner.feedrate.constraints.limits import Limits
from planner.feedrate.sampling.grid import JERK_SHARE, MARGIN_SAFETY
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine.user_limit import Moving, OwnLimit, Place, bounds_at, limit_derivatives

# Of the resolution, what a bound may be less in the middle of an interval than the mean of its ends [-].
BOUND_SHARE = 5.0
JUMP = 0.3  # change of a bound across an interval, from which on the interval is halved down to `LEAST` [share of the larger]
LEAST = 1e-3  # shortest interval that is halved [mm]: what a motion does within is less than any period shows
# A quantity that is not bounded gets a bound this far beyond what the machine's axes can do [-].
BEYOND = 10.0
FAR = 4.0  # caps of feed^2 beyond so many times those of the axes are as good as none [-]


class UserRows(NamedTuple):
    """Rows of V limits at P grid points."""

    d1: FloatArray  # (P, V) q'; d2_left, d2_right, d3_left and d3_right: as those of the axes
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    # (3, V) least bounds of velocity, acceleration and jerk that were met, inf where nothing is bounded, or far beyond the axes
    least: FloatArray
    acceleration: FloatArray  # (P, V) bounds at the points, like `jerk`
    jerk: FloatArray
    feed_sq_max: FloatArray  # (P, V) what the bounds of the velocity allow; inf where nothing
    margin: FloatArray  # (P,) of the interval to the right, share of the acceleration bounds [-]
    coarse: Array  # (P,) True where that interval needs points


@njit(cache=True, error_model="numpy")
def _points(legs, corners, spans, element, w, axes):
    """(n, 4, A) position and arc-length derivatives at the parameters w (n,) of elements."""
    out = np.empty((len(w), 4, axes))
    work = np.empty((2, 4, axes))
    for i in range(len(w)):
        element_point(legs, corners, spans, element[i], w[i], w[i], work, out[i])
        to_arc_length(out[i])
    return out


def user_rows(samples: PathSamples, limits: Limits, resolution: float = np.inf) -> UserRows:
    """The rows of the limits `along`; `resolution`: how far off the chord they may be, of the limits."""
    at, axes = samples.intervals, samples.path.toolpath.axes
    middle = 0.5 * (samples.w0[at] + samples.w1[at])
    inside = _points(*samples.table, samples.element[at], middle, len(axes))
    real = _real_bounds(samples, limits, at, inside)
    motions = (
        Moving.of(axes, (samples.position, samples.d1, samples.d2_left, samples.d3_left)),
        Moving.of(axes, (samples.position, samples.d1, samples.d2_right, samples.d3_right)),
        Moving.of(axes, tuple(inside[:, k] for k in range(4))),
    )
    found = [_column(limit, samples, at, motions, real, resolution) for limit in limits.along]
    columns, errors, coarse = zip(*found, strict=True)
    margin, divided = np.zeros(len(samples)), np.zeros(len(samples), dtype=bool)
    # the middle of an interval does not tell all
    margin[at] = MARGIN_SAFETY * np.max(errors, axis=0)
    divided[at] = np.any(coarse, axis=0) & (samples.s[at + 1] - samples.s[at] > LEAST)
    stacked = (np.stack(one, axis=1) for one in zip(*columns, strict=True))
    return UserRows._make((*stacked, margin, divided))


def _real_bounds(
    samples: PathSamples, limits: Limits, at: Array, inside: FloatArray
) -> tuple[FloatArray, float, FloatArray]:
    """Generous bounds by the machine's axes at the middle of the intervals `at` (n,): feed^2 (n,), acceleration
    and jerk (n,) along them."""
    velocity, acceleration, jerk = limits.of_axes
    d1, d3 = np.abs(inside[:, 1]), np.linalg.norm(inside[:, 3], axis=1)
    curve = np.linalg.norm(inside[:, 2], axis=1)
    strong = float(np.linalg.norm(acceleration))
    with np.errstate(divide="ignore"):
        feed = np.minimum(samples.path.toolpath.feed[samples.segment[at]], (velocity / d1).min(axis=1))
        feed_sq = np.minimum(feed**2, strong / curve)
    v = np.sqrt(feed_sq)
    return feed_sq, strong, float(np.linalg.norm(jerk)) + 3.0 * curve * v * strong + d3 * v**3


def _column(
    limit: OwnLimit,
    samples: PathSamples,
    at: Array,
    motions: tuple[Moving, Moving, Moving],
    real: tuple[FloatArray, float, FloatArray],
    resolution: float,
) -> tuple[tuple[FloatArray, ...], FloatArray, Array]:
    """One limit, by the motions left and right of the points and in the middle of the intervals: the first fields of `UserRows`,
    (P,) or (3,) each; of the intervals (n,) the errors of the rows, and which need points."""
    axes, points = samples.path.toolpath.axes, len(samples)
    _, right, middle = motions
    block = samples.path.toolpath.block[samples.segment]
    here, between = (
        Place(axes, list(p.table[0].T), p.table[1], b) for p, b in ((right, block), (middle, block[at]))
    )
    q_left, q_right, q_mid = (_along(limit, p) for p in motions)
    bound, bound_mid = bounds_at(limit, here, points), bounds_at(limit, between, len(at))
    a, b = at, at + 1
    real_sq, u, real_jerk = real
    far = np.zeros(points)
    for end in (a, b):
        np.maximum.at(far, end, FAR * real_sq)
    with np.errstate(divide="ignore", over="ignore"):
        feed_sq = (bound[:, 0] / np.abs(q_right[0])) ** 2
        feed_sq_mid = (bound_mid[:, 0] / np.abs(q_mid[0])) ** 2
    least = np.minimum(bound.min(axis=0), bound_mid.min(axis=0))
    short = jump = np.zeros(len(at))
    if np.isfinite(least[0]):
        feed_sq, short, jump = _between(feed_sq, feed_sq_mid, at, far, FAR * real_sq)
    # what the intervals can be run with, for the errors of their rows
    x = np.minimum(real_sq, np.minimum(np.maximum(feed_sq[a], feed_sq[b]), feed_sq_mid))
    size, bend = np.abs(q_mid[0]), np.abs(q_mid[1])
    v = np.sqrt(x)
    third = size * real_jerk + 3.0 * bend * v * u + np.abs(q_mid[2]) * v**3
    most = [BEYOND * float(one.max(initial=1.0)) for one in (size * u + bend * x, third)]
    (acceleration, short_a, jump_a), (jerk, short_j, jump_j) = (
        _between(np.minimum(bound[:, k], beyond), np.minimum(bound_mid[:, k], beyond), at)
        for k, beyond in enumerate(most, start=1)
    )
    least = np.where(least >= [np.inf, *most], np.inf, least)
    strongest = np.minimum(np.minimum(acceleration[a], acceleration[b]), bound_mid[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.fmin(x, (strongest + size * u) / bend)
        u_of = np.fmin(u, (strongest + bend * x) / size)
    h = samples.s[b] - samples.s[a]
    error = x * np.abs(q_mid[1] - 0.5 * (q_right[1][a] + q_left[1][b]))
    error = error + 0.5 * u_of * h * np.abs(q_left[1][b] - q_right[1][a])
    error = (error + u_of * np.abs(q_mid[0] - 0.5 * (q_right[0][a] + q_right[0][b]))) / strongest
    twist = x**1.5 * np.abs(q_mid[2] - 0.5 * (q_right[2][a] + q_left[2][b])) / np.minimum(jerk[a], jerk[b])
    coarse = np.zeros(len(at), dtype=bool)
    if np.isfinite(resolution):
        coarse = (error > resolution) | (twist > JERK_SHARE * resolution)
        coarse |= np.max([short, short_a, short_j], axis=0) > BOUND_SHARE * resolution
        coarse |= np.max([jump, jump_a, jump_j], axis=0) > JUMP
    rows = (q_right[0], q_left[1], q_right[1], q_left[2], q_right[2])
    return (*rows, least, acceleration, jerk, feed_sq), error, coarse


def _along(limit: OwnLimit, moving: Moving) -> FloatArray:
    """(3, n) q', q'', q''' by the arc length; of the length of the path without rounding."""
    axes, found = moving.place.axes, limit_derivatives(limit, moving)
    if limit.value(moving.place) is None:
        whole = np.isin(axes, getattr(limit, "counts", None) or axes)
        alone = ~(np.abs(moving.table[1:, :, ~whole]) > 0.0).any(axis=(0, 2))
        found[:, alone] = [[1.0], [0.0], [0.0]]
    return found


def _between(
    bound: FloatArray,
    middle: FloatArray,
    at: Array,
    cap: FloatArray | float = np.inf,
    beyond: FloatArray | float = np.inf,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A bound (P,) kept between points, by how much it was short in the middles (n,), and how it changes. What a bound
    is above `cap` and `beyond` does not count: it cannot be reached."""
    bound = np.minimum(bound, cap)
    middle, *ends = (np.minimum(one, beyond) for one in (middle, bound[at], bound[at + 1]))
    share = np.minimum(2.0 * middle / (ends[0] + ends[1]), 1.0)
    least = np.minimum(np.minimum(*ends), middle)
    jump = 1.0 - least / np.maximum(np.maximum(*ends), middle)
    found = bound.copy()
    for side in (at, at + 1):
        np.minimum.at(found, side, np.where(jump > JUMP, least, share * bound[side]))
    return found, 1.0 - share, jump
