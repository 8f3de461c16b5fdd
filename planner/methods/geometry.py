"""Which geometry a time-optimal motion runs on: rounded corners, one spline, or the better of both from stop to stop.

"spline" puts splines in the place of all runs of corners that they fit (smoothing/) and reshapes them (methods/reshape.py). "auto"
plans the rounded corners too and keeps them between the full stops where they are faster; beyond `COMPARED_POINTS`, where it would
take as long again, it is "spline".

A run on which the spline has a cusp, where the path turns back within the tolerance, would keep its single corners as a whole: the
motion stops there instead, and the run is two.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.arrays import FloatArray
from planner.corners.smooth import SmoothPath, round_corners
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.methods.reshape import OnPath, PlanOn, reshaped
from planner.methods.stages import Stages
from planner.smoothing.spline_path import SplineShape, cusp_joints, spline_shape, with_spline

SPLINE, AUTO = "spline", "auto"

# Stops at cusps change the runs around them, which may then have others; so often at most.
CUSP_ROUNDS = 4
POINTS_PER_SPAN = 4  # about, on the grid that is not there yet
COMPARED_POINTS = 300_000
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
        return usual(given)
    shape, best = reshaped(rounded, shape, usual, rounds, stages)
    if auto and POINTS_PER_SPAN * len(shape.left) <= COMPARED_POINTS:
        shape, best = _with_corners(rounded, shape, best, usual)
        if rounded is not given:
            without = usual(given)
            if without.solution.solved and without.solution.cycle_time < best.solution.cycle_time:
                return without
    if best.solution.solved and len(best.samples) <= FINE_POINTS:
        fine = plan_on(best.path, FINER)
        if fine.solution.solved and fine.solution.cycle_time < best.solution.cycle_time:
            best = fine
    return dataclasses.replace(best, shape=shape)


def splined_with_stops(
    rounded: SmoothPath, machine: Machine, blend_tangents: bool
) -> tuple[SmoothPath, SplineShape]:
    """The splines of a path, and the path with full stops where they would have cusps."""
    shape = spline_shape(rounded, machine)
    for _ in range(CUSP_ROUNDS):
        at = cusp_joints(rounded, shape)
        if not len(at):
            break
        stopping = rounded.toolpath.with_joints(at, Joint.STOP)
        rounded = round_corners(stopping, machine, rounded.corner, blend_tangents=blend_tangents)
        shape = spline_shape(rounded, machine)
    return rounded, shape


def _with_corners(
    rounded: SmoothPath, shape: SplineShape, best: OnPath, plan_on: PlanOn
) -> tuple[SplineShape, OnPath]:
    """Corners instead of splines between the full stops where they are faster."""
    corners = plan_on(rounded)
    if not corners.solution.solved:
        return shape, best
    if not best.solution.solved:
        return shape, corners
    faster = _piece_times(corners) < _piece_times(best)
    piece = np.searchsorted(best.samples.stop, shape.runs.joint_first) - 1
    fits = shape.laid.fits & ~faster[piece]
    if fits.all() or (fits == shape.laid.fits).all():
        return shape, best
    mixed = dataclasses.replace(shape, laid=shape.laid._replace(fits=fits))
    planned = plan_on(with_spline(rounded, mixed))
    if planned.solution.solved and planned.solution.cycle_time < best.solution.cycle_time:
        return mixed, planned
    return shape, best


def _piece_times(planned: OnPath) -> FloatArray:
    """(G,) time between full stops [s]."""
    return np.add.reduceat(planned.solution.duration, planned.samples.piece[:-1])
