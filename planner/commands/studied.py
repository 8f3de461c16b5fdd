"""Common to `what-if` and `sweep`: the options of a job that is planned many times, and how such a command
ends."""

import inspect
from collections import Counter
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from planner.base.errors import InputError
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.progress import ProgressBar
from planner.commands.terminal import FAILED, NOT_SOLVED, guarded, say, say_json, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.commands.study.settings import StudiedJob
else:
    StudiedJob = Any  # of the commands' arguments: the module is loaded when a command runs


_JOB: dict[str, Any] = {
    "job": get_args(options.Job),
    "machine": get_args(options.MachineOption),
    "tolerance": get_args(options.ToleranceOption),
    "how": (dict, None),  # in the place of these two come the options of planning and of the reader
    "reading": (Reading, None),
}


def takes_studied_job(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of a job, of planning and of the reader; it gets them as one argument,
    `studied`."""
    usual = dict.fromkeys(_JOB, None) | {"job": inspect.Parameter.empty}
    of_job = options.taking(command, "studied", _JOB, usual, lambda given: _studied_job(**given))
    return options.takes_reading(options.takes_planning(of_job))


def _studied_job(
    *, job: Any, machine: str | None, tolerance: float | None, how: dict[str, Any], reading: Reading
) -> StudiedJob:
    """The job of a command line, read. Raises InputError, for settings that the method does not use too."""
    from planner.commands.study.settings import StudiedJob
    from planner.nc.reader import read_program
    from planner.planning.methods.registry import check_settings

    check_settings(**how)
    limits = machine_named(machine)
    program = read_program(job, limits, reading)
    return StudiedJob(program=program, machine=limits, tolerance=tolerance, how=how)


def title_of(studied: StudiedJob) -> str:
    """The head of a table of its plans."""
    return f"{studied.program.source}: {studied.how['method']}, machine {studied.machine.name}"


def end_with(outcomes: Collection[str]) -> None:
    """End the command with exit code 0 if all plans passed, 1 if one failed its verdict, 3 if one has no
    motion."""
    if set(outcomes) != {"passed"}:
        raise typer.Exit(FAILED if set(outcomes) <= {"passed", "failed"} else NOT_SOLVED)


@guarded
@takes_studied_job
def what_if_command(
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="another value, such as axes.y.jerk=4e5, y.velocity=+10%, tolerance=20um or feed=1.2; repeat it for more",
        ),
    ] = None,
    as_json: options.JsonOption = False,
    threads: options.ThreadsOption = None,
    quiet: options.QuietOption = False,
    *,
    studied: StudiedJob,
) -> None:
    """Plan a program as it is, with each --set alone, and with all of them; beside it what prices foretell.

    The exit code is 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion.
    """
    if not changes:
        raise InputError("nothing to change: name a setting and its value, such as --set axes.y.jerk=4e5")
    from planner.commands.study.settings import parse_setting
    from planner.commands.study.what_if import what_if, what_if_dict, what_if_table
    from planner.report.tables import assumed_lines

    settings = [parse_setting(text, studied.machine, studied.present_tolerance) for text in changes]
    with ProgressBar(quiet=quiet) as progress:
        rows = what_if(studied, settings, lambda label, stage, done: progress(f"{label}: {stage}", done))
    if as_json:
        say_json(what_if_dict(studied, rows))
    else:
        show(*assumed_lines(studied.program.assumptions), what_if_table(studied, rows, title_of(studied)))
    end_with({it.row.outcome for it in rows})


@guarded
@takes_studied_job
def sweep_command(
    output: Annotated[Path, options.output_option("DIR", "where points, table and picture are kept")],
    vary: Annotated[
        list[str],
        typer.Option(
            "--vary",
            metavar="NAME=RANGE",
            help="values of a setting: FIRST:LAST:COUNT, with :log for equal ratios, or A,B,C; such as tolerance=0.005:0.1:10:log; "
            "repeat it for all combinations",
        ),
    ],
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            metavar="ADDRESS",
            help="plan on a Dask cluster: its scheduler, such as tcp://host:8786",
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="begin anew in a directory that holds something else")
    ] = False,
    as_json: options.JsonOption = False,
    threads: options.ThreadsOption = None,
    quiet: options.QuietOption = False,
    *,
    studied: StudiedJob,
) -> None:
    """Plan a program with every combination of values; what is done is kept, and the same command goes on
    with it.

    The exit code is 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion.
    """
    if cluster is not None and threads is not None:
        raise InputError("--threads is for processes of this machine; a cluster has the workers that it has")
    from planner.commands.study.points import SweepFolder
    from planner.commands.study.settings import grid_of, parse_varied
    from planner.commands.study.sweep import sweep, write_sweep
    from planner.commands.study.what_if import sweep_table
    from planner.report.tables import assumed_lines

    varied = [parse_varied(text, studied.machine, studied.present_tolerance) for text in vary]
    for point in grid_of(varied)[:1]:
        studied.changed(point)
    folder = SweepFolder(output, studied)
    folder.open(force=force)
    with ProgressBar(quiet=quiet) as progress:
        done = sweep(studied, varied, folder, cluster, progress.count)
    written = write_sweep(done, output)
    outcomes = Counter(row["outcome"] for row in done.rows)
    if as_json:
        say_json({"reused": done.reused, "outcomes": outcomes, "points": done.rows})
    else:
        show(*assumed_lines(studied.program.assumptions), sweep_table(done, title_of(studied)))
        for name in written:
            say(str(output / name))
    end_with(outcomes)
