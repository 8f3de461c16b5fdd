"""Rows that a running program appends, and how they become rows of words for the interpreter.

Appending has to be cheap, since a loop does it a million times: a statement appends its number to `pending`
and the values it has computed to `values`. Everything else about its rows is constant and stands in tables:
letters, places, the numbers that are not computed. `take` puts both together, some 100,000 rows at once, with
a few numpy operations.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.nc.lexer import Words

RowWord = tuple[int, int, float | None]  # letter code, place, value


@dataclass
class _Tables:
    """All rows of all files. Word w of row r: first[r] <= w < first[r + 1]; `computed` ones have no value."""

    letter: Array
    value: FloatArray
    at: Array
    computed: Array
    line: Array
    first: Array
    begin: Array  # first row of each entry
    end: Array  # one after its last row


class AppendedRows:
    """Rows that were appended and not yet executed."""

    def __init__(self) -> None:
        self.pending: list[int] = []  # entries in their order, by number
        self.values: list[float | None] = []  # computed values of their words, in their order
        # (entries pending when the frame changed, frame), ascending
        self.frames: list[tuple[int, int]] = [(0, 0)]
        self.data = b""
        self.files: list[tuple[int, str]] = []
        # letters, values, places, computed or not; lines, and how many words they have
        self._parts: list[tuple[Array, ...]] = []
        self._rows = 0
        self._entries: list[tuple[int, int]] = []
        self._new: list[tuple[int, Sequence[RowWord]]] = []  # rows that are not in arrays yet: line, words
        self._tables: _Tables | None = None

    def add_file(self, words: Words, name: str) -> tuple[int, int]:
        """Take a file's words into the tables; returns its first row, and where its bytes begin in `data`."""
        self._settle()
        begin = len(self.data)
        if begin:
            self.files.append((begin, name))
        self.data += words.data + b"\n"
        self._append(words.letter, words.value, words.at + begin, words.line, np.diff(words.first))
        return self._rows - len(words.line), begin

    def add_row(self, line: int, words: Sequence[RowWord]) -> int:
        """Make an entry of a row of (letter code, place, value or None for computed); returns its number."""
        self._new.append((line, words))
        row = self._rows + len(self._new) - 1
        return self.add_entry(row, row + 1)

    def add_entry(self, first: int, last: int) -> int:
        """Make an entry of the rows `first` to `last` - 1 of the tables; returns its number."""
        self._entries.append((first, last))
        self._tables = None
        return len(self._entries) - 1

    def enter(self, frame: int) -> None:
        """Rows appended from now on stand in this call."""
        if self.frames[-1][0] == len(self.pending):
            self.frames[-1] = (len(self.pending), frame)
        else:
            self.frames.append((len(self.pending), frame))

    def take(self) -> Words:
        """All pending rows as words, which are then no longer pending. A computed value of None, here NaN, was
        vacant: its word is left out."""
        tables = self._tables_now()
        entries = np.array(self.pending, dtype=np.int64)
        at_entry, frame = np.array(self.frames, dtype=np.int64).T
        frame = np.repeat(frame, np.diff(np.append(at_entry, len(entries))))
        rows, count = _ranges(tables.begin[entries], tables.end[entries])
        words, length = _ranges(tables.first[rows], tables.first[rows + 1])
        value, computed = tables.value[words], tables.computed[words]
        value[computed] = np.array(self.values, dtype=np.float64)
        letter, at = tables.letter[words], tables.at[words]
        self.pending.clear()
        self.values.clear()
        self.frames[:] = self.frames[-1:]
        self.frames[0] = (0, self.frames[0][1])
        has_value = ~np.isnan(value)
        if not has_value.all():
            length = np.add.reduceat(np.append(has_value, False), np.cumsum(length) - length) * (length > 0)
            letter, value, at = letter[has_value], value[has_value], at[has_value]
        return Words(
            letter=letter,
            value=value,
            at=at,
            line=tables.line[rows].astype(np.int32),
            first=np.concatenate([[0], np.cumsum(length)]),
            data=self.data,
            frame=np.repeat(frame, count).astype(np.int32),
            files=tuple(self.files),
        )

    def _append(self, letter: Array, value: FloatArray, at: Array, line: Array, count: Array) -> None:
        self._parts.append((letter, np.nan_to_num(value), at.astype(np.int64), np.isnan(value), line, count))
        self._rows += len(line)
        self._tables = None

    def _settle(self) -> None:
        if not self._new:
            return
        letter, at, value = zip(*(word for _, row in self._new for word in row), strict=True)
        lines, count = zip(*((line, len(row)) for line, row in self._new), strict=True)
        words = np.array(letter, np.uint8), np.array(value, np.float64), np.array(at, np.int64)  # None: NaN
        self._append(*words, np.array(lines, np.int32), np.array(count, np.int64))
        self._new.clear()

    def _tables_now(self) -> _Tables:
        self._settle()
        if self._tables is None:
            begin, end = np.array(self._entries, dtype=np.int64).reshape(-1, 2).T
            parts = zip(*self._parts, strict=True)
            letter, value, at, computed, line, count = (np.concatenate(column) for column in parts)
            first = np.concatenate([[0], np.cumsum(count)])
            self._tables = _Tables(letter, value, at, computed, line, first, begin, end)
        return self._tables


def _ranges(first: Array, last: Array) -> tuple[Array, Array]:
    """The numbers first[k] ... last[k] - 1 for all k, one after another, and how many for each k."""
    count = last - first
    shift = np.repeat(first - (np.cumsum(count) - count), count)
    return np.arange(len(shift)) + shift, count
