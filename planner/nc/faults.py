"""Constructs of a program that are not read: one record per place, in the order of the program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from planner.base.errors import InputError
from planner.nc.events import MadeWhenAsked
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


class FaultList(MadeWhenAsked[Fault]):
    """Faults by word (a rotary program has 220,000)."""

    def __init__(self, found: list[tuple[Words, int, str]]):
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    def made(self, index: int) -> Fault:
        """The fault of that number."""
        words, word, message = self._found[index]
        line = int(words.line[words.row(word)])
        return Fault(line, words.column(word), words.text(word), message, words.file(word))


class Said(NamedTuple):
    """A note, its line, and whether it is an assumption that may change geometry or time."""

    line: int
    text: str
    changes: bool


class Notes(NamedTuple):
    """Messages about a program: assumptions that may change geometry or time, and other notes."""

    assumptions: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


class Findings:
    """Findings while a program is read in chunks: faults by word, assumptions that may change geometry or time, and other notes.

    strict : such assumptions are faults
    faults : of the chunks so far, in the order of their words; a line that is executed many times is named once
    """

    def __init__(self, *, strict: bool = False) -> None:
        self.strict = strict
        self.faults: list[tuple[Words, int, str]] = []
        self._reports: list[tuple[int, str]] = []  # of the chunk that is being read
        self._said: set[tuple[int, str]] = set()
        self._notes: dict[tuple[bool, str], list[int]] = {}  # in their order: first line, times

    def report(self, word: int, message: str) -> None:
        """Keep a fault of a word of the chunk, by its index."""
        self._reports.append((word, message))

    def keep(self, words: Words, more: list[tuple[int, str]]) -> None:
        """End a chunk: keep its reports and `more` of them in the order of its words."""
        for word, message in sorted(more + self._reports):
            key = (int(words.at[word]), message)
            if key not in self._said:
                self._said.add(key)
                self.faults.append((words, word, message))
        self._reports.clear()

    def note(self, text: str, line: int) -> None:
        """Keep what a user should know of a line, and what changes neither geometry nor time."""
        self._notes.setdefault((False, text), [line, 0])[1] += 1

    def assume(self, text: str, line: int, word: int | None = None) -> None:
        """Keep what was assumed on a line, and may change geometry or time.

        word : index in the chunk; strict reading refuses it there. None where strict reading does not come by.
        """
        if self.strict and word is not None:
            self.report(word, f"{text} (assumed without --strict)")
        else:
            self._notes.setdefault((True, text), [line, 0])[1] += 1

    def notes(self, more: Sequence[Said]) -> Notes:
        """Assumptions and notes, each once, with its first line and how often, and `more`; in the order of the lines."""
        found = [
            Said(line, f"line {line}: {text}{f' ({times} times)' if times > 1 else ''}", changes)
            for (changes, text), (line, times) in self._notes.items()
        ]
        ordered = sorted([*found, *more], key=lambda said: said.line)
        return Notes(
            tuple(said.text for said in ordered if said.changes),
            tuple(said.text for said in ordered if not said.changes),
        )


def require_none(faults: Sequence[Fault], source: str) -> None:
    """Raise InputError for the first fault, with the number of the others."""
    if not faults:
        return
    first, more = faults[0], len(faults) - 1
    text = str(first)
    if more:
        text += f" ({more} more in this program; 'planner info' shows them)"
    raise InputError(text, source=first.source or source, line=first.line, column=first.column)
