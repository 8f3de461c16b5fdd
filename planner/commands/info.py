"""`planner info`: what a program holds."""

from __future__ import annotations

import json

import typer

from planner.commands.exit_codes import BAD_INPUT
from planner.commands.options import DEFAULT_MACHINE, Job, JsonOption, MachineOption, takes_reading
from planner.commands.terminal import guarded, say, show
from planner.nc.reading import Reading


@guarded
@takes_reading
def info_command(
    job: Job, machine: MachineOption = None, as_json: JsonOption = False, *, reading: Reading
) -> None:
    """Show what a program contains, and the line of every construct that is not supported."""
    from planner.machine import load_machine
    from planner.nc.info import inspect_program
    from planner.report.summary import info_summary
    from planner.report.tables import info_table

    found = inspect_program(job, load_machine(machine or DEFAULT_MACHINE), reading)
    if as_json:
        say(json.dumps(info_summary(found), indent=2, allow_nan=False))
    else:
        show(info_table(found))
    if found.unsupported:
        raise typer.Exit(BAD_INPUT)
