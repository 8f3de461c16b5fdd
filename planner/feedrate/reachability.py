"""Own kernel for the second-order problem: reachability analysis in linear time.

TOPP-RA (Pham & Pham 2018, IEEE T-RO 34:645, doi 10.1109/TRO.2018.2819195) with the interpolation scheme. A
backward pass finds K_i, the largest feed^2 at point i from which the end can still be reached; a forward pass
then goes as fast as K allows.

On interval i every axis gives two rows |a u + b x| <= c, at the left end (a, b) = (r', r'') and at the right
end, where x_{i+1} = x + 2 h u, (a, b) = (r' + 2 h r'', r''); and reaching K_{i+1} is 0 <= x + 2 h u <=
K_{i+1}. For given x the rows leave an interval [low(x), high(x)] for u; low is convex and high concave in x,
so the gap phi = high - low is concave and positive at x = 0 (standing still is always allowed). The largest
feasible x is found by Newton's method on phi from the right: on a concave piecewise linear function it never
overshoots the root and ends after finitely many steps, two or three in practice.

A piece begins and ends at rest, so the set of controllable x is [0, K_i], because (x, u) = (0, 0) satisfies
every row. Cost: a few dozen flops per point and axis; no tolerance, no scaling needed.

The passes are greedy, and on the grid that is the optimum only where no interval leads from a larger x_i to a
smaller x_{i+1} at best: -d(high)/dx <= 1/(2 h), so 2 h |r''_k| <= |r'_k| for the row that acts. It fails in
the intervals where r'_k changes sign, so the time is the optimum's plus a term that vanishes with h: on the
adaptive grid running the path backwards changes the cycle time by 1e-5 at most, on coarse random curves by
percents, and there loosening a limit can cost time. toppra does exactly the same.
"""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, Status

# Newton steps at most; each drops one of the 4A + 2 rows for good: never reached with A <= 6.
NEWTON_STEPS = 60
# Rows whose |a u| stays below this share of their limit, for every u that the other limits allow, bound x
# alone [-]. Not a threshold on a itself: beside an axis with a limit a million times larger even |r'_k| =
# 1e-9 counts. Not rounding either: with a u of 1e-13 of the limit the greedy pass would trade the last digit
# of x_i for all of u_i (module text).
NEGLIGIBLE = 1e-10


class AxisRows(NamedTuple):
    """The limits of the axes at P points and A axes: | r'_k u + r''_k x | <= limit."""

    d1: FloatArray  # (P, A), like the next three
    d2_left: FloatArray
    d2_right: FloatArray
    limit: FloatArray


class Bounds(NamedTuple):
    """The rest of a second-order problem: G pieces over P points, the fields of `FeedrateProblem`."""

    piece: Array  # (G+1,)
    s: FloatArray  # (P,), like the next two
    margin: FloatArray
    x_max: FloatArray


class Interval(NamedTuple):
    """Interval i, of length h, with its limits times `scale`, on the way to x_{i+1} in [0, target]."""

    i: int
    h: float
    scale: float
    target: float


def axis_rows(problem: FeedrateProblem) -> AxisRows:
    """The limits of a problem's axes, as the kernels take them."""
    return AxisRows(problem.d1, problem.d2_left, problem.d2_right, problem.acceleration_limit)


@dataclass(frozen=True, kw_only=True)
class Reachability:
    """The numba reachability solver; it has no settings."""

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Time-optimal second-order profile."""
        began = time.perf_counter()
        bounds = Bounds(problem.piece, problem.s, problem.margin, problem.feed_sq_limit)
        x, u = _solve(axis_rows(problem), bounds)
        took = time.perf_counter() - began
        if not (np.isfinite(x).all() and np.isfinite(u).all()):
            sentence = "the profile is not finite; check the path for points that coincide"
            return FeedrateSolution.failed(problem, Status.NUMERICAL_ERROR, sentence, repr(self), took)
        return FeedrateSolution.second_order(
            problem,
            feed_sq=x,
            acc_s=u,
            sentence="time-optimal for the second-order limits",
            solver=repr(self),
            solve_time=took,
        )


@njit(cache=True, error_model="numpy")
def _row(a, b, c, x, low, low_slope, high, high_slope):
    """Intersect [low, high] with |a u + b x| <= c; slopes are d/dx of the active bounds."""
    slope = -b / a
    size = c / abs(a)
    if slope * x - size > low:
        low, low_slope = slope * x - size, slope
    if slope * x + size < high:
        high, high_slope = slope * x + size, slope
    return low, low_slope, high, high_slope


@njit(cache=True, error_model="numpy")
def _parallel(rows, on, x_max):
    """Largest |a| per limit that is negligible on an interval (see `NEGLIGIBLE`)."""
    u = max(x_max, on.target) / (2.0 * on.h)  # x stays within [0, target]
    for k in range(rows.d1.shape[1]):
        a = abs(rows.d1[on.i, k])
        size = rows.limit[on.i, k] * on.scale + abs(rows.d2_right[on.i, k]) * x_max
        if a * u > size:
            u = size / a
    return NEGLIGIBLE / u


@njit(cache=True, error_model="numpy")
def _interval(rows, on, x, parallel):
    """u-interval of an interval at feed^2 = x: low, its slope, high, its slope; without the rows |a| <=
    parallel * limit."""
    d1, d2_left, d2_right, limit = rows
    i, h, scale, target = on
    low, low_slope = -x / (2.0 * h), -0.5 / h  # x + 2 h u >= 0
    high, high_slope = (target - x) / (2.0 * h), -0.5 / h  # x + 2 h u <= K_{i+1}
    for k in range(d1.shape[1]):
        c = limit[i, k] * scale
        a, b = d1[i, k], d2_right[i, k]
        if abs(a) > parallel * c:
            low, low_slope, high, high_slope = _row(a, b, c, x, low, low_slope, high, high_slope)
        c = limit[i + 1, k] * scale
        b = d2_left[i + 1, k]
        a = d1[i + 1, k] + 2.0 * h * b
        if abs(a) > parallel * c:
            low, low_slope, high, high_slope = _row(a, b, c, x, low, low_slope, high, high_slope)
    return low, low_slope, high, high_slope


@njit(cache=True, error_model="numpy")
def largest_feed_sq(rows, on, x_max):
    """Largest x <= x_max on an interval from which some u leads to x_{i+1} in [0, target]."""
    d1, d2_left, d2_right, limit = rows
    i, h, scale, target = on
    parallel = _parallel(rows, on, x_max)
    x = x_max
    for k in range(d1.shape[1]):
        c = limit[i, k] * scale
        a, b = abs(d1[i, k]), abs(d2_right[i, k])
        if a <= parallel * c:  # rows without u bound x alone
            x = min(x, c / b)
        elif a > 2.0 * h * b:
            # x <= target + 2 h |u| and a |u| <= c + b x. Newton would get there, but from an x_max far above,
            # where the last digits of x_max drown the result.
            x = min(x, (target * a + 2.0 * h * c) / (a - 2.0 * h * b))
        c = limit[i + 1, k] * scale
        b = d2_left[i + 1, k]
        if abs(d1[i + 1, k] + 2.0 * h * b) <= parallel * c:
            x = min(x, c / abs(b))
    for _ in range(NEWTON_STEPS):
        low, low_slope, high, high_slope = _interval(rows, on, x, parallel)
        gap = high - low
        slope = high_slope - low_slope
        if gap >= 0.0 or slope >= 0.0:
            return x
        step = gap / slope
        if step <= 0.0 or x - step == x:
            return x
        x = max(x - step, 0.0)
    return 0.0


@njit(cache=True, error_model="numpy")
def _solve(rows, bounds):
    """Backward and forward pass over all pieces; returns x and u."""
    piece, s, margin, x_max = bounds
    points = len(s)
    reach, x, u = np.empty(points), np.empty(points), np.zeros(points)
    for g in range(len(piece) - 1):
        first, last = piece[g], piece[g + 1] - 1
        reach[last] = 0.0
        for i in range(last - 1, first - 1, -1):
            on = Interval(i, s[i + 1] - s[i], 1.0 - margin[i], reach[i + 1])
            reach[i] = largest_feed_sq(rows, on, x_max[i])
        x[first] = 0.0
        for i in range(first, last):
            on = Interval(i, s[i + 1] - s[i], 1.0 - margin[i], reach[i + 1])
            low, _, high, _ = _interval(rows, on, x[i], _parallel(rows, on, x_max[i]))
            # Equal up to rounding where the set is a point. The difference of x over 2 h would be the same u
            # but for rounding, which exceeds the limits where h is a billionth of its neighbours.
            u[i] = max(high, low)
            x[i + 1] = min(max(x[i] + 2.0 * on.h * u[i], 0.0), on.target)
    return x, u
