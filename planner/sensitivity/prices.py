"""What the limits cost: by how much the cycle time of a time-optimal plan changes with each of them, and which corners are dear.

The solver's multipliers price what is directly in the feedrate problem: axis limits and programmed feed (feedrate/lagrangian.py). The
tolerance works through the path: more of it makes corners larger. So do accelerations, the other way: the more a corner could use,
the more of its budget is set aside for the chord error that goes with it (eq. (20)); both in sensitivity/corner_prices.py.

Slopes need no second solution. They are derivatives at the plan, of the problem that its motion solves: with the corners, the splines
and the `limit_scale` that it has (optimal/tighten.py). Where two limits hold together and both must give (equal axes at 45
degrees) the time has a kink and the price is a slope between the left one and the right one. Prices of the programmed feed and of axis
velocities are those of more of them: where both are equal, neither alone is worth anything.

Splines are shaped by a problem of their own, which has the tolerance among its constraints: a round of reshaping (optimal/reshape.py)
from the present shape gives dT/d(tolerance) at every site as a multiplier, added up at the nearest joint of the program. Accelerations
are priced with the path as it is.

**Finite changes.** Ten per cent of a limit and 10 um of tolerance are a long way. What they save is found by solving again
(sensitivity/savings.py), on rounded corners to within a few per cent, on splines between a least and a most. For the tolerance of
splines these are the multipliers of two rounds, one in the corridor as it is and one in the wider one, times the 10 um: a round's
problem is convex, so its optimum falls ever less steeply. Where the first round alone promises less than `WORTH`, there is no second
one, and the least is nothing; so it is on the runs that cost least, 5 % together (optimal/reshape.py). A plan made again finds another
shape, too, and ends a little faster or slower for no other reason: by `UNREST`. Where least and most are so far apart that their middle
may be off by more than `HINT` of itself and more than `HINT_LEAST` of the time, the saving is a hint only.

**Long periods.** Where chords between samples use more than `CHORDS` of the tolerance, a faster motion may need some of it back
(delivery/periods.py), which no multiplier knows: 10 % more feed saved 16 % less than the problem says, 10 um half, on five points at
4 ms, where chords use 40 %. There nothing may be saved, and what would be is a hint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints import chord_error
from planner.constraints.limits import ACCELERATION, FEED, OF_AXES, VELOCITY
from planner.constraints.problem import FeedrateProblem
from planner.corners.smooth import SmoothPath
from planner.feedrate.lagrangian import Lagrangian, lagrangian
from planner.feedrate.solution import FeedrateSolution, Prices
from planner.geometry.toolpath import Joint
from planner.job.records import SAVED_MIN, DearCorners, PriceList
from planner.machine import Machine
from planner.path.samples import PathSamples
from planner.sensitivity.corner_prices import (
    DEAREST,
    MORE_TOLERANCE,
    STEP,
    CornerPrices,
    corner_prices,
    sums,
)
from planner.sensitivity.places import MORE_LIMIT, bounds_but_speeds, bounds_with, by_place
from planner.sensitivity.savings import Change, more_of, thinned

WORTH = 5e-4  # what by its slope saves less is not solved for [share of the time]; it stands in no table
HINT, HINT_LEAST = (
    0.15,
    1e-4,
)  # how far a saving may be off and still be told as a number [-, share of the time]
# By how much a plan on splines, made again, is faster or slower for no other reason [share of the time]: 2.5e-4 with 1e-4 more or less
# of the tolerance (pentagon), 1e-3 with more jerk (bracket: 5e-4 was too little for jerk.y).
UNREST = 1e-3
CHORDS = 0.2  # what chords between samples may use of the tolerance before what is saved is a hint [-]


class SitePrices(NamedTuple):
    """What the corridor of splines costs at J sites.

    place : (J,) along the legs [mm]
    now   : (J,) dT/d(tolerance) there [s/mm]
    wider : (J,) the same with `MORE_TOLERANCE` more [s/mm]
    """

    place: FloatArray
    now: FloatArray
    wider: FloatArray


def price_list(
    samples: PathSamples,
    problem: FeedrateProblem,
    solution: FeedrateSolution,
    machine: Machine,
    by_site: SitePrices | None = None,
) -> PriceList:
    """The prices of a solution.

    by_site : what the corridor of splines costs; None for single corners

    Raises ValueError if the solver of the solution gives no multipliers.
    """
    now = lagrangian(problem, solution)
    rest = bounds_but_speeds(samples, machine)
    prices = solution.prices
    assert prices is not None  # solvers that give multipliers give prices
    limit, by_share = _by_share(problem, prices)
    changes = {name: Change(machine=more_of(machine, name)) for name in limit}
    changes[FEED.name] = Change(machine=lambda share: machine, feed=lambda share: 1.0 + share)
    velocities = [name for name in map(VELOCITY.called, problem.axes) if name in limit]
    speeds = [FEED.name, *(name for name in velocities if by_share[name] < 0.0)]
    for name in speeds:  # these are dT/d(ln limit)
        by_share[name] = _by_speed(samples, problem, now, changes[name], rest)
    dear, tolerance, together = None, None, None
    corners: CornerPrices | None = None
    if by_site is not None:
        together = _by_joint(samples.path, by_site.place, by_site.now)
        tolerance = float(together.sum())
        wider = _by_joint(samples.path, by_site.place, by_site.wider)
        saved = np.minimum(-0.5 * MORE_TOLERANCE * (together + wider), solution.cycle_time)
        dear = _dearest(samples.path, together, saved)
    elif isinstance(samples.path, SmoothPath) and not len(samples.path.spline):
        corners = corner_prices(samples.path, samples, problem, solution, machine, now)
        for axis in problem.axes[: problem.machine_axes]:
            by_share[ACCELERATION.called(axis)] += corners.by_acceleration(axis)
        together = corners.by_tolerance()
        tolerance = float(together.sum()) + corners.between()
        dear = corners.dearest(together)
        changes["tolerance"] = Change(
            machine=lambda share: machine, tolerance=lambda share: share * MORE_TOLERANCE
        )
    found = _Savings(samples, problem, solution, machine, changes, speeds, now, rest).all(by_share, tolerance)
    if by_site is not None:
        found["tolerance"] = Saving(*sorted(-MORE_TOLERANCE * float(x.sum()) for x in by_site[1:]))
    if _chord_use(samples, solution, machine) > CHORDS:
        found = {name: Saving(min(saving.least, 0.0), saving.most) for name, saving in found.items()}
    unrest = 0.0 if corners is not None else UNREST * solution.cycle_time
    found = {name: saving.widened(unrest) for name, saving in found.items()}
    most = solution.cycle_time * (1.0 - 1.0 / (1.0 + MORE_LIMIT))
    found = {
        name: saving.below(solution.cycle_time if name == "tolerance" else most)
        for name, saving in found.items()
    }
    return PriceList(
        limits={name: by_share[name] / limit[name] for name in limit},
        feed=by_share[FEED.name],
        tolerance=tolerance,
        saved={name: saving.middle for name, saving in found.items()},
        corners=dear,
        ranges={name: (saving.least, saving.most) for name, saving in found.items()},
        hints=tuple(name for name, saving in found.items() if saving.vague(solution.cycle_time)),
        places=by_place(samples, problem, now, changes[FEED.name], together, rest),
    )


def _by_share(problem: FeedrateProblem, prices: Prices) -> tuple[dict[str, float], dict[str, float]]:
    """The limits of the axes and of one's own by their names, as far as they bound anything: the limit itself, of one's own the least
    that was met, in its own unit; and dT/d(ln limit) [s]."""
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


class Saving(NamedTuple):
    """Time saved, between a least and a most [s]."""

    least: float
    most: float

    @property
    def middle(self) -> float:
        """The middle of the range [s]."""
        return 0.5 * (self.least + self.most)

    def widened(self, by: float) -> Saving:
        """The range with `by` [s] more on both sides."""
        return Saving(self.least - by, self.most + by)

    def below(self, bound: float) -> Saving:
        """The range cut off at a bound [s]."""
        return Saving(min(self.least, bound), min(self.most, bound))

    def vague(self, cycle_time: float) -> bool:
        """True if the middle may be off by too much to be told as a number."""
        return 0.5 * (self.most - self.least) > max(HINT * abs(self.middle), HINT_LEAST * cycle_time)


@dataclass(frozen=True, eq=False)
class _Savings:
    """What more of everything saves (sensitivity/savings.py)."""

    samples: PathSamples
    problem: FeedrateProblem
    solution: FeedrateSolution
    machine: Machine
    changes: dict[str, Change]
    speeds: list[str]
    now: Lagrangian
    rest: FloatArray | None  # of `bounds_but_speeds`

    def all(self, by_share: dict[str, float], tolerance: float | None) -> dict[str, Saving]:
        """Of `MORE_LIMIT` more of every limit, and of `MORE_TOLERANCE` more tolerance where that is a change of corners; from the
        prices dT/d(ln limit) and dT/d(tolerance)."""
        slope = dict(by_share)
        if tolerance is not None and "tolerance" in self.changes:
            slope["tolerance"] = MORE_TOLERANCE * tolerance
        straight = {name: self._straight(name, price) for name, price in slope.items()}
        worth = [name for name in slope if abs(straight[name]) >= WORTH * self.solution.cycle_time]
        found = {name: Saving(*sorted((0.0, most))) for name, most in straight.items()}
        part = thinned(self.samples, self.problem, self.solution, self.machine, len(worth)) if worth else None
        if part is None:
            return found
        for name in worth:
            solved = part.saves(self.changes[name], 1.0 if name == "tolerance" else MORE_LIMIT, slope[name])
            if solved is not None:
                other = solved if part.rounds_again and not part.sampled else straight[name]
                found[name] = Saving(*sorted((solved, other)))
        return found

    def _straight(self, name: str, price: float) -> float:
        """What a straight line foretells [s]: in one over the limit, in the tolerance."""
        if name == "tolerance":
            return -price
        if name not in self.speeds:
            return -price * (1.0 - 1.0 / (1.0 + MORE_LIMIT))
        more = bounds_with(self.samples, self.changes[name], MORE_LIMIT, self.rest)
        return -2.0 * float(self.now.feed_sq_max @ (1.0 - np.sqrt(self.problem.feed_sq_max / more)))


def _by_joint(path: SmoothPath, place: FloatArray, price: FloatArray) -> FloatArray:
    """(R+1,) prices of places along the legs, added up at the nearest joint that is no full stop."""
    joints = np.concatenate([[0.0], np.cumsum(path.legs.length)])
    inner = np.flatnonzero(path.joint != Joint.STOP)
    middles = (joints[inner[1:]] + joints[inner[:-1]]) / 2.0
    return sums(inner[np.searchsorted(middles, place)], price, len(joints))


def _dearest(path: SmoothPath, price: FloatArray, saved: FloatArray) -> DearCorners:
    """The dearest joints of a spline, of prices (R+1,) and what more tolerance saves there (R+1,)."""
    best = np.argsort(-saved, kind="stable")[:DEAREST]
    best = best[saved[best] >= SAVED_MIN]
    at = path.legs.first[best]
    toolpath = path.toolpath
    return DearCorners(
        line=toolpath.line[at - 1],
        position=toolpath.end[at - 1],
        theta=path.theta[best],
        price=price[best],
        saved=saved[best],
    )


def _by_speed(
    samples: PathSamples, problem: FeedrateProblem, now: Lagrangian, change: Change, rest: FloatArray | None
) -> float:
    """dT/d(ln of a feed or axis velocity) [s] for more of it: where it and another bound are equal, it is the other one that stays."""
    gained = np.log(bounds_with(samples, change, STEP, rest) / problem.feed_sq_max)
    return float(now.feed_sq_max @ gained) / STEP


def _chord_use(samples: PathSamples, solution: FeedrateSolution, machine: Machine) -> float:
    """The largest share of the tolerance that chords between samples use, kappa v^2 dt^2 / 8 over eps, eq. (18)."""
    kappa = np.maximum(samples.kappa_left, samples.kappa_right)
    tolerance = samples.path.toolpath.tolerance[samples.segment]
    chord = kappa * solution.feed_sq * chord_error.rate(machine)
    return float(np.divide(chord, tolerance, out=np.zeros_like(chord), where=tolerance > 0.0).max())
