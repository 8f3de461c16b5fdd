"""The command line: every command of `planner.commands` under its name.

Exit codes: 0 done and verified; 1 the verdict failed; 2 bad input; 3 not solved; 70 a bug of ours; 130
interrupted.
"""

from __future__ import annotations

import typer

from planner.commands.compare import compare
from planner.commands.info import info
from planner.commands.machine import init_file, list_machines, show_machine
from planner.commands.plan import plan
from planner.commands.pulses import pulses
from planner.commands.verify import verify

app = typer.Typer(
    help="The fastest motion of an NC program within the limits of a machine, planned and verified.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (plan, compare, verify, info, pulses):
    app.command()(command)

machine_app = typer.Typer(help="Machine files.", no_args_is_help=True)
machine_app.command("list")(list_machines)
machine_app.command("show")(show_machine)
machine_app.command("init")(init_file)
app.add_typer(machine_app, name="machine")


def main() -> None:
    """Entry point of the command `planner`."""
    app(prog_name="planner")
