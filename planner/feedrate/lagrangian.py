"""The Lagrangian of the jerk-limited problem by interval: what changes of the problem do to the time.

    L = sum_i  h_i + sum_r lam_ir g_ir + pi_i (x_i + (2 u_i + p_i) ds_i + p_i (2 u_i + p_i) h_i^2/12 - x_{i+1})

with the rows g and the kinematics of jerk/rows.py, and the multipliers lam, pi that the solver ends with. At
the optimum L is stationary in the profile. So if the limits, or the path under the grid, change with some
theta, the shortest time changes by

    dT/dtheta = dL/dtheta       with profile and multipliers as they are (envelope theorem):

no second solution is needed, and the difference of L between two problems on corresponding grids is the
difference of their times to first order, place by place. Where two limits hold at once that only together
determine the motion (equal axes at 45 degrees), the time has a kink; the multipliers then are one of its
slopes between left and right.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.columns import ProblemColumns, columns_of
from planner.feedrate.jerk.rows import duration
from planner.feedrate.solution import FeedrateSolution


@dataclass(frozen=True, eq=False, kw_only=True)
class Lagrangian:
    """value (P,) of every interval [s], and its change per relative change of the limits: acceleration, jerk
    (A,), all of these by interval, rows (P,), and feed_sq_max (P,) [s]."""

    value: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    rows: FloatArray
    feed_sq_max: FloatArray


class _Profile(NamedTuple):
    """A profile, x, u, p (P,), and the fields of `Multipliers`."""

    x: FloatArray
    u: FloatArray
    p: FloatArray
    rows: FloatArray
    feed: FloatArray
    pi: FloatArray


def lagrangian(
    problem: FeedrateProblem, solution: FeedrateSolution, columns: ProblemColumns | None = None
) -> Lagrangian:
    """The Lagrangian of a problem at the profile and the multipliers of a solution, of this problem or of a
    neighbouring one on a corresponding grid; `columns` are those of the problem, if they are known. Raises
    ValueError if the solution has no multipliers."""
    found = solution.multipliers
    if found is None:
        raise ValueError(f"lagrangian: {solution.solver} gives no multipliers")
    profile = _Profile(
        x=solution.feed_sq,
        u=solution.acc_s,
        p=solution.jerk_s * solution.duration,
        rows=found.rows,
        feed=found.feed,
        pi=found.dynamics,
    )
    value, of_acceleration, of_jerk, of_rows, of_feed = _lagrangian(
        columns or columns_of(problem), problem.interval, profile
    )
    return Lagrangian(
        value=value, acceleration=of_acceleration, jerk=of_jerk, rows=of_rows, feed_sq_max=of_feed
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _lagrangian(columns, interval, profile):
    """Fields of `Lagrangian`, in their order; interval (P,) is False behind the last point of a piece."""
    _, s, x_max, d1, d2_left, d2_right, d3_left, d3_right, acceleration, jerk = columns
    x, u, p, rows, feed, pi = profile
    points, axes = d1.shape
    value, of_rows, of_feed = np.zeros(points), np.zeros(points), np.zeros(points)
    of_acceleration, of_jerk = np.zeros(axes), np.zeros(axes)
    for i in range(points):
        if not interval[i]:
            continue
        ds = s[i + 1] - s[i]
        v0, v1, u1 = np.sqrt(x[i]), np.sqrt(x[i + 1]), u[i] + p[i]
        h = duration(v0, v1, p[i], ds)
        q, j = p[i] * (2.0 * u[i] + p[i]), p[i] / h
        total = h + pi[i] * (x[i] + (2.0 * u[i] + p[i]) * ds + q * h * h / 12.0 - x[i + 1])
        for k in range(jerk.shape[1]):
            left = (d1[i, k] * u[i] + d2_right[i, k] * x[i]) / acceleration[i, k]
            right = (d1[i + 1, k] * u1 + d2_left[i + 1, k] * x[i + 1]) / acceleration[i + 1, k]
            held = rows[i, k, 0] * left + rows[i, k, 3] * right
            of_acceleration[k] -= held
            of_rows[i] -= held
            total += held
            left = d1[i, k] * j + v0 * (3.0 * d2_right[i, k] * u[i] + d3_right[i, k] * x[i])
            right = d1[i + 1, k] * j + v1 * (3.0 * d2_left[i + 1, k] * u1 + d3_left[i + 1, k] * x[i + 1])
            held = rows[i, k, 1] * left / jerk[i, k] + rows[i, k, 2] * right / jerk[i + 1, k]
            of_jerk[k] -= held
            of_rows[i] -= held
            total += held
        held = feed[i, 0] * x[i] / x_max[i]
        of_feed[i] -= held
        total += held
        middle, both = 0.5 * (v0 + v1) - 0.125 * p[i] * h, x_max[i] + x_max[i + 1]
        held = feed[i, 1] * middle * middle * 2.0 / both
        of_feed[i] -= held * x_max[i] / both
        of_feed[i + 1] -= held * x_max[i + 1] / both
        value[i] = total + held
    return value, of_acceleration, of_jerk, of_rows, of_feed
