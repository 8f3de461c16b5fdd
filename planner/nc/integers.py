"""Lengths without a point, as Fanuc and Haas controls read them: in least increments.

X100 is 0.1 mm where the machine's least increment is 0.001 mm, and 0.01 inch under G20, whose increment has the same digits one place
further on (0.0001 inch). X100. is 100 everywhere. Which of G20 and G21 holds is taken from the lines before it in the file.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine
from planner.nc.lexer import Words

LENGTHS = frozenset(ord(letter) for letter in "XYZUVWIJKRQ")
INCH_INCREMENT = 0.1  # the least increment in inch over that in mm, as numbers


@dataclass(frozen=True)
class Integers:
    """The meaning of numbers without a point.

    increment : of lengths [mm], or None: they are whole units
    """

    increment: float | None = None

    def scale(self, words: Words) -> FloatArray:
        """(R,) what a length without a point is multiplied by on each row."""
        rows = len(words.line)
        if self.increment is None:
            return np.ones(rows)
        switch = np.flatnonzero((words.letter == ord("G")) & np.isin(words.value, (20.0, 21.0)))
        inch = np.append(False, words.value[switch] == 20.0)
        at = np.searchsorted(switch, words.first[1:], side="left")  # switches up to the end of each row
        return np.where(inch[at], self.increment * INCH_INCREMENT, self.increment)

    def applied(self, words: Words) -> Words:
        """The words with their numbers in units."""
        if self.increment is None:
            return words
        row = np.repeat(np.arange(len(words.line)), np.diff(words.first))
        value = words.value.copy()
        whole = value == np.rint(value)
        lengths = _without_point(words, np.flatnonzero(whole & np.isin(words.letter, list(LENGTHS))))
        value[lengths] *= self.scale(words)[row[lengths]]
        return dataclasses.replace(words, value=value)


def integers_of(machine: Machine | None) -> Integers:
    """The meaning of numbers without a point on a machine."""
    given = machine.dialect.least_increment if machine is not None and machine.dialect is not None else None
    return Integers(given)


def _without_point(words: Words, found: Array) -> Array:
    """Those of the words whose text has no point."""
    return np.array([w for w in found.tolist() if "." not in words.text(w)], dtype=np.int64)
