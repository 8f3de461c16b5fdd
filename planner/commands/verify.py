"""`planner verify`: judge a trajectory file.

Without -m and --tolerance it is judged with its own machine and tolerance, and its program read as it was for the plan
unless settings of the reader are given; the output says so. Limits that a file declares as not kept are judged too.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.progress import ProgressBar
from planner.commands.terminal import FAILED, guarded, say, say_json, show
from planner.nc.reading import AS_USUAL, Reading

if TYPE_CHECKING:
    from planner.machine import Machine
    from planner.report.judging import FileSays


@guarded
@options.takes_reading
def verify_command(
    trajectory: options.TrajectoryArgument,
    job: Annotated[
        Path | None, typer.Argument(metavar="JOB", help="NC program (default: the one that TRAJECTORY names)")
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--machine",
            metavar="FILE",
            help=f"machine file, or name of a built-in machine (default: the one in TRAJECTORY, else {options.DEFAULT_MACHINE})",
        ),
    ] = None,
    tolerance: options.ToleranceOption = None,
    not_limited: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY",
            help="report this limit without judging it, for example jerk for a plan that does not limit it",
        ),
    ] = None,
    quiet: options.QuietOption = False,
    as_json: options.JsonOption = False,
    *,
    reading: Reading,
) -> None:
    """Judge a trajectory file, from any source, against its program and a machine."""
    from planner.nc.reader import read_program
    from planner.report.judging import FileSays, judge
    from planner.report.summary import json_ready
    from planner.report.tables import assumed_lines, verdict_table
    from planner.report.trajectory_reader import FORMATS, read_trajectory, trajectory_file
    from planner.verifier import NOT_LIMITED_NAMES

    unjudged = tuple(not_limited or ())
    for name in unjudged:
        known_name("limit", name, NOT_LIMITED_NAMES)
    if job is not None and job.suffix[1:].lower() in FORMATS and trajectory.suffix[1:].lower() not in FORMATS:
        raise InputError(f"the trajectory comes first: planner verify {job} {trajectory}")
    trajectory = trajectory_file(trajectory)
    read = read_trajectory(trajectory)
    says = FileSays.of(read.metadata)
    limits, from_file = _machine(machine, trajectory, says)
    job = says.program_at(trajectory) if job is None else job
    taken = says.tolerance if machine is None and tolerance is None else None
    as_planned = reading == AS_USUAL
    program = read_program(job, limits, says.reading_at(trajectory) if as_planned else reading)
    with ProgressBar(quiet=quiet) as progress:
        allowed, told = tolerance if taken is None else taken, partial(progress, "verify")
        found = judge(read, program, limits, tolerance=allowed, not_limited=unjudged, progress=told)
    verdict, budgets, time = found.verdict, found.toolpath.tolerance, found.motion.cycle_time
    notes = [*read.notes, *found.notes, *verdict.notes]
    notes += [f"the file says: {text}" for text in says.sentences(from_file, taken is not None, as_planned)]
    notes += says.remedies(verdict, unjudged)
    if as_json:
        about = {
            "corners": verdict.corners.summary(),
            "machine": limits.name,
            "tolerance_mm": found.toolpath.same_tolerance,
            "cycle_time_s": time,
            "notes": notes,
        }
        say_json(json_ready({"assumptions": program.assumptions, **verdict.summary(), **about}))
    else:
        for note in notes:
            say(f"note: {note}", err=True)
        low, high = float(budgets.min()), float(budgets.max())
        inputs = {
            "cycle time": f"{time:.4f} s",
            "tolerance": f"{low:g} mm" if low == high else f"{low:g} to {high:g} mm",
        }
        title = f"{trajectory} on {job}, machine {limits.name}"
        show(*assumed_lines(program.assumptions), verdict_table(verdict, title, inputs))
    if not verdict.passed:
        raise typer.Exit(FAILED)


def _machine(machine: str | None, trajectory: Path, says: FileSays) -> tuple[Machine, bool]:
    """The machine of the command line, else the one that the file brings, else the default; True if it is the
    file's."""
    from planner.machine import machine_from_dict

    if machine is None and says.machine is not None:
        return machine_from_dict(says.machine, source=f"{trajectory} (its own machine)"), True
    return machine_named(machine), False
