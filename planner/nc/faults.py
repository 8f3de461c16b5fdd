"""What a program holds that is not read: one record per place, in the order of the program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from planner.errors import InputError


@dataclass(frozen=True, slots=True)
class Fault:
    """One construct that is not supported or not valid.

    line, column : 1-based place in the source
    word         : the word found, as it is written
    message      : what it is, what is allowed and what to do
    """

    line: int
    column: int
    word: str
    message: str

    def __str__(self) -> str:
        return f"{self.word}: {self.message}" if self.word else self.message


def require_none(faults: Sequence[Fault], source: str) -> None:
    """Raise InputError for the first fault, with the number of the others."""
    if not faults:
        return
    first, more = faults[0], len(faults) - 1
    text = str(first)
    if more:
        text += f" ({more} more in this program; 'planner info' lists them all)"
    raise InputError(text, source=source, line=first.line, column=first.column)
