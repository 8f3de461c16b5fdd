"""The prices of the limits: how the cycle time changes with each of them, and which corners are dear.

The solver's multipliers price what is directly in the feedrate problem: axis limits and programmed feed
(feedrate/lagrangian.py). The tolerance works through the path: more of it makes corners larger. So do
accelerations, the other way: the more a corner could use, the more of its budget is set aside for the chord
error that goes with it (eq. (20)); both in sensitivity/corner_prices.py.

Slopes need no second solution. They are derivatives at the plan, of the problem that its motion solves: with
the corners, the splines and the `limit_scale` that it has (planning/optimal/tighten.py). Where two limits
hold together and both must give (equal axes at 45 degrees) the time has a kink and the price is a slope
between the left one and the right one. Prices of the programmed feed and of axis velocities are those of more
of them: where both are equal, neither alone is worth anything.

On splines the tolerance has no price: they are laid before the feed is known. Accelerations are priced with
the path as it is.

**Finite changes** are foretold as prices.py says.

**Long periods.** Where chords between samples use more than `CHORDS` of the tolerance, a faster motion may
need some of it back (delivery/periods.py), which no multiplier knows: 10 % more feed saved 16 % less than the
problem says, 10 um half, on five points at 4 ms, where chords use 40 %. There nothing may be saved, and what
would be is a hint.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.budget import chord_rate
from planner.corners.smooth import SmoothPath
from planner.feedrate.constraints.limits import ACCELERATION, FEED, OF_AXES, VELOCITY
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.lagrangian import Lagrangian, lagrangian
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.solution import FeedrateSolution, Prices
from planner.machine import Machine
from planner.sensitivity.corner_prices import RoundedPath
from planner.sensitivity.places import bounds_but_speeds, bounds_with, by_place
from planner.sensitivity.prices import MORE_LIMIT, STEP, WITHIN, dearest, more_of, price_list
from planner.sensitivity.records import PriceList

# By how much a plan on splines, made again, is faster or slower for no other reason [share of the time].
UNREST = 1e-3
# How much less than foretold more of a limit may save on rounded corners [-] (benchmarks/solvers/prices.py).
LESS = 0.5
CHORDS = 0.2  # what chords between samples may use of the tolerance before what is saved is a hint [-]


def path_prices(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution, machine: Machine
) -> PriceList:
    """The prices of a solution. Raises ValueError if its solver gives no multipliers."""
    now, path, cycle_time = lagrangian(problem, solution), samples.path, solution.cycle_time
    rest = bounds_but_speeds(samples, machine)
    prices = solution.prices
    assert prices is not None  # solvers that give multipliers give prices
    limit, slope = _by_share(problem, prices)
    velocities = [name for name in map(VELOCITY.called, problem.axes) if slope.get(name, 0.0) < 0.0]
    more, saved = {}, {}
    for name in (FEED.name, *velocities):
        slope[name] = _by_speed(samples, problem, now, (machine, name), rest)
        more[name] = bounds_with(samples, machine, name, MORE_LIMIT, rest)
        saved[name] = -2.0 * float(now.feed_sq_max @ (1.0 - np.sqrt(problem.feed_sq_max / more[name])))
    dear, together, rounded = None, None, None
    if isinstance(path, SmoothPath) and not len(path.spline):
        rounded = RoundedPath(samples, path, problem, solution, machine, now)
        for name in map(ACCELERATION.called, problem.axes[: problem.machine_axes]):
            slope[name] = float(rounded.change(more_of(machine, name, STEP)).sum()) / STEP
        together = rounded.by_tolerance()
        dear = dearest(path.toolpath, rounded.alone(together))
    return price_list(
        limit,
        slope,
        None if together is None else float(together.sum()),
        path.toolpath,
        cycle_time,
        bounds=saved,
        unrest=UNREST if rounded is None else 0.0,
        less=WITHIN if rounded is None else LESS,
        unsure=_chord_use(samples, solution, machine) > CHORDS,
        corners=dear,
        places=by_place(samples, problem, now, more[FEED.name], together),
    )


def _by_share(problem: FeedrateProblem, prices: Prices) -> tuple[dict[str, float], dict[str, float]]:
    """The limits of the axes and of one's own by their names, as far as they bound anything: the limit
    itself, of one's own the least that was met, in its own unit; and dT/d(ln limit) [s]."""
    limit, by_share = {}, {}
    for quantity, kind in enumerate(OF_AXES):
        planned, price = getattr(problem, kind.name), getattr(prices, kind.name)
        for k, axis in enumerate(problem.axes):
            least = planned[k]
            if problem.own_least is not None and k >= problem.machine_axes:
                least = problem.own_least[quantity, k - problem.machine_axes]
            if np.isfinite(least):
                name = kind.called(axis)
                limit[name], by_share[name] = float(least), float(price[k]) * float(planned[k])
    return limit, by_share


def _by_speed(
    samples: PathSamples,
    problem: FeedrateProblem,
    now: Lagrangian,
    of: tuple[Machine, str],
    rest: FloatArray | None,
) -> float:
    """dT/d(ln of a feed or axis velocity) [s] for more of it: of equal bounds the other one stays."""
    gained = np.log(bounds_with(samples, *of, STEP, rest) / problem.feed_sq_max)
    return float(now.feed_sq_max @ gained) / STEP


def _chord_use(samples: PathSamples, solution: FeedrateSolution, machine: Machine) -> float:
    """The largest share of the tolerance that chords use, kappa v^2 dt^2 / 8 over eps, eq. (18)."""
    kappa = np.maximum(samples.kappa_left, samples.kappa_right)
    tolerance = samples.path.toolpath.tolerance[samples.segment]
    chord = kappa * solution.feed_sq * chord_rate(machine)
    return float(np.divide(chord, tolerance, out=np.zeros_like(chord), where=tolerance > 0.0).max())
