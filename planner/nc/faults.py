"""Findings while a program is read: constructs that are not read, and assumptions about it.

Words that, as far as the program tells, move nothing are counted and said once each; `Reading.strict` refuses
them. An axis that is not planned may be named as long as it does not move: all its words have one value,
after G91 they are 0. The compiled loop (plain.py) checks it by `treatment` and `parked`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.errors import InputError
from planner.nc.codes import LETTERS_REFUSED, PARKABLE, Assumption
from planner.nc.extruder import Retraction
from planner.nc.lexer import Words
from planner.nc.program import MadeWhenAsked, plain
from planner.nc.reading import AUTO, IGNORE, Reading
from planner.nc.settings import EXTRUDER_ZERO, RETRACTION, TOOL_POINT_M

# How a letter is treated whatever stands beside it, in `IgnoredWords.treatment`.
READ, REFUSED, LEFT_OUT, PARKED, AXIS = range(5)


@dataclass(frozen=True, slots=True)
class Fault:
    """One construct that is not supported or not valid."""

    line: int
    column: int  # 1-based, as `line`
    word: str  # the word found, as it is written
    message: str  # what it is, what is allowed and what to do
    source: str = ""  # name of the file, if it is not the main program's

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


class Note(NamedTuple):
    """A note."""

    line: int
    text: str
    changes: bool  # an assumption that may change geometry or time
    grave: bool = False  # it comes before the others, because the path may be another one altogether


class Notes(NamedTuple):
    """Messages about a program: assumptions that may change geometry or time, and other notes."""

    assumptions: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


class Findings:
    """What is found while a program is read in chunks."""

    def __init__(self, *, strict: bool = False) -> None:
        self.strict = strict  # such assumptions are faults
        # of the chunks so far, in the order of their words; a line that is executed many times is named once
        self.faults: list[tuple[Words, int, str]] = []
        self._reports: list[tuple[int, str]] = []  # of the chunk that is being read
        self._reported: set[tuple[int, str]] = set()
        self._notes: dict[tuple[bool, str], list[int]] = {}  # in their order: first line, times
        self._grave: set[str] = set()

    def report(self, word: int, message: str) -> None:
        """Keep a fault of a word of the chunk, by its index."""
        self._reports.append((word, message))

    def keep(self, words: Words, more: list[tuple[int, str]]) -> None:
        """End a chunk: keep its reports and `more` of them in the order of its words."""
        for word, message in sorted(more + self._reports):
            key = (int(words.at[word]), message)
            if key not in self._reported:
                self._reported.add(key)
                self.faults.append((words, word, message))
        self._reports.clear()

    def note(self, text: str, line: int) -> None:
        """Keep what a user should know of a line, and what changes neither geometry nor time."""
        self._notes.setdefault((False, text), [line, 0])[1] += 1

    def assume(self, text: str, line: int, word: int | None = None, *, grave: bool = False) -> None:
        """Keep what was assumed on a line, and may change geometry or time; `grave` as in `Note`.

        word : index in the chunk; strict reading refuses it there. None where strict reading does not come
               by.
        """
        if self.strict and word is not None:
            self.report(word, f"{text} (assumed without --strict)")
        else:
            self._notes.setdefault((True, text), [line, 0])[1] += 1
            if grave:
                self._grave.add(text)

    def notes(self, more: Sequence[Note]) -> Notes:
        """Assumptions and notes, each once with its first line and how often, and `more`, by line."""
        found = []
        for (changes, text), (line, times) in self._notes.items():
            said = f"line {line}: {text}{f' ({times} times)' if times > 1 else ''}"
            found.append(Note(line, said, changes, text in self._grave))
        ordered = sorted([*found, *more], key=lambda note: (not note.grave, note.line))
        return Notes(*(tuple(n.text for n in ordered if n.changes == changes) for changes in (True, False)))


def require_none(faults: Sequence[Fault], source: str) -> None:
    """Raise InputError for the first fault, with the number of the others."""
    if not faults:
        return
    first, more = faults[0], len(faults) - 1
    text = str(first) + (f" ({more} more in this program; 'planner info' shows them)" if more else "")
    raise InputError(text, source=first.source or source, line=first.line, column=first.column)


class IgnoredWords:
    """Assumptions so far in one program."""

    def __init__(
        self,
        reading: Reading,
        axes: str = "",
        *,
        extruder: bool = False,
        at_tip: bool = False,
        klipper: bool = False,
    ):
        self.reading = reading
        self.klipper = klipper  # the machine's control is Klipper
        self.at_tip = at_tip  # the machine has kinematics: the switch of the tool centre point is read
        # E words are those of an extruder of the machine (extruder.py); nothing is said of them
        self.follows = extruder and reading.extruder != IGNORE
        self.strict = reading.strict
        self.printer = False  # the program is one for a 3-D printer (printer.py)
        self.extruder = ""  # the last T word of a printer
        self.retractions: list[Retraction] = []  # that a printer's program sets
        # where axes that are not planned stand, by letter; NaN before a word
        self.parked = np.full(256, np.nan)
        self.treatment = np.full(256, READ, dtype=np.uint8)  # by letter
        for letter in LETTERS_REFUSED:
            self.treatment[ord(letter)] = AXIS if letter in axes else self._treatment(letter)
        self._first: dict[Assumption, tuple[str, int]] = {}  # word and line where each was met first
        self._times = Counter[Assumption]()
        # letters of axes that are not planned and were refused, because they move
        self.moved: set[str] = set()
        self.used = Counter[str]()  # words that a code uses: they are not left out

    def _treatment(self, letter: str) -> int:
        left_out = self.follows or self.reading.extruder == IGNORE
        of_extruder = left_out or (self.printer and self.reading.extruder == AUTO)
        if letter in self.reading.ignore or (letter == "E" and of_extruder):
            return LEFT_OUT
        return PARKED if letter in PARKABLE and not self.strict else REFUSED

    def read_printer(self) -> None:
        """The program is one for a 3-D printer."""
        self.printer = True
        self.treatment[ord("E")] = self._treatment("E")

    def refuse_extruder(self) -> None:
        """E is no axis here: a program that computes may use the letter otherwise."""
        if self.follows:
            self.follows = False
            self.treatment[ord("E")] = self._treatment("E")

    def count(self, what: Assumption, word: str, line: int, times: int = 1) -> None:
        """Keep that a word was met; `times` if it stands for more of them."""
        if self.follows and (what is EXTRUDER_ZERO or (what is RETRACTION and self.retractions)):
            return
        turning = (self.treatment[[ord(letter) for letter in "ABC"]] == AXIS).any()
        if turning and word.upper().lstrip("M0") in ("128", "428"):
            what = TOOL_POINT_M
        self._first.setdefault(what, (word, line))
        self._times[what] += times

    def may_stand(self, letter: str, value: float, *, absolute: bool) -> bool:
        """True if a word of an axis that is not planned leaves it where its first word put it."""
        if not absolute:
            return value == 0.0
        code = ord(letter)
        if np.isnan(self.parked[code]):
            self.parked[code] = value
        return bool(self.parked[code] == value)

    def count_letters(self, words: Words, rows: int) -> None:
        """Count the words of letters that were left out or parked in the first `rows` rows of a chunk."""
        letter = words.letter[: words.first[rows]]
        for code in np.flatnonzero((self.treatment == LEFT_OUT) | (self.treatment == PARKED)):
            times = int(np.count_nonzero(letter == code)) - self.used.pop(chr(code), 0)
            of_commands = self.printer and self.treatment[code] == PARKED and np.isnan(self.parked[code])
            if of_commands or (chr(code) == "E" and self.follows):
                continue
            if times > 0 and chr(code) not in self.moved:
                word = int(np.argmax(letter == code))
                line = int(words.line[words.row(word)])
                self.count(self._of_letter(chr(code)), words.text(word), line, times)

    def _of_letter(self, letter: str) -> Assumption:
        name, at = f"{letter} word{{|s}}", self.parked[ord(letter)]
        if self.treatment[ord(letter)] == PARKED:
            where = "" if np.isnan(at) else f" at {plain(float(at))}"
            return Assumption(name, f"axis {letter} is assumed to stand still{where}", changes=True)
        if letter != "E":
            return Assumption(name, "left out, as --ignore says: the plan knows nothing of this axis")
        asked = self.reading.extruder == IGNORE
        why = "--extruder ignore" if asked else "the machine file has no table [axes.e]"
        text = f"left out ({why}); what the extruder does by itself takes no time in this plan"
        return Assumption(name, text, changes=not asked)

    def notes(self) -> list[Note]:
        """Everything that was assumed, by its first line."""
        return [
            Note(
                line,
                f"{what.named(self._times[what])}: {what.meaning}; first {word} line {line}",
                what.changes,
            )
            for what, (word, line) in self._first.items()
        ]
