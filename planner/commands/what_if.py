"""`planner what-if`: a job with other values of some settings, foretold by prices and planned again."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError
from planner.commands.options import (
    DEFAULT_MACHINE,
    Job,
    JsonOption,
    MachineOption,
    QuietOption,
    ThreadsOption,
    ToleranceOption,
    takes_planning,
    takes_reading,
)
from planner.commands.progress import ProgressBar
from planner.commands.terminal import FAILED, NOT_SOLVED, guarded, say, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.study.variant import StudiedJob


@guarded
@takes_reading
@takes_planning
def what_if_command(
    job: Job,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="another value, such as axes.y.jerk=4e5, y.velocity=+10%, tolerance=20um or feed=1.2; repeat it for more",
        ),
    ] = None,
    machine: MachineOption = None,
    tolerance: ToleranceOption = None,
    as_json: JsonOption = False,
    threads: ThreadsOption = None,
    quiet: QuietOption = False,
    *,
    how: dict[str, Any],
    reading: Reading,
) -> None:
    """Plan a program as it is, with each --set alone, and with all of them; beside it what prices foretell.

    The exit code is 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion.
    """
    if not changes:
        raise InputError("nothing to change: name a setting and its value, such as --set axes.y.jerk=4e5")
    studied = studied_job(job, machine, tolerance, reading, how)
    from planner.study.settings import parse_setting
    from planner.study.tables import what_if_dict, what_if_table
    from planner.study.what_if import what_if

    settings = [parse_setting(text, studied.machine, studied.present_tolerance) for text in changes]
    with ProgressBar(quiet=quiet) as progress:
        rows = what_if(studied, settings, lambda label, stage, done: progress(f"{label}: {stage}", done))
    if as_json:
        say(json.dumps(what_if_dict(studied, rows), indent=2, allow_nan=False))
    else:
        title = f"{studied.program.source}: {how['method']}, machine {studied.machine.name}"
        show(what_if_table(studied, rows, title))
    outcomes = {it.row.outcome for it in rows}
    if outcomes != {"passed"}:
        raise typer.Exit(FAILED if outcomes <= {"passed", "failed"} else NOT_SOLVED)


def studied_job(
    job: Any, machine: str | None, tolerance: float | None, reading: Reading, how: dict[str, Any]
) -> StudiedJob:
    """The job of a command line, read. Raises InputError, for settings that the method does not use too."""
    from planner.machine import load_machine
    from planner.methods.registry import check_settings
    from planner.nc.reader import read_program
    from planner.study.variant import StudiedJob

    check_settings(**how)
    if tolerance is not None and not 0.0 < tolerance < float("inf"):
        raise InputError(f"tolerance {tolerance} mm; it must be positive and finite")
    limits = load_machine(machine or DEFAULT_MACHINE)
    program = read_program(job, limits, reading)
    return StudiedJob(program=program, machine=limits, tolerance=tolerance, how=how)
