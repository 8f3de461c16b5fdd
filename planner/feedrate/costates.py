"""Multipliers of the second-order optimum: what its limits cost, from the profile alone.

With x = feed^2 and u on the intervals (feedrate/constraints/problem.py), rows g = (r' u + r'' x)/c, pi of the
kinematics and mu of x/X, the Lagrangian

    L = sum_i 2 h_i/(sqrt(x_i) + sqrt(x_{i+1})) + pi_i (x_i + 2 h_i u_i - x_{i+1}) + lam_i g_i + mu_i x_i/X_i

is stationary in u_i and x_i:

    2 h_i pi_i + lam_i r'/c = 0,       T'_i + pi_i - pi_{i-1} + (lam r''/c of the intervals on both sides) + mu_i/X_i = 0.

Time-optimal profiles speed up or brake with one row at its limit, or keep to X. Where no row holds, pi is 0.
Where the motion speeds up, pi <= 0, and what more speed is worth adds up towards the start of the ramp; where
it brakes, pi >= 0 adds up towards its end. A ramp that ends at X or at a peak begins with what its last
interval's own time says. Between the two, at a valley, the second equation gives mu, or, where X does not
hold, the multiplier of the row that holds x alone (r' = 0, r'' x = c): on the grid that is the row with the
largest |r'' x|/c there. All in one sweep to the left and one to the right.

On the grid several rows may hold an interval and the profile is greedy (feedrate/reachability.py), so these
multipliers are good to some percent, not to rounding (tested against the change of the time with the limits).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import axis_rows
from planner.feedrate.solution import FeedrateSolution, Multipliers

# A row, or x, within this share of its limit holds it [-]: the passes of the solver end there to rounding.
HOLDS = 1e-6
# Rows with 2 h |r''| above this share of |r'| turn from holding u to holding x alone [-]: their pi would
# oscillate.
TURNING = 0.5
# Of what bounds x, a row by itself has to be at this share of its limit [-]; between grid points it may be
# nearer.
ALONE = 0.5


class _Profile(NamedTuple):
    """A profile on P points, with its bounds, and what its time changes by."""

    piece: Array  # (G+1,)
    s: FloatArray  # (P,), like the next six
    margin: FloatArray
    x_max: FloatArray
    x: FloatArray
    u: FloatArray
    before: FloatArray  # T' of the interval before a point ...
    behind: FloatArray  # ... and of the one behind it


class _Held(NamedTuple):
    """The row that holds u on each of P intervals; axis -1 where none does."""

    axis: Array
    side: Array  # 0: at the left end, 1: at the right end
    a: FloatArray  # r'
    b: FloatArray  # r''
    size: FloatArray  # its limit, with the sign of the side that holds
    way: FloatArray  # 1 where it makes the motion speed up, -1 brake, 0 where no row holds, or one that turns to holding x alone


def second_order_multipliers(problem: FeedrateProblem, solution: FeedrateSolution) -> Multipliers:
    """Multipliers of a second-order profile. Raises NotSolvedError without one."""
    solution.require()
    points = len(problem)
    profile = _Profile(
        piece=problem.piece,
        s=problem.s,
        margin=problem.margin,
        x_max=problem.feed_sq_limit,
        x=solution.feed_sq,
        u=solution.acc_s,
        before=np.zeros(points),
        behind=np.zeros(points),
    )
    rows, feed, dynamics = _costates(axis_rows(problem), profile)
    return Multipliers(rows=rows, feed=feed, dynamics=dynamics)


@njit(cache=True, error_model="numpy")
def _holding(i, limits, profile):
    """The row that holds u on interval i: axis, 0 left or 1 right, r', r'' and c with its sign; axis -1 if
    none does."""
    d1, d2_left, d2_right, limit = limits
    x, u, scale = profile.x, profile.u, 1.0 - profile.margin[i]
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
def _costates(limits, profile):
    """The multipliers: rows (P, A, 4), feed (P, 2) and pi (P,)."""
    piece, s, _, x_max, x, _, before, behind = profile
    d1, _, d2_right, limit = limits
    points, axes = d1.shape
    rows, feed, pi = np.zeros((points, axes, 4)), np.zeros((points, 2)), np.zeros(points)
    held = _Held(
        np.full(points, -1),
        np.zeros(points, np.int64),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points),
    )
    axis, side, a, b, size, way = held
    for g in range(len(piece) - 1):
        first, last = piece[g], piece[g + 1] - 1
        for i in range(first, last):
            h, both = s[i + 1] - s[i], np.sqrt(x[i]) + np.sqrt(x[i + 1])
            if x[i] > 0.0:
                behind[i] = -h / (np.sqrt(x[i]) * both * both)
            if x[i + 1] > 0.0:
                before[i + 1] = -h / (np.sqrt(x[i + 1]) * both * both)
            axis[i], side[i], a[i], b[i], size[i] = _holding(i, limits, profile)
            if axis[i] >= 0 and 2.0 * h * abs(b[i]) <= TURNING * abs(a[i]):
                way[i] = np.sign(a[i] * size[i])
        for i in range(last - 1, first - 1, -1):  # speeding up: from the end of the ramp
            if way[i] > 0.0:
                pi[i] = _speeding(i, profile, held, pi)
        for i in range(first, last):  # braking: from its beginning
            if way[i] < 0.0:
                pi[i] = _braking(i, profile, held, pi)
        for i in range(first, last):
            if way[i] != 0.0:
                rows[i, axis[i], 3 * side[i]] -= 2.0 * (s[i + 1] - s[i]) * pi[i] * abs(size[i]) / a[i]
        for i in range(first + 1, last):
            over = before[i] + behind[i] + pi[i] - pi[i - 1] + _of_row(i, s, held, pi)
            if over >= 0.0:
                continue
            if x[i] >= x_max[i] * (1.0 - HOLDS):
                feed[i, 0] = -over * x_max[i]
                continue
            best, k_best = ALONE, -1
            for k in range(axes):
                ratio = abs(d2_right[i, k]) * x[i] / limit[i, k]
                if ratio > best:
                    best, k_best = ratio, k
            if k_best >= 0:
                rows[i, k_best, 0] -= over * limit[i, k_best] / d2_right[i, k_best]
    return rows, feed, pi


@njit(cache=True, error_model="numpy")
def _of_row(i, s, held, pi):
    """lam r''/c of the intervals on both sides of point i."""
    side, a, b = held.side, held.a, held.b
    total = 0.0
    if a[i] != 0.0 and side[i] == 0:
        total -= 2.0 * (s[i + 1] - s[i]) * pi[i] * b[i] / a[i]
    if a[i - 1] != 0.0 and side[i - 1] == 1:
        total -= 2.0 * (s[i] - s[i - 1]) * pi[i - 1] * b[i - 1] / a[i - 1]
    return total


@njit(cache=True, error_model="numpy")
def _speeding(i, profile, held, pi):
    """pi of interval i, which speeds up, from that of the next one."""
    s, x, side, a, b = profile.s, profile.x, held.side, held.a, held.b
    n, rest = i + 1, profile.before[i + 1]
    if held.way[n] > 0.0 and x[n] < profile.x_max[n] * (1.0 - HOLDS):
        by = 1.0 - (2.0 * (s[n + 1] - s[n]) * b[n] / a[n] if side[n] == 0 else 0.0)
        rest += profile.behind[n] + pi[n] * by
    return min(rest / (1.0 + (2.0 * (s[n] - s[i]) * b[i] / a[i] if side[i] == 1 else 0.0)), 0.0)


@njit(cache=True, error_model="numpy")
def _braking(i, profile, held, pi):
    """pi of interval i, which brakes, from that of the one before."""
    s, x, side, a, b = profile.s, profile.x, held.side, held.a, held.b
    n, rest = i - 1, -profile.behind[i]
    if held.way[n] < 0.0 and x[i] < profile.x_max[i] * (1.0 - HOLDS):
        by = 1.0 + (2.0 * (s[i] - s[n]) * b[n] / a[n] if side[n] == 1 else 0.0)
        rest += pi[n] * by - profile.before[i]
    return max(rest / (1.0 - (2.0 * (s[i + 1] - s[i]) * b[i] / a[i] if side[i] == 0 else 0.0)), 0.0)
