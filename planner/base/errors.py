"""Kinds of failure, and how they are reported.

* bad input            an `InputError`, raised before any work: file, line and column, what was found and what is allowed;
* an unsolved problem  a status with a sentence and a remedy; `require()` turns it into `NotSolvedError`;
* a bug of ours        an assertion or an uncaught exception.

Packages that only some solvers and outputs need are imported when needed, asked for if missing.
"""

import importlib
import unicodedata
from typing import Any


def import_needed(package: str, user: str, extra: str = "") -> Any:
    """The package, imported; `user` is what needs it, `extra` the extra of ours that has it. Raises InputError
    with the command that installs it."""
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as fault:
        if fault.name != package.partition(".")[0]:
            raise  # it is there, and something that it needs is not
        wanted = f"'feedrate-planner[{extra}]'" if extra else fault.name
        said = f"{user} needs the package {fault.name}, which is not installed: pip install {wanted}"
        raise InputError(said) from None


class PlannerError(Exception):
    """Base of all exceptions that this package raises on purpose."""


class InputError(PlannerError, ValueError):
    """Input that cannot be planned: a program, a machine file or an argument.

    message : what was found, what is allowed, what to do
    source  : file name, or None for values passed from Python
    line    : 1-based line in that file, or None
    column  : 1-based column in that line, or None

    The text has no control characters, which a terminal might obey, whatever words of a program it quotes.
    """

    def __init__(
        self, message: str, *, source: str | None = None, line: int | None = None, column: int | None = None
    ):
        self.message, self.source, self.line, self.column = message, source, line, column
        place = ":".join(str(part) for part in (source, line, column) if part is not None)
        super().__init__(printable(f"{place}: {message}" if place else message))


class NotSolvedError(PlannerError, RuntimeError):
    """There is no solution. The text is the sentence of the status, with its remedy."""


def printable(text: str) -> str:
    """The text with control characters other than line ends and tabs written as \\x1b and the like."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or unicodedata.category(c) != "Cc" else f"\\x{ord(c):02x}" for c in text)
