"""Grid points where a second-order profile switches on straight stretches.

Between rest and feed, or between two corners, a straight stretch is one interval; its end speeds are already exact, because the
limits do not change along it. Inside it the optimum accelerates at the largest rate b, holds the speed limit, decelerates at b:

    peak below the limit:  one switch,  sigma = (x1 - x0 + 2 b L) / (4 b)
    limit x_c reached:     two,         sigma = (x_c - x0)/(2 b)  and  L - (x_c - x1)/(2 b)

With these points added the profile on the grid *is* the optimum, however long the stretch.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array
from planner.constraints.assemble import interval_feed_sq_max
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine
from planner.path import PathSamples, insert_points

# Two switches nearer to each other than this share of their interval are one [-]: a peak that just touches the limit.
SWITCH_MIN = 1e-9


def add_switching_points(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution, machine: Machine
) -> PathSamples:
    """Split the straight intervals of a solved problem where the profile switches. Raises NotSolvedError."""
    x = solution.require().feed_sq
    cap = interval_feed_sq_max(samples, machine)
    interval = _straight(samples)
    x0, x1, cap = x[interval], x[interval + 1], cap[interval]
    length = samples.s[interval + 1] - samples.s[interval]
    along = np.abs(samples.d1[interval]) / problem.acceleration
    rate = (1.0 - samples.margin[interval]) / along.max(axis=1)
    single = (x1 - x0 + 2.0 * rate * length) / (4.0 * rate)
    capped = x0 + 2.0 * rate * single > cap
    rise = np.where(capped, (cap - x0) / (2.0 * rate), single)
    fall = np.where(capped, length - (cap - x1) / (2.0 * rate), np.inf)
    s0, s1 = samples.s[interval, None], samples.s[interval + 1, None]
    places = s0 + np.stack([rise, fall], axis=1)
    real = (places > s0) & (places < s1)  # as far as arc length can tell them apart
    real[:, 1] &= places[:, 1] - places[:, 0] > SWITCH_MIN * length
    row, _ = np.nonzero(real)
    return insert_points(samples, interval[row], places[real])


def _straight(samples: PathSamples) -> Array:
    """Indices of the intervals on straight legs."""
    interval = samples.intervals
    element = samples.element[interval]
    return interval[(element >= 0) & ~samples.table.legs["round"][np.maximum(element, 0)]]
