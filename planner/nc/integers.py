"""Numbers whose unit depends on the control: lengths without a point, and dwells, as Fanuc and Haas read
them.

X100 is 0.1 mm where the machine's least increment is 0.001 mm, and 0.01 inch under G20, whose increment has
the same digits one place further on (0.0001 inch). X100. is 100 everywhere.

P words are dwells beside G4, and of a canned cycle on the line or in force. LinuxCNC and grbl have them in
seconds. Fanuc and Haas have all of them in milliseconds; written with a point Haas takes seconds. X and U
beside G4 follow the rule of lengths: seconds, or 0.001 s where the least increment is 0.001 mm, in G20 too.
"""

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MILLISECOND
from planner.machine import Machine
from planner.nc import codes
from planner.nc.lexer import Words

_DWELL = 4.0
IN_INCREMENTS = "least_increment = 0.001 under [dialect] of the machine file makes it thousandths"
_IN_UNITS = f"X or U of a dwell without a point is read in seconds, as lengths without one are in whole units; {IN_INCREMENTS}"
_MOTIONS = np.array([code / 10 for code, group in codes.G_GROUP.items() if group in ("motion", "cycle end")])
_CYCLES = np.array(sorted({*codes.CYCLES, codes.THREADING})) / 10  # G76 of mills bores
_DWELLING = {*codes.CYCLES, codes.THREADING, 40}
# Codes whose line has a P of their own: those of `codes.WORDS` that are no cycles, and calls.
_OTHERS = {
    letter: np.array([
        *(code / 10 for (of, code), used in codes.WORDS.items() if of == letter and "P" in used and code not in _DWELLING),
        *calls,
    ])
    for letter, calls in (("G", (65.0, 66.0)), ("M", (97.0, 98.0, 99.0)))
}  # fmt: skip
LENGTHS = frozenset(ord(letter) for letter in "XYZUVWIJKRQ")
_COORDINATES, _WHOLE, _LOOKED_AT = (
    b"XYZUVW",
    re.compile(r"[A-Za-z][-+]?\d+"),
    10_000,
)  # the first words of a program
INCH_INCREMENT = 0.1  # the least increment in inch over that in mm, as numbers


class DwellWords:
    """Follows the cycle in force through the rows of a program."""

    def __init__(self) -> None:
        self._in_cycle = False

    def find(self, words: Words) -> list[int]:
        """Indices of the P words of a chunk that are dwells."""
        motion = words.find("G", *_MOTIONS)
        cycle = np.append(self._in_cycle, np.isin(words.value[motion], _CYCLES))
        found = []
        some = words.letter == ord("P")
        for row in words.rows_with(words.find("G", _DWELL)):
            some[words.first[row] : words.first[row + 1]] |= np.isin(words.of_rows(row)[0], list(b"XU"))
        for word in np.flatnonzero(some).tolist():
            row = words.row(word)
            letter, value = words.of_rows(row)
            in_cycle = cycle[np.searchsorted(motion, words.first[row + 1])]
            other = any(np.isin(value[letter == ord(of)], codes).any() for of, codes in _OTHERS.items())
            dwells = words.letter[word] == ord("P") and in_cycle and not other
            if _DWELL in value[letter == ord("G")] or dwells:
                found.append(word)
        self._in_cycle = bool(cycle[-1])
        return found

    def in_seconds(self, words: Words, say: Callable[[str, int, int], None] | None) -> Words:
        """The words of a chunk of Fanuc's with dwells in seconds, which numbers with a point are already.

        say : gets how X and U without a point are read, their line and index; None with a least increment
        """
        whole = [w for w in self.find(words) if "." not in words.text(w)]
        times = [w for w in whole if words.text(w)[:1] in "Pp"]  # as written: X of a lathe has become P
        if say is not None:
            for word in sorted(set(whole).difference(times)):
                say(_IN_UNITS, int(words.line[words.row(word)]), word)
        value = words.value.copy()
        value[times] *= MILLISECOND
        return dataclasses.replace(words, value=value)


@dataclass(frozen=True)
class Integers:
    """The meaning of numbers without a point."""

    increment: float | None = None  # of lengths [mm], or None: they are whole units

    def scale(self, words: Words) -> FloatArray:
        """(R,) what a length without a point is multiplied by on each row."""
        rows = len(words.line)
        if self.increment is None:
            return np.ones(rows)
        switch = words.find("G", 20.0, 21.0)
        inch = np.append(False, words.value[switch] == 20.0)
        # by switches up to the end of each row
        inch = inch[np.searchsorted(switch, words.first[1:], side="left")]
        inch[words.rows_with(words.find("G", _DWELL))] = False  # a time has no inches
        return np.where(inch, self.increment * INCH_INCREMENT, self.increment)

    def applied(self, words: Words) -> Words:
        """The words with their numbers in units."""
        if self.increment is None:
            return words
        row = np.repeat(np.arange(len(words.line)), np.diff(words.first))
        value = words.value.copy()
        whole = np.flatnonzero((value == np.rint(value)) & np.isin(words.letter, list(LENGTHS)))
        lengths = np.array([w for w in whole.tolist() if "." not in words.text(w)], dtype=np.int64)
        value[lengths] *= self.scale(words)[row[lengths]]
        return dataclasses.replace(words, value=value)


def mixed(words: Words) -> int | None:
    """The first coordinate without a point beside others with one, as index of its word; None where there is none:
    a control that counts numbers without a point in least increments reads both in one program."""
    coordinates = np.flatnonzero(np.isin(words.letter, list(_COORDINATES)) & (words.value != 0.0))[
        :_LOOKED_AT
    ]
    texts = [words.text(word) for word in coordinates.tolist()]
    whole = next(
        (w for w, text in zip(coordinates.tolist(), texts, strict=True) if _WHOLE.fullmatch(text)), None
    )
    return whole if any("." in text for text in texts) else None


def integers_of(machine: Machine | None) -> Integers:
    """The meaning of numbers without a point on a machine."""
    given = machine.dialect.least_increment if machine is not None and machine.dialect is not None else None
    return Integers(given)
