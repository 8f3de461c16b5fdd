"""The notes of a plan, on what it assumed and gave up, each with its first line and a count.

Those of the reader (`Program.notes`) come first, then machine and tolerance, then the method.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MM_PER_INCH, RAD_PER_DEG, SECONDS_PER_MINUTE
from planner.geometry.curves import CHORD_SHARE
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.nc.extents import travel_faults
from planner.nc.points import in_inches, own_text
from planner.nc.program import FEED_MOVES, Kind, Program
from planner.planning.job.beside import TOOL_CHANGE, codes_of

# A tolerance above this share of the part's extent is noted [-]: little is left of a part's shape.
TOLERANCE_OF_PART = 0.02
# Numbers that are allowed and hardly meant, as of a machine in m, mm/min or ms, are asked about: velocities [mm/s]
# outside of which a number is rather in m/s (6 m/h) or in mm/min (900 m/min).
VELOCITY_MIN, VELOCITY_MAX = 1.67, 15_000.0
# Times to build up the acceleration, acceleration / jerk [s]; of built-in machines 0.01 to 0.04.
RAMP_MIN, RAMP_MAX = 2.5e-4, 0.5
PERIOD_MIN, PERIOD_MAX = 1e-5, 0.05  # interpolation periods [s]: one of 1 is rather 1 ms
CONSTANT_SURFACE_SPEED, MM_PER_M = 96, 1000.0
ROUNDING = 1e-9  # of F and S, by their size
_UNITS = {
    "feed_per_tooth_max": "{:.4g} mm per tooth",
    "surface_speed_max": "{:.4g} m/min at its diameter",
    "spindle_max": "S{:g}",
}


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


def unit_notes(machine: Machine) -> list[str]:
    """Sentences on numbers of a machine that are rather in other units."""
    notes = []
    for letter in LINEAR_AXES:
        if letter not in machine.axes:
            continue
        axis = machine.axes[letter]
        if not VELOCITY_MIN <= axis.velocity <= VELOCITY_MAX:
            unit = "m/s" if axis.velocity < VELOCITY_MIN else "mm/min"
            notes.append(f"axis {letter} has a velocity of {axis.velocity:g} mm/s: is the number in {unit}?")
        ramp = axis.acceleration / axis.jerk
        if not RAMP_MIN <= ramp <= RAMP_MAX:
            notes.append(
                f"axis {letter} takes {ramp:.3g} s to build up its acceleration of {axis.acceleration:g} mm/s2 with a jerk of "
                f"{axis.jerk:g} mm/s3: are both in mm and s?"
            )
    if not PERIOD_MIN <= machine.dt <= PERIOD_MAX:
        unit = "ms" if machine.dt > PERIOD_MAX else "another unit"
        notes.append(f"the interpolation period dt is {machine.dt:g} s: is the number in {unit}?")
    return notes


def inch_notes(program: Program, machine: Machine) -> list[str]:
    """A sentence where a program in inches asks for more than any axis can: it may be one in mm."""
    fed = np.where(np.isfinite(program.feed), program.feed, 0.0)
    most = max((machine.axes[axis].velocity for axis in LINEAR_AXES if axis in machine.axes), default=np.inf)
    if fed.max(initial=0.0) <= most or not in_inches(program, own_text(program) or b""):
        return []
    k, unit = int(fed.argmax()), MM_PER_INCH / SECONDS_PER_MINUTE
    return [
        f"line {program.line[k]}: F{fed[k] / unit:.5g} in inches (G20) is more than any axis can, {most / unit:.5g} in/min: is the "
        "program in mm (G21)?"
    ]


def short_block_notes(toolpath: Toolpath) -> list[str]:
    """A sentence if most of the blocks that cut are shorter than the tolerance, which may round them away."""
    cutting = ~toolpath.rapid
    if not cutting.any():
        return []
    tolerance = float(toolpath.tolerance.max())
    middle = float(np.median(toolpath.length[cutting]))
    if middle >= tolerance:
        return []
    return [
        f"half of the blocks are not longer than {middle:.3g} mm, and the tolerance is {tolerance:g} mm: details of their size may "
        "be rounded away"
    ]


def cutting_notes(program: Program, machine: Machine) -> list[str]:
    """A note for each limit of each tool that the programmed F and S exceed: the first line, and by how much at
    most. None under G96, where S is no number of turns."""
    limited = {int(n): tool for n, tool in machine.tools.items() if tool.model_fields_set & {*_UNITS}}
    _, codes = codes_of(program, "G")
    if not limited or (codes == CONSTANT_SURFACE_SPEED).any():
        return []
    block, code = codes_of(program, "M")
    changes = block[code == TOOL_CHANGE]
    named, number = codes_of(program, "T")
    tool = _in_force(len(program), named, number)
    if len(changes):  # a tool that is named cuts from its change on
        chosen = np.append(tool, tool[-1:])[np.minimum(changes, len(tool) - 1)] if len(tool) else tool
        tool = _in_force(len(program), changes, chosen)
    speed = _in_force(len(program), *codes_of(program, "S"))
    cuts = np.isin(program.kind, FEED_MOVES) & (speed > 0)
    cuts[program.synchronised] = False
    notes = []
    for n, data in limited.items():
        on = np.flatnonzero(cuts & (tool == n))
        of_blocks = {
            "feed_per_tooth_max": program.feed[on] * SECONDS_PER_MINUTE / (speed[on] * (data.flutes or 1)),
            "surface_speed_max": np.pi * data.diameter * speed[on] / MM_PER_M,
            "spindle_max": speed[on],
        }
        for key, found in of_blocks.items():
            most = getattr(data, key)
            over = np.flatnonzero(found > (np.inf if most is None else most * (1.0 + ROUNDING)))
            if len(over):
                notes.append(
                    f"line {program.line[on[over[0]]]}: T{n} has {_UNITS[key].format(found[over[0]])}, above its {key} of {most:g} "
                    f"({len(over):,} blocks, at most {found.max():.4g})"
                )
    return notes


def _in_force(blocks: int, at: FloatArray, value: FloatArray) -> FloatArray:
    """(B,) the value in force on each block, of those (K,) that begin before the blocks `at` (K,); 0 before."""
    row = np.searchsorted(at, np.arange(blocks), side="right")
    return np.append(0.0, value)[row]
