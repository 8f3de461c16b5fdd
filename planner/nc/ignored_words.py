"""Assumptions about a program, counted and said once each: words that, as far as the program tells, move nothing.

    12 M codes that this reader does not know: assumed not to move anything; first M428 line 4

`Reading.strict` refuses them instead. What may move is never among them, except where the sentence says what was assumed of it.

An axis that is not planned may be named as long as it does not move: all its words have one value, after G91 they are 0. The compiled
loop (plain.py) checks it by `treatment` and `parked`, and so does `check_parked` for the other rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nc.codes import LETTERS_REFUSED, PARKABLE, Assumption
from planner.nc.events import plain
from planner.nc.faults import Said
from planner.nc.lexer import Words
from planner.nc.reading import IGNORE, Reading
from planner.nc.settings import EXTRUDER_ZERO, PRINTER_M, TOOL_POINT_M

# How a letter is treated whatever stands beside it, in `Assumed.treatment`.
READ, REFUSED, LEFT_OUT, PARKED, AXIS = range(5)

LEFT_OUT_BY_USER = Assumption("word", "words", "left out, as --ignore says")


@dataclass(slots=True)
class _Counted:
    times: int
    word: str
    line: int


class IgnoredWords:
    """Assumptions so far in one program.

    treatment : (256,) uint8, `READ`, `REFUSED`, `LEFT_OUT`, `PARKED` or `AXIS` (of the machine) by letter
    parked    : (256,) where an axis that is not planned stands, by letter; NaN before its first word
    moved     : letters of axes that are not planned and were refused, because they move
    printer   : the program is one for a 3-D printer: it has M82, M83 or another code that only those have
    follows   : E words are those of an extruder of the machine (extruder.py); nothing is said of them
    at_tip    : the machine has kinematics: the switch of the tool centre point is read (tool_point.py)
    """

    def __init__(self, reading: Reading, axes: str = "", *, extruder: bool = False, at_tip: bool = False):
        self.reading, self.at_tip = reading, at_tip
        self.follows = extruder and reading.extruder != IGNORE
        self.strict = reading.strict
        self.printer = False
        self.parked = np.full(256, np.nan)
        self.treatment = np.full(256, READ, dtype=np.uint8)
        for letter in LETTERS_REFUSED:
            self.treatment[ord(letter)] = AXIS if letter in axes else self._treatment(letter)
        self._counted: dict[Assumption, _Counted] = {}
        self.moved: set[str] = set()
        self._used: dict[str, int] = {}

    def _treatment(self, letter: str) -> int:
        if letter in self.reading.ignore or (
            letter == "E" and (self.follows or self.reading.extruder == IGNORE)
        ):
            return LEFT_OUT
        return PARKED if letter in PARKABLE and not self.strict else REFUSED

    def refuse_extruder(self) -> None:
        """E is no axis here: a program that computes may use the letter otherwise."""
        if self.follows:
            self.follows = False
            self.treatment[ord("E")] = self._treatment("E")

    def count(self, what: Assumption, word: str, line: int, times: int = 1) -> None:
        """Keep that a word was met; `times` if it stands for more of them."""
        if what is EXTRUDER_ZERO and self.follows:
            return
        turning = (self.treatment[[ord(letter) for letter in "ABC"]] == AXIS).any()
        if turning and word.upper().lstrip("M0") in ("128", "428"):
            what = TOOL_POINT_M
        self.printer |= what is PRINTER_M
        found = self._counted.setdefault(what, _Counted(0, word, line))
        found.times += times

    def ignores(self, name: str) -> bool:
        """True if the user said that a code or command is harmless."""
        return name in self.reading.ignore

    def may_stand(self, letter: str, value: float, *, absolute: bool) -> bool:
        """True if a word of an axis that is not planned leaves it where it is; its first word says where that is."""
        if not absolute:
            return value == 0.0
        code = ord(letter)
        if np.isnan(self.parked[code]):
            self.parked[code] = value
        return bool(self.parked[code] == value)

    def used(self, letter: str) -> None:
        """A code uses a word of this letter: it is not left out."""
        self._used[letter] = self._used.get(letter, 0) + 1

    def count_letters(self, words: Words, rows: int) -> None:
        """Count the words of letters that were left out or parked in the first `rows` rows of a chunk."""
        letter = words.letter[: words.first[rows]]
        for code in np.flatnonzero((self.treatment == LEFT_OUT) | (self.treatment == PARKED)):
            times = int(np.count_nonzero(letter == code)) - self._used.pop(chr(code), 0)
            if chr(code) == "E" and self.follows:
                continue
            if times > 0 and chr(code) not in self.moved:
                word = int(np.argmax(letter == code))
                line = int(words.line[words.row(word)])
                self.count(self._of_letter(chr(code)), words.text(word), line, times)

    def _of_letter(self, letter: str) -> Assumption:
        parked = bool(self.treatment[ord(letter)] == PARKED)
        if parked:
            at = self.parked[ord(letter)]
            where = "" if np.isnan(at) else f" at {plain(float(at))}"
            said = f"axis {letter} is assumed to stand still{where}"
        elif letter == "E":
            said = "left out (--extruder ignore); what the extruder does by itself takes no time in this plan"
        else:
            said = "left out, as --ignore says: the plan knows nothing of this axis"
        return Assumption(f"{letter} word", f"{letter} words", said, changes=parked)

    def notes(self) -> list[Said]:
        """Everything that was assumed, by its first line."""
        return [
            Said(
                found.line,
                f"{found.times:,} {what.one if found.times == 1 else what.many}: {what.said}; "
                f"first {found.word} line {found.line}",
                what.changes,
            )
            for what, found in self._counted.items()
        ]
