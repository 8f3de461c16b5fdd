"""`planner report`: a page to look at, of a plan that was written before."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands.options import ForceOption
from planner.commands.terminal import guarded, say


@guarded
def report_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="directory that 'plan -o' wrote")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="page to write (default: DIR/report.html)"),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a page of a plan that opens in a browser: path, profiles, NC lines, corners, verdict."""
    if not os.path.isdir(directory):
        raise InputError("give the directory that 'plan -o' wrote", source=str(directory))
    from planner.report.html.page import REPORT, report_page
    from planner.report.html.saved import saved_plan
    from planner.report.replace import check_file, write_whole

    file = output or directory / REPORT
    check_file(file, force=force)
    plan, summary, text = saved_plan(directory)
    write_whole(file, report_page(plan, text, summary))
    say(str(file))
