"""The prices of the limits on a path, from the solver's multipliers (feedrate/slopes.py).

They are derivatives at the plan, of the problem that its motion solves: with the corners, the splines and the
`limit_scale` that it has (planning/optimal/tighten.py). Prices of the programmed feed and of axis velocities
are those of more of them: where both are equal, neither alone is worth anything. The tolerance has no price:
what it makes of the path is not known to the multipliers. Finite changes are foretold as prices.py says.

**Places.** What changes on one segment alone, an F word or the limits there, is priced by the multipliers of
its own points and intervals. For a finite change, straight lines in one over the limit are taken:

    feed    -2 sum mu_i (1 - sqrt(X_i / X'_i))             X, X' the bounds of feed^2 without and with more of the programmed feed
    limits  (sum lam g + 2 sum mu_i) (1 - 1/(1 + more))     all bounds at once: of feed, velocity, acceleration and jerk

with multipliers lam of the rows g and mu of the bounds; neighbours that cannot follow save less.

**Long periods.** Where chords between samples use more than `CHORDS` of the tolerance, a faster motion may
need some of it back (delivery/periods.py), which no multiplier knows: 10 % more feed saved 16 % less than the
problem says, 10 um half, on five points at 4 ms, where chords use 40 %. There nothing may be saved, and what
would be is a hint.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.budget import chord_rate
from planner.feedrate.constraints.assemble import bounds_of, feedrate_problem
from planner.feedrate.constraints.limits import ACCELERATION, FEED, LIMITS, OF_AXES, VELOCITY
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.slopes import Slopes, slopes_of
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine
from planner.sensitivity.prices import MORE_LIMIT, STEP, WITHIN, more_of, price_list
from planner.sensitivity.records import PlacePrices, PriceList

# By how much a plan on splines, made again, is faster or slower for no other reason [share of the time].
UNREST = 1e-3
# How much less than foretold more of a limit may save on rounded corners [-] (benchmarks/solvers/prices.py).
LESS = 0.5
CHORDS = 0.2  # what chords between samples may use of the tolerance before what is saved is a hint [-]
SPEEDS = (FEED, VELOCITY)


def path_prices(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution, machine: Machine
) -> PriceList:
    """The prices of a solution. Raises ValueError if its solver gives no multipliers."""
    now, toolpath = slopes_of(problem, solution), samples.path.toolpath
    rest = bounds_but_speeds(samples, machine)
    limit, slope = _by_share(problem, now)
    velocities = [name for name in map(VELOCITY.called, problem.axes) if slope.get(name, 0.0) < 0.0]
    saved: dict[str, FloatArray] = {}  # at each point
    for name in (FEED.name, *velocities):
        little, more = (bounds_with(samples, machine, name, share, rest) for share in (STEP, MORE_LIMIT))
        slope[name] = float(now.feed_sq_max @ np.log(little / problem.feed_sq_max)) / STEP
        saved[name] = -2.0 * now.feed_sq_max * (1.0 - np.sqrt(problem.feed_sq_max / more))
    every = -(now.rows + 2.0 * now.feed_sq_max) * (1.0 - 1.0 / (1.0 + MORE_LIMIT))
    splines = len(samples.path.spline) > 0
    kappa = np.maximum(samples.kappa_left, samples.kappa_right)
    tolerance = toolpath.tolerance[samples.segment]
    chord = kappa * solution.feed_sq * chord_rate(machine)  # kappa v^2 dt^2 / 8, eq. (18)
    use = float(np.divide(chord, tolerance, out=np.zeros_like(chord), where=tolerance > 0.0).max())

    def by_segment(of_points: FloatArray) -> FloatArray:
        return np.bincount(samples.segment, of_points, len(toolpath)).astype(np.float64)

    return price_list(
        limit,
        slope,
        None,
        toolpath,
        solution.cycle_time,
        bounds={name: float(of.sum()) for name, of in saved.items()},
        unrest=UNREST if splines else 0.0,
        less=WITHIN if splines else LESS,
        unsure=use > CHORDS,
        corners=None,
        places=PlacePrices(feed=by_segment(saved[FEED.name]), limits=by_segment(every), tolerance=None),
    )


def _by_share(problem: FeedrateProblem, now: Slopes) -> tuple[dict[str, float], dict[str, float]]:
    """The limits of the axes and of one's own by their names, as far as they bound anything: the limit, of
    one's own the least that was met, in its own unit; and dT/d(ln limit) [s], of bounds on the feed too that
    come of it."""
    number = {name: k for k, name in enumerate(problem.bound_names)}

    def of_bounds(name: str) -> float:
        return float(now.feed_sq_max[problem.feed_sq_bound == number.get(name, -1)].sum())

    limit, slope = {}, {}
    for quantity, kind in enumerate(OF_AXES):
        for k, axis in enumerate(problem.axes):
            least = getattr(problem, kind.name)[k]
            if problem.own_least is not None and k >= problem.machine_axes:
                least = problem.own_least[quantity, k - problem.machine_axes]
            if not np.isfinite(least):
                continue
            name = kind.called(axis)
            limit[name] = float(least)
            if kind is VELOCITY:
                slope[name] = 2.0 * of_bounds(name)
                continue
            slope[name] = float(getattr(now, kind.name)[k])
            if kind is ACCELERATION:
                slope[name] += of_bounds(ACCELERATION.called_at_jump(axis))
    return limit, slope


def bounds_with(
    samples: PathSamples, machine: Machine, name: str, share: float, rest: FloatArray | None = None
) -> FloatArray:
    """(P,) bounds of feed^2 with a share more of the feed or of an axis velocity, by `name` [mm2/s2]; `rest`
    are those by all other limits, from `bounds_but_speeds`, if they are known."""
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
