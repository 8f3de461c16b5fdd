"""`planner smooth`: the same program with fewer lines."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.base.units import MICROMETRE
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.terminal import guarded, say, say_json
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.base.arrays import Array
    from planner.machine import Machine
    from planner.nc.program import Program
    from planner.verifier import SamePath

SAME_TIME = 0.001  # predictions this near are the same [-]
SHARE = 0.5  # of the tolerance that the new path may take
ROOM = 0.98  # of what is allowed that is made use of: the comparison needs some for the chords of its arcs
_COMMENT = re.compile(rb"\([^)\n]*\)?|;[^\n]*")


@guarded
@functools.partial(options.takes_reading, caps=False)
def smooth_command(
    job: options.Job,
    output: Annotated[Path, options.output_option("FILE", "the file to write")],
    machine: options.MachineOption = None,
    tolerance: options.ToleranceOption = None,
    share: Annotated[
        float,
        typer.Option("--share", metavar="S", help="of the tolerance that the new path may take, 0 to 1"),
    ] = SHARE,
    control: options.ControlOption = None,
    lines: Annotated[bool, typer.Option("--lines", help="straight moves alone, no arcs")] = False,
    force: options.ForceOption = False,
    as_json: options.JsonOption = False,
    *,
    reading: Reading,
) -> None:
    """Write a program with fewer lines: short straight moves become longer ones and arcs, within a share of the
    tolerance; all other lines stay. What was written is read back and compared with the program."""
    from planner.controls.export.fewer import fewer_lines
    from planner.controls.timing.times import TIMED, control_times
    from planner.geometry.build import toolpath_from_program
    from planner.nc.reader import load, parse_program, source_name
    from planner.report.replace import refuse_inputs, write_new

    if not 0.0 < share <= 1.0:
        raise InputError(f"--share {share:g}; it must be above 0, and 1 at most")
    refuse_inputs([output], [job])
    limits = machine_named(machine)
    data = load(job)
    program = parse_program(data, limits, reading, source=source_name(job))
    whole = float(toolpath_from_program(program, limits, tolerance).tolerance.min())
    made = fewer_lines(data, program, limits, ROOM * share * whole, arcs=not lines)
    again = parse_program(made.text, limits, reading, source=str(output))
    found = compared(program, again, limits, share * whole)
    if found.fault or _COMMENT.findall(data) != _COMMENT.findall(made.text):
        raise InputError(
            f"the rewritten program is not the same: {found.fault or 'comments differ'}; nothing is written",
            source=str(output),
            line=found.line or None,
        )
    own = limits.control.name if limits.control is not None else None
    name = known_name("control", control, TIMED) if control else own if own in TIMED else None
    seconds = [control_times(each, limits, name, tolerance).seconds for each in (program, again) if name]
    write_new(output, made.text, force=force)
    if as_json:
        said = {"lines_before": made.before, "lines_after": made.after, "arcs": made.arcs, "share": share}
        said |= dict(zip(("seconds_before", "seconds_after"), seconds, strict=False))
        say_json(said | {"allowed_mm": share * whole, "within_mm": found.within, "kept": made.kept})
        return
    if seconds:
        longer = seconds[1] / seconds[0] - 1.0
        verdict = "LONGER" if longer > SAME_TIME else "shorter" if longer < -SAME_TIME else "the same"
        say(
            f"{verdict} on {name}: {seconds[1]:.4f} s instead of {seconds[0]:.4f} s ({longer:+.1%}), predicted"
        )
    say(
        f"{output}: {made.before:,} straight moves become {made.after:,} ({made.after / made.before - 1.0:+.0%}), {made.arcs:,} of "
        f"them arcs; within {found.within / MICROMETRE:.3g} µm of the program both ways and in order, of {share:.0%} of "
        f"{whole / MICROMETRE:.3g} µm"
    )
    if made.arcs and not seconds:
        say("  a control may run short arcs slower than lines: --control NAME predicts; --lines writes none")
    for why, (count, line) in made.kept.items():
        say(f"  kept as they are: {count:,} line{'s' * (count > 1)}, first line {line}: {why}")


def compared(program: Program, again: Program, machine: Machine, allowed: float) -> SamePath:
    """Compare two programs: their paths within `allowed` [mm], and everything that happens beside them.

    Raises InputError as laying out their paths does.
    """
    from planner.geometry.build import toolpath_from_program
    from planner.verifier import SamePath, same_path

    one, other = (toolpath_from_program(each, machine) for each in (program, again))
    said = [[event.text for event in each.events] for each in (program, again)]
    marks = [_marks(each) for each in (program, again)]
    if said[0] != said[1] or len(marks[0]) != len(marks[1]):
        return SamePath(within=float("inf"), fault="words beside the motion differ")
    return same_path(one, other, allowed, (marks[0], marks[1]))


def _marks(program: Program) -> Array:
    """Blocks before which something happens: an event, another path mode or tolerance; each as often as it does."""
    import numpy as np

    modes = np.stack([program.path_control, np.nan_to_num(program.tolerance, nan=-1.0)])
    changes = np.flatnonzero((np.diff(modes, axis=1) != 0).any(axis=0)) + 1
    return np.sort(np.append(changes, [event.block for event in program.events])).astype(np.int64)
