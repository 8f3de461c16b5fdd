"""All limits of a job put together: from a sampled path to the feedrate problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import NotSolvedError
from planner.feedrate.constraints.limit import Cap, Limit
from planner.feedrate.constraints.limits import LIMITS, Limits
from planner.feedrate.constraints.on_grid import OnGrid
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.constraints.user_limits import user_inside, with_user_limits
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine import Machine

# Share of the bounds [-] for what effective curvatures miss beside the middle of an interval: up to 4e-4.
CURVATURE_MARGIN = 5e-4
# Of a problem what its path has.
OF_SAMPLES = ("piece", "s", "d1", "d2_left", "d2_right", "d3_left", "d3_right", "margin")


def feedrate_problem(samples: PathSamples, machine: Machine, *, measured: bool = False) -> FeedrateProblem:
    """The feedrate problem of a sampled path on a machine; rest at both ends of every piece.

    measured : the error of the machine's filters is measured afterwards (behind_filters.py); bounded here on
    programmed
        arcs only

    Raises InputError if the machine lacks an axis of the path, NotSolvedError if the grid is too coarse.
    """
    if samples.margin.max(initial=0.0) >= 1.0:
        worst = int(samples.margin.argmax())
        line = int(samples.path.toolpath.line[samples.segment[worst]])
        raise NotSolvedError(
            f"the path turns faster at line {line} than a grid of the finest step follows: moves there are too short for "
            "this smoothing; leave them out, or use --corner bezier or --method stop"
        )
    grid = OnGrid(samples, machine, measured)
    caps, limits = _caps(grid), Limits.of(machine, grid.axes)
    problem = FeedrateProblem(
        axes=grid.axes,
        **{name: getattr(samples, name) for name in OF_SAMPLES},
        velocity=limits.velocity,
        acceleration=limits.acceleration,
        jerk=limits.jerk,
        feed_sq_max=caps.feed_sq_max,
        feed_sq_bound=caps.which,
        bound_names=tuple(caps.names),
    )
    return with_user_limits(problem, samples, limits) if limits.along else problem


def interval_feed_sq_max(samples: PathSamples, machine: Machine) -> FloatArray:
    """(P,) bound of feed^2 inside straight intervals: programmed feed and axis velocities [mm2/s2]."""
    grid = OnGrid(samples, machine)
    found = [bound for limit in LIMITS if (bound := limit.inside(grid)) is not None]
    feed_sq = np.min(found, axis=0)
    limits = Limits.of(machine, grid.axes)
    return np.minimum(feed_sq, user_inside(samples, limits)) if limits.along else feed_sq


def bounds_of(samples: PathSamples, machine: Machine, limits: Sequence[Limit]) -> FloatArray:
    """(P,) bound of feed^2 by some of `LIMITS`, no user limits; inf where they bound nothing [mm2/s2]."""
    return _caps(OnGrid(samples, machine), limits).feed_sq_max


def _caps(grid: OnGrid, limits: Sequence[Limit] = LIMITS) -> _Caps:
    """The smallest caps of limits."""
    caps = _Caps(len(grid.samples))
    for limit in limits:
        for cap in limit.at_points(grid):
            caps.tighten(cap)
    sided = [limit for limit in limits if type(limit).on_side is not Limit.on_side]
    for side in grid.sides() if sided else ():
        for limit in sided:
            for cap in limit.on_side(side, grid.machine):
                caps.tighten(Cap(cap.name, cap.feed_sq * (1.0 - CURVATURE_MARGIN)))
    for limit in limits:
        for cap in limit.at_jumps(grid):
            caps.tighten(cap)
    return caps


class _Caps:
    """The running minimum of all caps, and which one it is."""

    def __init__(self, points: int):
        self.feed_sq_max = np.full(points, np.inf)
        self.which = np.zeros(points, dtype=np.int64)
        self.names: list[str] = []

    def tighten(self, cap: Cap) -> None:
        """Keep what is smaller of the cap; of equal ones the earlier stays."""
        if cap.name not in self.names:
            self.names.append(cap.name)
        tighter = cap.feed_sq < self.feed_sq_max
        self.feed_sq_max[tighter] = cap.feed_sq[tighter]
        self.which[tighter] = self.names.index(cap.name)
