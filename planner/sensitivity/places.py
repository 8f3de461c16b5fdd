"""Where more of a limit, of the feed or of the tolerance would save time: the prices of a plan by place.

The Lagrangian is a sum over the intervals of the grid (feedrate/lagrangian.py), so what changes on one
segment alone, an F word or the limits there, is priced by the multipliers of its own points and intervals.
For a finite change, straight lines in one over the limit are taken, as for the limits of the whole program
(sensitivity/path_prices.py):

    feed    -2 sum mu_i (1 - sqrt(X_i / X'_i))             X, X' the bounds of feed^2 without and with more of the programmed feed
    limits  (sum lam g + 2 sum mu_i) (1 - 1/(1 + more))     all bounds at once: of feed, velocity, acceleration and jerk

with multipliers lam of the rows g and mu of the bounds; neighbours that cannot follow save less.
"""

import dataclasses

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.smooth import SmoothPath
from planner.feedrate.constraints.assemble import bounds_of, feedrate_problem
from planner.feedrate.constraints.limits import FEED, LIMITS, VELOCITY
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.lagrangian import Lagrangian
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine import Machine
from planner.sensitivity.prices import MORE_LIMIT, more_of
from planner.sensitivity.records import PlacePrices

SPEEDS = (FEED, VELOCITY)


def by_place(
    samples: PathSamples,
    problem: FeedrateProblem,
    now: Lagrangian,
    faster: FloatArray,
    by_joint: FloatArray | None,
) -> PlacePrices:
    """The prices of a solution by place.

    now      : the Lagrangian at the solution
    faster   : (P,) the bounds of feed^2 with `MORE_LIMIT` more of the programmed feed [mm2/s2]
    by_joint : (R+1,) dT/d(tolerance) at the joints of the path's legs [s/mm]; None where it is not known
    """
    segments = len(samples.path.toolpath)
    all_limits = -(now.rows + 2.0 * now.feed_sq_max) * (1.0 - 1.0 / (1.0 + MORE_LIMIT))
    of_feed = -2.0 * now.feed_sq_max * (1.0 - np.sqrt(problem.feed_sq_max / faster))
    tolerance = None
    if by_joint is not None and isinstance(samples.path, SmoothPath):
        tolerance = np.zeros(segments + 1)
        np.add.at(tolerance, samples.path.legs.first, by_joint)
    return PlacePrices(
        feed=np.bincount(samples.segment, of_feed, segments).astype(np.float64),
        limits=np.bincount(samples.segment, all_limits, segments).astype(np.float64),
        tolerance=tolerance,
    )


def bounds_with(
    samples: PathSamples, machine: Machine, name: str, share: float, rest: FloatArray | None = None
) -> FloatArray:
    """(P,) bounds of feed^2 with a share more of the feed or of an axis velocity, by `name` [mm2/s2].

    rest : the bounds by all other limits, from `bounds_but_speeds`, if they are known
    """
    toolpath = samples.path.toolpath
    if name == FEED.name:
        toolpath = dataclasses.replace(toolpath, feed=toolpath.feed * (1.0 + share))
    else:
        machine = more_of(machine, name, share)
    there = dataclasses.replace(samples, path=dataclasses.replace(samples.path, toolpath=toolpath))
    if rest is None:
        return feedrate_problem(there, machine).feed_sq_max
    return np.minimum(rest, bounds_of(there, machine, SPEEDS))


def bounds_but_speeds(samples: PathSamples, machine: Machine) -> FloatArray | None:
    """(P,) bounds of feed^2 by all limits but programmed feed and axis velocities [mm2/s2]; None with limits
    of one's own, whose bounds are not apart from each other."""
    if machine.own:
        return None
    return bounds_of(samples, machine, [limit for limit in LIMITS if limit not in SPEEDS])
