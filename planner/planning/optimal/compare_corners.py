"""Single corners instead of splines, on the runs between full stops where they are faster.

The motion without jerk limits on a coarse grid gives a lower bound on the time of single corners. If the bound
is above the time of the splines, there is nothing to compare. Otherwise the corners are planned, by
themselves: on the grid of the rounds, those that are still close to the splines on the final one, and those
that win with the whole path. That takes at least the points of their own grid, of which corners of a few um
need 200 each if jerks are low; runs are therefore compared in the order of their possible gain per point, up
to `COMPARED_POINTS`, and the notes say which runs were left out.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.corners.smooth import SmoothPath
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.samples import RESOLUTION, sample_path
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.planning.job.job import Job
from planner.planning.optimal.effort import Grids
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import Order, second_order
from planner.smoothing.spline_path import with_spline

COMPARED_POINTS = SIZES.corners_compared
# Points on a grid of the usual resolution, about: of a corner (98 on chords of 0.3 mm, 213 on chords of 20
# um, at a/j = 40 ms), and of the rest of a leg.
CORNER_POINTS, LEG_POINTS = 100.0, 10.0
# On a grid of so many times the usual resolution the second-order time on corners comes out too long (9 % on
# chords of 0.1 mm): this share of it is less than what corners take (tested). The errors of a grid go with
# the square of its intervals: it has a tenth of the usual one's points (22.7 and 213 for each corner on
# chords of 20 um, 10.6 and 98 on chords of 0.3 mm, at a/j = 40 ms).
COARSER, COARSE_SHARE, FEWER = 100.0, 0.9, 10.0

# Corners that take so many times as long as splines on the first grid are not tried on the final one [-].
CLOSE = 1.01
FASTER = 1e-4  # corners that save less of the whole time are not worth it [-]: the solver's own gap


class CornerBounds(NamedTuple):
    """Of a motion on corners between G full stops: least time (G,) [s], points (G,) of its grid, about."""

    time: FloatArray
    points: FloatArray


def corner_bounds(path: SmoothPath, machine: Machine) -> CornerBounds:
    """Bounds from the motion without jerk limits on a coarse grid. Of paths of more than `COMPARED_POINTS`
    points, and of a motion without a solution there, nothing is known: no time at all, so that the corners
    are planned to see. Corners that no grid follows have no motion: their runs take forever.
    """
    stop = np.flatnonzero(path.joint == Joint.STOP)
    points = np.add.reduceat(LEG_POINTS + CORNER_POINTS * (path.d[:-1] > 0.0), stop[:-1])
    if points.sum() > COMPARED_POINTS:
        return CornerBounds(np.zeros(len(points)), points)
    samples = sample_path(path, machine, COARSER * RESOLUTION, third_order=True)
    points = FEWER * np.diff(samples.piece)
    followed = np.maximum.reduceat(samples.margin, samples.piece[:-1]) < 1.0
    if not followed.all():
        time = np.full(len(points), np.inf)
        if followed.any():
            time[followed] = corner_bounds(path.part(followed), machine).time
        return CornerBounds(time, points)
    planned = second_order(path, samples, machine, Reachability())
    if not planned.solution.solved:
        return CornerBounds(np.zeros(len(points)), points)
    return CornerBounds(COARSE_SHARE * planned.stop_to_stop(), points)


def with_corners(
    rounded: SmoothPath, best: OnPath, corners: CornerBounds, job: Job, order: Order, grids: Grids
) -> tuple[OnPath, Array]:
    """Corners instead of splines between the full stops where they are faster; (L,) runs not compared.

    rounded : the path with the corners that the splines of `best` replace
    corners : bounds on the motion on them
    grids   : of corners at first, and the final one, of `best`
    """
    none = np.zeros(0, dtype=np.int64)
    shape = best.shape
    assert shape is not None
    if not best.solution.solved:
        if corners.points.sum() > COMPARED_POINTS:
            return best, none
        planned = order.solve(rounded, job, grids.final)
        return dataclasses.replace(planned, shape=shape) if planned.solution.solved else best, none
    piece = np.searchsorted(best.samples.stop, shape.runs.joint_first) - 1
    chosen = np.zeros(len(corners.time), dtype=bool)
    chosen[piece[shape.splines.fits]] = True  # elsewhere there is nothing to choose
    gain = best.stop_to_stop() - corners.time
    chosen &= gain > 0.0
    ranked = np.flatnonzero(chosen)[np.argsort(-(gain / corners.points)[chosen], kind="stable")]
    left = np.sort(ranked[np.cumsum(corners.points[ranked]) > COMPARED_POINTS])
    chosen[left] = False
    job.tell("bound on corners", found=corners.time.sum(), runs=len(ranked), left=len(left))
    splines = best.stop_to_stop()
    for resolution, fraction in ((grids.first, CLOSE), (grids.final, 1.0)):
        if not chosen.any():
            return best, left
        planned = order.solve(rounded.part(chosen), job, resolution)
        if not planned.solution.solved:
            return best, left
        time, before = planned.stop_to_stop(), splines[chosen]
        faster = time < fraction * before
        job.tell("corners", found=time.sum(), before=before.sum(), runs=len(time), faster=int(faster.sum()))
        chosen[chosen] = faster
    if not chosen.any() or (before - time)[faster].sum() < FASTER * best.solution.cycle_time:
        return best, left
    mixed = dataclasses.replace(
        shape, splines=shape.splines._replace(fits=shape.splines.fits & ~chosen[piece])
    )
    planned = order.solve(with_spline(rounded, mixed), job, grids.final)
    return dataclasses.replace(planned, shape=mixed) if planned.faster_than(best) else best, left
