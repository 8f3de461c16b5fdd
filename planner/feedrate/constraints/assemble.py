"""All limits of a job put together: from a sampled path to the feedrate problem.

Each limit of one's own is an axis more (machine/user_limit.py says what they are, feedrate/sampling/user_rows.py makes
their rows). These axes are scaled by 1/max |q'|, so that none of them moves faster than the path; whatever unit a limit is
in, solvers see numbers like those of the machine's axes. Rows are shares of limits, so that scaling changes
nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import NotSolvedError
from planner.feedrate.constraints.limit import Cap, Limit
from planner.feedrate.constraints.limits import LIMITS, VELOCITY, Limits
from planner.feedrate.constraints.on_grid import OnGrid
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.user_rows import user_rows
from planner.machine import Machine

DERIVATIVES = ("d1", "d2_left", "d2_right", "d3_left", "d3_right")


def with_user_limits(problem: FeedrateProblem, samples: PathSamples, limits: Limits) -> FeedrateProblem:
    """The problem with the limits `along` as further axes; the margin says what is found between the points.

    Raises NotSolvedError where a limit changes faster than the grid follows, InputError for a bound that is
    not positive and for a joint without derivatives.
    """
    rows, own = user_rows(samples, limits), tuple(limit.name for limit in limits.along)
    if rows.margin.max() >= 1.0:
        line = int(samples.path.toolpath.line[samples.segment[int(rows.margin.argmax())]])
        raise NotSolvedError(
            f"one of the limits {', '.join(own)} changes faster at line {line} than a grid of the finest step follows"
        )
    fastest = np.abs(rows.d1).max(axis=0)
    unit = np.divide(1.0, fastest, out=np.ones(len(fastest)), where=fastest > 0.0)
    caps, names = problem.feed_sq_max.copy(), list(problem.bound_names)
    which = problem.feed_sq_bound.copy()
    for k, name in enumerate(own):
        tighter = rows.feed_sq_max[:, k] < caps
        caps[tighter], which[tighter] = rows.feed_sq_max[tighter, k], len(names)
        names.append(VELOCITY.called(name))
    least = [getattr(rows, q).min(axis=0) for q in ("acceleration", "jerk")]

    return replace(
        problem,
        axes=problem.axes + own,
        **{name: np.hstack([getattr(problem, name), unit * getattr(rows, name)]) for name in DERIVATIVES},
        velocity=np.append(problem.velocity, np.minimum(unit * rows.least[0], np.finfo(float).max)),
        acceleration=np.append(problem.acceleration, unit * least[0]),
        jerk=np.append(problem.jerk, unit * least[1]),
        feed_sq_max=caps,
        feed_sq_bound=which,
        bound_names=tuple(names),
        margin=np.maximum(problem.margin, rows.margin),
        own=len(own),
        own_here=np.stack([rows.acceleration / least[0], rows.jerk / least[1]]),
        own_least=rows.least,
    )


def user_inside(samples: PathSamples, limits: Limits) -> FloatArray:
    """(P,) what the limits `along` allow of feed^2 inside the interval to the right of each point; inf where
    nothing limits, and where a piece ends [mm2/s2]."""
    at = samples.intervals
    own = user_rows(samples, limits).feed_sq_max.min(axis=1)
    inside = np.full(len(samples), np.inf)
    inside[at] = np.maximum(own[at], own[at + 1])
    return inside


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
