"""The command line: every command under its name."""

from __future__ import annotations

from typing import Annotated

import typer

from planner.commands.compare import compare_command
from planner.commands.export import export_command, pulses_command, report_command
from planner.commands.info import expand_command, info_command
from planner.commands.machine import import_file, init_file, list_machines, show_machine
from planner.commands.plan import plan_command
from planner.commands.studied import sweep_command, what_if_command
from planner.commands.usage import PlainCommand, PlainGroup
from planner.commands.verify import verify_command

HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    cls=PlainGroup,
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


# Every command with the line that `planner --help` has of it; its docstring is what its own --help says.
for name, (command, line) in {
    "plan": (plan_command, "Plan and verify the motion of a program, or of several."),
    "what-if": (what_if_command, "What other limits would change: foretold and planned again."),
    "sweep": (sweep_command, "Plan a program over ranges of limits, into a table."),
    "compare": (compare_command, "Plan a program with several methods, side by side."),
    "verify": (verify_command, "Judge a trajectory file, from any source."),
    "info": (info_command, "What a program contains, and what is not supported."),
    "expand": (expand_command, "Write a program without parameters, loops and calls."),
    "pulses": (pulses_command, "Make step and direction pulses of a trajectory."),
    "export": (export_command, "Write a plan for a control."),
    "report": (report_command, "Write the page of a plan that opens in a browser."),
}.items():
    app.command(name, cls=PlainCommand, short_help=line)(command)

machine_app = typer.Typer(
    cls=PlainGroup,
    help="Machine files: list, show, init, import.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
machine_app.command("list", cls=PlainCommand)(list_machines)
machine_app.command("show", cls=PlainCommand)(show_machine)
machine_app.command("init", cls=PlainCommand)(init_file)
machine_app.command("import", cls=PlainCommand)(import_file)
app.add_typer(machine_app, name="machine")
