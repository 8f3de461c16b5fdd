"""Blocks under G61 and G61.1: the delivered samples lie on the path itself.

Which block a sample is at follows from the times at which the joints are passed (matching.py), to within a period; the nearest of the
blocks of these times and of their neighbours counts. On a line the distance is that from the chord, on an arc that from the place p(x)
where the sample is perpendicular to the arc,

    (p(x) - q) p'(x) = 0,      by Newton's method from the angle at which q is seen from the axis, in each turn,

or from its ends; on a spline of the program the same, from the nearest of `STARTS` places (curves.py). Between samples the tolerance
counts (contour.py), and within a period of a block under G64, and on the half of a block beside one, where the corner between them may
be rounded.

Where the tolerance is larger than what the path does between two joints, such as a whole circle, the times of the joints say little.
A sample that is off is therefore looked for once more, at the nearest of the pieces that it can belong to by the order of the path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Joint, Toolpath
from planner.motion.trajectory import Trajectory
from planner.verify.curves import curve_points
from planner.verify.findings import Look, joint_times
from planner.verify.matching import AtStop, Located, Match, match_samples, new_match
from planner.verify.pieces import PLACE_ROUNDING, ProgramPieces

STARTS = 17  # places on a curve
CURVE_STEPS = 6  # of Newton's method without the curvature, which is exact for samples on the curve
NEWTON = 3  # steps: the angle is off by the gap of an arc over its radius, some 1e-4 at most; squared twice that is rounding


def exact_faults(
    trajectory: Trajectory, looks: list[Look], toolpath: Toolpath, pieces: ProgramPieces, rounding: FloatArray
) -> list[str]:
    """The largest distance of a sample from a path that is to be followed exactly, as a sentence, if it is more than rounding.

    rounding : (A,) largest error of a position by its digits [mm]
    """
    if not toolpath.exact.any():
        return []
    allowed = PLACE_ROUNDING + float(np.linalg.norm(rounding))
    worst = _worst(trajectory, looks, toolpath, pieces, None)
    if worst.apart > allowed:
        worst = _worst(trajectory, looks, toolpath, pieces, new_match(pieces))
    if worst.apart <= allowed:
        return []
    where = f"{worst.apart:.6g} mm off at t = {worst.time:.6g} s, line {worst.line}"
    return [f"exact path: {where}: G61 asks for the path itself"]


class Worst(NamedTuple):
    """The sample that is farthest from a path to be followed exactly: its distance [mm], time [s] and line."""

    apart: float = 0.0
    time: float = 0.0
    line: int = 0


def _worst(
    trajectory: Trajectory, looks: list[Look], toolpath: Toolpath, pieces: ProgramPieces, match: Match | None
) -> Worst:
    """The worst sample by the times of the joints; with a match, a new one, the nearest of what it finds possible counts too."""
    passed = joint_times(looks[0], pieces)
    free = np.append(0, np.cumsum(~toolpath.exact))  # blocks before that need not be followed exactly
    worst = Worst()
    before: Trajectory | None = None
    for chunk in trajectory.chunks():
        matched = None if match is None else _matched(pieces, match, before, chunk)
        before = chunk.rows(np.array([len(chunk) - 1]))
        first, k, last = (_segment(passed, chunk.t + by * chunk.dt, len(toolpath)) for by in (-1.0, 0.0, 1.0))
        exact = free[last + 1] == free[first]
        inside = np.flatnonzero(exact & ~_of_a_corner(toolpath, chunk.position, k))
        if not len(inside):
            continue
        q = chunk.position[inside]
        off = _least_distance(toolpath, q, first[inside] - 1, last[inside] + 1)
        if matched is not None:
            off = np.minimum(off, _least_distance(toolpath, q, matched[inside] - 1, matched[inside] + 1))
        at = int(off.argmax())
        if off[at] > worst.apart:
            worst = Worst(float(off[at]), float(chunk.t[inside[at]]), int(toolpath.line[k[inside[at]]]))
    return worst


def _matched(pieces: ProgramPieces, match: Match, before: Trajectory | None, chunk: Trajectory) -> Array:
    """(T,) the segment of each sample: of the pieces it can belong to by the order of the path, the nearest.

    before : the last sample of the chunk before; None for the first chunk
    """
    t, position, skip = chunk.t, chunk.position, 0
    if before is not None:
        t, position, skip = np.append(before.t, t), np.vstack([before.position, position]), 1
    axes = position.shape[1]
    place = Located(np.zeros(len(t), dtype=np.int64), np.zeros(len(t)))
    anywhere = AtStop(np.full(axes, np.inf), np.zeros(axes))  # stops are judged elsewhere
    match_samples(pieces, match, t, position, skip, False, anywhere, place)
    segment: Array = pieces.piece["segment"][place.piece[skip:]]
    return segment


def _segment(passed: FloatArray, t: FloatArray, count: int) -> Array:
    """(n,) segment of `count` on which the motion is at times t (n,) [s], by when the joints are passed (count - 1,) [s]."""
    found: Array = np.clip(np.searchsorted(passed, t, side="right") - 1, 0, count - 1)
    return found


def _least_distance(toolpath: Toolpath, q: FloatArray, first: Array, last: Array) -> FloatArray:
    """(n,) distance of points q (n, A) from the nearest of the segments `first` to `last`."""
    first, last = np.maximum(first, 0), np.minimum(last, len(toolpath) - 1)
    least = np.full(len(q), np.inf)
    for step in range(int((last - first).max()) + 1):
        at = np.flatnonzero(first + step <= last)
        least[at] = np.minimum(least[at], _distance(toolpath, q[at], first[at] + step))
    return least


def _of_a_corner(toolpath: Toolpath, q: FloatArray, segment: Array) -> Array:
    """(n,) whether points q (n, A) may belong to a corner with a block that need not be followed exactly: they are on the half of their
    segment that is beside it, and no full stop is between."""
    free, moving = np.append(~toolpath.exact, False), toolpath.joint != Joint.STOP
    half = 0.5 * toolpath.length[segment]
    before = free[segment - 1] & moving[segment] & (_apart(q, toolpath.start[segment]) < half)
    behind = free[segment + 1] & moving[segment + 1] & (_apart(q, toolpath.end[segment]) < half)
    found: Array = before | behind
    return found


def _apart(q: FloatArray, p: FloatArray) -> FloatArray:
    gap: FloatArray = np.linalg.norm(q - p, axis=1)
    return gap


def _distance(toolpath: Toolpath, q: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points q (n, A) from segments (n,)."""
    found = np.full(len(q), np.inf)
    lines, arcs = np.flatnonzero(toolpath.straight[segment]), np.flatnonzero(toolpath.arc[segment] >= 0)
    start, length = toolpath.start[segment[lines]], toolpath.length[segment[lines]]
    along = (toolpath.end[segment[lines]] - start) / length[:, None]
    x = np.clip(np.einsum("na,na->n", q[lines] - start, along), 0.0, length)
    found[lines] = np.linalg.norm(q[lines] - start - x[:, None] * along, axis=1)
    for row in np.unique(segment[arcs]):
        of_row = arcs[segment[arcs] == row]
        found[of_row] = _from_arc(toolpath, q[of_row], int(row))
    curves = np.flatnonzero(toolpath.curve[segment] >= 0)
    if len(curves):
        found[curves] = _from_curves(toolpath, q[curves], toolpath.curve[segment[curves]])
    return found


def _from_curves(toolpath: Toolpath, q: FloatArray, row: Array) -> FloatArray:
    """(n,) distance of points q (n, A) from curves, by their rows (n,)."""
    points, weights = toolpath.curves.points[row], toolpath.curves.weight[row]
    best, u = np.full(len(q), np.inf), np.zeros(len(q))
    for place in np.linspace(0.0, 1.0, STARTS):
        apart = np.linalg.norm(curve_points(points, weights, np.full(len(q), place))[0] - q, axis=1)
        u, best = np.where(apart < best, place, u), np.minimum(best, apart)
    for _ in range(CURVE_STEPS):
        point, rate = curve_points(points, weights, u)
        step = np.einsum("na,na->n", point - q, rate) / np.einsum("na,na->n", rate, rate)
        u = np.clip(u - step, 0.0, 1.0)
    return np.linalg.norm(curve_points(points, weights, u)[0] - q, axis=1)


def _from_arc(toolpath: Toolpath, q: FloatArray, segment: int) -> FloatArray:
    """(n,) distance of points q (n, A) from an arc or helix."""
    k, length = int(toolpath.arc[segment]), float(toolpath.length[segment])
    centre, e1, e2 = toolpath.arcs.center[k], toolpath.arcs.e1[k], toolpath.arcs.e2[k]
    drift, radius, rate = toolpath.arcs.drift[k], float(toolpath.arcs.radius[k]), float(toolpath.arcs.rate[k])
    out = q - centre
    turn = 2.0 * np.pi / abs(rate)
    first = np.mod(np.arctan2(out @ e2, out @ e1) / rate, turn)
    nearest = np.full(len(q), np.inf)
    for n in range(-1, int(length / turn) + 2):
        x = np.clip(first + n * turn, 0.0, length)
        for step in range(NEWTON + 1):
            cos, sin = np.cos(rate * x)[:, None], np.sin(rate * x)[:, None]
            gap = radius * (cos * e1 + sin * e2) + drift * x[:, None] - out
            if step == NEWTON:
                break
            slope = radius * rate * (cos * e2 - sin * e1) + drift
            bend = -radius * rate**2 * (cos * e1 + sin * e2)
            rise = np.einsum("na,na->n", slope, slope) + np.einsum("na,na->n", gap, bend)
            along = np.einsum(
                "na,na->n", gap, slope
            )  # at the centre all points are as near, and none is better
            x = np.clip(x - np.divide(along, rise, out=np.zeros_like(along), where=rise != 0.0), 0.0, length)
        nearest = np.fmin(nearest, np.linalg.norm(gap, axis=1))
    return nearest
