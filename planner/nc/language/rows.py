"""Rows of words: those that a running program appends, and those on their way to the interpreter with the moves that
they say, in mm, and the parts of a frame.

Appending has to be cheap, since a loop does it a million times: a statement appends its number to `pending`
and the values it has computed to `values`. Everything else about its rows is constant and stands in tables:
letters, places, the numbers that are not computed. `take` puts both together, some 100,000 rows at once, with
a few numpy operations.
"""

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.nc.arcs import FULL_TURN, IN_PLANE, Arc, ArcWay, arc_from_centre, at_place, in_plane
from planner.nc.lexer import Words
from planner.nc.state import System

RowWord = tuple[int, int, float | None]  # letter code, place, value
F, G, M = ord("F"), ord("G"), ord("M")
AXES, CENTRES = (ord("X"), ord("Y"), ord("Z")), (ord("I"), ord("J"), ord("K"))
TURNS, RADIUS = ord("P"), ord("R")
ROTARY = (ord("A"), ord("B"), ord("C"))
_KNOT = ord("K")
_PIECE, _PIECE_OF_HELIX = math.pi / 2.0, math.pi / 36.0  # most of an arc in a piece of a curve
STANDS = 1e-9  # a move that is shorter stays where it is [mm]
STOPS = (0.0, 1.0, 2.0, 30.0, 60.0)  # M codes that act after the moves of their row


def require(good: object, message: str) -> None:
    """Raise ValueError with a message unless all is good."""
    if not good:
        raise ValueError(message)


@dataclass
class TravelRow:
    """A row of words: (letter code, value, byte offset) each; its line and its call."""

    words: list[tuple[int, float, int]]
    line: int
    frame: int


class AppendedRows:
    """Rows that were appended and not yet executed."""

    def __init__(self) -> None:
        self.pending: list[int] = []  # entries in their order, by number
        self.values: list[float | None] = []  # computed values of their words, in their order
        # (entries pending when the frame changed, frame), ascending
        self.frames: list[tuple[int, int]] = [(0, 0)]
        self.data = b""
        self.files: tuple[tuple[int, str], ...] = ()
        # letters, values (NaN where computed), places; lines, and how many words they have
        self._parts: list[tuple[Array, ...]] = []
        self._rows = 0
        self._entries: list[tuple[int, int]] = []  # the first row of each, and one after its last
        self._new: list[tuple[int, Sequence[RowWord]]] = []  # rows that are not in arrays yet: line, words
        # all of `_parts` as arrays, the first word of each row for their count, and the columns of `_entries`
        self._tables: tuple[Array, ...] | None = None

    def add_file(self, words: Words, name: str) -> tuple[int, int]:
        """Take a file's words into the tables; returns its first row, and where its bytes begin in `data`."""
        self._settle()
        begin = len(self.data)
        if begin:
            self.files += ((begin, name),)
        self.data += words.data + b"\n"
        self._append(
            words.letter, words.value, words.at.astype(np.int64) + begin, words.line, np.diff(words.first)
        )
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
            self.frames.pop()
        self.frames.append((len(self.pending), frame))

    def take(self) -> Words:
        """All pending rows as words, which are then no longer pending. A computed value of None, here NaN, was
        vacant: its word is left out."""
        self._settle()
        if self._tables is None:
            *columns, count = (np.concatenate(column) for column in zip(*self._parts, strict=True))
            entries = np.array(self._entries, dtype=np.int64).reshape(-1, 2)
            self._tables = *columns, np.concatenate([[0], np.cumsum(count)]), *entries.T
        all_letters, all_values, all_places, lines, first, begin, end = self._tables
        entries = np.array(self.pending, dtype=np.int64)
        at_entry, frame = np.array(self.frames, dtype=np.int64).T
        frame = np.repeat(frame, np.diff(np.append(at_entry, len(entries))))
        rows, count = _ranges(begin[entries], end[entries])
        words, length = _ranges(first[rows], first[rows + 1])
        letter, value, at = all_letters[words], all_values[words], all_places[words]
        value[np.isnan(value)] = np.array(self.values, dtype=np.float64)
        self.pending.clear()
        self.values.clear()
        self.frames[:] = [(0, self.frames[-1][1])]
        has_value = ~np.isnan(value)
        if not has_value.all():
            length = np.add.reduceat(np.append(has_value, False), np.cumsum(length) - length) * (length > 0)
            letter, value, at = letter[has_value], value[has_value], at[has_value]
        return Words(
            letter=letter,
            value=value,
            at=at,
            line=lines[rows].astype(np.int32),
            first=np.concatenate([[0], np.cumsum(length)]),
            data=self.data,
            frame=np.repeat(frame, count).astype(np.int32),
            files=self.files,
        )

    def words_of(self, rows: Sequence[TravelRow]) -> Words:
        """Rows as the interpreter takes them."""
        flat = [word for row in rows for word in row.words]
        return Words(
            letter=np.array([word[0] for word in flat], dtype=np.uint8),
            value=np.array([word[1] for word in flat], dtype=np.float64),
            at=np.array([word[2] for word in flat], dtype=np.int64),
            line=np.array([row.line for row in rows], dtype=np.int32),
            first=np.cumsum([0, *(len(row.words) for row in rows)]),
            data=self.data,
            frame=np.array([row.frame for row in rows], dtype=np.int32),
            files=self.files,
        )

    def _append(self, letter: Array, value: FloatArray, at: Array, line: Array, count: Array) -> None:
        self._parts.append((letter, value, at, line, count))
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


def _ranges(first: Array, last: Array) -> tuple[Array, Array]:
    """The numbers first[k] ... last[k] - 1 for all k, one after another, and how many for each k."""
    count = last - first
    shift = np.repeat(first - (np.cumsum(count) - count), count)
    return np.arange(len(shift)) + shift, count


def rows_from(words: Words, row: int) -> Words:
    """The words without those of the rows before `row`."""
    first = int(words.first[row])
    return replace(
        words,
        letter=words.letter[first:],
        value=words.value[first:],
        at=words.at[first:],
        line=words.line[row:],
        first=words.first[row:] - first,
        frame=words.frame[row:],
    )


@dataclass(frozen=True)
class Move:
    """A move of a row, in the work system [mm]."""

    rest: TravelRow  # the row without motion code, coordinates and centre
    at: int  # byte offset of the row
    code: int  # 0 or 1; that of an arc follows from its sweep
    # begin and end: (3,)
    begin: FloatArray
    end: FloatArray
    axes: Sequence[int]  # indices of the coordinates to write
    arc: Arc | None = None

    def rows(self, normal: int) -> list[TravelRow]:
        """The move as a row."""
        code = self.code if self.arc is None else 3 if self.arc.sweep > 0 else 2
        words = [(G, float(code), self.at), *self.rest.words]
        words += [(AXES[a], float(self.end[a]), self.at) for a in self.axes]
        if self.arc is not None:
            words += arc_words(self.arc, self.begin, normal, self.at)
        return [TravelRow(words, self.rest.line, self.rest.frame)]

    def stands(self, normal: int) -> bool:
        """True if it stays at its place in the plane."""
        way = [self.end[a] - self.begin[a] for a in IN_PLANE[normal]]
        return self.arc is None and math.hypot(*way) < STANDS

    def tangent(self, normal: int) -> complex:
        """Unit tangent at its start, in the plane."""
        if self.arc is None:
            way = in_plane(self.end, normal) - in_plane(self.begin, normal)
            return way / abs(way)
        spoke = in_plane(self.begin, normal) - in_plane(self.arc.centre, normal)
        return spoke / abs(spoke) * (1j if self.arc.sweep > 0 else -1j)

    def leaving(self, normal: int) -> complex:
        """Unit tangent at its end, in the plane."""
        start = self.tangent(normal)
        return start if self.arc is None else start * cmath.rect(1.0, self.arc.sweep)


def arc_words(arc: Arc, begin: FloatArray, normal: int, at: int) -> list[tuple[int, float, int]]:
    """Centre and turns of an arc from begin (3,)."""
    words = [(CENTRES[a], float(arc.centre[a] - begin[a]), at) for a in IN_PLANE[normal]]
    more = math.ceil((abs(arc.sweep) - FULL_TURN) / (2.0 * math.pi))
    return [*words, (TURNS, float(more), at)] if more > 1 else words


def tilted_rows(
    row: TravelRow, begin: FloatArray, tilt: tuple[FloatArray, FloatArray], unit: float, normal: int
) -> tuple[list[TravelRow], FloatArray]:
    """A row of a plane (G90, centres as I J K) in the coordinates in which the plane is tilted, and where it
    ends in the plane (3,) [mm]. Arcs become G6.2, rational curves of degree 2, exact without a rise along the
    normal; a helix has pieces of 5 degrees, within 1e-6 of its rise.

    begin : (3,) where it begins [mm]
    tilt  : matrix (3, 3) and shift (3,) [mm]
    """
    given = {letter: value * unit for letter, value, _ in row.words if letter in (*AXES, *CENTRES)}
    if not set(AXES) & given.keys() and not set(CENTRES) & given.keys():
        return [row], begin
    end = np.array([given.get(letter, begin[k]) for k, letter in enumerate(AXES)])
    code = [value for letter, value, _ in row.words if letter == G and value in (2.0, 3.0)]
    at = row.words[0][2]
    drop = {*AXES, *CENTRES} | ({TURNS} if code else set())
    rest = [word for word in row.words if word[0] not in drop and word[:2] not in ((G, 2.0), (G, 3.0))]

    def place(point: FloatArray) -> list[tuple[int, float, int]]:
        found = (tilt[0] @ point + tilt[1]) / unit
        return list(zip(AXES, found.tolist(), [at] * 3, strict=True))

    if not code:
        return [TravelRow([*rest, *place(end)], row.line, row.frame)], end
    turns = next((value for letter, value, _ in row.words if letter == TURNS), 1.0)
    centre = begin + np.array([given.get(letter, 0.0) for letter in CENTRES])
    arc = arc_from_centre(begin, end, centre, ArcWay(normal, code[0] == 2.0, round(turns), unit))
    points, weights = _curve(arc, begin, end, normal)
    rows = []
    for k in range(len(points) + 3):
        words = [(_KNOT, float(min(max(k - 1, 0) // 2, (len(points) - 1) // 2)), at)]
        if k == 0:
            words = [(G, 6.2, at), (TURNS, 3.0, at), *rest, *words]
        if k < len(points):
            words += [*place(points[k]), (RADIUS, weights[k], at)]
        rows.append(TravelRow(words, row.line, row.frame))
    return rows, end


def _curve(arc: Arc, begin: FloatArray, end: FloatArray, normal: int) -> tuple[list[FloatArray], list[float]]:
    """Control points (3,) and weights of an arc from begin to end (3,)."""
    rises = begin[normal] != end[normal]
    count = max(1, math.ceil(abs(arc.sweep) / (_PIECE_OF_HELIX if rises else _PIECE)))
    half, centre = arc.sweep / count / 2.0, in_plane(arc.centre, normal)
    first, last = in_plane(begin, normal) - centre, in_plane(end, normal) - centre
    points, weights = [], []
    for k in range(2 * count + 1):
        share, odd = k / (2 * count), k % 2
        size = abs(first) + (abs(last) - abs(first)) * share
        spoke = first / abs(first) * size * cmath.rect(1.0 / math.cos(half) if odd else 1.0, k * half)
        point = at_place(centre + spoke, begin, normal)
        point[normal] = begin[normal] + (end[normal] - begin[normal]) * share
        points.append(point)
        weights.append(math.cos(half) if odd else 1.0)
    points[-1] = end
    return points, weights


def travel_rows_of(words: Words) -> Iterator[TravelRow]:
    """The rows of words that the interpreter would take."""
    columns = words.letter, words.value, words.at, words.first
    letter, value, at, first = (column.tolist() for column in columns)
    for row, (line, frame) in enumerate(zip(words.line.tolist(), words.frame.tolist(), strict=True)):
        span = slice(first[row], first[row + 1])
        yield TravelRow(list(zip(letter[span], value[span], at[span], strict=True)), line, frame)


@dataclass
class FrameParts:
    """A frame d + R S M p: the mirror image M, the scale S and the rotation R, each about its centre, that of
    the rotation mirrored and scaled as the points are, and the datum d.

    mirror (1 or -1), scale and all centres: (3,) [mm]; rotation in degrees about the axis `normal`
    """

    datum: FloatArray = field(default_factory=lambda: np.zeros(3))
    mirror: FloatArray = field(default_factory=lambda: np.ones(3))
    mirrored_at: FloatArray = field(default_factory=lambda: np.zeros(3))
    scale: FloatArray = field(default_factory=lambda: np.ones(3))
    centre: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: float = 0.0
    about: FloatArray = field(default_factory=lambda: np.zeros(3))
    normal: int = 2

    def affine(self) -> tuple[FloatArray, FloatArray]:
        """Matrix (3, 3) and shift (3,) [mm]."""
        mirror, scale, turn = np.diag(self.mirror), np.diag(self.scale), turned(self.rotation, self.normal)
        shift = scale @ (self.mirrored_at - mirror @ self.mirrored_at) + self.centre - scale @ self.centre
        about = scale @ mirror @ self.about + shift
        return turn @ scale @ mirror, self.datum + (turn @ shift + about - turn @ about)


def turned(degrees: float, axis: int) -> FloatArray:
    """The matrix (3, 3) of a rotation about an axis."""
    about_z, pair = System(np.zeros(3), degrees), ((1, 2), (2, 0), (0, 1))[axis]
    matrix = np.eye(3)
    matrix[np.ix_(pair, pair)] = np.array([about_z.turn(np.eye(3)[k])[:2] for k in (0, 1)]).T
    return matrix
