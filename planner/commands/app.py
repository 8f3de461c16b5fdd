"""The command line: every command under its name, and faults of its use in plain words, with the one hint that helps:
the command for a file that stands where one belongs, the one option that is near, what is missing by its help.
"""

import difflib
import os
import re
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from planner.commands.compare import compare_command
from planner.commands.control_time import time_command
from planner.commands.export import export_command, pulses_command, report_command
from planner.commands.info import expand_command, info_command
from planner.commands.machine import fit_command, import_file, init_file, list_machines, show_machine
from planner.commands.plan import plan_command
from planner.commands.smooth import smooth_command
from planner.commands.studied import sweep_command, what_if_command
from planner.commands.verify import verify_command

# typer has a click of its own from 0.2x on, under another name: its base class of usage faults is the one of
# BadParameter.
UsageError: Any = typer.BadParameter.__mro__[1]
_NUMBER = re.compile(r"Input should be a valid (number|integer).*|'.*' is not a valid (float|integer)\.?")
# Options that most people need; a command with more than `LONG` of them has the others below (count of rows).
FIRST = ("machine", "tolerance", "output", "report", "units", "verbose", "changes", "vary")
LONG = 16
NEAR = 0.7  # how like a wrong option one must be that is named, of 1
_LEAST = re.compile(r"Input should be greater than or equal to (\S+)")


class PlainCommand(TyperCommand):
    """A command whose usage faults are in plain words."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """The options of a long list that a machinist needs first, the others under "Advanced"."""
        shown = [
            (one.name in FIRST or one.param_type_name == "argument", one.get_help_record(ctx))
            for one in self.get_params(ctx)
        ]
        needed, others = (
            [line for first, line in shown if line and first is which] for which in (True, False)
        )
        parts = {"Options": needed, "Advanced": others} if len(shown) > LONG else {"Options": needed + others}
        for title, lines in parts.items():
            if lines:
                formatter.write_paragraph()
                formatter.write_heading(title)
                formatter.indent()
                formatter.write_dl(lines)
                formatter.dedent()

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As in the base class; raises its UsageError with a message of ours."""
        try:
            return super().parse_args(ctx, args)
        except UsageError as fault:
            _plain(fault, [name for option in self.params for name in option.opts])
            raise


class PlainGroup(TyperGroup):
    """The commands; a file where one belongs is answered with `planner plan FILE`."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """As in the base class; raises its UsageError with a message of ours."""
        try:
            return super().resolve_command(ctx, args)
        except UsageError as fault:
            if Path(args[0]).suffix or os.path.exists(args[0]):
                fault.message = (
                    f"'{args[0]}' is no command. To plan a program: {ctx.command_path} plan {args[0]}"
                )
            raise


def _plain(fault: Any, options: list[str]) -> None:
    """Change the message of a usage fault, in place."""
    wrong = getattr(fault, "option_name", None)
    if type(fault).__name__ == "NoSuchOption":
        near = difflib.get_close_matches(str(wrong), options, n=1, cutoff=NEAR)
        near = ["--vary NAME=RANGE"] if wrong == "--set" and "--vary" in options else near
        fault.message = f"no option {wrong}" + (f"; did you mean {near[0]}?" if near else "")
        fault.possibilities = None
    if type(fault).__name__ == "MissingParameter" and not fault.message:
        fault.message = getattr(fault.param, "help", None) or ""
    text = str(fault.message or "").removeprefix("Value error, ")
    if found := _NUMBER.fullmatch(text):
        kind = "a whole number" if "integer" in found.groups() else "a number"
        text = f"give {kind}"
    elif least := _LEAST.match(text):
        text = f"must be {least[1]} or more"
    fault.message = text


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
    "what-if": (what_if_command, "What other limits would save: estimated, then planned."),
    "sweep": (sweep_command, "Plan a program over ranges of limits, into a table."),
    "compare": (compare_command, "Plan a program with several methods, side by side."),
    "verify": (verify_command, "Judge a trajectory file, from any source."),
    "info": (info_command, "What a program contains, and what is not supported."),
    "time": (time_command, "How long a control takes for a program as it is."),
    "expand": (expand_command, "Write a program without parameters, loops and calls."),
    "smooth": (smooth_command, "Write a program with fewer lines, within a share of the tolerance."),
    "pulses": (pulses_command, "Make step and direction pulses of a trajectory."),
    "export": (export_command, "Write a plan for a control."),
    "report": (report_command, "Write the page of a plan that opens in a browser."),
}.items():
    app.command(name, cls=PlainCommand, short_help=line)(command)

machine_app = typer.Typer(
    cls=PlainGroup,
    help="Machine files: list, show, init, import, fit.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
machine_app.command("list", cls=PlainCommand)(list_machines)
machine_app.command("show", cls=PlainCommand)(show_machine)
machine_app.command("init", cls=PlainCommand)(init_file)
machine_app.command("import", cls=PlainCommand)(import_file)
machine_app.command("fit", cls=PlainCommand)(fit_command)
app.add_typer(machine_app, name="machine")
