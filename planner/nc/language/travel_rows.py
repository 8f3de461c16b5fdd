"""Rows of words on their way to the interpreter, the moves that they say, in mm, and the parts of a frame."""

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import (
    FULL_TURN,
    IN_PLANE,
    Arc,
    ArcWay,
    arc_from_centre,
    at_place,
    in_plane,
)
from planner.nc.lexer import Words
from planner.nc.state import System

G, M = ord("G"), ord("M")
AXES, CENTRES = (ord("X"), ord("Y"), ord("Z")), (ord("I"), ord("J"), ord("K"))
TURNS, RADIUS = ord("P"), ord("R")
ROTARY = (ord("A"), ord("B"), ord("C"))
_KNOT = ord("K")
_PIECE, _PIECE_OF_HELIX = math.pi / 2.0, math.pi / 36.0  # most of an arc in a piece of a curve
STANDS = 1e-9  # a move that is shorter stays where it is [mm]
STOPS = (0.0, 1.0, 2.0, 30.0, 60.0)  # M codes that act after the moves of their row


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
