"""Multipliers of the second-order optimum: what its limits cost, from the profile alone.

With x = feed^2 and u on the intervals (constraints/problem.py), rows g = (r' u + r'' x)/c, pi of the kinematics and mu of x/X, the
Lagrangian

    L = sum_i 2 h_i/(sqrt(x_i) + sqrt(x_{i+1})) + pi_i (x_i + 2 h_i u_i - x_{i+1}) + lam_i g_i + mu_i x_i/X_i

is stationary in u_i and x_i:

    2 h_i pi_i + lam_i r'/c = 0,       T'_i + pi_i - pi_{i-1} + (lam r''/c of the intervals on both sides) + mu_i/X_i = 0.

Time-optimal profiles speed up or brake with one row at its limit, or keep to X. Where no row holds, pi is 0. Where the motion speeds
up, pi <= 0, and what more speed is worth adds up towards the start of the stretch; where it brakes, pi >= 0 adds up towards its end.
A stretch that ends at X or at a peak begins with what its last interval's own time says. Between the two, at a valley, the second
equation gives mu, or, where X does not hold, the multiplier of the row that holds x alone (r' = 0, r'' x = c): on the grid that is the
row with the largest |r'' x|/c there. All in one sweep to the left and one to the right.

On the grid several rows may hold an interval and the profile is greedy (feedrate/reachability.py), so these multipliers are good to
some percent, not to rounding (tested against the change of the time with the limits).
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, Multipliers

# A row, or x, within this share of its limit holds it [-]: the passes of the solver end there to rounding.
HOLDS = 1e-6
# Rows with 2 h |r''| above this share of |r'| turn from holding u to holding x alone [-]: their pi would oscillate.
TURNING = 0.5
# Of what bounds x, a row by itself has to be at this share of its limit [-]; between grid points it may be nearer.
ALONE = 0.5


def second_order_multipliers(problem: FeedrateProblem, solution: FeedrateSolution) -> Multipliers:
    """Multipliers of a second-order profile. Raises NotSolvedError without one."""
    solution.require()
    points, axes = problem.d1.shape
    rows, feed, dynamics = np.zeros((points, axes, 4)), np.zeros((points, 2)), np.zeros(points)
    _costates(
        problem.piece, problem.s, problem.d1, problem.d2_left, problem.d2_right, problem.acceleration_limit,
        problem.margin, problem.feed_sq_limit, solution.feed_sq, solution.acc_s, rows, feed, dynamics,
    )  # fmt: skip
    return Multipliers(rows=rows, feed=feed, dynamics=dynamics)


@njit(cache=True, error_model="numpy")
def _holding(i, d1, d2_left, d2_right, limit, scale, x, u):
    """The row that holds u on interval i: axis, 0 left or 1 right, r', r'' and c with its sign; axis -1 if none does."""
    best, axis, side, a, b, size = 1.0 - HOLDS, -1, 0, 0.0, 0.0, 0.0
    for k in range(d1.shape[1]):
        c = limit[i, k] * scale
        g = (d1[i, k] * u[i] + d2_right[i, k] * x[i]) / c
        if abs(g) > best and d1[i, k] != 0.0:
            best, axis, side, a, b, size = abs(g), k, 0, d1[i, k], d2_right[i, k], np.copysign(c, g)
        c = limit[i + 1, k] * scale
        g = (d1[i + 1, k] * u[i] + d2_left[i + 1, k] * x[i + 1]) / c
        if abs(g) > best and d1[i + 1, k] != 0.0:
            best, axis, side, a, b, size = abs(g), k, 1, d1[i + 1, k], d2_left[i + 1, k], np.copysign(c, g)
    return axis, side, a, b, size


@njit(cache=True, error_model="numpy")
def _costates(piece, s, d1, d2_left, d2_right, limit, margin, x_max, x, u, rows, feed, pi):
    """Fill rows (P, A, 4), feed (P, 2) and pi (P,)."""
    points = len(s)
    axis, side, way = np.full(points, -1), np.zeros(points, np.int64), np.zeros(points)
    a, b, size = np.zeros(points), np.zeros(points), np.zeros(points)
    before, behind = (
        np.zeros(points),
        np.zeros(points),
    )  # T' of the interval before a point, and of the one behind it
    for g in range(len(piece) - 1):
        first, last = piece[g], piece[g + 1] - 1
        for i in range(first, last):
            h, both = s[i + 1] - s[i], np.sqrt(x[i]) + np.sqrt(x[i + 1])
            if x[i] > 0.0:
                behind[i] = -h / (np.sqrt(x[i]) * both * both)
            if x[i + 1] > 0.0:
                before[i + 1] = -h / (np.sqrt(x[i + 1]) * both * both)
            axis[i], side[i], a[i], b[i], size[i] = _holding(
                i, d1, d2_left, d2_right, limit, 1.0 - margin[i], x, u
            )
            if axis[i] >= 0 and 2.0 * h * abs(b[i]) <= TURNING * abs(a[i]):
                way[i] = np.sign(a[i] * size[i])
        for i in range(last - 1, first - 1, -1):  # speeding up: from the end of the stretch
            if way[i] > 0.0:
                pi[i] = _speeding(i, s, side, a, b, way, before, behind, x, x_max, pi)
        for i in range(first, last):  # braking: from its beginning
            if way[i] < 0.0:
                pi[i] = _braking(i, s, side, a, b, way, before, behind, x, x_max, pi)
        for i in range(first, last):
            if way[i] != 0.0:
                rows[i, axis[i], 3 * side[i]] -= 2.0 * (s[i + 1] - s[i]) * pi[i] * abs(size[i]) / a[i]
        for i in range(first + 1, last):
            over = before[i] + behind[i] + pi[i] - pi[i - 1] + _of_row(i, s, side, a, b, pi)
            if over >= 0.0:
                continue
            if x[i] >= x_max[i] * (1.0 - HOLDS):
                feed[i, 0] = -over * x_max[i]
                continue
            best, k_best = ALONE, -1
            for k in range(d1.shape[1]):
                part = abs(d2_right[i, k]) * x[i] / limit[i, k]
                if part > best:
                    best, k_best = part, k
            if k_best >= 0:
                rows[i, k_best, 0] -= over * limit[i, k_best] / d2_right[i, k_best]


@njit(cache=True, error_model="numpy")
def _of_row(i, s, side, a, b, pi):
    """lam r''/c of the intervals on both sides of point i."""
    total = 0.0
    if a[i] != 0.0 and side[i] == 0:
        total -= 2.0 * (s[i + 1] - s[i]) * pi[i] * b[i] / a[i]
    if a[i - 1] != 0.0 and side[i - 1] == 1:
        total -= 2.0 * (s[i] - s[i - 1]) * pi[i - 1] * b[i - 1] / a[i - 1]
    return total


@njit(cache=True, error_model="numpy")
def _speeding(i, s, side, a, b, way, before, behind, x, x_max, pi):
    """pi of interval i, which speeds up, from that of the next one."""
    n, rest = i + 1, before[i + 1]
    if way[n] > 0.0 and x[n] < x_max[n] * (1.0 - HOLDS):
        by = 1.0 - (2.0 * (s[n + 1] - s[n]) * b[n] / a[n] if side[n] == 0 else 0.0)
        rest += behind[n] + pi[n] * by
    return min(rest / (1.0 + (2.0 * (s[n] - s[i]) * b[i] / a[i] if side[i] == 1 else 0.0)), 0.0)


@njit(cache=True, error_model="numpy")
def _braking(i, s, side, a, b, way, before, behind, x, x_max, pi):
    """pi of interval i, which brakes, from that of the one before."""
    n, rest = i - 1, -behind[i]
    if way[n] < 0.0 and x[i] < x_max[i] * (1.0 - HOLDS):
        by = 1.0 + (2.0 * (s[i] - s[n]) * b[n] / a[n] if side[n] == 1 else 0.0)
        rest += pi[n] * by - before[i]
    return max(rest / (1.0 - (2.0 * (s[i + 1] - s[i]) * b[i] / a[i] if side[i] == 0 else 0.0)), 0.0)
