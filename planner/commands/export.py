"""`planner export`: the setpoints of a plan as files that a control plays."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError
from planner.commands import options
from planner.commands.options import length_option, output_option, time_option
from planner.commands.terminal import FAILED, guarded, say, say_json

if TYPE_CHECKING:
    from planner.motion.pulses import AxisPulses
    from planner.planning.job.plan import Plan


class For(StrEnum):
    """The purpose of the files."""

    stream = "linuxcnc-stream"
    pvt = "pvt"
    pt = "pt"
    twincat = "twincat"
    joint_trajectory = "joint-trajectory"
    grbl = "grbl"
    klipper = "klipper"
    marlin = "marlin"
    linuxcnc = "linuxcnc"


NUMBERS = (For.pvt, For.pt, For.twincat)
TABLES = (*NUMBERS, For.joint_trajectory)
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
            "times; pt: positions and times; twincat: times and positions of each axis; joint-trajectory: for ROS; "
            "grbl, klipper, marlin, linuxcnc: a program that its own planner runs well",
        ),
    ],
    output: Annotated[Path, output_option("DIR", "new directory for the files")],
    unit: Annotated[Unit, typer.Option("--unit", help="length unit of the files")] = Unit.mm,
    within: Annotated[
        float | None,
        length_option(
            "--within",
            "tables: how far the motion between rows may be from the setpoints [mm] (default 0.001)",
        ),
    ] = None,
    cycle: Annotated[
        float | None,
        time_option("--cycle", "tables: time between rows [s], such as 4ms (default: the longest within)"),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option(
            "--joints", metavar="NAME,...", help="joint-trajectory: names of the axes, in their order"
        ),
    ] = None,
    power: Annotated[
        bool,
        typer.Option(
            "--power", help="pvt, pt, twincat: the laser's power too; under M4 it follows the real speed"
        ),
    ] = False,
    tolerance: Annotated[
        float | None,
        length_option(
            "--tolerance",
            "programs: what plan and chords may be off the program together [mm] (default: that of the plan)",
        ),
    ] = None,
) -> None:
    """Write a plan for a control: setpoints that it plays, or a program that its own planner runs well."""
    for given, name, users in (
        (tolerance is not None, "--tolerance", PROGRAMS),
        (within is not None, "--within", TABLES),
        (cycle is not None, "--cycle", TABLES),
        (unit is not Unit.mm, "--unit", (For.stream, *NUMBERS)),
        (joints is not None, "--joints", (For.joint_trajectory,)),
        (power, "--power", NUMBERS),
    ):
        if given and for_ not in users:
            raise InputError(f"{name} is for {', '.join(users)}; --for {for_} does not take it")
    if for_ in PROGRAMS:
        _program(plan, for_, output, tolerance)
        return
    from planner.controls.export.tables import STRAIGHT, Table, laser_power, write_stream, write_table
    from planner.report.trajectory_reader import read_trajectory, trajectory_file

    with _new_directory(output) as new:
        read = read_trajectory(trajectory_file(plan))
        trajectory = read.trajectory
        if len(trajectory.extruder):
            raise InputError(_NO_EXTRUDER, source=str(plan))
        machine = read.metadata.get("machine")
        between = machine.get("interpolation", "linear") if isinstance(machine, dict) else "linear"
        if between == "cubic" and for_ in (For.stream, *STRAIGHT):
            raise InputError(_POSITIONS_ALONE, source=str(plan))
        if for_ is For.stream:
            write_stream(new, trajectory, unit)
            text = f"{len(trajectory):,} rows, one every {trajectory.dt * 1e3:g} ms; try them with: halrun -f try.hal"
        else:
            table = Table(
                kind=for_.value,
                unit=unit.value,
                within=within,
                cycle=cycle,
                joints=tuple(joints.split(",")) if joints else (),
                power=laser_power(plan_in(plan).program, trajectory) if power else None,
            )
            periods, miss = write_table(new, trajectory, table)
            shape = "straight moves" if for_ in STRAIGHT else "cubics"
            text = f"a row every {periods * trajectory.dt * 1e3:g} ms, {shape} between them within {miss * 1e3:.2g} µm of the setpoints"
            if between != "cubic" and for_ not in STRAIGHT:
                text += f'; the verdict is on interpolation = "{between}" between the setpoints'
    faults = _faults_of(plan, read.metadata.get("run_id"))
    _say_verdict(faults)
    assumed = read.metadata.get("assumptions")
    _say_assumed(assumed if isinstance(assumed, list) else ())
    say(f"{output}: {text}")
    if faults:
        raise typer.Exit(FAILED)


def _faults_of(plan: Path, run: object) -> Sequence[str]:
    """Why the motion of a run failed its verdict, as the summary beside it says; empty if it passed."""
    from planner.report.replace import SUMMARY

    try:
        said = json.loads(((plan if os.path.isdir(plan) else plan.parent) / SUMMARY).read_bytes())
        if said["run_id"] != run:
            raise ValueError("of another run")
        passed, faults = said["verdict"]["passed"], said["verdict"]["faults"]
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        say("note: no summary of this motion is beside it: 'planner verify' judges it", err=True)
        return ()
    return () if passed is True else [str(fault) for fault in faults] or ["see its summary"]


def _say_verdict(faults: Sequence[str]) -> None:
    if faults:
        say(f"verdict FAILED, and these files hold that motion: {faults[0]}")


@contextmanager
def _new_directory(output: Path) -> Iterator[Path]:
    """A directory to fill, which becomes `output` at the end. Raises InputError if that exists or cannot be
    written."""
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


def plan_in(plan: Path) -> Plan:
    """The plan of a directory. Raises InputError for a trajectory file, which has no program."""
    from planner.report.html.saved import saved_plan

    _require_directory(plan, ": the program is needed too")
    return saved_plan(plan)[0]


def _require_directory(plan: Path, why: str = "") -> None:
    if not os.path.isdir(plan):  # False, too, for names that are too long
        there = "" if os.path.exists(plan) else "no such directory; "
        raise InputError(f"{there}give the directory that 'plan -o' wrote{why}", source=str(plan))


def _program(plan: Path, for_: For, output: Path, tolerance: float | None) -> None:
    """Write the program of a plan's directory for a control, and say what it holds."""
    from planner.controls.export.program import NO_JERK, write_program

    with _new_directory(output) as new:
        saved = plan_in(plan)
        allowed = float(saved.toolpath.tolerance.min()) if tolerance is None else tolerance
        made = write_program(new, saved, for_.value, allowed)
    assert saved.verdict is not None
    faults = saved.verdict.sentences if made.planned and not saved.verdict.passed else ()
    _say_verdict(faults)
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
    if faults:
        raise typer.Exit(FAILED)


@guarded
def pulses_command(
    trajectory: options.TrajectoryArgument,
    steps: Annotated[
        str, typer.Option(metavar="x=400,y=400", help="pulses per mm of each axis (rotary axes: per degree)")
    ],
    output: Annotated[Path | None, output_option("FILE", "file for the pulses (.parquet, .csv)")] = None,
    max_frequency: Annotated[
        float | None, typer.Option(metavar="HZ", help="highest pulse rate that the drives can take [1/s]")
    ] = None,
    pulse_width: Annotated[
        float | None, typer.Option(metavar="US", help="shortest high and low time of the step signal [us]")
    ] = None,
    force: options.ForceOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Make step and direction pulses of a trajectory, at every instant within one pulse of it.

    If the pulses follow each other faster than the drives can take, nothing is written and the exit code is
    1.
    """
    from planner.motion.pulses import Drive, overrun, pulses_of
    from planner.report.replace import check_file
    from planner.report.trajectory_file import SUFFIXES, write_pulses
    from planner.report.trajectory_reader import read_trajectory, trajectory_file

    wanted = parse_steps(steps)
    if output is not None:
        check_file(output, [trajectory], suffixes=SUFFIXES, force=force)
    drive = Drive(frequency_max=max_frequency, width=None if pulse_width is None else pulse_width * 1e-6)
    trajectory = trajectory_file(trajectory)
    read = read_trajectory(trajectory)
    trains = pulses_of(read.trajectory, wanted)
    faults = overrun(trains, drive)
    if output is not None and not faults:
        write_pulses(output, trains, {n: v for n, v in read.metadata.items() if n in ("run_id", "program")})
    if as_json:
        say_json({"axes": {train.axis: _figures(train) for train in trains}, "faults": faults})
    else:
        for train in trains:
            rate = train.frequency_max
            fastest = f", at most {rate:,.0f} per second" if rate is not None else ""
            say(f"{train.axis}: {len(train):,} pulses, {train.changes:,} changes of direction{fastest}")
        for fault in faults:
            say(fault, err=True)
        if output is not None and not faults:
            say(str(output))
    if faults:
        raise typer.Exit(FAILED)


def parse_steps(text: str) -> dict[str, float]:
    """Axes and numbers of `x=400,y=400`. Raises InputError naming the part that is not one."""
    found: dict[str, float] = {}
    for part in text.split(","):
        axis, equals, value = (word.strip() for word in part.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        if not equals or len(axis) != 1 or not number > 0 or axis.lower() in found:
            raise InputError(f"--steps: '{part}'; write each axis once, as in x=400,y=400")
        found[axis.lower()] = number
    return found


def _figures(train: AxisPulses) -> dict[str, Any]:
    return {
        "steps": train.steps,
        "pulses": len(train),
        "direction_changes": train.changes,
        "highest_frequency_hz": train.frequency_max,
    }


@guarded
def report_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="directory that 'plan -o' wrote")],
    output: Annotated[Path | None, output_option("FILE", "page to write (default: DIR/report.html)")] = None,
    units: options.UnitsOption = None,
    force: options.ForceOption = False,
) -> None:
    """Write a page of a plan that opens in a browser: path, profiles, NC lines, corners, verdict."""
    _require_directory(directory)
    from planner.report.html.page import REPORT, report_page
    from planner.report.html.saved import saved_plan
    from planner.report.replace import check_file, write_whole

    file = output or directory / REPORT
    check_file(file, force=force)
    plan, summary = saved_plan(directory)
    write_whole(file, report_page(plan, summary, units))
    say(str(file))
