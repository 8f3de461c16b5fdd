"""`planner sweep`: a job over ranges of settings, on this machine or on a cluster."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands.options import (
    JsonOption,
    QuietOption,
    ThreadsOption,
)
from planner.commands.progress import ProgressBar
from planner.commands.studied import StudiedJob, end_with, takes_studied_job, title_of
from planner.commands.terminal import guarded, say, show


@guarded
@takes_studied_job
def sweep_command(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="where points, table and picture are kept")
    ],
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
    as_json: JsonOption = False,
    threads: ThreadsOption = None,
    quiet: QuietOption = False,
    *,
    studied: StudiedJob,
) -> None:
    """Plan a program with every combination of values; what is done is kept, and the same command goes on with it.

    The exit code is 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion.
    """
    if cluster is not None and threads is not None:
        raise InputError("--threads is for processes of this machine; a cluster has the workers that it has")
    from planner.commands.study.points import SweepFolder
    from planner.commands.study.ranges import grid_of, parse_varied
    from planner.commands.study.sweep import sweep
    from planner.commands.study.tables import sweep_table
    from planner.commands.study.written import write_sweep
    from planner.report.tables import assumed_lines

    varied = [parse_varied(text, studied.machine, studied.present_tolerance) for text in vary]
    for point in grid_of(varied)[:1]:
        studied.changed(point)
    inputs = {
        "program": studied.program.source,
        "machine": studied.machine.name,
        "tolerance_mm": studied.tolerance,
        **studied.how,
    }
    folder = SweepFolder(output, studied, inputs)
    folder.open(force=force)
    with ProgressBar(quiet=quiet) as progress:
        done = sweep(studied, varied, folder, cluster, progress.count)
    written = write_sweep(done, output)
    outcomes = Counter(row["outcome"] for row in done.rows)
    if as_json:
        say(
            json.dumps(
                {"reused": done.reused, "outcomes": outcomes, "points": done.rows}, indent=1, allow_nan=False
            )
        )
    else:
        show(*assumed_lines(studied.program.assumptions), sweep_table(done, title_of(studied)))
        for name in written:
            say(str(output / name))
    end_with(outcomes)
