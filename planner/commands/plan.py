"""`planner plan`: plan, sample and verify a program, and write the files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError, NotSolvedError
from planner.commands.options import (
    DEFAULT_MACHINE,
    Corner,
    ForceOption,
    Format,
    Job,
    JsonOption,
    MachineOption,
    Method,
    QuietOption,
    Solver,
    ToleranceOption,
)
from planner.commands.terminal import FAILED, ProgressBar, guarded, say, show

NO_CORNERS = "no corners to list: the program turns nowhere without a stop"


@guarded
def plan(
    job: Job,
    machine: MachineOption = None,
    method: Annotated[Method, typer.Option(help="how to plan")] = Method.optimal,
    corner: Annotated[
        Corner | None,
        typer.Option(
            help="how toppra and optimal smooth the path: one spline, single corners, or the better of spline and bezier "
            f"[default: {Corner.auto}]"
        ),
    ] = None,
    solver: Annotated[
        Solver | None,
        typer.Option(
            help=f"of method optimal: {Solver.own} (default), or casadi's ipopt, fatrop and sequential-convex for comparison; "
            f"of method toppra: {Solver.reachability} (default), or the package toppra"
        ),
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="of reshaping splines for optimal and toppra [default: as many as the size of the job lets pay]",
        ),
    ] = None,
    shaped: Annotated[
        bool,
        typer.Option(
            "--shaped",
            help="set points that leave the machine's vibration modes at rest, for optimal and toppra",
        ),
    ] = False,
    tolerance: ToleranceOption = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="write trajectory and summary into DIR"),
    ] = None,
    file_format: Annotated[
        Format | None,
        typer.Option("--format", help=f"format of the trajectory in DIR [default: {Format.parquet}]"),
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="write pictures into DIR (PNG)")] = False,
    corners: Annotated[
        bool, typer.Option("--corners", help="list every programmed corner beside eq. 18-20")
    ] = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Plan, sample and verify the motion of a program."""
    if plot and output is None:
        raise InputError("--plot writes its pictures into the output directory: give one with -o DIR")
    if file_format is not None and output is None:
        raise InputError("--format is that of the trajectory in the output directory: give one with -o DIR")
    from planner import plan as plan_program
    from planner.report.export import SUMMARY, check_places, summary, write_plan

    form = file_format or Format.parquet
    if output is not None:
        inputs = [job, Path(machine or DEFAULT_MACHINE)]
        check_places(output, inputs, file_format=form.value, plots=plot, force=force)
    with ProgressBar(quiet=quiet) as progress:
        result = plan_program(
            job,
            machine or DEFAULT_MACHINE,
            method=method.value,
            corner=corner and corner.value,
            rounds=rounds,
            solver=solver and solver.value,
            shaped=shaped,
            tolerance=tolerance,
            progress=progress,
        )
        written: list[str] = []
        if output is not None and result.trajectory is not None:
            progress("write", 0.0)
            written = write_plan(result, output, file_format=form.value, plots=plot, force=force)

    said = summary(result)
    if written and output is not None:  # with what was not written, and why
        said["notes"] = json.loads((output / SUMMARY).read_text(encoding="utf-8"))["notes"]
    if as_json:
        say(json.dumps(said, indent=2, allow_nan=False))
    else:
        from planner.report.tables import corner_table, plan_table

        show(plan_table(result, said["notes"]))
        if corners:
            show("", (corner_table(result.corners) if result.corners is not None else None) or NO_CORNERS)
        for name in written:
            say(str(output / name) if output else name)
    if result.trajectory is None:
        kept = f"; {output} was not touched" if output is not None else ""
        raise NotSolvedError(f"{result.sentence}{kept}")
    if result.verdict is None or not result.verdict.passed:
        raise typer.Exit(FAILED)
