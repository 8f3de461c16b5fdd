"""Which geometry a time-optimal motion runs on: rounded corners, one spline, or the better of both from stop to stop.

"spline" puts splines in the place of all runs of corners that they fit (smoothing/) and reshapes them (methods/reshape.py). "auto"
plans the rounded corners too, wherever they could be faster as far as their time without jerk limits tells, and keeps them between
the full stops where they are; beyond `COMPARED_POINTS`, where that takes minutes and twice the memory, it is "spline".

A run of which one place gets no spline, because the curve leaves the tolerance there, has no certificate or has a cusp where the path
turns back within the tolerance, would keep its single corners as a whole: the motion stops there instead, and the run is two. What
still gets none after some rounds is fenced off by two full stops, and keeps its single corners alone. `given_up` says all of it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.arrays import FloatArray
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.reachability import Reachability
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.methods.reshape import OnPath, PlanOn, reshaped
from planner.methods.second_order import second_order
from planner.methods.stages import Stages
from planner.path import RESOLUTION, sample_path
from planner.smoothing.spline_path import SplineShape, lost_joints, spline_shape, with_spline

SPLINE, AUTO = "spline", "auto"

# Stops change the runs around them, which may then get no spline elsewhere; so often at most, the last time with fences.
STOP_ROUNDS = 4
POINTS_PER_SPAN = 4  # about, on the grid that is not there yet
COMPARED_POINTS = 1_000_000
# On a grid of so many times the usual resolution the second-order time on corners comes out too long (9 % on chords of 0.1 mm): this
# share of it is less than what corners take (tested).
COARSER, COARSE_SHARE = 100.0, 0.9
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
    if not shape.laid.fits.any():
        return dataclasses.replace(usual(given), notes=given_up(rounded, rounded, shape))
    notes = given_up(given, rounded, shape)
    shape, best = reshaped(rounded, shape, usual, rounds, stages)
    if auto and POINTS_PER_SPAN * len(shape.left) <= COMPARED_POINTS:
        with stages.stage("solve"):
            least = _least_times(rounded, machine)
            least_given = least if rounded is given else _least_times(given, machine)
        shape, best = _with_corners(rounded, shape, best, usual, least)
        if rounded is not given and least_given.sum() < best.solution.cycle_time:
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


def given_up(given: SmoothPath, rounded: SmoothPath, shape: SplineShape) -> tuple[str, ...]:
    """Sentences on what splines did not do: full stops that `given` did not have, and runs that keep their single corners."""
    said = []
    stops = np.flatnonzero((rounded.toolpath.joint == Joint.STOP) & (given.toolpath.joint != Joint.STOP))
    if len(stops):
        said.append(
            f"{len(stops)} full stops where no curve fits inside the tolerance, the first after line {_line(rounded, stops[0])}"
        )
    lost = np.flatnonzero(~shape.laid.fits)
    if len(lost):
        corners = int((shape.runs.joint_last - shape.runs.joint_first + 1)[lost].sum())
        first = rounded.legs.first[shape.runs.joint_first[lost[0]]]
        said.append(
            f"{corners} corners are rounded one by one because no curve through them fits inside the tolerance, "
            f"the first after line {_line(rounded, first)}"
        )
    return tuple(said)


def _line(path: SmoothPath, joint: int) -> int:
    """The program's line that ends at a joint of the toolpath."""
    return int(path.toolpath.line[joint - 1])


def _with_corners(
    rounded: SmoothPath, shape: SplineShape, best: OnPath, plan_on: PlanOn, least: FloatArray
) -> tuple[SplineShape, OnPath]:
    """Corners instead of splines between the full stops where they are faster; `least` (G,) time that they take there [s]."""
    if not best.solution.solved:
        corners = plan_on(rounded)
        return shape, corners if corners.solution.solved else best
    piece = np.searchsorted(best.samples.stop, shape.runs.joint_first) - 1
    on_corners = np.zeros(len(least), dtype=bool)
    on_corners[piece[shape.laid.fits]] = True  # elsewhere there is nothing to choose
    on_corners &= least < _piece_times(best)
    for _ in range(2):  # the second time on those that turned out to be faster
        fits = shape.laid.fits & ~on_corners[piece]
        if (fits == shape.laid.fits).all():
            break
        mixed = dataclasses.replace(shape, laid=shape.laid._replace(fits=fits))
        planned = plan_on(with_spline(rounded, mixed))
        if not planned.solution.solved:
            break
        slower = on_corners & (_piece_times(planned) >= _piece_times(best))
        if not slower.any():
            return (
                (mixed, planned) if planned.solution.cycle_time < best.solution.cycle_time else (shape, best)
            )
        on_corners &= ~slower
    return shape, best


def _least_times(path: SmoothPath, machine: Machine) -> FloatArray:
    """(G,) time between full stops that a motion on a path's corners takes at least [s]: without jerk limits, on a coarse grid.
    None at all where that has no solution: then the corners are planned to see."""
    samples = sample_path(path, machine, COARSER * RESOLUTION)
    planned = second_order(path, samples, machine, Reachability())
    if not planned.solution.solved:
        return np.zeros(len(samples.piece) - 1)
    return COARSE_SHARE * _piece_times(planned)


def _piece_times(planned: OnPath) -> FloatArray:
    """(G,) time between full stops [s]."""
    return np.add.reduceat(planned.solution.duration, planned.samples.piece[:-1])
