"""What a program holds that is not read: one record per place, in the order of the program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

from planner.base.errors import InputError
from planner.nc.lexer import Words


@dataclass(frozen=True, slots=True)
class Fault:
    """One construct that is not supported or not valid.

    line, column : 1-based place in the source
    word         : the word found, as it is written
    message      : what it is, what is allowed and what to do
    source       : name of the file, if it is not the main program's
    """

    line: int
    column: int
    word: str
    message: str
    source: str = ""

    def __str__(self) -> str:
        return f"{self.word}: {self.message}" if self.word else self.message


class FaultList(Sequence[Fault]):
    """Faults by word; a `Fault` is made when it is looked at (a rotary program has 220,000)."""

    def __init__(self, found: list[tuple[Words, int, str]]):
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    @overload
    def __getitem__(self, index: int) -> Fault: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Fault]: ...
    def __getitem__(self, index: int | slice) -> Fault | Sequence[Fault]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        words, word, message = self._found[index]
        line = int(words.line[words.row(word)])
        return Fault(line, words.column(word), words.text(word), message, words.file(word))


def require_none(faults: Sequence[Fault], source: str) -> None:
    """Raise InputError for the first fault, with the number of the others."""
    if not faults:
        return
    first, more = faults[0], len(faults) - 1
    text = str(first)
    if more:
        text += f" ({more} more in this program; 'planner info' shows them)"
    raise InputError(text, source=first.source or source, line=first.line, column=first.column)
