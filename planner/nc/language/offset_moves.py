"""Cutter radius compensation as Heidenhain and Siemens (NORM, G450) have it, on the geometry of `planner.nc.cutter`.

The first move leads straight to the place beside its programmed end, normal to the move after it; the contour then runs beside the
programmed one, with arcs about outer corners and intersections at inner ones, and ends normal to its last move. The move behind it
leads straight from there to its programmed end. So the first move waits for the next one in the plane; all others are given out at the
end, since a corner moves the end of the move before it.
"""

from __future__ import annotations

from collections.abc import Iterator

from planner.base.arrays import FloatArray
from planner.nc.arcs import FULL_TURN, IN_PLANE, Arc, at_place, in_plane
from planner.nc.block_table import BlockTable
from planner.nc.cutter import Cutter, CutterFault
from planner.nc.language.travel_rows import AXES, G, Move, TravelRow, arc_words, stops_apart
from planner.nc.program import Kind
from planner.nc.state import State

_KINDS = (Kind.RAPID, Kind.LINE, Kind.ARC, Kind.ARC)


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
        self._cutter = Cutter(
            self._state, self._table, radius=self.radius, left=self.side > 0, normal=self.normal
        )
        self._cutter.begin_beside(tangent)
        assert self._state.actual is not None
        self._start = self._state.actual.copy()
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
        beside = at_place(in_plane(place, self.normal), first.end, self.normal)
        axes = sorted({*first.axes, *IN_PLANE[self.normal]})
        rows = Move(first.rest, first.at, first.code, first.begin, beside, axes).rows(self.normal)
        for one in self._waiting:
            rows += [one] if isinstance(one, TravelRow) else one.rows(self.normal)
        self._add(move)
        return rows

    def finish(self) -> list[TravelRow]:
        """The moves of the contour, at its end. Raises ValueError."""
        if not self.started:
            if self._first is not None:
                raise CutterFault(
                    "radius compensation is on for one move only, which no contour follows; remove it"
                )
            return []
        assert self._cutter is not None
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
        assert self._state.actual is not None
        return self._state.actual.copy()

    def _add(self, move: Move) -> None:
        assert self._cutter is not None
        before = self._table.blocks
        line = move.rest.line
        if move.arc is not None:
            self._cutter.arc(move.end, move.arc, line)
        else:
            self._cutter.line(move.end, _KINDS[move.code], line)
        self._items.append((move, before, self._table.blocks))

    def _written(self) -> Iterator[TravelRow]:
        arcs = {block: (centre, sweep) for block, centre, _, sweep in self._table.arcs}
        place = self._start
        for item in self._items:
            if isinstance(item, TravelRow):
                yield item
                continue
            move, first, last = item
            before, stops = stops_apart(move.rest)
            for block in range(first, last):
                end = self._table.block.end[block].copy()
                axes = [
                    *IN_PLANE[self.normal],
                    *([self.normal] if end[self.normal] != place[self.normal] else []),
                ]
                words = [(AXES[a], float(end[a]), move.at) for a in sorted(axes)]
                code = 0 if self._table.block.kind[block] == Kind.RAPID else 1
                if block in arcs and abs(arcs[block][1]) > 2.0 * FULL_TURN:
                    code = 3 if arcs[block][1] > 0 else 2
                    words += arc_words(Arc(*arcs[block]), place, self.normal, move.at)
                yield TravelRow(
                    [(G, float(code), move.at), *(before if block == first else []), *words,
                     *(stops if block == last - 1 else [])],
                    move.rest.line,
                    move.rest.frame,
                )  # fmt: skip
                place = end
