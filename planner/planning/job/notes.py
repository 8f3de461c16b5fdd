"""The notes of a plan, on what it assumed and gave up, each with its first line and a count.

Those of the reader (`Program.notes`) come first, then machine and tolerance, then the method.
"""

import numpy as np

from planner.base.units import RAD_PER_DEG, SECONDS_PER_MINUTE
from planner.geometry.curves import CHORD_SHARE
from planner.geometry.toolpath import Toolpath
from planner.machine import ROTARY_AXES, Machine
from planner.nc.extents import travel_faults
from planner.nc.program import Kind, Program
from planner.planning.job.cutting import cutting_notes
from planner.planning.job.plausible import inch_notes, short_block_notes, unit_notes

# A tolerance above this share of the part's extent is noted [-]: little is left of a part's shape.
TOLERANCE_OF_PART = 0.02


def job_notes(program: Program, machine: Machine, toolpath: Toolpath) -> list[str]:
    """Notes on a tolerance that is large beside the part, of the reader, on numbers that are hardly meant, and on
    feeds that the machine lowers."""
    large = tolerance_notes(toolpath)
    return [
        *large,
        *program.notes,
        *_travel_notes(program, machine),
        *cutting_notes(program, machine),
        *unit_notes(machine),
        *inch_notes(program, machine),
        *_feed_notes(program, machine),
        *_spline_notes(program, toolpath),
        *_extruder_notes(toolpath),
        *_radius_notes(toolpath, machine),
        *([] if large else short_block_notes(toolpath)),
    ]


def _travel_notes(program: Program, machine: Machine) -> list[str]:
    """What lies beyond the travel, where it was to be planned, and what of it is not known."""
    faults, notes = travel_faults(program, machine)
    ignored = [f"line {fault.line}: {fault.message.partition(';')[0]} (--ignore-travel)" for fault in faults]
    return [*notes, *ignored]


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


def _spline_notes(program: Program, toolpath: Toolpath) -> list[str]:
    if not len(program.splines):
        return []
    chords = np.flatnonzero(toolpath.straight & (program.kind[toolpath.block] == Kind.SPLINE))
    if not len(chords):
        return []
    return [
        f"line {toolpath.line[chords[0]]}: the spline all but stands still, at a control point on its end or at a cusp, where its "
        f"curvature has no bound; a chord of {toolpath.length[chords[0]]:.3g} mm stands for it there, within {CHORD_SHARE:.0%} of the "
        f"tolerance ({len(chords):,} chords)"
    ]


def _extruder_notes(toolpath: Toolpath) -> list[str]:
    fed = toolpath.extrusion
    if fed is None or not len(fed.at):
        return []
    at = np.unique(fed.at)
    line = int(toolpath.line[max(int(fed.at[0]) - 1, 0)])
    return [
        f"line {line}: the extruder moves alone behind it while the axes wait ({len(fed.at):,} such moves; with dwells beside them "
        f"{float(toolpath.dwell[at].sum()):.4g} s)"
    ]


def _radius_notes(toolpath: Toolpath, machine: Machine) -> list[str]:
    if machine.rotary_radius is not None or not set(toolpath.axes) & set(ROTARY_AXES) or not len(toolpath):
        return []
    angle = float(toolpath.tolerance.min()) / (machine.radius * RAD_PER_DEG)
    return [
        f"rotary axes are measured at {machine.radius:g} mm, so that their tolerance is {angle:.3g} degrees; rotary_radius or "
        "tolerance_angle in the machine file says another"
    ]


def tolerance_notes(toolpath: Toolpath) -> list[str]:
    """A sentence where the tolerance is more than `TOLERANCE_OF_PART` of the part's largest extent."""
    if not len(toolpath):
        return []
    moved = ~toolpath.rapid if not toolpath.rapid.all() else np.ones(len(toolpath), bool)
    arc = toolpath.arc[moved & (toolpath.arc >= 0)]
    points = np.vstack(
        [toolpath.start[moved], toolpath.end[moved], toolpath.curves.points.reshape(-1, len(toolpath.axes))]
    )
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
