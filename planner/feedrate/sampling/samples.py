"""The smooth path sampled along its arc length, on a grid fine enough for linear interpolation.

A second-order solver sees the axis acceleration g(s) = r'(s) u + r''(s) x(s) only at grid points; in an
interval u is constant and x = feed^2 linear. Between the points g leaves the chord of its end values by at
most (midpoint values, one interval of length h, fastest x and largest u that the limits allow there)

    e_k = x |r''_mid - (r''_0 + r''_1)/2|  +  u h |r''_1 - r''_0|/2  +  u |r'_mid - (r'_0 + r'_1)/2|        per axis k

(the second term comes from the product of two linear functions). An interval is halved until max_k e_k / a_k
is below `RESOLUTION`; for solvers of third order the error of the axis jerk at constant speed, relative to
its limit, may be `JERK_SHARE` times as large, and x is bounded by the jerk limits as well. What remains is
kept per interval as `margin`, and the constraints are tightened by it, so that they hold between grid points
and not only at them. Straight elements need one interval: there g is exactly linear.

PathLimits of the form kappa x <= X hold between the points by another device that costs nothing at the apex
of a corner. A cap X/kappa is convex there, so a line through two caps would cut the corner; the end with the
larger curvature keeps its cap and the other end gets a slightly larger *effective* curvature, such that the
line meets X/kappa_mid in the middle:

    1/kappa_low = min(1/kappa_low, 2/kappa_mid - 1/kappa_high);     both ends kappa_mid where that is the largest.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.corners.elements import ElementTable, element_table
from planner.corners.smooth import SmoothPath
from planner.feedrate.constraints.limits import Limits
from planner.feedrate.sampling.feed_limited import FeedLimited, feed_limited, quiet_way
from planner.feedrate.sampling.grid import Intervals, divide, evaluate, grade
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.rows import Joints, Longest, PathLimits, cut_path
from planner.feedrate.sampling.user_rows import user_rows
from planner.geometry.toolpath import Joint
from planner.machine import Machine

# Interpolation error of the axis accelerations that the grid may have [share of the limit]: cycle times are
# 0.6e-3 to 3e-3 above those of a fine grid (tests/feedrate/sampling), as u is constant on intervals.
RESOLUTION = 2e-3
# Jobs with more corners than the first number get the second resolution, or grids would fill the memory.
MANY_CORNERS, COARSE_RESOLUTION = SIZES.corners_finely, 1e-2
# For solvers of third order an interval on an arc or a span lasts at most this share of a/j, the time an axis
# needs for its acceleration [-], where feedrate/sampling/feed_limited.py does not say that it may last longer.
ARC_PERIOD = 0.5
# ... and the first interval after a full stop is what the jerk makes of this share of a/j [-].
REST_PERIOD = 0.25
# A spline passes a change of the feed within so many tolerances of where the program has it [-].
NEAR = 2.0
# Rounds of halving intervals for limits of one's own, down to a um: from 10^9 km at most.
HALVINGS_OF_OWN = 60


def sample_path(
    path: SmoothPath, machine: Machine, resolution: float | None = None, *, third_order: bool = False
) -> PathSamples:
    """Sample a smooth path on an adaptive grid.

    resolution  : interpolation error allowed between grid points [share of the acceleration limits]; None for
                  `RESOLUTION`, or `COARSE_RESOLUTION` where there are many corners
    third_order : the grid is for a solver with jerk limits

    Raises InputError if the machine lacks an axis of the path.
    """
    axes = path.toolpath.axes
    if resolution is None:
        resolution = RESOLUTION if np.count_nonzero(path.d) <= MANY_CORNERS else COARSE_RESOLUTION
    table = element_table(path)
    of_machine = Limits.of(machine, axes)
    velocity, acceleration = of_machine.velocity, of_machine.acceleration
    jerk, longest, shortest = np.full(len(axes), np.inf), np.inf, np.inf
    if third_order:
        jerk = of_machine.jerk
        delay = float((acceleration / jerk).min())
        longest = ARC_PERIOD * delay
        shortest = float(jerk.min()) * (REST_PERIOD * delay) ** 3 / 6.0
    acceleration = np.minimum(acceleration, of_machine.normal)
    where_calm = FeedLimited(np.array([[-np.inf, np.inf]]), np.zeros(len(table.legs) + len(table.spans)))
    if third_order:
        where_calm = feed_limited(path, table, (velocity, acceleration, jerk))
    limits = PathLimits(path.toolpath.feed, velocity, acceleration, jerk)
    quiet = quiet_way(path.toolpath.feed, acceleration, jerk)
    rows = cut_path(table, _joints(path), limits, Longest(longest, *where_calm, quiet))
    rows = divide(table, rows, limits, resolution, shortest)
    if third_order:
        rows = grade(table.legs, rows)
    samples = _samples_of(path, table, rows, limits)
    if of_machine.along:
        for _ in range(HALVINGS_OF_OWN):
            coarse = np.flatnonzero(user_rows(samples, of_machine, resolution).coarse)
            if not len(coarse):
                break
            rows = np.insert(rows, coarse + 1, rows[coarse])
            behind = coarse + np.arange(1, len(coarse) + 1)
            rows["w1"][behind - 1] = rows["w0"][behind] = 0.5 * (rows["w0"][behind] + rows["w1"][behind])
            samples = _samples_of(path, table, rows, limits)
    return samples


def _samples_of(path: SmoothPath, table: ElementTable, rows: Array, limits: PathLimits) -> PathSamples:
    """The path on the grid of the rows (P,) of feedrate/sampling/rows.py."""
    grid = Intervals(*(rows[name].copy() for name in ("curve", "w0", "w1", "segment", "last")))
    return PathSamples(
        path=path,
        table=table,
        piece=np.concatenate([[0], np.flatnonzero(grid.last) + 1]),
        stop=np.flatnonzero(path.joint == Joint.STOP),
        element=grid.element,
        w0=grid.w0,
        w1=grid.w1,
        segment=grid.segment,
        **evaluate(table, grid, limits)._asdict(),
    )


def _joints(path: SmoothPath) -> Joints:
    """The kernels' view of what the path does between its legs."""
    return Joints(
        first=path.legs.first,
        place=path.legs.place,
        passed=path.passed,
        d_in=path.d_in,
        d_out=path.d_out,
        blended=path.d > 0.0,
        is_stop=path.joint == Joint.STOP,
        breaks=_corner_breaks(path),
        run=path.run,
        run_first=path.spline.first,
    )


def insert_points(samples: PathSamples, interval: Array, s: FloatArray) -> PathSamples:
    """Add points at arc lengths `s` (n,) [mm] inside straight intervals `interval` (n,), sorted by place.

    Raises ValueError if one of the intervals is not straight: on curves a new point needs new geometry.
    """
    if not straight(samples.table.legs, samples.element[interval]).all():
        raise ValueError("insert_points: only straight intervals can be split")
    ds = s - samples.s[interval]
    w, zero = samples.w0[interval] + ds, np.zeros((len(interval), samples.d1.shape[1]))
    new = {name: getattr(samples, name)[interval] for name in ("d1", "element", "w1", "segment", "margin")}
    new |= {"s": s, "w0": w, "position": samples.position[interval] + ds[:, None] * samples.d1[interval]}
    new |= dict.fromkeys(("d2_left", "d2_right", "d3_left", "d3_right"), zero)
    new |= dict.fromkeys(("kappa_left", "kappa_right"), np.zeros(len(interval)))
    columns = {name: np.insert(getattr(samples, name), interval + 1, of, axis=0) for name, of in new.items()}
    columns["w1"][interval + np.arange(len(interval))] = w
    piece = samples.piece + np.searchsorted(interval, samples.piece, side="left")
    return replace(samples, piece=piece, **columns)


def straight(legs: Array, element: Array) -> Array:
    """(n,) True where `element` (n,) is the free part of a straight leg; `legs` (R,): geometry/legs.py."""
    leg = (element >= 0) & (element < len(legs))
    return leg & ~legs["round"][np.where(leg, element, 0)]


def _corner_breaks(path: SmoothPath) -> FloatArray:
    """(R+1, B) parameters where each corner starts with a grid point, ascending, padded with 1: the shape's breaks,
    and quarters, so that no symmetric half is mistaken for a straight line."""
    always = (0.25, 0.5, 0.75)
    blended = np.flatnonzero(path.d > 0)
    width = 3 if not len(blended) else max(len(path.corner.breaks(path.params[blended[0]])), 1) + 8
    out = np.ones((len(path.d), width))
    if path.corner.shape == 0:
        out[:, :3] = always
        return out
    for k in blended:
        points = sorted(set(path.corner.breaks(path.params[k])) | set(always))
        out[k, : len(points)] = points
    return out
