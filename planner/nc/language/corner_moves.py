"""A rounding or chamfer between two moves of a contour.

The rounding of radius R touches both moves: its centre lies on both, moved by R to the side to which the contour turns
(`offset_lines.meeting`), and each move ends or begins at the foot of the centre on it. A chamfer is cut between straight moves only; it
lies

    CHR    the given distance from the corner on both moves
    CHF    such that it is itself as long as given: length / (2 cos(turn / 2)) from the corner on both
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace

from planner.base.arrays import FloatArray
from planner.nc.arcs import IN_PLANE, Arc, at_place, in_plane
from planner.nc.language.travel_rows import STANDS, Move, TravelRow
from planner.nc.offset_lines import OffsetMove, meeting

KINDS = ("RND", "CHR", "CHF")
_STRAIGHT_ON = 1e-6  # turn below which there is no corner [rad]


@dataclass
class CornerMove:
    """A corner whose second move has not come.

    kind : one of KINDS
    size : R, or the number of the chamfer [mm]
    line : where it stands
    """

    kind: str
    size: float
    line: int
    first: Move | None = None

    def joined(self, second: Move, normal: int) -> tuple[list[Move], Move]:
        """The first move cut short with the corner behind it, and the second move cut short. Raises ValueError."""
        first = self.first
        assert first is not None
        rises = any(move.begin[normal] != move.end[normal] for move in (first, second))
        if rises or first.stands(normal) or second.stands(normal):
            raise ValueError("a rounding or chamfer stands between two moves in the plane")
        corner, before, after = in_plane(first.end, normal), _leaving(first, normal), second.tangent(normal)
        turn = cmath.phase(after / before)
        if abs(turn) < _STRAIGHT_ON or self.size == 0.0:
            return [first], second
        if self.kind != "RND":
            return self._chamfer(second, corner, (before, after), turn, normal)
        side = 1 if turn > 0 else -1
        centre = meeting(
            _beside(first, side * self.size, normal), _beside(second, side * self.size, normal), side
        )
        if centre is None:
            raise ValueError(_TOO_LARGE)
        start, end = _foot(first, centre, normal), _foot(second, centre, normal)
        sweep = cmath.phase((end - centre) / (start - centre))
        if sweep * side <= 0.0:
            raise ValueError(_TOO_LARGE)
        arc = Arc(at_place(centre, first.end, normal), sweep)
        return self._parts(second, start, end, arc, normal)

    def _chamfer(
        self, second: Move, corner: complex, ways: tuple[complex, complex], turn: float, normal: int
    ) -> tuple[list[Move], Move]:
        if self.first is None or self.first.arc is not None or second.arc is not None:
            raise ValueError("a chamfer is read between two straight moves; write its points out")
        distance = self.size if self.kind == "CHR" else self.size / (2.0 * math.cos(turn / 2.0))
        return self._parts(second, corner - distance * ways[0], corner + distance * ways[1], None, normal)

    def _parts(
        self, second: Move, start: complex, end: complex, arc: Arc | None, normal: int
    ) -> tuple[list[Move], Move]:
        first = self.first
        assert first is not None
        plane = IN_PLANE[normal]
        one = _cut(first, first.begin, at_place(start, first.end, normal), normal)
        two = _cut(second, at_place(end, second.begin, normal), second.end, normal)
        rest = TravelRow([], first.rest.line, first.rest.frame)
        code = 1 if arc is None else 3 if arc.sweep > 0 else 2
        between = Move(rest, first.at, code, one.end, two.begin, plane, arc)
        return [one, between], two


_TOO_LARGE = "the rounding or chamfer takes more of a move than there is; correct it"


def _leaving(move: Move, normal: int) -> complex:
    """Unit tangent at the end of a move."""
    start = move.tangent(normal)
    return start if move.arc is None else start * cmath.rect(1.0, move.arc.sweep)


def _beside(move: Move, distance: float, normal: int) -> OffsetMove:
    """The line or circle of a move, moved to its left."""
    first, last, end = move.tangent(normal), _leaving(move, normal), in_plane(move.end, normal)
    if move.arc is None:
        return OffsetMove(end + 1j * distance * last, first, last)
    turning, centre = (1 if move.arc.sweep > 0 else -1), in_plane(move.arc.centre, normal)
    radius = abs(end - centre) - turning * distance
    if radius <= 0.0:
        raise ValueError(_TOO_LARGE)
    return OffsetMove(end + 1j * distance * last, first, last, turning, centre, radius)


def _foot(move: Move, centre: complex, normal: int) -> complex:
    """The point of a move's line or circle next to the centre of a rounding."""
    if move.arc is None:
        tangent, begin = move.tangent(normal), in_plane(move.begin, normal)
        return begin + ((centre - begin).conjugate() * tangent).real * tangent
    middle = in_plane(move.arc.centre, normal)
    radius = abs(in_plane(move.end, normal) - middle)
    return middle + radius * (centre - middle) / abs(centre - middle)


def _cut(move: Move, begin: FloatArray, end: FloatArray, normal: int) -> Move:
    """A move between other ends on its line or circle. Raises ValueError if nothing is left of it."""
    axes = sorted({*move.axes, *IN_PLANE[normal]})
    start, stop = in_plane(begin, normal), in_plane(end, normal)
    if move.arc is None:
        if ((stop - start).conjugate() * move.tangent(normal)).real < -STANDS:
            raise ValueError(_TOO_LARGE)
        return replace(move, begin=begin, end=end, axes=axes)
    centre, sweep = in_plane(move.arc.centre, normal), move.arc.sweep
    left_out = abs(cmath.phase((start - centre) / (in_plane(move.begin, normal) - centre)))
    left_out += abs(cmath.phase((in_plane(move.end, normal) - centre) / (stop - centre)))
    if left_out >= abs(sweep):
        raise ValueError(_TOO_LARGE)
    rest = math.copysign(abs(sweep) - left_out, sweep)
    return replace(move, begin=begin, end=end, axes=axes, arc=Arc(move.arc.centre, rest))
