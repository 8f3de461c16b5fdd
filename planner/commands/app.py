"""The command line: every command under its name."""

from __future__ import annotations

from typing import Annotated

import typer

from planner.commands.compare import compare_command
from planner.commands.expand import expand_command
from planner.commands.export import export_command
from planner.commands.info import info_command
from planner.commands.machine import import_file, init_file, list_machines, show_machine
from planner.commands.plan import plan_command
from planner.commands.pulses import pulses_command
from planner.commands.report import report_command
from planner.commands.sweep import sweep_command
from planner.commands.verify import verify_command
from planner.commands.what_if import what_if_command

HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    help="The fastest motion of an NC program within the limits of a machine, planned and verified.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich would take longer to import than everything else for --help
    context_settings=HELP_OPTIONS,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from planner import __version__

        typer.echo(f"planner {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """The fastest motion of an NC program within the limits of a machine, planned and verified."""


for name, command in {
    "plan": plan_command,
    "what-if": what_if_command,
    "sweep": sweep_command,
    "compare": compare_command,
    "verify": verify_command,
    "info": info_command,
    "expand": expand_command,
    "pulses": pulses_command,
    "export": export_command,
    "report": report_command,
}.items():
    app.command(name)(command)

machine_app = typer.Typer(help="Machine files.", no_args_is_help=True, rich_markup_mode=None)
machine_app.command("list")(list_machines)
machine_app.command("show")(show_machine)
machine_app.command("init")(init_file)
machine_app.command("import")(import_file)
app.add_typer(machine_app, name="machine")
