"""What a motion on a smooth path gave up, in short sentences, each with its first place and how often."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array
from planner.geometry.toolpath import Joint, Toolpath
from planner.optimal.reshape import OnPath


def path_notes(toolpath: Toolpath, best: OnPath) -> list[str]:
    """What a motion on a smooth path gave up: what its splines did, corners that are not rounded, full stops of the solver.

    toolpath : the program's own
    best     : the path and its solved motion
    """
    notes: list[str] = []
    path, at = best.path, best.path.legs.first
    added = (path.joint == Joint.STOP) & (toolpath.joint[at] != Joint.STOP)
    if added.any():
        notes.append(
            _at(toolpath, at[added], "full stop", "where no smooth curve was found inside the tolerance")
        )
    on_spline = np.zeros(len(path.joint), bool)
    for first, last in zip(path.spline.joint_first, path.spline.joint_last, strict=True):
        on_spline[first : last + 1] = True
    sharp = (path.joint == Joint.CORNER) & (path.d == 0.0) & ~on_spline
    if sharp.any():
        notes.append(_at(toolpath, at[sharp], "corner", "not rounded: there is no room for it"))
    lost = _standstills(best)
    if len(lost):
        notes.append(_at(toolpath, lost, "full stop", "where the solver did not converge"))
    return notes


def _standstills(best: OnPath) -> Array:
    """Joints of the toolpath behind the segments on which the profile rests between two full stops of the path."""
    inner = best.problem.interval.copy()
    inner[best.samples.piece[:-1]] = False
    return best.samples.segment[inner & (best.solution.feed_sq == 0.0)] + 1


def _at(toolpath: Toolpath, joint: Array, what: str, why: str) -> str:
    line = int(toolpath.line[max(int(joint.min()) - 1, 0)])
    count = f"{len(joint):,} {what}s" if len(joint) > 1 else f"a {what}"
    return f"line {line}: {count} {why}" if len(joint) == 1 else f"line {line}: the first of {count} {why}"
