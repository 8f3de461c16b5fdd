"""What a plan assumed and what it gave up, in short sentences, each with its first place and how often.

The reader's notes (`Program.notes`) come first, then what machine and tolerance make of the program, then what the method says.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.methods.reshape import OnPath
from planner.nc.program import Program
from planner.units import SECONDS_PER_MINUTE

# A tolerance above this share of the part's largest extent is noted [-]: 0.05 mm on a part of 2.5 mm. What is rounded by more has
# little left of its shape.
TOLERANCE_OF_PART = 0.02


def job_notes(program: Program, machine: Machine, toolpath: Toolpath) -> list[str]:
    """What the reader assumed, feeds that the machine lowers, and a tolerance that is large beside the part."""
    return [*program.notes, *_feed_notes(program, machine), *_tolerance_notes(toolpath)]


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


def _feed_notes(program: Program, machine: Machine) -> list[str]:
    if machine.feed_max is None:
        return []
    above = np.flatnonzero(np.isfinite(program.feed) & (program.feed > machine.feed_max))
    if not len(above):
        return []
    highest = float(program.feed[above].max()) * SECONDS_PER_MINUTE
    return [
        f"line {program.line[above[0]]}: F above the machine's feed_max is planned at "
        f"{machine.feed_max * SECONDS_PER_MINUTE:g} mm/min ({len(above):,} blocks, up to F{highest:g})"
    ]


def _tolerance_notes(toolpath: Toolpath) -> list[str]:
    if not len(toolpath):
        return []
    moved = ~toolpath.rapid if not toolpath.rapid.all() else np.ones(len(toolpath), bool)
    arc = toolpath.arc[moved & (toolpath.arc >= 0)]
    points = np.vstack([toolpath.start[moved], toolpath.end[moved]])
    swept = np.minimum(2.0 * toolpath.arcs.radius[arc], toolpath.length[moved & (toolpath.arc >= 0)])
    part = float(max(np.ptp(points, axis=0).max(), swept.max(initial=0.0)))
    joint = int(toolpath.tolerance.argmax())
    tolerance = float(toolpath.tolerance[joint])
    if tolerance <= TOLERANCE_OF_PART * part:
        return []
    line = int(toolpath.line[max(joint - 1, 0)])
    return [
        f"line {line}: the tolerance of {tolerance:g} mm is {tolerance / part:.3g} times the part's largest extent, {part:.4g} mm: "
        "little may be left of its shape"
    ]
