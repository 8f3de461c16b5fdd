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

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.corners.elements import element_point, to_arc_length
from planner.feedrate.constraints.limits import Limits
from planner.feedrate.sampling.grid import JERK_SHARE, MARGIN_SAFETY
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine.user_limit import OwnLimit, Place, bounds_at, limit_derivatives

# Of the resolution, what a bound may be less in the middle of an interval than the mean of its ends [-].
BOUND_SHARE = 5.0
JUMP = 0.3  # change of a bound across an interval, from which on the interval is halved down to `LEAST` [share of the larger]
LEAST = 1e-3  # shortest interval that is halved [mm]: what a motion does within is less than any period shows
# A quantity that is not bounded gets a bound this far beyond what the machine's axes can do [-].
BEYOND = 10.0
FAR = 4.0  # caps of feed^2 beyond so many times those of the axes are as good as none [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class _Rows:
    """What the grid has of a limit at P points, each (P,), or of V limits side by side, each (P, V)."""

    d1: FloatArray  # q'
    # d2_left, d2_right, d3_left and d3_right: as those of the axes
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    # (3,) or (3, V) least bounds of velocity, acceleration and jerk that were met, inf where nothing is bounded, or far beyond the axes
    least: FloatArray
    # acceleration and jerk: bounds at the points
    acceleration: FloatArray
    jerk: FloatArray
    feed_sq_max: FloatArray  # what the bounds of the velocity allow; inf where nothing


@dataclass(frozen=True, eq=False, kw_only=True)
class UserRows(_Rows):
    """Rows of V limits at P grid points."""

    names: tuple[str, ...]  # of the limits
    error: FloatArray  # (P,) of the interval to the right, share of the acceleration bounds [-]
    coarse: Array  # (P,) True where that interval needs points

    @property
    def margin(self) -> FloatArray:
        """(P,) of the interval to the right, with what the middle does not tell [-]."""
        return MARGIN_SAFETY * self.error


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
    axes = samples.path.toolpath.axes
    at = samples.intervals
    middle = 0.5 * (samples.w0[at] + samples.w1[at])
    inside = _points(*samples.table, samples.element[at], middle, len(axes))
    real = _real_bounds(samples, limits, at, inside)
    columns = [_Column.of(limit, samples, at, inside, real) for limit in limits.along]
    stacked = {
        field.name: np.stack([getattr(column, field.name) for column in columns], axis=1)
        for field in fields(_Rows)
    }
    error, coarse = np.zeros(len(samples)), np.zeros(len(samples), dtype=bool)
    for column in columns:
        error[at] = np.maximum(error[at], column.error)
        coarse[at] |= column.coarse(resolution)
    coarse[at] &= samples.s[at + 1] - samples.s[at] > LEAST
    return UserRows(
        names=tuple(limit.name for limit in limits.along),
        error=error,
        coarse=coarse,
        **stacked,
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Real:
    """The bounds by the machine's axes on each interval (n,): feed^2, acceleration and jerk along it."""

    feed_sq: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def _real_bounds(samples: PathSamples, limits: Limits, at: Array, inside: FloatArray) -> _Real:
    """Bounds at the middle of the intervals `at`, generous ones."""
    velocity, acceleration, jerk = limits.of_axes
    d1, d3 = np.abs(inside[:, 1]), np.linalg.norm(inside[:, 3], axis=1)
    curve = np.linalg.norm(inside[:, 2], axis=1)
    strong = float(np.linalg.norm(acceleration))
    with np.errstate(divide="ignore"):
        feed = np.minimum(samples.path.toolpath.feed[samples.segment[at]], (velocity / d1).min(axis=1))
        feed_sq = np.minimum(feed**2, strong / curve)
    v = np.sqrt(feed_sq)
    most = float(np.linalg.norm(jerk)) + 3.0 * curve * v * strong + d3 * v**3
    return _Real(feed_sq=feed_sq, acceleration=np.full(len(at), strong), jerk=most)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Column(_Rows):
    """One limit on the grid: rows at the points (P,), and on the intervals (n,) what their middles say."""

    error: FloatArray
    bend: FloatArray
    short: FloatArray
    jump: FloatArray

    @classmethod
    def of(cls, limit: OwnLimit, samples: PathSamples, at: Array, inside: FloatArray, real: _Real) -> _Column:
        axes, points = samples.path.toolpath.axes, len(samples)
        left = (samples.position, samples.d1, samples.d2_left, samples.d3_left)
        right = (samples.position, samples.d1, samples.d2_right, samples.d3_right)
        middle = tuple(inside[:, k] for k in range(4))
        block = _block(samples)
        here, between = (Place(axes, list(p[0].T), p[1], b) for p, b in ((right, block), (middle, block[at])))
        q_left, q_right, q_mid = (_along(limit, axes, p) for p in (left, right, middle))
        bound, bound_mid = bounds_at(limit, here, points), bounds_at(limit, between, len(at))
        a, b = at, at + 1
        real_sq = np.zeros(points)
        for end in (a, b):
            np.maximum.at(real_sq, end, FAR * real.feed_sq)
        with np.errstate(divide="ignore", over="ignore"):
            feed_sq = (bound[:, 0] / np.abs(q_right[0])) ** 2
            feed_sq_mid = (bound_mid[:, 0] / np.abs(q_mid[0])) ** 2
        least = np.minimum(bound.min(axis=0), bound_mid.min(axis=0))
        limited = bool(np.isfinite(least[0]))
        short, jump = np.zeros(len(at)), np.zeros(len(at))
        if limited:
            feed_sq, short, jump = _between(feed_sq, feed_sq_mid, at, real_sq, FAR * real.feed_sq)
        # what the intervals can be run with, for the errors of their rows
        x = np.minimum(real.feed_sq, np.minimum(np.maximum(feed_sq[a], feed_sq[b]), feed_sq_mid))
        u = real.acceleration
        size = np.abs(q_mid[0])
        beyond_a = BEYOND * float((size * u + np.abs(q_mid[1]) * x).max(initial=1.0))
        v = np.sqrt(x)
        third = size * real.jerk + 3.0 * np.abs(q_mid[1]) * v * u + np.abs(q_mid[2]) * v**3
        beyond_j = BEYOND * float(third.max(initial=1.0))
        acceleration, short_a, jump_a = _between(
            np.minimum(bound[:, 1], beyond_a), np.minimum(bound_mid[:, 1], beyond_a), at
        )
        jerk, short_j, jump_j = _between(
            np.minimum(bound[:, 2], beyond_j), np.minimum(bound_mid[:, 2], beyond_j), at
        )
        least = np.where(least >= [np.inf, beyond_a, beyond_j], np.inf, least)
        strongest = np.minimum(np.minimum(acceleration[a], acceleration[b]), bound_mid[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.fmin(x, (strongest + size * u) / np.abs(q_mid[1]))
            u = np.fmin(u, (strongest + np.abs(q_mid[1]) * x) / size)
        h = samples.s[b] - samples.s[a]
        error = x * np.abs(q_mid[1] - 0.5 * (q_right[1][a] + q_left[1][b]))
        error = error + 0.5 * u * h * np.abs(q_left[1][b] - q_right[1][a])
        error = (error + u * np.abs(q_mid[0] - 0.5 * (q_right[0][a] + q_right[0][b]))) / strongest
        bend = x**1.5 * np.abs(q_mid[2] - 0.5 * (q_right[2][a] + q_left[2][b])) / np.minimum(jerk[a], jerk[b])
        return cls(
            d1=q_right[0],
            d2_left=q_left[1],
            d2_right=q_right[1],
            d3_left=q_left[2],
            d3_right=q_right[2],
            least=least,
            acceleration=acceleration,
            jerk=jerk,
            feed_sq_max=feed_sq,
            error=error,
            bend=bend,
            short=np.max([short, short_a, short_j], axis=0),
            jump=np.max([jump, jump_a, jump_j], axis=0),
        )

    def coarse(self, resolution: float) -> Array:
        """(n,) True for intervals that need points."""
        if not np.isfinite(resolution):
            return np.zeros(len(self.error), dtype=bool)
        far = (self.error > resolution) | (self.bend > JERK_SHARE * resolution)
        return far | (self.short > BOUND_SHARE * resolution) | (self.jump > JUMP)


def _block(samples: PathSamples) -> Array:
    """(P,) the program's block of the interval to the right of each point."""
    block: Array = samples.path.toolpath.block[samples.segment]
    return block


def _along(limit: OwnLimit, axes: tuple[str, ...], motion: Sequence[FloatArray]) -> FloatArray:
    """(3, n) q', q'', q''' by the arc length; of the length of the path without rounding."""
    found = limit_derivatives(limit, axes, motion)
    if limit.value(Place(axes, list(motion[0].T), motion[1])) is None:
        whole = np.isin(axes, getattr(limit, "counts", None) or axes)
        alone = ~(np.abs(np.stack(motion[1:])[:, :, ~whole]) > 0.0).any(axis=(0, 2))
        found[:, alone] = [[1.0], [0.0], [0.0]]
    return found


def _between(
    bound: FloatArray,
    middle: FloatArray,
    at: Array,
    cap: FloatArray | float = np.inf,
    beyond: FloatArray | float = np.inf,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A bound (P,) kept between points, by how much it was short in the middles (n,), and how it changes.

    cap, beyond : at the points and of the intervals, what the bound cannot be reached beyond: what it is there does not count
    """
    bound = np.minimum(bound, cap)
    middle, *ends = (np.minimum(one, beyond) for one in (middle, bound[at], bound[at + 1]))
    share = np.minimum(2.0 * middle / (ends[0] + ends[1]), 1.0)
    least = np.minimum(np.minimum(*ends), middle)
    jump = 1.0 - least / np.maximum(np.maximum(*ends), middle)
    found = bound.copy()
    for side in (at, at + 1):
        np.minimum.at(found, side, np.where(jump > JUMP, least, share * bound[side]))
    return found, 1.0 - share, jump
