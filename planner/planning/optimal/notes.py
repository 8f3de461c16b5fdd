"""The notes of a motion on a smooth path, in short sentences, each with its first line and a count."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath, exact_stops
from planner.geometry.toolpath import Joint, Toolpath
from planner.planning.optimal.on_path import OnPath
from planner.smoothing.spline_path import SplineShape


class Noted(NamedTuple):
    """Joints of a toolpath, each (n,), of which a motion on a smooth path has something to say.

    exact : full stops because of G61
    added : other full stops that the program has not
    sharp : corners that are not rounded
    lost  : where the profile rests
    """

    exact: Array
    added: Array
    sharp: Array
    lost: Array


def noted(toolpath: Toolpath, best: OnPath) -> Noted:
    """The joints to be noted: splines, corners that are not rounded, full stops of the solver.

    toolpath : the program's own
    best     : the path and its solved motion
    """
    path, at = best.path, best.path.legs.first
    added = (path.joint == Joint.STOP) & (toolpath.resting().joint[at] != Joint.STOP)
    exact = added & np.isin(at, exact_stops(toolpath))
    on_spline = np.zeros(len(path.joint), bool)
    for first, last in zip(path.spline.joint_first, path.spline.joint_last, strict=True):
        on_spline[first : last + 1] = True
    sharp = (path.joint == Joint.CORNER) & (path.d == 0.0) & ~on_spline
    return Noted(at[exact], at[added & ~exact], at[sharp], _standstills(best))


def path_notes(toolpath: Toolpath, at: Noted, stays: Array | None = None) -> list[str]:
    """The notes of a motion on a smooth path.

    toolpath : the program's own
    at       : what of it is noted
    stays    : (M+1,) the toolpath's joints where this motion is the one that is delivered; None for all
    """
    exact, *others = at if stays is None else (joints[stays[joints]] for joints in at)
    why = (
        ("full stop", "where no smooth curve was found inside the tolerance"),
        ("corner", "not rounded: there is no room for it"),
        ("full stop", "where the solver did not converge"),
    )
    of_others = (
        _at(toolpath, joints, *each) for joints, each in zip(others, why, strict=True) if len(joints)
    )
    return [*exact_note(toolpath, exact), *of_others]


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
