"""Which limit is active where, and for what share of the cycle time.

A time-optimal motion is nearly always at some limit: with a larger limit it would be faster there, at once or
after the rest of the motion has adapted (sensitivity/prices.py says by how much). A limit is active in an
interval if its ratio is within `HELD` of 1. Those that are active together count in full each, so that shares
may add up to more than 1: a path that is followed at F along the edge of the tolerance is at both all the
time, and the prices tell which of them costs time. Of the bounds on the feed itself (F, velocities) the
lowest is active. "none" is the time in which no limit is reached, "rest" that of the dwells.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, active_names, ratios_by_limit
from planner.sensitivity.records import GridHistory

HELD = 1e-2  # an interval is held by a limit that it comes this close to [share of the limit]
NONE, REST = "none", "rest"


def history(problem: FeedrateProblem, solution: FeedrateSolution, t: FloatArray, end: float) -> GridHistory:
    """The profile of a solution of P points, which are passed at the times t (P,) [s], up to the `end` [s],
    with the active limits. Raises NotSolvedError if there is no solution."""
    names = (*active_names(problem), NONE, REST)
    none, rest = len(names) - 2, len(names) - 1
    moving = problem.interval
    lasting = np.diff(t, append=end)
    reached = np.zeros((len(problem), len(names)), dtype=bool)
    closest, active = np.full(len(problem), 1.0 - HELD), np.full(len(problem), none)
    bounds = len(problem.bound_names)
    behind = np.append((solution.feed_sq / problem.feed_sq_limit)[1:], 0.0)
    for limit, ratio in ratios_by_limit(problem, solution):
        if limit < bounds:  # an interval is at a bound of the feed where it begins and ends there
            ratio = np.minimum(ratio, behind)
        reached[:, limit] |= ratio >= 1.0 - HELD
        nearer = ratio > closest
        closest[nearer], active[nearer] = ratio[nearer], limit
    reached[~moving] = False
    reached[:, none], reached[:, rest] = moving & ~reached.any(axis=1), ~moving
    active[~moving] = rest
    return GridHistory(
        t=t,
        s=problem.s,
        feed=np.sqrt(solution.feed_sq),
        active=active,
        reached=reached,
        active_names=names,
        share=times_of(reached, lasting) / lasting.sum(),
    )


def times_of(reached: Array, lasting: FloatArray) -> FloatArray:
    """(n,) how long each of n limits is active [s]: of intervals `lasting` (P,), in which it is `reached` (P,
    n). As a product of matrices it would take `reached` as floats."""
    return np.array([lasting[here].sum() for here in reached.T])
