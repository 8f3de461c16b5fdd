"""`planner compare`: several methods on the same job, machine and tolerance, judged by the same verifier."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.base.names import METHODS, method_name
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.progress import ProgressBar
from planner.commands.terminal import CODES, guarded, memory_used_up, say, say_json, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.machine import Machine
    from planner.nc.program import Program
    from planner.report.compare import Row

ALL = "all"


@guarded
@options.takes_reading
def compare_command(
    job: options.Job,
    machine: options.MachineOption = None,
    method: Annotated[
        str,
        typer.Option("--method", "--methods", metavar="A,B,...", help="methods to compare (default: all)"),
    ] = ALL,
    tolerance: options.ToleranceOption = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", "--out", metavar="FILE", help="write the comparison (.json, .csv)"),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE",
            help="write a page with the motions side by side (.html) for a browser",
        ),
    ] = None,
    force: options.ForceOption = False,
    threads: options.ThreadsOption = None,
    quiet: options.QuietOption = False,
    as_json: options.JsonOption = False,
    *,
    reading: Reading,
) -> None:
    """Plan a program with several methods and compare cycle times, limits, errors and verdicts.

    The exit code is 0 if one of them passed, 1 if none did, 3 if none ended with a motion, 2 if all refused
    the job.
    """
    files = [file for file in (output, report) if file is not None]
    if force and not files:
        raise InputError(
            "--force has no effect without a file to write; name one with -o FILE or --report FILE"
        )
    methods = parse_methods(method)
    from planner.nc.reader import read_program
    from planner.report import comparison
    from planner.report.replace import check_file, write_whole
    from planner.report.tables import assumed_lines

    inputs = [job, Path(machine or options.DEFAULT_MACHINE)]
    if output is not None:
        check_file(output, inputs, suffixes=comparison.SUFFIXES, force=force)
    if report is not None:
        check_file(report, inputs, force=force)
    limits = machine_named(machine)
    program = read_program(job, limits, reading)
    rows = [_run(name, program, limits, tolerance, quiet, report is not None) for name in methods]
    about = comparison.about_job(str(job), limits, tolerance)
    if report is not None:
        from planner.report.html.comparison_page import comparison_page

        write_whole(report, comparison_page(rows, str(job), limits, program))
    if output is not None:
        comparison.write_comparison(output, rows, about)
    if as_json:
        say_json(comparison.comparison_dict(rows, about))
    else:
        title = f"{job}: {len(rows)} methods, machine {limits.name}"
        show(*assumed_lines(program.assumptions), comparison.comparison_table(rows, title))
        for file in files:
            say(str(file))
    outcomes = {row.outcome for row in rows}
    if code := next(code for outcome, code in CODES.items() if outcome in outcomes):
        raise typer.Exit(code)


def parse_methods(text: str) -> list[str]:
    """The methods of `a,b,...`, or all of them, by their present names.

    Raises InputError for a name that is unknown or given twice.
    """
    if text == ALL:
        return list(METHODS)
    try:
        names = [method_name(name.strip()) for name in text.split(",")]
    except InputError as fault:
        raise InputError(f"--method: {fault}") from None
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--method: '{name}' is named twice")
    return names


def _run(
    method: str, program: Program, machine: Machine, tolerance: float | None, quiet: bool, shown: bool
) -> Row:
    """Plan with one method and say on standard error how it went; keep samples of the motion if they are
    `shown` on a page."""
    from planner.report.compare import Row, row_of
    from planner.report.html.comparison_page import SAMPLES_MAX

    with ProgressBar(quiet=quiet) as progress:
        try:

            def told(stage: str, fraction: float) -> None:
                progress(f"{method}: {stage}", fraction)

            row = row_of(method, program, machine, tolerance, told, SAMPLES_MAX if shown else 0)
        except MemoryError as fault:
            row = Row(method=method, outcome="not solved", sentence=memory_used_up(fault))
    took = "" if row.cycle_time is None else f" {row.cycle_time:.4f} s,"
    if not quiet:
        say(f"{method}:{took} {row.outcome}", err=True)
    return row
