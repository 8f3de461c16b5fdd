"""Grid points on straight stretches for jerk-limited profiles.

The second-order optimum says where things happen: at the ends of a straight stretch and where it switches (grid.py). A jerk-limited
profile rounds these switches off within a few tau = a/j, the time an axis needs to build up its acceleration, and is dull in
between. So every straight interval of the second-order solution gets points in time from both of its ends: steps of `STEP` tau for
the first `NEAR` tau, then growing by `GROWTH` from step to step. A stretch of any length costs a few dozen points, one that passes
in less than `STEP` tau none. Runs between full stops that take less than `SHORT` tau are all start and stop: their intervals get at
least `PARTS` parts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution
from planner.path import PathSamples, insert_points

STEP = 0.25  # first steps from an end [tau]
NEAR = 3.0  # how far from an end the steps stay small [tau]
GROWTH = 1.3  # from step to step beyond [-]
SHORT = 8.0  # duration of a short run [tau]
PARTS = 16.0  # of a straight interval on a short run


def refine_straights(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution
) -> PathSamples:
    """Split the straight intervals of a solved second-order problem for a jerk-limited solver. Raises NotSolvedError."""
    duration = solution.require().duration
    interval = samples.intervals
    element = samples.element[interval]
    interval = interval[(element >= 0) & ~samples.table.legs["round"][np.maximum(element, 0)]]
    tau = float((problem.acceleration / problem.jerk).min())
    run = np.repeat(np.add.reduceat(duration, samples.piece[:-1]), np.diff(samples.piece))[interval]
    whole = duration[interval] / tau
    row, t = _graded(whole, np.where(run < SHORT * tau, np.minimum(STEP, whole / PARTS), STEP))
    at = interval[row]
    t = t * tau
    s = samples.s[at] + t * (np.sqrt(solution.feed_sq[at]) + 0.5 * solution.acc_s[at] * t)
    inside = (s > samples.s[at]) & (s < samples.s[at + 1])
    inside[1:] &= (np.diff(s) > 0) | (np.diff(at) > 0)
    return insert_points(samples, at[inside], s[inside])


@njit(cache=True, error_model="numpy")
def _steps(whole, first, out):
    """Distances from an end, up to the middle of `whole`, into out; returns their number."""
    count, at, step = 0, 0.0, first
    while count < len(out):
        if at > NEAR:
            step *= GROWTH
        if at + step >= 0.5 * whole - 0.25 * step:
            break
        at += step
        out[count] = at
        count += 1
    return count


@njit(cache=True, error_model="numpy")
def _graded(whole, first):
    """Points inside intervals of the durations `whole` (n,), first steps `first` (n,), in tau: their interval and time."""
    scratch = np.empty(256)
    total = 0
    for i in range(len(whole)):
        if whole[i] > first[i]:
            total += 2 * _steps(whole[i], first[i], scratch) + 1
    row, t = np.empty(total, np.int64), np.empty(total)
    n = 0
    for i in range(len(whole)):
        if whole[i] <= first[i]:
            continue
        count = _steps(whole[i], first[i], scratch)
        for k in range(count):
            row[n], t[n] = i, scratch[k]
            n += 1
        row[n], t[n] = i, 0.5 * whole[i]
        n += 1
        for k in range(count - 1, -1, -1):
            row[n], t[n] = i, whole[i] - scratch[k]
            n += 1
    return row, t
