"""Own kernel for the second-order problem: reachability analysis in linear time.

TOPP-RA (Pham & Pham 2018, IEEE T-RO 34:645, doi 10.1109/TRO.2018.2819195) with the interpolation scheme. A backward pass finds
K_i, the largest feed^2 at point i from which the end can still be reached; a forward pass then goes as fast as K allows.

On interval i every axis gives two rows |a u + b x| <= c, at the left end (a, b) = (r', r'') and at the right end, where
x_{i+1} = x + 2 h u, (a, b) = (r' + 2 h r'', r''); and reaching K_{i+1} is 0 <= x + 2 h u <= K_{i+1}. For given x the rows leave an
interval [low(x), high(x)] for u; low is convex and high concave in x, so the gap phi = high - low is concave and positive at
x = 0 (standing still is always allowed). The largest feasible x is found by Newton's method on phi from the right: on a concave
piecewise linear function it never overshoots the root and ends after finitely many steps, two or three in practice.

For a piece that ends at rest the set of controllable x is [0, K_i], because (x, u) = (0, 0) satisfies every row. For x_end > 0 it
has a lower end too; the forward pass does not need it, it keeps to K from above and x_end is compared at the end. Cost: a few dozen
flops per point and axis; no tolerance, no scaling needed.

The passes are greedy, and on the grid that is the optimum only where no interval leads from a larger x_i to a smaller x_{i+1} at
best: -d(high)/dx <= 1/(2 h), so 2 h |r''_k| <= |r'_k| for the row that acts. It fails in the intervals where r'_k changes sign, so
the time is the optimum's plus a term that vanishes with h: on the adaptive grid running the path backwards changes the cycle time by
1e-5 at most, on coarse random curves by percents, and there loosening a limit can cost time. toppra does exactly the same.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from planner.base.kernels import njit
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, Status

# Newton steps at most; each step drops at least one of the 4A + 2 rows for good, so this is never reached with A <= 6.
NEWTON_STEPS = 60
# Rows whose |a u| stays below this share of their limit, for every u that the other limits allow, bound x alone [-]. Not a threshold
# on a itself: beside an axis with a limit a million times larger even |r'_k| = 1e-9 counts. Not rounding either: with a u of 1e-13 of
# the limit the greedy pass would trade the last digit of x_i for all of u_i (module text; a zigzag with r'_k = 1e-16 lost 7e-6).
NEGLIGIBLE = 1e-10
# Relative slack under which an end condition counts as reachable: rounding of the passes [-].
ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Reachability:
    """The numba reachability solver; it has no settings."""

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Time-optimal second-order profile; INFEASIBLE if the ends of a piece ask for more than is reachable."""
        began = time.perf_counter()
        x, u, bad_piece = _solve(
            problem.piece,
            problem.s,
            problem.d1,
            problem.d2_left,
            problem.d2_right,
            problem.acceleration_limit,
            problem.margin,
            problem.feed_sq_limit,
            problem.feed_sq_start,
            problem.feed_sq_end,
        )
        took = time.perf_counter() - began
        if bad_piece >= 0:
            at = problem.s[problem.piece[bad_piece]]
            sentence = (
                f"piece {bad_piece} (from s = {at:.6g} mm): the speeds at its ends cannot be joined within the limits; "
                "lower them or loosen the limits"
            )
            return FeedrateSolution.failed(problem, Status.INFEASIBLE, sentence, repr(self), took)
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
def _parallel(i, x_max, h, d1, d2_right, limit, scale, target):
    """Largest |a| per limit that is negligible on interval i (see `NEGLIGIBLE`)."""
    u = max(x_max, target) / (2.0 * h)  # x stays within [0, target]
    for k in range(d1.shape[1]):
        a, size = abs(d1[i, k]), limit[i, k] * scale + abs(d2_right[i, k]) * x_max
        if a * u > size:
            u = size / a
    return NEGLIGIBLE / u


@njit(cache=True, error_model="numpy")
def _interval(i, x, h, d1, d2_left, d2_right, limit, scale, target, parallel):
    """u-interval of interval i at feed^2 = x: low, its slope, high, its slope; without the rows |a| <= parallel * limit."""
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
def _largest(i, x_max, h, d1, d2_left, d2_right, limit, scale, target):
    """Largest x <= x_max on interval i from which some u leads to x_{i+1} in [0, target]."""
    parallel = _parallel(i, x_max, h, d1, d2_right, limit, scale, target)
    x = x_max
    for k in range(d1.shape[1]):
        c = limit[i, k] * scale
        a, b = abs(d1[i, k]), abs(d2_right[i, k])
        if a <= parallel * c:  # rows without u bound x alone
            x = min(x, c / b)
        elif a > 2.0 * h * b:
            # x <= target + 2 h |u| and a |u| <= c + b x. Newton would get there, but from an x_max far above, where the last digits of
            # x_max drown the result.
            x = min(x, (target * a + 2.0 * h * c) / (a - 2.0 * h * b))
        c = limit[i + 1, k] * scale
        b = d2_left[i + 1, k]
        if abs(d1[i + 1, k] + 2.0 * h * b) <= parallel * c:
            x = min(x, c / abs(b))
    for _ in range(NEWTON_STEPS):
        low, low_slope, high, high_slope = _interval(
            i, x, h, d1, d2_left, d2_right, limit, scale, target, parallel
        )
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
def _solve(piece, s, d1, d2_left, d2_right, limit, margin, x_max, x_start, x_end):
    """Backward and forward pass over all pieces; returns x, u and the first infeasible piece or -1."""
    points = len(s)
    reach = np.empty(points)
    x = np.empty(points)
    u = np.zeros(points)
    for g in range(len(piece) - 1):
        first, last = piece[g], piece[g + 1] - 1
        if x_end[g] > x_max[last] * (1.0 + ROUNDING):
            return x, u, g
        reach[last] = min(x_end[g], x_max[last])
        for i in range(last - 1, first - 1, -1):
            h = s[i + 1] - s[i]
            reach[i] = _largest(i, x_max[i], h, d1, d2_left, d2_right, limit, 1.0 - margin[i], reach[i + 1])
        if x_start[g] > reach[first] * (1.0 + ROUNDING):
            return x, u, g
        x[first] = min(x_start[g], reach[first])
        for i in range(first, last):
            h = s[i + 1] - s[i]
            target, scale = reach[i + 1], 1.0 - margin[i]
            parallel = _parallel(i, x_max[i], h, d1, d2_right, limit, scale, target)
            low, _, high, _ = _interval(i, x[i], h, d1, d2_left, d2_right, limit, scale, target, parallel)
            # Equal up to rounding where the set is a point. The difference of x over 2 h would be the same u but for rounding, which
            # exceeds the limits where h is a billionth of its neighbours.
            u[i] = max(high, low)
            x[i + 1] = min(max(x[i] + 2.0 * h * u[i], 0.0), target)
        if x[last] < x_end[g] * (1.0 - ROUNDING):
            return x, u, g
    return x, u, -1
