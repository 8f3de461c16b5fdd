"""How close a profile comes to its limits, and to which."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, ratios_by_limit


def constraint_ratios(problem: FeedrateProblem, solution: FeedrateSolution) -> tuple[FloatArray, Array]:
    """Largest ratio (P,) of any constraint at each point (`ratios_by_limit`), and the constraint's index (P,) in
    `active_names`."""
    worst, which = np.zeros(len(problem)), problem.feed_sq_bound.copy()
    for limit, ratio in ratios_by_limit(problem, solution):
        better = ratio > worst
        worst[better], which[better] = ratio[better], limit
    return worst, which
