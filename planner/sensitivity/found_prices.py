"""The prices of limits and tolerance where path and feed were found together, from its multipliers.

Its motion has no path of its own: what a multiplier prices is the time with the path free to follow. So
nothing is solved again. A limit acts at every step through its price there, the tolerance through the rooms of legs
and vertices, which are in proportion to it.

Finite changes are foretold as prices.py says.

Where the programmed feed and an axis velocity hold together, more of one alone is worth nothing, as on a path
(path_prices.py); where an axis can follow only a part of ten per cent more feed, in the direction that the
motion has, that part is what counts. Where the start's motion stays nothing is priced.
"""

from functools import cached_property
from math import fsum  # `sum` rounds otherwise from Python 3.12 on

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limits import ACCELERATION, FEED, JERK, VELOCITY
from planner.geometry.toolpath import Joint, Toolpath
from planner.joint import price
from planner.joint.own_laws import Where, motion_at
from planner.joint.parts import FoundRun
from planner.machine import Machine
from planner.sensitivity.prices import MORE_LIMIT, dearest, price_list
from planner.sensitivity.records import PlacePrices, PriceList

QUANTITIES = JERK, ACCELERATION, VELOCITY  # in the order of the columns of joint/price.py
# By how much a plan made again differs for no other reason [share] (benchmarks/solvers/found_prices.py).
UNREST = 2e-4
SLOWEST = 1e-6  # instead of standstill, in ratios [mm/s]
TIED = 1e-2  # what a limit has to cost of a step's time to hold it [-]; of those that do not it is some 1e-5


class RunPrices:
    """dT/d(ln limit) of a run with N steps on R legs [s].

    leg, segment, middle : (N,) of the steps, and the place of their middles along the run [mm]
    step                 : (N, 3 A + 5 + M) of joint/price.py
    tied                 : (N,) where feed and velocities hold together, so that more of one alone is worth nothing
    vertex               : (R+1,) of what vertices may use
    """

    def __init__(self, toolpath: Toolpath, found: FoundRun, step: FloatArray, place: FloatArray):
        """place : (N+1,) of the nodes along the run [mm]"""
        self.found, self.step, axes = found, step, len(found.run.axis)
        assert found.steps is not None
        least = TIED * found.steps.h
        held = -step[:, 2 * axes : 3 * axes + 1] > least[:, None]  # by the velocities, and by the feed
        self.tied = held[:, -1] & held[:, :-1].any(axis=1)
        self.middle = (place[:-1] + place[1:]) / 2.0
        self.leg = found.run.leg_at(self.middle)
        first, last = found.run.first[0], found.run.first[-1]
        along = np.cumsum(toolpath.length[first : last - 1])
        self.segment = first + np.searchsorted(along, self.middle, side="right")
        self.vertex = np.bincount(self.leg, self.of(price.VERTEX), len(found.run) + 1)

    def of(self, column: int) -> FloatArray:
        """(N,) prices of what is not of one axis."""
        return np.asarray(self.step[:, 3 * len(self.found.run.axis) + column])

    def of_feed(self) -> FloatArray:
        """(N,) prices of the feed where more of it alone is worth something."""
        return np.where(self.tied, 0.0, self.of(price.FEED))

    def of_axes(self, many: int) -> FloatArray:
        """(3, many) dT/d(ln limit) of the quantities of all axes, where more of them alone is worth something [s]."""
        found, axes = np.zeros((len(QUANTITIES), many)), self.found.run.axis
        columns = np.ascontiguousarray(self.step[:, : len(QUANTITIES) * len(axes)].T)
        columns[2 * len(axes) :, self.tied] = 0.0
        found[:, axes] = columns.sum(axis=1).reshape(len(QUANTITIES), -1)
        return found

    def of_laws(self) -> dict[str, tuple[float, float]]:
        """Of laws that bound the motion somewhere, by name: the least bound, and dT/d(ln limit) [s]."""
        steps, laws = self.found.steps, self.found.run.laws
        found: dict[str, tuple[float, float]] = {}
        if not laws.named:
            return found
        assert steps is not None
        state = np.stack([steps.position, steps.velocity, steps.acceleration], axis=1)
        motion = motion_at(state, steps.jerk, steps.h / 2.0)
        least = laws.bounds(Where(self.leg, self.middle), motion, np.array(laws.named, dtype=np.int64))
        for column, m in enumerate(laws.named):
            if np.isfinite(least[:, column]).any():
                slope = float(self.of(price.LAWS + m).sum())
                found[laws.laws[m].name] = float(least[:, column].min()), slope
        return found

    @cached_property
    def feed_saves(self) -> FloatArray:
        """(N,) time saved by `MORE_LIMIT` more of the feed, as far as the axes can follow the motion with it [s]."""
        steps = self.found.steps
        assert steps is not None
        h = steps.h[:, None]
        velocity = steps.velocity + h * (steps.acceleration / 2.0 + h * steps.jerk / 8.0)
        follows = (self.found.run.velocity / np.maximum(np.abs(velocity), SLOWEST)).min(axis=1)
        return np.asarray(-self.of_feed() * (1.0 - 1.0 / np.clip(follows, 1.0, 1.0 + MORE_LIMIT)))

    def nearer_end(self) -> Array:
        """(N,) vertices nearest to the steps, on their legs; no end of the run but of a single leg."""
        offset, legs = self.found.run.offset, len(self.found.run)
        begin, end = offset[self.leg], offset[self.leg + 1]
        nearer = self.leg + (self.middle - begin > end - self.middle)
        return np.clip(nearer, 1, legs - 1) if legs > 1 else nearer


def found_prices(
    toolpath: Toolpath, machine: Machine, found: list[FoundRun], cycle_time: float
) -> PriceList | None:
    """The prices of runs along a toolpath, of a motion of `cycle_time` [s]; None if there are none."""
    priced = [one for one in found if one.price is not None and one.place is not None]
    runs = [RunPrices(toolpath, one, one.price, one.place) for one in priced]  # type: ignore[arg-type]
    if not runs:
        return None
    limit, slope = _of_limits(toolpath, machine, runs)
    of_tolerance = _OfTolerance(toolpath, runs)
    return price_list(
        limit,
        slope,
        float(of_tolerance.together.sum()),
        toolpath,
        cycle_time,
        bounds={FEED.name: fsum(float(run.feed_saves.sum()) for run in runs)},
        unrest=UNREST,
        corners=dearest(toolpath, of_tolerance.alone),
        places=_by_place(toolpath, runs, of_tolerance.together),
    )


def _of_limits(
    toolpath: Toolpath, machine: Machine, runs: list[RunPrices]
) -> tuple[dict[str, float], dict[str, float]]:
    """The limits by name, in mm or rad and s, and dT/d(ln limit) of these and of the feed [s]."""
    limit, slope = {}, {FEED.name: fsum(float(run.of_feed().sum()) for run in runs)}
    of_axes = np.array([run.of_axes(len(toolpath.axes)) for run in runs])
    for quantity, kind in enumerate(QUANTITIES):
        values = machine.limits(kind.name, toolpath.axes)  # type: ignore[arg-type]
        for k, axis in enumerate(toolpath.axes):
            name = kind.called(axis)
            limit[name], slope[name] = float(values[k]), fsum(of_axes[:, quantity, k].tolist())
    for run in runs:
        for name, (least, cost) in run.of_laws().items():
            limit[name] = min(least, limit.get(name, np.inf))
            slope[name] = slope.get(name, 0.0) + cost
    return limit, slope


class _OfTolerance:
    """dT/d(tolerance) [s/mm].

    together : (M+1,) at the joints, raised at all; what steps pay goes to the nearer end of their leg
    alone    : (M+1,) of a joint alone, with the segments beside it whose budget grows; 0 of full stops
    """

    def __init__(self, toolpath: Toolpath, runs: list[RunPrices]):
        self.together = np.zeros(len(toolpath) + 1)
        vertex, segment = np.zeros(len(toolpath) + 1), np.zeros(len(toolpath))
        for run in runs:
            first = run.found.run.first
            paid, at_vertex = run.of(price.ROOM), run.vertex[1:-1]
            of_vertex = np.bincount(run.nearer_end(), paid, len(first)).astype(np.float64)
            of_vertex[1:-1] += at_vertex
            np.add.at(self.together, first, of_vertex / toolpath.tolerance[first])
            vertex[first[1:-1]] += at_vertex
            np.add.at(segment, run.segment, paid)
        tolerance = toolpath.tolerance
        grows_before = np.append(False, tolerance[1:] >= tolerance[:-1])
        grows_behind = np.append(tolerance[:-1] >= tolerance[1:], False)
        beside = grows_before * np.append(0.0, segment) + grows_behind * np.append(segment, 0.0)
        self.alone = np.where(toolpath.joint == Joint.STOP, 0.0, (vertex + beside) / tolerance)


def _by_place(toolpath: Toolpath, runs: list[RunPrices], by_joint: FloatArray) -> PlacePrices:
    """The prices by segment and joint."""
    feed, limits = np.zeros(len(toolpath)), np.zeros(len(toolpath))
    share = 1.0 - 1.0 / (1.0 + MORE_LIMIT)
    for run in runs:
        axes = len(run.found.run.axis)
        jerk, acceleration, velocity = (run.step[:, q * axes : (q + 1) * axes].sum(axis=1) for q in range(3))
        every = velocity + run.of(price.FEED) + acceleration + run.of(price.NORMAL) + jerk
        every = every + sum(run.of(price.LAWS + m) for m in run.found.run.laws.named)
        np.add.at(feed, run.segment, run.feed_saves)
        np.add.at(limits, run.segment, -share * every)
    return PlacePrices(feed=feed, limits=limits, tolerance=by_joint)
