"""The notes of a motion on a smooth path, in short sentences, each with its first line and a count."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath, exact_stops
from planner.geometry.toolpath import Joint, Toolpath
from planner.planning.optimal.on_path import OnPath
from planner.smoothing.spline_path import SplineShape


def path_notes(toolpath: Toolpath, best: OnPath, stays: Array | None = None) -> list[str]:
    """The notes of a motion on a smooth path: splines, corners that are not rounded, full stops of the solver.

    toolpath : the program's own
    best     : the path and its solved motion
    stays    : (M+1,) the toolpath's joints where this motion is the one that is delivered; None for all
    """
    notes: list[str] = []
    path, at = best.path, best.path.legs.first
    here = np.ones(len(at), bool) if stays is None else stays[at]
    added = (path.joint == Joint.STOP) & (toolpath.resting().joint[at] != Joint.STOP) & here
    exact = added & np.isin(at, exact_stops(toolpath))
    notes += exact_note(toolpath, at[exact])
    added &= ~exact
    if added.any():
        notes.append(
            _at(toolpath, at[added], "full stop", "where no smooth curve was found inside the tolerance")
        )
    on_spline = np.zeros(len(path.joint), bool)
    for first, last in zip(path.spline.joint_first, path.spline.joint_last, strict=True):
        on_spline[first : last + 1] = True
    sharp = (path.joint == Joint.CORNER) & (path.d == 0.0) & ~on_spline & here
    if sharp.any():
        notes.append(_at(toolpath, at[sharp], "corner", "not rounded: there is no room for it"))
    lost = _standstills(best)
    lost = lost[stays[lost]] if stays is not None else lost
    if len(lost):
        notes.append(_at(toolpath, lost, "full stop", "where the solver did not converge"))
    return notes


def exact_note(toolpath: Toolpath, at: Array) -> tuple[str, ...]:
    """That the tangent joints `at` (n,) are full stops because of G61, if there are any."""
    if not len(at):
        return ()
    why = "where G61 asks for the exact path and its curvature jumps, which limited jerk allows at rest only; G64 P0.001 rounds them"
    return (_at(toolpath, at, "full stop", why),)


def no_spline_note(rounded: SmoothPath, shape: SplineShape) -> tuple[str, ...]:
    """That no run of corners got a spline, if there are any."""
    runs = len(shape.splines.fits)
    if not runs:
        return ()
    line = _line(rounded, int(rounded.legs.first[shape.runs.joint_first[0]]))
    return (f"line {line}: no spline was found inside the tolerance, here and on all {runs} runs of corners",)


def not_compared_note(rounded: SmoothPath, left: Array, points: FloatArray) -> tuple[str, ...]:
    """That single corners were not compared on some runs between full stops (compare_corners.py).

    left   : (L,) these runs
    points : (G,) of the grid that each run would have
    """
    if not len(left):
        return ()
    stops = np.flatnonzero(rounded.joint == Joint.STOP)
    line = _line(rounded, int(rounded.legs.first[stops[left[0] + 1]]))
    return (
        f"line {line}: single corners were not compared on {len(left)} runs between full stops, of which the first ends "
        f"here: their grids would have some {points[left].sum():.2g} points",
    )


def _line(path: SmoothPath, joint: int) -> int:
    """The program's line that ends at a joint of the toolpath."""
    return int(path.toolpath.line[joint - 1])


def _standstills(best: OnPath) -> Array:
    """Joints behind the segments on which the profile rests between two full stops of the path."""
    inner = best.problem.interval.copy()
    inner[best.samples.piece[:-1]] = False
    return best.samples.segment[inner & (best.solution.feed_sq == 0.0)] + 1


def _at(toolpath: Toolpath, joint: Array, what: str, why: str) -> str:
    line = int(toolpath.line[max(int(joint.min()) - 1, 0)])
    count = f"{len(joint):,} {what}s" if len(joint) > 1 else f"a {what}"
    return f"line {line}: {count} {why}" if len(joint) == 1 else f"line {line}: the first of {count} {why}"
