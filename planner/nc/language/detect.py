"""Whether a program computes, and in whose language: LinuxCNC's O words, or the macros of Fanuc and Haas.

A program that holds nothing of it is told from the words that the lexer has made, without looking at its text.

LinuxCNC's are O words with a keyword and named parameters. Fanuc's are GOTO, IF [ without an O word, WHILE [ with DO, G65, G66, M98,
M99, and sums without brackets behind an equals sign. Parameters and brackets alone belong to both and are read as LinuxCNC's.
"""

from __future__ import annotations

import re

import numpy as np

from planner.base.arrays import Array
from planner.nc.lexer import FAULT, Words
from planner.nc.reading import AUTO, FANUC, LINUXCNC, Reading

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
    """Rows, ascending, that the lexer could not split, or that have an O word or a code that calls: what may be of a language."""
    mark = (words.letter == FAULT) | (words.letter == ord("O"))
    for letter, numbers in _CALLS.items():
        mark |= (words.letter == letter) & np.isin(words.value, numbers)
    return np.unique(np.searchsorted(words.first, np.flatnonzero(mark), side="right") - 1)


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
