"""A rounding or chamfer between two moves of a contour, and cutter radius compensation as Heidenhain and
Siemens (NORM, G450) have it, on the geometry of `planner.nc.cutter`.

The centre of a rounding lies on both moves, moved by R to the side to which the contour turns, and each move
ends or begins at its foot on it. A chamfer between straight moves lies CHR from the corner on both, or CHF /
(2 cos(turn / 2)), so that it is itself CHF long.

The first compensated move leads straight to the place beside its programmed end, normal to the move after it;
the contour then runs beside the programmed one and ends normal to its last move. So the first move waits for
the next one in the plane; all others are given out at the end, since a corner moves the end of the move
before it.
"""

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from planner.base.arrays import FloatArray
from planner.nc.arcs import FULL_TURN, IN_PLANE, Arc, at_place, in_plane
from planner.nc.block_table import BlockTable
from planner.nc.cutter import Cutter, CutterFault, OffsetMove, dot, meeting
from planner.nc.language.rows import AXES, STANDS, STOPS, F, G, M, Move, TravelRow, arc_words, require
from planner.nc.program import Kind
from planner.nc.state import State

KINDS = ("RND", "CHR", "CHF")
_STRAIGHT_ON = 1e-6  # turn below which there is no corner [rad]
_TOO_LARGE = "the rounding or chamfer takes more of a move than there is; correct it"


class OffsetMoves:
    """The moves of one contour, from its first move to `finish`.

    radius : of the tool [mm]
    side   : 1 left of the path, -1 right
    normal : axis normal to the plane
    """

    def __init__(self, place: FloatArray, radius: float, side: int, normal: int):
        self.radius, self.side, self.normal = radius, side, normal
        self._start = place.copy()
        self._state, self._table = State(), BlockTable()
        self._state.normal = normal
        self._cutter: Cutter | None = None
        self._first: Move | None = None  # it waits for the next one in the plane
        self._waiting: list[TravelRow | Move] = []  # behind the first move
        self._items: list[TravelRow | tuple[Move, int, int]] = []  # rows, and moves with their blocks

    @property
    def started(self) -> bool:
        """True if the contour has begun."""
        return self._cutter is not None

    def begin_at(self, place: FloatArray, tangent: complex) -> FloatArray:
        """The contour begins at a place (3,) with a unit tangent; returns where the tool is then (3,)."""
        self._state.position[:] = place
        left = self.side > 0
        self._cutter = Cutter(self._state, self._table, radius=self.radius, left=left, normal=self.normal)
        self._cutter.begin_beside(tangent)
        self._start = self._state.place.copy()
        return self._start

    def pass_row(self, row: TravelRow) -> list[TravelRow]:
        """A row without a move; returns what can be executed now."""
        if self.started:
            self._items.append(row)
        elif self._first is not None:
            self._waiting.append(row)
        else:
            return [row]
        return []

    def move(self, move: Move) -> list[TravelRow]:
        """The next move; returns what can be executed now. Raises ValueError if the tool cannot follow."""
        if self.started:
            self._add(move)
            return []
        if self._first is None:
            if move.stands(self.normal):
                return move.rows(self.normal)
            if move.arc is not None:
                raise CutterFault("radius compensation begins with a straight move; write one before the arc")
            self._first = move
            return []
        if move.stands(self.normal):
            self._waiting.append(move)
            return []
        first, tangent = self._first, move.tangent(self.normal)
        place = self.begin_at(move.begin, tangent)
        offset_end = at_place(in_plane(place, self.normal), first.end, self.normal)
        axes = sorted({*first.axes, *IN_PLANE[self.normal]})
        rows = Move(first.rest, first.at, first.code, first.begin, offset_end, axes).rows(self.normal)
        for one in self._waiting:
            rows += [one] if isinstance(one, TravelRow) else one.rows(self.normal)
        self._add(move)
        return rows

    def finish(self) -> list[TravelRow]:
        """The moves of the contour, at its end. Raises ValueError."""
        if self._first is not None and not self.started:
            text = "radius compensation is on for one move only, which no contour follows; remove it"
            raise CutterFault(text)
        if self._cutter is not None:
            self._cutter.fix()
        return list(self._written())

    @property
    def leaving(self) -> complex:
        """Unit tangent at the end of the contour."""
        assert self._cutter is not None
        return self._cutter.leaving

    @property
    def place(self) -> FloatArray:
        """(3,) where the tool is."""
        return self._state.place.copy()

    def _add(self, move: Move) -> None:
        assert self._cutter is not None
        before = self._table.blocks
        line = move.rest.line
        if move.arc is not None:
            self._cutter.arc(move.end, move.arc, line)
        else:
            self._cutter.line(move.end, Kind.LINE if move.code else Kind.RAPID, line)
        self._items.append((move, before, self._table.blocks))

    def _written(self) -> Iterator[TravelRow]:
        arcs = {block: (centre, sweep) for block, centre, _, sweep in self._table.arcs}
        place = self._start
        for item in self._items:
            if isinstance(item, TravelRow):
                yield item
                continue
            move, first, last = item
            stops = [word for word in move.rest.words if word[0] == M and word[1] in STOPS]
            before = [word for word in move.rest.words if word not in stops]
            for block in range(first, last):
                end = self._table.block.end[block].copy()
                rises = end[self.normal] != place[self.normal]
                axes = range(3) if rises else sorted(IN_PLANE[self.normal])
                words = [(AXES[a], float(end[a]), move.at) for a in axes]
                code = 0 if self._table.block.kind[block] == Kind.RAPID else 1
                if block in arcs and abs(arcs[block][1]) > 2.0 * FULL_TURN:
                    code = 3 if arcs[block][1] > 0 else 2
                    words += arc_words(Arc(*arcs[block]), place, self.normal, move.at)
                words = [(G, float(code), move.at), *(before if block == first else []), *words]
                words += stops if block == last - 1 else []
                yield TravelRow(words, move.rest.line, move.rest.frame)
                place = end


@dataclass
class CornerMove:
    """A corner whose second move has not come."""

    kind: str  # one of KINDS
    size: float  # R, or the number of the chamfer [mm]
    line: int  # where it stands
    modal: bool = False  # of all moves: none where it has no room, such as before a move along the tool axis
    feed: float | None = None  # F of its own; behind it that before holds again
    first: Move | None = None

    def joined(self, second: Move, normal: int) -> tuple[list[Move], Move]:
        """The first move cut short with the corner behind it, and the second cut short. Raises ValueError."""
        first = self.first
        assert first is not None
        rises = any(move.begin[normal] != move.end[normal] for move in (first, second))
        out = rises or first.stands(normal) or second.stands(normal)
        if self.modal and (out or 0 in (first.code, second.code)):
            return [first], second
        require(not out, "a rounding or chamfer stands between two moves in the plane")
        corner, before, after = in_plane(first.end, normal), first.leaving(normal), second.tangent(normal)
        turn = cmath.phase(after / before)
        if abs(turn) < _STRAIGHT_ON or self.size == 0.0:
            return [first], second
        if self.kind != "RND":
            if first.arc is not None or second.arc is not None:
                raise ValueError("a chamfer is read between two straight moves; write its points out")
            distance = self.size if self.kind == "CHR" else self.size / (2.0 * math.cos(turn / 2.0))
            return self._parts(second, corner - distance * before, corner + distance * after, None, normal)
        side = 1 if turn > 0 else -1
        one, other = (_beside(move, side * self.size, normal) for move in (first, second))
        centre = meeting(one, other, side)
        if centre is None:
            raise ValueError(_TOO_LARGE)
        start, end = _foot(first, centre, normal), _foot(second, centre, normal)
        sweep = cmath.phase((end - centre) / (start - centre))
        require(sweep * side > 0.0, _TOO_LARGE)
        arc = Arc(at_place(centre, first.end, normal), sweep)
        return self._parts(second, start, end, arc, normal)

    def _parts(
        self, second: Move, start: complex, end: complex, arc: Arc | None, normal: int
    ) -> tuple[list[Move], Move]:
        first = self.first
        assert first is not None
        plane = IN_PLANE[normal]
        one = _cut(first, first.begin, at_place(start, first.end, normal), normal)
        two = _cut(second, at_place(end, second.begin, normal), second.end, normal)
        own = [] if self.feed is None else [(F, self.feed, first.at)]
        rest = TravelRow(own, first.rest.line, first.rest.frame)
        return [one, Move(rest, first.at, 1, one.end, two.begin, plane, arc)], two


def _beside(move: Move, distance: float, normal: int) -> OffsetMove:
    """The line or circle of a move, moved to its left."""
    first, last, end = move.tangent(normal), move.leaving(normal), in_plane(move.end, normal)
    if move.arc is None:
        return OffsetMove(end + 1j * distance * last, first, last)
    turning, centre = (1 if move.arc.sweep > 0 else -1), in_plane(move.arc.centre, normal)
    radius = abs(end - centre) - turning * distance
    require(radius > 0.0, _TOO_LARGE)
    return OffsetMove(end + 1j * distance * last, first, last, turning, centre, radius)


def _foot(move: Move, centre: complex, normal: int) -> complex:
    """The point of a move's line or circle next to the centre of a rounding."""
    if move.arc is None:
        tangent, begin = move.tangent(normal), in_plane(move.begin, normal)
        return begin + dot(centre - begin, tangent) * tangent
    middle = in_plane(move.arc.centre, normal)
    radius = abs(in_plane(move.end, normal) - middle)
    return middle + radius * (centre - middle) / abs(centre - middle)


def _cut(move: Move, begin: FloatArray, end: FloatArray, normal: int) -> Move:
    """A move between other ends on its line or circle. Raises ValueError if nothing is left of it."""
    axes = sorted({*move.axes, *IN_PLANE[normal]})
    start, stop = in_plane(begin, normal), in_plane(end, normal)
    if move.arc is None:
        require(dot(stop - start, move.tangent(normal)) >= -STANDS, _TOO_LARGE)
        return replace(move, begin=begin, end=end, axes=axes)
    centre, sweep = in_plane(move.arc.centre, normal), move.arc.sweep
    left_out = abs(cmath.phase((start - centre) / (in_plane(move.begin, normal) - centre)))
    left_out += abs(cmath.phase((in_plane(move.end, normal) - centre) / (stop - centre)))
    require(left_out < abs(sweep), _TOO_LARGE)
    rest = math.copysign(abs(sweep) - left_out, sweep)
    return replace(move, begin=begin, end=end, axes=axes, arc=Arc(move.arc.centre, rest))
