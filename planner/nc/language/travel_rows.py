"""Rows of words on their way to the interpreter, and the moves that they say, in mm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import FULL_TURN, IN_PLANE, Arc, in_plane
from planner.nc.lexer import Words

G, M = ord("G"), ord("M")
AXES, CENTRES = (ord("X"), ord("Y"), ord("Z")), (ord("I"), ord("J"), ord("K"))
TURNS, RADIUS = ord("P"), ord("R")
STANDS = 1e-9  # a move that is shorter stays where it is [mm]
_STOPS = (0.0, 1.0, 2.0, 30.0, 60.0)  # M codes that act after the moves of their row


@dataclass
class TravelRow:
    """A row of words: (letter code, value, byte offset) each; its line and its call."""

    words: list[tuple[int, float, int]]
    line: int
    frame: int


def words_of(rows: Sequence[TravelRow], data: bytes, files: tuple[tuple[int, str], ...]) -> Words:
    """Rows as the interpreter takes them."""
    flat = [word for row in rows for word in row.words]
    count = [len(row.words) for row in rows]
    return Words(
        letter=np.array([word[0] for word in flat], dtype=np.uint8),
        value=np.array([word[1] for word in flat], dtype=np.float64),
        at=np.array([word[2] for word in flat], dtype=np.int64),
        line=np.array([row.line for row in rows], dtype=np.int32),
        first=np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        data=data,
        frame=np.array([row.frame for row in rows], dtype=np.int32),
        files=files,
    )


@dataclass(frozen=True)
class Move:
    """A move of a row, in the work system [mm].

    rest       : the row without motion code, coordinates and centre
    at         : byte offset of the row
    code       : 0 to 3
    begin, end : (3,)
    axes       : indices of the coordinates to write
    arc        : of codes 2 and 3
    """

    rest: TravelRow
    at: int
    code: int
    begin: FloatArray
    end: FloatArray
    axes: Sequence[int]
    arc: Arc | None = None

    def rows(self, normal: int) -> list[TravelRow]:
        """The move as a row."""
        words = [(G, float(self.code), self.at), *self.rest.words]
        words += [(AXES[a], float(self.end[a]), self.at) for a in self.axes]
        if self.arc is not None:
            words += arc_words(self.arc, self.begin, normal, self.at)
        return [TravelRow(words, self.rest.line, self.rest.frame)]

    def stands(self, normal: int) -> bool:
        """True if it leaves its place in the plane."""
        way = [self.end[a] - self.begin[a] for a in IN_PLANE[normal]]
        return self.arc is None and math.hypot(*way) < STANDS

    def tangent(self, normal: int) -> complex:
        """Unit tangent at its start, in the plane."""
        if self.arc is None:
            way = in_plane(self.end, normal) - in_plane(self.begin, normal)
            return way / abs(way)
        spoke = in_plane(self.begin, normal) - in_plane(self.arc.centre, normal)
        return spoke / abs(spoke) * (1j if self.arc.sweep > 0 else -1j)


def arc_words(arc: Arc, begin: FloatArray, normal: int, at: int) -> list[tuple[int, float, int]]:
    """Centre and turns of an arc from begin (3,)."""
    words = [(CENTRES[a], float(arc.centre[a] - begin[a]), at) for a in IN_PLANE[normal]]
    more = math.ceil((abs(arc.sweep) - FULL_TURN) / (2.0 * math.pi))
    return [*words, (TURNS, float(more), at)] if more > 1 else words


def stops_apart(row: TravelRow) -> tuple[list[tuple[int, float, int]], list[tuple[int, float, int]]]:
    """The words that act before the moves of a row, and the stops behind them."""
    stops = [word for word in row.words if word[0] == M and word[1] in _STOPS]
    return [word for word in row.words if word not in stops], stops


def travel_rows_of(words: Words) -> Iterator[TravelRow]:
    """The rows of words that the interpreter would take."""
    letter, value, at, first = (
        column.tolist() for column in (words.letter, words.value, words.at, words.first)
    )
    for row, (line, frame) in enumerate(zip(words.line.tolist(), words.frame.tolist(), strict=True)):
        span = slice(first[row], first[row + 1])
        yield TravelRow(list(zip(letter[span], value[span], at[span], strict=True)), line, frame)


def other_words(row: TravelRow, *, arc: bool) -> list[tuple[int, float, int]]:
    """The words of a row beside its motion code, coordinates and centre."""
    own = (*AXES, *CENTRES, RADIUS, *((TURNS,) if arc else ()))
    return [word for word in row.words if not (word[0] == G and word[1] <= 3.0) and word[0] not in own]
