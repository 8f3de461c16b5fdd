"""`planner verify`: judge a trajectory file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import DEFAULT_MACHINE, Job, JsonOption, QuietOption, ToleranceOption
from planner.commands.terminal import FAILED, ProgressBar, guarded, say, show
from planner.errors import InputError


@guarded
def verify(
    trajectory: Annotated[
        Path, typer.Argument(metavar="TRAJECTORY", help="trajectory file (.parquet, .csv, .npz)")
    ],
    job: Job,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--machine",
            metavar="FILE",
            help=f"machine file or built-in machine [default: TRAJECTORY's own, or {DEFAULT_MACHINE}]",
        ),
    ] = None,
    tolerance: ToleranceOption = None,
    not_limited: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY", help="report without judging: jerk for a plan that does not limit it"
        ),
    ] = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Judge a trajectory against its program and a machine; it may come from anywhere."""
    from planner.geometry.build import toolpath_from_program
    from planner.machine import load_machine, machine_from_dict
    from planner.nc.reader import read_program
    from planner.report.export import verdict_summary
    from planner.report.tables import verdict_table
    from planner.report.trajectory_file import read_trajectory
    from planner.verify import verify as judge
    from planner.verify.judge import NOT_LIMITED_NAMES

    read = read_trajectory(trajectory)
    recorded = read.metadata.get("machine")
    if machine is None and recorded is not None:
        limits = machine_from_dict(recorded, source=f"{trajectory} (recorded machine)")
    else:
        limits = load_machine(machine or DEFAULT_MACHINE)
    recorded_tolerance = read.metadata.get("tolerance_mm")
    if tolerance is None and isinstance(recorded_tolerance, float):
        tolerance = recorded_tolerance
    recorded_free = read.metadata.get("not_limited")
    recorded_names = recorded_free if isinstance(recorded_free, list) else []
    unjudged = tuple(recorded_names if not_limited is None else not_limited)
    for name in unjudged:
        if name not in NOT_LIMITED_NAMES:
            raise InputError(
                f"--not-limited {name}: there is no such limit; {', '.join(NOT_LIMITED_NAMES)} are"
            )
    toolpath = toolpath_from_program(read_program(job, limits), limits, tolerance)
    with ProgressBar(quiet=quiet) as progress:
        verdict = judge(
            read.trajectory,
            toolpath,
            limits,
            not_limited=unjudged,
            progress=lambda fraction: progress("verify", fraction),
        )
    if as_json:
        say(json.dumps({**verdict_summary(verdict), "machine": limits.name, "notes": read.notes}, indent=2))
    else:
        for note in read.notes:
            say(f"note: {note}", err=True)
        show(verdict_table(verdict, f"{trajectory} on {job}, machine {limits.name}"))
    if not verdict.passed:
        raise typer.Exit(FAILED)
