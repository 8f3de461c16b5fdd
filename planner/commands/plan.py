"""`planner plan`: plan, sample and verify a program, and write the files."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError, NotSolvedError
from planner.base.names import users_of
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.progress import ProgressBar
from planner.commands.terminal import FAILED, guarded, say, say_json, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan
    from planner.planning.job.trace import Trace

INTO_OUTPUT = "into the output directory: name one with -o DIR"
IN_OUTPUT = "in the output directory: name one with -o DIR"
NO_CORNERS = "no corners to list: the program has no corner without a full stop"


@guarded
@options.takes_reading
@options.takes_planning
def plan_command(
    context: typer.Context,
    jobs: options.Jobs,
    machine: options.MachineOption = None,
    tolerance: options.ToleranceOption = None,
    shaped: Annotated[
        bool,
        typer.Option(
            "--shaped",
            help=f"deliver setpoints that leave the machine's vibration modes at rest ({' and '.join(users_of('shaped'))})",
        ),
    ] = False,
    output: Annotated[
        Path | None,
        options.output_option(
            "DIR", "write the trajectory, the program with planned feeds and a summary into DIR"
        ),
    ] = None,
    file_format: Annotated[
        options.Format | None,
        typer.Option("--format", help=f"format of the trajectory in DIR (default: {options.Format.parquet})"),
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="write pictures into DIR (PNG)")] = False,
    report: Annotated[
        bool, typer.Option("--report", help="write a page into DIR that opens in a browser (report.html)")
    ] = False,
    corners: Annotated[
        bool, typer.Option("--corners", help="list every programmed corner with its values of eq. 18 to 20")
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option("-v", "--verbose", help="print all rows, and the steps of planning on standard error"),
    ] = False,
    units: options.UnitsOption = None,
    trace: Annotated[
        Path | None,
        typer.Option("--trace", metavar="FILE", help="write what planning tried into FILE (JSON)"),
    ] = None,
    as_json: options.JsonOption = False,
    threads: options.ThreadsOption = None,
    quiet: options.QuietOption = False,
    force: options.ForceOption = False,
    *,
    how: dict[str, Any],
    reading: Reading,
) -> None:
    """Plan and verify one or more programs; several ones go into DIR/NAME each."""
    nowhere = output is None
    for wrong, why in (
        (plot and nowhere, f"--plot writes its pictures {INTO_OUTPUT}"),
        (report and nowhere, f"--report writes its page {INTO_OUTPUT}"),
        (file_format is not None and nowhere, f"--format is the format of the trajectory {IN_OUTPUT}"),
        (corners and as_json, "--corners adds to the table, and --json prints none; leave one out"),
        (verbose and quiet, "--verbose tells what --quiet keeps quiet; leave one out"),
        (
            force and nowhere and trace is None,
            "--force is for files, and without -o or --trace there are none; leave one out",
        ),
    ):
        if wrong:
            raise InputError(why)
    how |= {"shaped": shaped} if shaped else {}
    if len(jobs) > 1:
        for name, value in {"--trace": trace, "--verbose": verbose, "--corners": corners}.items():
            if value:
                raise InputError(f"{name} is for one program; {len(jobs)} are given")
        from planner.commands.many import plan_many
        from planner.planning.methods.registry import check_settings

        check_settings(**how)
        handed_on = options.given_options(context, ("output", "threads", "quiet", "as_json"))
        code = plan_many(jobs, handed_on, output, threads=threads, quiet=quiet, as_json=as_json)
        if code:
            raise typer.Exit(code)
        return
    (job,) = jobs
    from planner import plan
    from planner.nc.reader import read_program
    from planner.planning.job.trace import Stages, Trace
    from planner.report.export import OF_FILES, SUMMARY, check_places, files_to_keep, write_plan
    from planner.report.replace import check_file, write_whole
    from planner.report.summary import summary
    from planner.report.tables import assumed_lines, brief_table, corners_table, plan_table
    from planner.report.units import units_of

    form = file_format or options.Format.parquet
    if output is not None:
        inputs = [job, Path(machine or options.DEFAULT_MACHINE)]
        check_places(output, inputs, file_format=form.value, plots=plot, force=force, report=report)
    if trace is not None:
        check_file(trace, [job, Path(machine or options.DEFAULT_MACHINE)], force=force)
    steps = Trace(line=partial(say, err=True) if verbose else None)
    with ProgressBar(quiet=quiet or verbose) as progress:
        stages, limits = Stages(progress), machine_named(machine)
        with stages.stage("read"):
            program = read_program(job, limits, reading)
        if output is not None:
            files_to_keep(program)  # what has no place there is refused before any work
        result = plan(
            program,
            limits,
            tolerance=tolerance,
            progress=progress,
            log=steps if verbose or trace is not None else None,
            **how,
        )
        result.timings.update(stages.timings)
        written: list[str] = []
        if output is not None and result.trajectory is not None:
            progress("write", 0.0)
            written = write_plan(
                result, output, file_format=form.value, plots=plot, report=report, force=force, units=units
            )

    if trace is not None:
        write_whole(trace, json.dumps(_trace(steps, result), indent=1, allow_nan=False) + "\n")
    if written and output is not None:  # with what was not written, and why
        said = json.loads((output / SUMMARY).read_text(encoding="utf-8"))
        said = {name: value for name, value in said.items() if name not in OF_FILES}
    else:
        said = summary(result)
    if as_json:
        say_json(said)
    else:
        shown_in = units_of(result.program, units)
        if verbose:
            show(*assumed_lines(result.program.assumptions), plan_table(result, said))
        else:
            show(brief_table(result, shown_in, said))
        if corners:
            show("", corners_table(result.corners, shown_in) or NO_CORNERS)
        if written:
            say(f"files in {output}: {', '.join(written)}")
    if result.trajectory is None:
        untouched = f"; {output} was not touched" if output is not None else ""
        raise NotSolvedError(f"{result.sentence}{untouched}")
    if result.verdict is None or not result.verdict.passed:
        raise typer.Exit(FAILED)


def _trace(steps: Trace, plan: Plan) -> dict[str, Any]:
    """The trace of planning, for a file: times in s; `kept` says whether a step was taken over."""
    return {
        "program": plan.program.source,
        "method": plan.method,
        "corner": plan.corner,
        "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
        "sentence": plan.sentence,
        "steps": steps.as_json(),
    }
