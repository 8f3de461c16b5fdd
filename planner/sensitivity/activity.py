"""Which limit is active where, and for what share of the cycle time.

A time-optimal motion is nearly always at some limit: with a larger limit it would be faster there, at once or after the rest of the
motion has adapted (sensitivity/prices.py says by how much). A limit is active in an interval if its ratio is within `HELD` of 1. If
several are, they share the time of the interval equally, so that all shares add up to 1 with "none", the time in which no limit is
reached, and "rest", the dwells.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, active_names, ratios_by_limit
from planner.job.records import GridHistory

# An interval is held by a limit that it comes this close to [share of the limit]. Time-optimal motions with jerk limits are within
# 1e-3 of some limit for 94 to 98 % of their time, within 1e-2 for 98 to 99.6 % (pentagon, zig-zag, arcs, spiral); more does not help.
HELD = 1e-2
NONE, REST = "none", "rest"


def history(problem: FeedrateProblem, solution: FeedrateSolution, t: FloatArray, end: float) -> GridHistory:
    """The profile of a solution of P points, which are passed at the times t (P,) [s], up to the `end` [s], with the active limits.
    Raises NotSolvedError if there is no solution."""
    names = (*active_names(problem), NONE, REST)
    none, rest = len(names) - 2, len(names) - 1
    moving = problem.interval
    lasting = np.diff(t, append=end)
    holders = np.zeros(len(problem))
    closest, active = np.full(len(problem), 1.0 - HELD), np.full(len(problem), none)
    for limit, ratio in ratios_by_limit(problem, solution):
        holders += ratio >= 1.0 - HELD
        nearer = ratio > closest
        closest[nearer], active[nearer] = ratio[nearer], limit
    part = np.divide(lasting, holders, out=np.zeros(len(problem)), where=moving & (holders > 0))
    time = np.zeros(len(names))
    for limit, ratio in ratios_by_limit(problem, solution):
        time[limit] = part[ratio >= 1.0 - HELD].sum()
    time[none], time[rest] = lasting[moving & (holders == 0)].sum(), lasting[~moving].sum()
    active[~moving] = rest
    return GridHistory(
        t=t,
        s=problem.s,
        feed=np.sqrt(solution.feed_sq),
        active=active,
        active_names=names,
        share=time / time.sum(),
    )
