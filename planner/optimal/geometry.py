"""Which geometry a time-optimal motion runs on: rounded corners, one spline, or the better of both from stop to stop.

"spline" puts splines in the place of all runs of corners that they fit (smoothing/) and reshapes them (optimal/reshape.py). "auto"
plans the rounded corners too, wherever they could be faster as far as their time without jerk limits tells, and keeps them between
the full stops where they are. That takes a grid point of their own grid at least, of which corners of a few um need 200 each where
jerks are low: stretches are compared in the order of what they could gain by point, up to `COMPARED_POINTS`, and the rest is said.

A run of which one place gets no spline, because the curve leaves the tolerance there, has no certificate or has a cusp where the path
turns back within the tolerance, would keep its single corners as a whole: the motion stops there instead, and the run is two. What
still gets none after some rounds is fenced off by two full stops, and keeps its single corners alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.reachability import Reachability
from planner.geometry.toolpath import Joint
from planner.job.stages import Stages
from planner.machine import Machine
from planner.optimal.reshape import OnPath, PlanOn, reshaped
from planner.optimal.second_order import second_order
from planner.path.samples import RESOLUTION, sample_path
from planner.smoothing.spline_path import SplineShape, lost_joints, spline_shape, with_spline

SPLINE, AUTO = "spline", "auto"

# Stops change the runs around them, which may then get no spline elsewhere; so often at most, the last time with fences.
STOP_ROUNDS = 4
COMPARED_POINTS = 1_000_000  # some 10 s and 1 GB
# On a grid of so many times the usual resolution the second-order time on corners comes out too long (9 % on chords of 0.1 mm): this
# share of it is less than what corners take (tested). The errors of a grid go with the square of its intervals: it has a tenth of the
# usual one's points (22.7 and 213 for each corner on chords of 20 um, 10.6 and 98 on chords of 0.3 mm, at a/j = 40 ms).
COARSER, COARSE_SHARE, FEWER = 100.0, 0.9, 10.0
# A job with fewer points than this is solved once more on a grid of this share of the resolution [-]; it gains about 1e-3 of the time.
FINE_POINTS, FINER = 20_000, 0.1


def on_spline(
    rounded: SmoothPath,
    machine: Machine,
    plan_on: Callable[[SmoothPath, float], OnPath],
    *,
    blend_tangents: bool,
    auto: bool,
    rounds: int | None,
    stages: Stages,
) -> OnPath:
    """The time-optimal motion on splines.

    rounded : the path with rounded corners
    plan_on : solves the feedrate problem on a path, on a grid of the usual resolution times a factor
    blend_tangents : as in `round_corners`, by which `rounded` was made
    auto    : keep the corners where they are faster
    rounds  : of reshaping; None for as many as the size of the job lets pay
    """

    def usual(path: SmoothPath) -> OnPath:
        return plan_on(path, 1.0)

    given = rounded
    with stages.stage("geometry"):
        rounded, shape = splined_with_stops(rounded, machine, blend_tangents)
    notes: tuple[str, ...] = ()
    if not shape.laid.fits.any():
        if runs := len(shape.laid.fits):
            line = _line(rounded, int(rounded.legs.first[shape.runs.joint_first[0]]))
            notes = (
                f"line {line}: no spline was found inside the tolerance, here and on all {runs} runs of corners",
            )
        return dataclasses.replace(usual(given), notes=notes)
    shape, best = reshaped(rounded, shape, usual, rounds, stages)
    if auto:
        with stages.stage("solve"):
            corners = corner_bounds(rounded, machine)
            of_given = corners if rounded is given else corner_bounds(given, machine)
        shape, best, left = _with_corners(rounded, shape, best, usual, corners)
        if len(left):
            line = _line(rounded, int(rounded.legs.first[rounded_stops(rounded)[left[0] + 1]]))
            notes = (
                f"line {line}: single corners were not compared on {len(left)} stretches between full stops, of which the first ends "
                f"here: their grids would have some {corners.points[left].sum():.2g} points",
            )
        small = of_given.points.sum() <= COMPARED_POINTS
        if rounded is not given and small and of_given.time.sum() < best.solution.cycle_time:
            without = usual(given)
            if without.solution.solved and without.solution.cycle_time < best.solution.cycle_time:
                return without
    if best.solution.solved and len(best.samples) <= FINE_POINTS:
        fine = plan_on(best.path, FINER)
        if fine.solution.solved and fine.solution.cycle_time < best.solution.cycle_time:
            best = fine
    return dataclasses.replace(best, shape=shape, notes=notes)


def splined_with_stops(
    rounded: SmoothPath, machine: Machine, blend_tangents: bool
) -> tuple[SmoothPath, SplineShape]:
    """The splines of a path, and the path with full stops where runs get none (module text)."""
    shape = spline_shape(rounded, machine)
    for again in range(STOP_ROUNDS):
        at = lost_joints(rounded, shape, fence=again == STOP_ROUNDS - 1)
        if not len(at):
            break
        stopping = rounded.toolpath.with_joints(at, Joint.STOP)
        rounded = round_corners(stopping, machine, rounded.corner, blend_tangents=blend_tangents)
        shape = spline_shape(rounded, machine)
    return rounded, shape


def _line(path: SmoothPath, joint: int) -> int:
    """The program's line that ends at a joint of the toolpath."""
    return int(path.toolpath.line[joint - 1])


class CornerBounds(NamedTuple):
    """Of a motion on corners between full stops: time (G,) that it takes at least [s], points (G,) of its grid, about."""

    time: FloatArray
    points: FloatArray


def corner_bounds(path: SmoothPath, machine: Machine) -> CornerBounds:
    """From the motion without jerk limits on a coarse grid; no time at all where that has no solution: then the corners are planned to
    see."""
    samples = sample_path(path, machine, COARSER * RESOLUTION, third_order=True)
    points = FEWER * np.diff(samples.piece)
    planned = second_order(path, samples, machine, Reachability())
    if not planned.solution.solved:
        return CornerBounds(np.zeros(len(points)), points)
    return CornerBounds(COARSE_SHARE * _piece_times(planned), points)


def rounded_stops(path: SmoothPath) -> Array:
    """(G+1,) the joints between legs at which the motion stops."""
    return np.flatnonzero(path.joint == Joint.STOP)


def _with_corners(
    rounded: SmoothPath, shape: SplineShape, best: OnPath, plan_on: PlanOn, corners: CornerBounds
) -> tuple[SplineShape, OnPath, Array]:
    """Corners instead of splines between the full stops where they are faster, and where that was too much to find out."""
    none = np.zeros(0, dtype=np.int64)
    if not best.solution.solved:
        if corners.points.sum() > COMPARED_POINTS:
            return shape, best, none
        planned = plan_on(rounded)
        return shape, planned if planned.solution.solved else best, none
    piece = np.searchsorted(best.samples.stop, shape.runs.joint_first) - 1
    chosen = np.zeros(len(corners.time), dtype=bool)
    chosen[piece[shape.laid.fits]] = True  # elsewhere there is nothing to choose
    gain = _piece_times(best) - corners.time
    chosen &= gain > 0.0
    ranked = np.flatnonzero(chosen)[np.argsort(-(gain / corners.points)[chosen], kind="stable")]
    left = np.sort(ranked[np.cumsum(corners.points[ranked]) > COMPARED_POINTS])
    chosen[left] = False
    for _ in range(2):  # the second time on those that turned out to be faster
        fits = shape.laid.fits & ~chosen[piece]
        if (fits == shape.laid.fits).all():
            break
        mixed = dataclasses.replace(shape, laid=shape.laid._replace(fits=fits))
        planned = plan_on(with_spline(rounded, mixed))
        if not planned.solution.solved:
            break
        slower = chosen & (_piece_times(planned) >= _piece_times(best))
        if not slower.any():
            faster = planned.solution.cycle_time < best.solution.cycle_time
            return (mixed, planned, left) if faster else (shape, best, left)
        chosen &= ~slower
    return shape, best, left


def _piece_times(planned: OnPath) -> FloatArray:
    """(G,) time between full stops [s]."""
    return np.add.reduceat(planned.solution.duration, planned.samples.piece[:-1])
