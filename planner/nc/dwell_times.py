"""P words that are dwells: beside G4, and of a canned cycle on the line or in force.

LinuxCNC and grbl have them in seconds. Fanuc and Haas have all of them in milliseconds; written with a point Haas takes seconds.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.base.arrays import Array
from planner.base.units import MILLISECOND
from planner.nc import codes
from planner.nc.lexer import Words

_DWELL = 4.0
_MOTIONS = np.array([code / 10 for code, group in codes.G_GROUP.items() if group in ("motion", "cycle end")])
_CYCLES = np.array(sorted(codes.CYCLES)) / 10
# Codes whose line has a P of their own: those of `codes.WORDS` that are no cycles, and calls.
_OTHERS = {
    letter: np.array([
        *(code / 10 for (of, code), used in codes.WORDS.items() if of == letter and "P" in used and code not in codes.CYCLES | {40}),
        *calls,
    ])
    for letter, calls in (("G", (65.0, 66.0)), ("M", (97.0, 98.0, 99.0)))
}  # fmt: skip


class DwellWords:
    """Follows the cycle in force through the rows of a program."""

    def __init__(self) -> None:
        self._in_cycle = False

    def find(self, words: Words) -> list[int]:
        """Indices of the P words of a chunk that are dwells."""
        of_g = words.letter == ord("G")
        motion = np.flatnonzero(of_g & np.isin(words.value, _MOTIONS))
        cycle = np.append(self._in_cycle, np.isin(words.value[motion], _CYCLES))
        found = []
        for word in np.flatnonzero(words.letter == ord("P")).tolist():
            row = words.row(word)
            span = slice(int(words.first[row]), int(words.first[row + 1]))
            value, letter = words.value[span], words.letter[span]
            if _DWELL in value[letter == ord("G")] or (
                cycle[np.searchsorted(motion, span.stop)] and not _is_other(letter, value)
            ):
                found.append(word)
        self._in_cycle = bool(cycle[-1])
        return found

    def in_seconds(self, words: Words) -> Words:
        """The words of a chunk of Fanuc's with their dwells in seconds; a number with a point is in seconds already."""
        times = [w for w in self.find(words) if words.text(w)[:1] in ("P", "p") and "." not in words.text(w)]
        if not times:
            return words
        value = words.value.copy()
        value[times] *= MILLISECOND
        return dataclasses.replace(words, value=value)


def _is_other(letter: Array, value: Array) -> bool:
    return any(np.isin(value[letter == ord(of)], own).any() for of, own in _OTHERS.items())
