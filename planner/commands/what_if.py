"""`planner what-if`: a job with other values of some settings, foretold by prices and planned again."""

from __future__ import annotations

import json
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
def what_if_command(
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="another value, such as axes.y.jerk=4e5, y.velocity=+10%, tolerance=20um or feed=1.2; repeat it for more",
        ),
    ] = None,
    as_json: JsonOption = False,
    threads: ThreadsOption = None,
    quiet: QuietOption = False,
    *,
    studied: StudiedJob,
) -> None:
    """Plan a program as it is, with each --set alone, and with all of them; beside it what prices foretell.

    The exit code is 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion.
    """
    if not changes:
        raise InputError("nothing to change: name a setting and its value, such as --set axes.y.jerk=4e5")
    from planner.commands.study.settings import parse_setting
    from planner.commands.study.tables import what_if_dict, what_if_table
    from planner.commands.study.what_if import what_if
    from planner.report.tables import assumed_lines

    settings = [parse_setting(text, studied.machine, studied.present_tolerance) for text in changes]
    with ProgressBar(quiet=quiet) as progress:
        rows = what_if(studied, settings, lambda label, stage, done: progress(f"{label}: {stage}", done))
    if as_json:
        say(json.dumps(what_if_dict(studied, rows), indent=2, allow_nan=False))
    else:
        show(*assumed_lines(studied.program.assumptions), what_if_table(studied, rows, title_of(studied)))
    end_with({it.row.outcome for it in rows})
