"""What a tenth more of a limit saves: the motion solved again with it, on a grid that is thinned out for the purpose.

A price is a slope, and ten per cent of a limit are a long way down a curve that flattens: soon another limit holds, a feed that an
axis cannot follow, a corner's normal acceleration. So the problem is solved once more for each limit that is worth it, on a part of
its grid: one point in `STEP` of the time a/j in which an axis builds up its acceleration, and, if these are more than `POINTS`, on
windows of them spread over the whole path. With p the price, and p', T', T'' price and times of the thinned problem without and with
more of the limit,

    saved = p (T' - T'') / p',

so that what thinning does to a motion, and the choice of windows, cancel to first order.

Rounded corners are rounded again for the changed machine (their size depends on accelerations and tolerance) and keep their grid
(path.moved_grid). Splines stay as they are here, though a plan made again would adapt their shape. So for them this is the least that
is saved, and the most is what a straight line says in one over the limit,

    p (1 - 1/(1 + more)),      for feeds and axis velocities with all bounds of the feed that then hold,

because the time is convex in one over a limit wherever it is exact for all limits together.

Slower by 1.1, a motion with 1.1 of any one limit keeps all the old ones: nothing saves more than T (1 - 1/1.1).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.constraints.assemble import feedrate_problem
from planner.constraints.own import ScaledLimit
from planner.constraints.problem import FeedrateProblem
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.lagrangian import lagrangian
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine
from planner.path.samples import PathSamples, moved_grid

STEP = 0.1  # of an interval of the thinned grid [a/j]; with 0.2 more jerk came out up to twice as valuable (pentagon)
INTERVALS_MIN = 12  # intervals that a piece keeps at least, as far as it has them
# The same with limits of one's own, whose rows bend on straight legs, too: with 0.1 a job that a joint holds everywhere was 4.6 %
# slower on the thinned grid, and more jerk of x saved 1.2 times what a new plan found; with 0.025 it is 0.7 % slower, and that is 0.98.
STEP_OWN = 0.025
# Of all thinned problems together: a quarter of the job's grid, but no fewer and no more than these.
POINTS, POINTS_MOST = SIZES.priced
WINDOW = SIZES.priced_window
SOLVER = JerkLimited(tol=1e-5)  # with a gap a tenth of the usual one: differences of times are wanted
SLOPE_STEP = 1e-4  # for the thinned problem's own price [-]: as in sensitivity/prices.py


@dataclass(frozen=True, eq=False, kw_only=True)
class Change:
    """More of something, as functions of the share that is added [-].

    machine   : share -> the machine with so much more
    feed      : share -> factor on the programmed feed [-]
    tolerance : share -> what is added to the tolerance [mm]
    """

    machine: Callable[[float], Machine]
    feed: Callable[[float], float] = lambda share: 1.0
    tolerance: Callable[[float], float] = lambda share: 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Thinned:
    """A solved part of the grid of a job, to try changes on.

    samples, scale : the grid, and its limit_scale
    sampled        : True if it consists of windows of the path only
    """

    samples: PathSamples
    scale: FloatArray
    sampled: bool
    solution: FeedrateSolution
    value: float  # of the Lagrangian [s]

    @property
    def rounds_again(self) -> bool:
        """True if changes move the path too; False for splines, which stay."""
        return rounds_again(self.samples.path)

    def saves(self, change: Change, share: float, price: float) -> float | None:
        """Time that a change saves for the whole job [s]; None if it is not found.

        share : how much more it is, as a fraction [-]
        price : dT/d(share) of the whole job [s]
        """
        try:
            near = lagrangian(_problem(*self._changed(change, SLOPE_STEP)), self.solution).value.sum()
            samples, machine, scale = self._changed(change, share)
            again = SOLVER.solve(_problem(samples, machine, scale))
        except ValueError:  # the grid has no room for it
            return None
        slope = (float(near) - self.value) / SLOPE_STEP
        if not again.solved or not slope * price > 0.0:
            return None
        gained = self.solution.cycle_time - again.cycle_time - self.opened(samples.path)
        return price / slope * gained

    def _changed(self, change: Change, share: float) -> tuple[PathSamples, Machine, FloatArray]:
        """Grid, machine and limit_scale with a share more of something."""
        samples, path, machine = self.samples, self.samples.path, change.machine(share)
        toolpath = dataclasses.replace(
            path.toolpath,
            feed=path.toolpath.feed * change.feed(share),
            tolerance=path.toolpath.tolerance + change.tolerance(share),
        )
        if self.rounds_again:
            rounded = round_corners(toolpath, machine, path.corner, blend_tangents=True)
            return moved_grid(samples, rounded), machine, self.scale
        moved = dataclasses.replace(samples, path=dataclasses.replace(path, toolpath=toolpath))
        return moved, machine, self.scale

    def opened(self, path: SmoothPath) -> float:
        """Time on parts of legs that another rounding leaves free and this one does not: the grid has no intervals there [s]."""
        if not self.rounds_again:
            return 0.0
        element = self.samples.element
        inside = np.ones(len(element) - 1, dtype=bool)
        inside[self.samples.piece[1:-1] - 1] = False
        meet = 1 + np.flatnonzero(
            inside & (element[1:] < 0) & (element[:-1] < 0) & (element[1:] != element[:-1])
        )
        leg = ~element[meet - 1]
        free = path.legs.length[leg] - path.d_out[leg] - path.d_in[leg + 1]
        v = np.sqrt(self.solution.feed_sq[meet])
        return float(np.divide(np.maximum(free, 0.0), v, out=np.zeros(len(v)), where=v > 0.0).sum())


def thinned(
    samples: PathSamples,
    problem: FeedrateProblem,
    solution: FeedrateSolution,
    machine: Machine,
    rows: int,
) -> Thinned | None:
    """The thinned grid of a solution, small enough for `rows` changes, solved without any of them; None if it has no solution."""
    again = rounds_again(samples.path)
    kept = _kept(samples, problem, solution, elements=again)
    piece, kept, sampled = windows_of_grid(
        samples.piece, kept, int(min(max(POINTS, len(samples) / 4), POINTS_MOST) / (rows + 1))
    )
    part = dataclasses.replace(_subset(samples, piece, kept), margin=problem.margin[kept])
    scale = problem.limit_scale[kept]
    try:
        if again:
            part = moved_grid(part, samples.path)
        own = _problem(part, machine, scale)
        found = SOLVER.solve(own)
    except ValueError:
        return None
    if not found.solved or found.multipliers is None:
        return None
    value = float(lagrangian(own, found).value.sum())
    return Thinned(samples=part, scale=scale, sampled=sampled, solution=found, value=value)


def more_of(machine: Machine, name: str) -> Callable[[float], Machine]:
    """A function that makes the machine with a given share more of a limit: "velocity.x" of an axis, or "velocity.NAME" of a limit of
    one's own, whose bound of that quantity is then so much larger everywhere."""
    quantity, _, of = name.partition(".")

    def more(share: float) -> Machine:
        limits = machine.axes[of]
        larger = limits.model_copy(update={quantity: getattr(limits, quantity) * (1.0 + share)})
        return machine.model_copy(update={"axes": machine.axes | {of: larger}})

    def more_of_own(share: float) -> Machine:
        return machine.with_own(
            [
                ScaledLimit(limit, quantity, 1.0 + share) if limit.name == of else limit
                for limit in machine.own
            ]
        )

    return more if of in machine.axes else more_of_own


def rounds_again(path: SmoothPath) -> bool:
    """True for paths whose corners can be rounded again: those without splines."""
    return isinstance(path, SmoothPath) and not len(path.spline)


def _problem(samples: PathSamples, machine: Machine, scale: FloatArray) -> FeedrateProblem:
    """The problem of a thinned grid."""
    return dataclasses.replace(feedrate_problem(samples, machine, between=False), limit_scale=scale)


def _kept(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution, *, elements: bool
) -> Array:
    """Indices of the points that a thinned grid keeps: the first in every `STEP` or `STEP_OWN`, the ends of pieces, the slowest places,
    and, if the grid will be moved, where one element or block ends."""
    axes = problem.machine_axes
    step = (STEP_OWN if problem.own else STEP) * float(
        (problem.acceleration[:axes] / problem.jerk[:axes]).min()
    )
    first, beyond = samples.piece[:-1], samples.piece[1:]
    count = beyond - first
    t = np.cumsum(solution.duration) - solution.duration
    lasting = t[beyond - 1] - t[first]
    steps = np.maximum(np.ceil(lasting / step), np.minimum(INTERVALS_MIN, count))
    number = np.floor((t - np.repeat(t[first], count)) / np.repeat(lasting / steps, count))
    few = np.repeat(count <= 2 * INTERVALS_MIN, count)
    keep = few | np.append(True, number[1:] != number[:-1])
    x = solution.feed_sq
    keep[1:-1] |= (x[1:-1] <= x[:-2]) & (x[1:-1] < x[2:])
    if elements:
        for column in (samples.element, samples.segment):
            keep[1:] |= column[1:] != column[:-1]
    keep[first] = keep[beyond - 1] = True
    return np.flatnonzero(keep)


def windows_of_grid(piece: Array, kept: Array, most: int) -> tuple[Array, Array, bool]:
    """Pieces (G+1,) of a thinned grid and its points (k,), in windows spread over all of them; True if these are not all points.

    piece : (G+1,) of the grid that was thinned
    kept  : (n,) its points that the thinned grid keeps
    most  : number of points in the windows, at most, but for a single window
    """
    start = np.searchsorted(kept, piece)
    if len(kept) <= max(most, WINDOW):
        return start, kept, False
    count = max(most // WINDOW, 1)
    first = np.linspace(0, len(kept) - WINDOW, count).astype(np.int64)
    chosen: list[Array] = []
    for begin in first:
        edges = np.unique(
            np.concatenate([[begin, begin + WINDOW], start[(start > begin) & (start < begin + WINDOW)]])
        )
        whole = np.isin(edges, start)  # what is cut from a piece needs room to start and stop
        for (a, b), ends in zip(pairwise(edges), pairwise(whole), strict=True):
            if all(ends) or b - a > INTERVALS_MIN:
                chosen.append(np.arange(a, b))
    sizes = np.cumsum([0, *(len(window) for window in chosen)])
    return sizes, kept[np.concatenate(chosen)], True


def _subset(samples: PathSamples, piece: Array, kept: Array) -> PathSamples:
    """The points `kept` of a grid as one with the given pieces; where its pieces begin in the toolpath is not told."""
    names = (
        "s", "position", "d1", "d2_left", "d2_right", "d3_left", "d3_right",
        "element", "w0", "segment", "margin", "kappa_left", "kappa_right",
    )  # fmt: skip
    columns = {name: getattr(samples, name)[kept] for name in names}
    w1 = samples.w1[np.append(kept[1:], kept[-1] + 1) - 1]
    return dataclasses.replace(samples, piece=piece, stop=np.zeros(len(piece)), w1=w1, **columns)
