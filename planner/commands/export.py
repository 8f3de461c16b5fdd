"""`planner export`: the setpoints of a plan as files that a control plays."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands.options import length_option
from planner.commands.terminal import guarded, say


class For(StrEnum):
    """What the files are for."""

    stream = "linuxcnc-stream"
    pvt = "pvt"
    grbl = "grbl"
    klipper = "klipper"
    marlin = "marlin"
    linuxcnc = "linuxcnc"


PROGRAMS = (For.grbl, For.klipper, For.marlin, For.linuxcnc)


class Unit(StrEnum):
    """Length units of the files."""

    mm = "mm"
    inch = "inch"


@guarded
def export_command(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="directory that 'plan -o' wrote, or a trajectory file")
    ],
    for_: Annotated[
        For,
        typer.Option(
            "--for",
            help="linuxcnc-stream: setpoints for the streamer of LinuxCNC's HAL, with the HAL files; pvt: positions, velocities, "
            "times; grbl, klipper, marlin, linuxcnc: a program that its own planner runs well",
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="new directory for the files")
    ],
    unit: Annotated[Unit, typer.Option("--unit", help="length unit of the files")] = Unit.mm,
    within: Annotated[
        float | None,
        length_option(
            "--within", "pvt: how far the cubics between rows may be from the setpoints [mm] (default 0.001)"
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        length_option(
            "--tolerance",
            "programs: what plan and chords may be off the program together [mm] (default: that of the plan)",
        ),
    ] = None,
) -> None:
    """Write a plan for a control: setpoints that it plays, or a program that its own planner runs well."""
    if for_ in PROGRAMS:
        if within is not None or unit is not Unit.mm:
            raise InputError(f"--within and --unit are for setpoints; --for {for_} takes --tolerance")
        _program(plan, for_, output, tolerance)
        return
    if tolerance is not None:
        raise InputError(f"--tolerance is for programs; --for {for_} takes every setpoint as it is")
    from planner.controls.export.stream import WITHIN, write_pvt, write_stream
    from planner.report.trajectory_reader import read_trajectory, trajectory_file

    if within is not None and for_ is not For.pvt:
        raise InputError(f"--within is for pvt; --for {for_} takes every setpoint as it is")
    with _new_directory(output) as new:
        read = read_trajectory(trajectory_file(plan))
        trajectory = read.trajectory
        if len(trajectory.extruder):
            raise InputError(_NO_EXTRUDER, source=str(plan))
        machine = read.metadata.get("machine")
        between = machine.get("interpolation", "linear") if isinstance(machine, dict) else "linear"
        if for_ is For.stream and between == "cubic":
            raise InputError(_POSITIONS_ALONE, source=str(plan))
        if for_ is For.stream:
            write_stream(new, trajectory, unit)
            said = f"{len(trajectory):,} rows, one every {trajectory.dt * 1e3:g} ms; try them with: halrun -f try.hal"
        else:
            periods, miss = write_pvt(new, trajectory, unit, WITHIN if within is None else within)
            said = f"a row every {periods * trajectory.dt * 1e3:g} ms, cubics between them within {miss * 1e3:.2g} µm of the setpoints"
            if between != "cubic":
                said += f'; the verdict is on interpolation = "{between}" between the setpoints'
    _say_assumed(assumed if isinstance(assumed := read.metadata.get("assumptions"), list) else ())
    say(f"{output}: {said}")


@contextmanager
def _new_directory(output: Path) -> Iterator[Path]:
    """A directory to fill, which becomes `output` at the end. Raises InputError if that exists or cannot be written."""
    if os.path.lexists(output):
        raise InputError("exists already and is not overwritten; give another name", source=str(output))
    new = output.with_name(f".{output.name}.{os.getpid()}")
    try:
        new.mkdir(parents=True)
        yield new
        new.rename(output)
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror}", source=str(output)) from fault
    finally:
        shutil.rmtree(new, ignore_errors=True)


_POSITIONS_ALONE = (
    'the plan is for a machine of interpolation = "cubic", whose drives get velocities too, and a stream has positions alone: '
    'take --for pvt, or plan with interpolation = "linear"'
)
_NO_EXTRUDER = (
    "setpoints of an extruder are no part of this export: --for klipper and --for marlin keep the program's E words, and the "
    "trajectory file of the plan has the columns of e"
)


def _say_assumed(assumptions: Sequence[object]) -> None:
    from planner.report.tables import assumed_lines

    for line in assumed_lines([str(text) for text in assumptions]):
        say(str(line))


def _program(plan: Path, for_: For, output: Path, tolerance: float | None) -> None:
    """Write the program of a plan's directory for a control, and say what it holds."""
    from planner.controls.export.program import NO_JERK, write_program
    from planner.report.html.saved import saved_plan

    with _new_directory(output) as new:
        if not plan.is_dir():
            said = "give the directory that 'plan -o' wrote: the program is needed too"
            raise InputError(said, source=str(plan))
        saved, _, _ = saved_plan(plan)
        allowed = float(saved.toolpath.tolerance.min()) if tolerance is None else tolerance
        made = write_program(new, saved, for_.value, allowed)
    _say_assumed(saved.program.assumptions)
    say(f"{output / made.file}: {made.sentence}")
    for text in made.assumptions:
        say(f"  {text}")
    for text in made.notes:
        say(f"note: {text}", err=True)
    for name, seconds in made.predicted.items():
        say(f"  {seconds:10.4f} s predicted by a model of {for_.value}'s planner: {name}")
    if made.predicted:
        say(f"  {for_.value} {NO_JERK}")
