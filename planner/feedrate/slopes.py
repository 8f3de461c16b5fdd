"""The slopes of the cycle time in the limits of a jerk-limited problem, from the multipliers of its solution.

With the rows g of jerk/rows.py, each a share of its limit, and the multipliers lam that the solver ends with,
the Lagrangian is stationary in the profile. So if a limit X changes, the shortest time changes by

    dT/d(ln X)  =  - sum lam g        over the rows of X, profile and multipliers as they are (envelope theorem):

no second solution is needed. Where two limits hold at once that only together determine the motion (equal
axes at 45 degrees), the time has a kink; the multipliers then are one of its slopes between left and right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.layout import columns_of
from planner.feedrate.jerk.rows import duration
from planner.feedrate.solution import FeedrateSolution


class Slopes(NamedTuple):
    """dT/d(ln limit) [s], never positive: of the rows of acceleration and jerk of each axis (A,), of all of
    these by interval, rows (P,), and of feed_sq_max of each point (P,)."""

    acceleration: FloatArray
    jerk: FloatArray
    rows: FloatArray
    feed_sq_max: FloatArray


class _Profile(NamedTuple):
    """A profile, x, u, p (P,), and its multipliers of rows (P, A, 4) and feed (P, 2)."""

    x: FloatArray
    u: FloatArray
    p: FloatArray
    rows: FloatArray
    feed: FloatArray


def slopes_of(problem: FeedrateProblem, solution: FeedrateSolution) -> Slopes:
    """The slopes at the solution of a problem. Raises ValueError if it has no multipliers."""
    found = solution.multipliers
    if found is None:
        raise ValueError(f"slopes_of: {solution.solver} gives no multipliers")
    change = solution.jerk_s * solution.duration
    profile = _Profile(solution.feed_sq, solution.acc_s, change, found.rows, found.feed)
    return Slopes(*_slopes(columns_of(problem), problem.interval, profile))


@njit(cache=True, error_model="numpy", nogil=True)
def _slopes(columns, interval, profile):
    """Fields of `Slopes`, in their order; interval (P,) is False behind the last point of a piece."""
    _, s, x_max, d1, d2_left, d2_right, d3_left, d3_right, acceleration, jerk = columns
    x, u, p, rows, feed = profile
    points, axes = d1.shape
    of_rows, of_feed = np.zeros(points), np.zeros(points)
    of_acceleration, of_jerk = np.zeros(axes), np.zeros(axes)
    for i in range(points):
        if not interval[i]:
            continue
        v0, v1, u1 = np.sqrt(x[i]), np.sqrt(x[i + 1]), u[i] + p[i]
        h = duration(v0, v1, p[i], s[i + 1] - s[i])
        j = p[i] / h
        for k in range(axes):
            left = (d1[i, k] * u[i] + d2_right[i, k] * x[i]) / acceleration[i, k]
            right = (d1[i + 1, k] * u1 + d2_left[i + 1, k] * x[i + 1]) / acceleration[i + 1, k]
            held = rows[i, k, 0] * left + rows[i, k, 3] * right
            of_acceleration[k] -= held
            of_rows[i] -= held
            left = d1[i, k] * j + v0 * (3.0 * d2_right[i, k] * u[i] + d3_right[i, k] * x[i])
            right = d1[i + 1, k] * j + v1 * (3.0 * d2_left[i + 1, k] * u1 + d3_left[i + 1, k] * x[i + 1])
            held = rows[i, k, 1] * left / jerk[i, k] + rows[i, k, 2] * right / jerk[i + 1, k]
            of_jerk[k] -= held
            of_rows[i] -= held
        of_feed[i] -= feed[i, 0] * x[i] / x_max[i]
        middle, both = 0.5 * (v0 + v1) - 0.125 * p[i] * h, x_max[i] + x_max[i + 1]
        held = feed[i, 1] * middle * middle * 2.0 / both
        of_feed[i] -= held * x_max[i] / both
        of_feed[i + 1] -= held * x_max[i + 1] / both
    return of_acceleration, of_jerk, of_rows, of_feed
