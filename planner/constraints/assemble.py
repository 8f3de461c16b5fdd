"""All limits of a job put together: from a sampled path to the feedrate problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import NotSolvedError
from planner.base.units import RAD_PER_DEG
from planner.constraints import bounds, normal_limit
from planner.constraints.problem import FeedrateProblem
from planner.corners.allocation import error_rate
from planner.machine import Machine
from planner.path.own_rows import own_rows
from planner.path.samples import PathSamples

# The effective curvature is exact in the middle of an interval; at its quarters up to 4e-4 is missing on grids of the default
# resolution (measured in tests/path), which this share of the bounds makes good [-].
CURVATURE_MARGIN = 5e-4
# Jumps of r'' below this are rounding of the two elements' formulas [share of the larger r''].
JUMP_ROUNDING = 1e-6


def feedrate_problem(samples: PathSamples, machine: Machine, *, measured: bool = False) -> FeedrateProblem:
    """The feedrate problem of a sampled path on a machine; rest at both ends of every piece.

    measured : the error of the machine's filters is measured afterwards (optimal/behind_filters.py), and bounded here on programmed
        arcs only

    Raises InputError if the machine lacks an axis of the path, NotSolvedError if the grid is too coarse for the path.
    """
    axes = samples.path.toolpath.axes
    if samples.margin.max(initial=0.0) >= 1.0:
        worst = int(samples.margin.argmax())
        line = int(samples.path.toolpath.line[samples.segment[worst]])
        raise NotSolvedError(
            f"the path turns faster at line {line} than a grid of the finest step follows: moves there are too short for "
            "this smoothing; leave them out, or use --corner bezier or --method stop"
        )
    collected = _Collector(len(samples))
    left, right = interval_sides(samples)
    feed_sq = bounds.programmed_feed(samples.path.toolpath.feed[samples.segment])
    collected.tighten("feed", np.minimum(feed_sq[left], feed_sq[right]))
    per_axis, axis = bounds.axis_velocity(samples.d1, machine.limits("velocity", axes))
    per_axis = per_axis * (
        1.0 - np.maximum(samples.margin[left], samples.margin[right])
    )  # r' turns between the points
    for k, letter in enumerate(axes):
        collected.tighten(f"velocity.{letter}", np.where(axis == k, per_axis, np.inf))
    budget = _remaining_budget(samples, machine)
    closed = _programmed(samples) | (not measured)
    for side, kappa in ((left, samples.kappa_left), (right, samples.kappa_right)):
        for name, bound in _curvature_bounds(kappa, budget[side], closed[side], machine):
            collected.tighten(name, bound * (1.0 - CURVATURE_MARGIN))
    jump, axis = bounds.curvature_jump(*_jumps(samples), machine.limits("acceleration", axes))
    for k, letter in enumerate(axes):
        collected.tighten(f"curvature_jump.{letter}", np.where(axis == k, jump, np.inf))
    pieces = len(samples.piece) - 1
    problem = FeedrateProblem(
        piece=samples.piece,
        s=samples.s,
        axes=axes,
        d1=samples.d1,
        d2_left=samples.d2_left,
        d2_right=samples.d2_right,
        d3_left=samples.d3_left,
        d3_right=samples.d3_right,
        velocity=machine.limits("velocity", axes),
        acceleration=machine.limits("acceleration", axes),
        jerk=machine.limits("jerk", axes),
        feed_sq_max=collected.feed_sq_max,
        feed_sq_bound=collected.which,
        bound_names=tuple(collected.names),
        margin=samples.margin,
        feed_sq_start=np.zeros(pieces),
        feed_sq_end=np.zeros(pieces),
    )
    return _with_own(problem, samples, machine) if machine.own else problem


def _with_own(problem: FeedrateProblem, samples: PathSamples, machine: Machine) -> FeedrateProblem:
    """The problem with the machine's own limits as further axes, in units in which none of them moves faster than the path."""
    rows = own_rows(samples, machine)
    if rows.margin.max() >= 1.0:
        line = int(samples.path.toolpath.line[samples.segment[int(rows.margin.argmax())]])
        all_names = ", ".join(rows.names)
        raise NotSolvedError(
            f"one of the limits {all_names} changes faster at line {line} than a grid of the finest step follows"
        )
    fastest = np.abs(rows.d1).max(axis=0)
    unit = np.divide(1.0, fastest, out=np.ones(len(fastest)), where=fastest > 0.0)
    bounds, names = problem.feed_sq_max.copy(), list(problem.bound_names)
    which = problem.feed_sq_bound.copy()
    for k, name in enumerate(rows.names):
        tighter = rows.feed_sq_max[:, k] < bounds
        bounds[tighter], which[tighter] = rows.feed_sq_max[tighter, k], len(names)
        names.append(f"velocity.{name}")
    least = [getattr(rows, q).min(axis=0) for q in ("acceleration", "jerk")]

    def columns(name: str) -> FloatArray:
        return np.hstack([getattr(problem, name), unit * getattr(rows, name)])

    return replace(
        problem,
        axes=problem.axes + rows.names,
        d1=columns("d1"),
        d2_left=columns("d2_left"),
        d2_right=columns("d2_right"),
        d3_left=columns("d3_left"),
        d3_right=columns("d3_right"),
        velocity=np.append(problem.velocity, unit * rows.velocity),
        acceleration=np.append(problem.acceleration, unit * least[0]),
        jerk=np.append(problem.jerk, unit * least[1]),
        feed_sq_max=bounds,
        feed_sq_bound=which,
        bound_names=tuple(names),
        margin=np.maximum(problem.margin, rows.margin),
        own=len(rows.names),
        own_here=np.stack([rows.acceleration / least[0], rows.jerk / least[1]]),
    )


def interval_feed_sq_max(samples: PathSamples, machine: Machine) -> FloatArray:
    """(P,) bound of feed^2 inside straight intervals: programmed feed and axis velocities [mm2/s2]."""
    feed_sq = bounds.programmed_feed(samples.path.toolpath.feed[samples.segment])
    velocity, _ = bounds.axis_velocity(samples.d1, machine.limits("velocity", samples.path.toolpath.axes))
    feed_sq = np.minimum(feed_sq, velocity)
    if machine.own:
        at = samples.intervals
        own = own_rows(samples, machine).feed_sq_max.min(axis=1)
        feed_sq[at] = np.minimum(feed_sq[at], np.maximum(own[at], own[at + 1]))
    return feed_sq


def interval_sides(samples: PathSamples) -> tuple[Array, Array]:
    """Indices (P,) of the interval to the left and (P,) to the right of every point; at a piece's ends the only one there is."""
    right = np.arange(len(samples))
    left = right - 1
    left[samples.piece[:-1]] += 1
    right[samples.piece[1:] - 1] -= 1
    return left, right


def _remaining_budget(samples: PathSamples, machine: Machine) -> FloatArray:
    """(P,) what the rounding leaves of the contour budget for chord and filter errors, per interval [mm]."""
    path = samples.path
    element = samples.element
    corner = element < 0
    joint = np.where(corner, ~element, 0)
    tolerance = path.toolpath.tolerance
    whole = np.minimum(tolerance[samples.segment], tolerance[samples.segment + 1])
    budget = np.where(corner, path.tol[joint] - path.tol_ap[joint], whole)
    span = element - len(samples.table.legs)
    if (span >= 0).any():
        budget[span >= 0] = path.spline.budget[span[span >= 0]]
    return budget


def _programmed(samples: PathSamples) -> Array:
    """(P,) True for intervals on programmed lines and arcs."""
    return (samples.element >= 0) & (samples.element < len(samples.table.legs))


def _curvature_bounds(
    kappa: FloatArray, budget: FloatArray, closed: Array, machine: Machine
) -> list[tuple[str, FloatArray]]:
    """The bounds that depend on curvature. Where `closed`, chord and filter errors share the budget in proportion (docs/papers.md D);
    elsewhere the chord has the whole of it."""
    rate = error_rate(machine)
    found = []
    across = normal_limit.feed_sq_max(kappa, machine)
    if across is not None:
        found.append((normal_limit.NAME, across))
    tol_chord = np.where(closed, budget * (machine.dt**2 / 8.0 / rate), budget)
    found.append(("chord_error", bounds.chord_error(kappa, tol_chord, machine.dt)))
    if machine.fir is not None:
        filters = machine.fir.time_constants
        found.append(
            (
                "filter_error",
                np.where(closed, bounds.filter_error(kappa, budget - tol_chord, filters), np.inf),
            )
        )
        if machine.fir.phase_lag_max is not None:
            angle = machine.fir.phase_lag_max * RAD_PER_DEG
            found.append(("phase_lag", bounds.phase_lag(kappa, angle, filters)))
    return found


def _jumps(samples: PathSamples) -> tuple[FloatArray, FloatArray]:
    """r'' on both sides of every point, made equal where they differ by rounding only."""
    left, right = samples.d2_left, samples.d2_right
    size = np.maximum(np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1))
    real = np.linalg.norm(right - left, axis=1) > JUMP_ROUNDING * size
    return left, np.where(real[:, None], right, left)


class _Collector:
    """The running minimum of all bounds, and which one it is."""

    def __init__(self, points: int):
        self.feed_sq_max = np.full(points, np.inf)
        self.which = np.zeros(points, dtype=np.int64)
        self.names: list[str] = []

    def tighten(self, name: str, bound: FloatArray) -> None:
        if name not in self.names:
            self.names.append(name)
        tighter = bound < self.feed_sq_max
        self.feed_sq_max[tighter] = bound[tighter]
        self.which[tighter] = self.names.index(name)
