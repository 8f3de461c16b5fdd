"""Faults of the command line in plain words: typer's messages are for programmers, and lack the one hint that helps.

A file where a command belongs (`planner part.nc`) is answered with the command; a misspelt option with the one that is near, not with
every option that resembles it; what is missing with what its help says.
"""

from __future__ import annotations

import difflib
import os
import re
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

# typer has a click of its own from 0.2x on, under another name: its base class of usage faults is the one of BadParameter.
UsageError: Any = typer.BadParameter.__mro__[1]
_NUMBER = re.compile(r"Input should be a valid (number|integer).*|'.*' is not a valid (float|integer)\.?")
_LEAST = re.compile(r"Input should be greater than or equal to (\S+)")


class PlainCommand(TyperCommand):
    """A command whose usage faults are in plain words."""

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
    if getattr(fault, "possibilities", None) and wrong:
        near = difflib.get_close_matches(wrong, options, n=1)
        fault.message = f"no option {wrong}" + (f"; did you mean {near[0]}?" if near else "")
        fault.possibilities = None
    if type(fault).__name__ == "MissingParameter" and not fault.message:
        fault.message = getattr(fault.param, "help", None) or ""
    said = str(fault.message or "").removeprefix("Value error, ")
    if found := _NUMBER.fullmatch(said):
        kind = "a whole number" if "integer" in found.groups() else "a number"
        said = f"give {kind}"
    elif least := _LEAST.match(said):
        said = f"must be {least[1]} or more"
    fault.message = said
