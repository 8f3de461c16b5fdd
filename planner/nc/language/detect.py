"""Whether a program computes, and in whose language: LinuxCNC's O words, or the macros of Fanuc and Haas.

A program that holds nothing of it is told from the words that the lexer has made, without looking at its text.

LinuxCNC's are O words with a keyword and named parameters. Fanuc's are GOTO, IF [ without an O word, WHILE [ with DO, G65, G66, M98,
M99, and sums without brackets behind an equals sign. Parameters and brackets alone belong to both and are read as LinuxCNC's.
"""

from __future__ import annotations

import re

import numpy as np

from planner.base.arrays import Array
from planner.machine import Machine
from planner.nc.lexer import FAULT, Words
from planner.nc.reading import AUTO, FANUC, LINUXCNC, Reading

LATHE_NOTE = (
    "read as the program of a Fanuc or Haas lathe: X and U are diameters, U and W increments, feeds per turn until G98 "
    "([dialect] lathe = false in the machine file if it is none)"
)
G_FURTHER = 54.1
# Codes that call and return, save and restore modes.
_CALLS = {ord("M"): (70, 71, 72, 73, 97, 98, 99), ord("G"): (65, 66, 67)}
_COMMENT = re.compile(r"\([^()]*\)|;.*|\s")
_O_WORD = r"O(?:\d+|<[^>]*>|\[.*?\]|#[\d<>\w]+)"
_LINUXCNC = re.compile(
    rf"{_O_WORD}(?:SUB|ENDSUB|CALL|IF|ELSEIF|ELSE|ENDIF|WHILE|ENDWHILE|DO|REPEAT|ENDREPEAT|RETURN|BREAK|CONTINUE)|#<"
)
_FANUC = re.compile(
    r"GOTO|^(?:/\d?)?(?:N\d+)?(?:IF\[|WHILE\[|DO\d|END\d|#[\d\[\]#]+=[^\[\]]*[#\d.][-+*/]|#[\d\[\]#]+=#0(?!\d)|"
    r"[A-Z\d.]*(?:G6[567](?![\d.])|M9[789](?![\d.])))"
)
_EITHER = re.compile(r"[#\[]|^(?:N\d+)?M7[0-3]$")


def may_compute(words: Words) -> Array:
    """(n,) rows, ascending, that the lexer could not split, or that have an O word or a code that calls: what may be of a language."""
    found = [np.flatnonzero((words.letter == FAULT) | (words.letter == ord("O")))]
    for letter, numbers in _CALLS.items():
        codes = np.flatnonzero(words.letter == letter)
        found.append(codes[np.isin(words.value[codes], numbers)])
    return np.unique(np.searchsorted(words.first, np.concatenate(found), side="right") - 1)


def bare(text: str) -> str:
    """A line without comments and blanks, in capitals."""
    return _COMMENT.sub("", text).upper()


def computes(text: str) -> bool:
    """Whether a bare line is a statement of a language rather than words."""
    return bool(_EITHER.search(text) or _LINUXCNC.search(text) or _FANUC.search(text))


def dialect_of(words: Words, reading: Reading) -> str | None:
    """The language that a program computes in, or None if it does not. `Reading.dialect` decides where it is given."""
    found, end = None, _first_end(words)
    for row in may_compute(words).tolist():
        if row > end and found is None:
            return None  # what follows the end of a program that computes nothing is not read
        text = bare(row_text(words, row))
        if not computes(text):
            continue
        if reading.dialect != AUTO:
            return reading.dialect
        if _LINUXCNC.search(text):
            return LINUXCNC
        if _FANUC.search(text):
            found = FANUC
        found = found or LINUXCNC
    return found


def is_turned(words: Words, dialect: str | None, reading: Reading, machine: Machine | None) -> bool:
    """Whether a program, found to be of that dialect, is one for a Fanuc or Haas lathe. `[dialect] lathe` of the machine decides.

    Otherwise it has no Y and V, and U or W (where these are no axes of the machine) beside X and Z, a cycle G70 to G73 with P and Q, or
    a G76 with K and D.
    """
    if reading.strict or reading.dialect not in (AUTO, FANUC):
        return False
    if dialect == LINUXCNC and any(
        _LINUXCNC.search(bare(row_text(words, row))) for row in may_compute(words).tolist()
    ):
        return False
    if machine is not None and machine.dialect is not None and machine.dialect.lathe is not None:
        return machine.dialect.lathe
    if _has(words, "Y") or _has(words, "V"):
        return False
    letters = {chr(c) for c in np.unique(words.letter) if c}
    own = set() if machine is None else {letter.upper() for letter in machine.axes}
    if letters >= set("XZ") and letters & (set("UW") - own):
        return not letters & set(reading.ignore)
    for codes, needed in (((70.0, 71.0, 72.0, 73.0), "PQ"), ((76.0,), "KD")):
        cycles = np.flatnonzero((words.letter == ord("G")) & np.isin(words.value, codes))
        for row in np.unique(np.searchsorted(words.first, cycles, side="right") - 1).tolist():
            if np.isin([ord(c) for c in needed], words.letter[words.first[row] : words.first[row + 1]]).all():
                return True
    return False


def _has(words: Words, letter: str) -> bool:
    return bool((words.letter == ord(letter)).any())


def has_further_systems(words: Words) -> bool:
    """Whether a program with L words has G54.1, which of the controls that are read only Fanuc's and Haas' know."""
    return _has(words, "L") and bool(((words.value == G_FURTHER) & (words.letter == ord("G"))).any())


def _first_end(words: Words) -> int:
    """The first row with M2 or M30, or the number of rows."""
    ends = np.flatnonzero((words.letter == ord("M")) & np.isin(words.value, (2, 30)))
    return words.row(int(ends[0])) if len(ends) else len(words.line)


def row_text(words: Words, row: int) -> str:
    """The line of a row as text."""
    at = int(words.at[words.first[row]])
    end = words.data.find(b"\n", at)
    return words.data[words.data.rfind(b"\n", 0, at) + 1 : end if end >= 0 else len(words.data)].decode(
        "latin-1"
    )
