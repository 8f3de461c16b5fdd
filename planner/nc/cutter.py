"""Cutter radius compensation, G41 (left of the path) and G42 (right of it): from programmed moves to the
tool's.

With the tool's radius r and the side s = +1 (left) or -1 (right) the tool's centre is at p + s r n(t) where
the programmed tangent is t, n(t) = t turned left by a quarter. So a line is offset to a parallel, and an arc
about its centre. Where two moves meet, the second turns by an angle away from the tool's side (outer corner),
towards it (inner corner), or by less than `STRAIGHT_ON`:

    outer corner    an arc of radius r about the programmed corner joins the two offset ends; before a rapid a straight move does
    inner corner    both offset moves end at their intersection: the one that crosses in the sense in which the programmed moves turn
    straight on     the second begins where the first ends

An inner corner that takes more of a move than there is would gouge, and is refused. Back by pi is an outer
corner between lines and before an arc with the tool inside, and an inner one otherwise. The first move,
longer than r, leads straight from where the tool is to the offset end (an arc becomes the one that ends there
with the programmed tangent); the move after G40 leads straight to the programmed end. Moves along the normal,
dwells and stops keep the place in the plane; M0 and M1 fix it. All this is what LinuxCNC does, but that it
refuses an arc that begins early by more than 0.0254 in mm programs where a corner follows
(move_endpoint_and_flush in interp_queue.cc compares the angle with a length); here it is cut. Points and
vectors in the plane are complex numbers: n(t) = i t.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.base.arrays import FloatArray
from planner.nc.arcs import FULL_TURN, IN_PLANE, Arc, at_place, in_plane
from planner.nc.block_table import BlockTable
from planner.nc.program import Kind
from planner.nc.state import State

NOWHERE = 1e-9  # a move that is shorter stays where it is [mm]: the rounding of coordinates around 1e3 mm
STRAIGHT_ON = 0.05  # [rad], as LinuxCNC has it, found by bisection on it
_ROUNDING = 1e-6  # of an angle where an arc's ends are not on one circle [rad]
_WHY = "the inner corner before this move takes more of a move than there is: the tool would gouge"
_GOUGE = f"{_WHY}; correct the path or take a smaller tool"


@dataclass(frozen=True)
class OffsetMove:
    """An offset move: where it would end, its tangent there and at its start, and its line or circle."""

    end: complex
    first: complex  # unit tangent
    last: complex  # unit tangent
    turning: int = 0  # +1 counter-clockwise, -1 clockwise, 0 for a line
    centre: complex = 0j
    radius: float = 0.0

    def tangent(self, point: complex) -> complex:
        """Unit tangent at a point of the line or circle."""
        if not self.turning:
            return self.first
        spoke = point - self.centre
        return 1j * self.turning * spoke / abs(spoke)


def meeting(before: OffsetMove, after: OffsetMove, sense: float) -> complex | None:
    """Where two offset moves cross in a sense (the sign of the turn from the one to the other), or None."""
    both = ((p, cross(before.tangent(p), after.tangent(p))) for p in _crossings(before, after))
    crossing = [p for p, turn in both if turn * sense > 0]
    return min(crossing, key=lambda p: abs(p - before.end)) if crossing else None


def _crossings(one: OffsetMove, other: OffsetMove) -> Sequence[complex]:
    if not one.turning and not other.turning:
        slope = cross(one.first, other.first)
        if slope == 0.0:
            return []
        along = cross(other.end - one.end, other.first) / slope
        return [one.end + along * one.first]
    if one.turning and other.turning:
        apart = other.centre - one.centre
        distance = abs(apart)
        if distance < NOWHERE:
            return []
        along = (distance**2 + one.radius**2 - other.radius**2) / (2.0 * distance)
        direction, foot, size = 1j * apart / distance, one.centre + along * apart / distance, one.radius
        rest = size**2 - along**2
    else:
        line, circle = (other, one) if one.turning else (one, other)
        direction = line.first
        foot = line.end + dot(circle.centre - line.end, direction) * direction
        rest = circle.radius**2 - abs(foot - circle.centre) ** 2
    if rest < 0.0:
        return []
    reach = math.sqrt(rest)
    return [foot - reach * direction, foot + reach * direction]


def cross(one: complex, other: complex) -> float:
    """Positive where the other vector lies to the left."""
    return (one.conjugate() * other).imag


def dot(one: complex, other: complex) -> float:
    """The scalar product."""
    return (one.conjugate() * other).real


class CutterFault(ValueError):
    """The tool cannot follow the programmed moves; the text says why."""


@dataclass
class _Open:
    """The last move, whose end the next corner may move."""

    side: OffsetMove
    row: int  # its block, or, once it is fixed, that of the first move along the normal after it, or -1
    arc: int  # its row among the arcs, or -1
    begin: complex  # where the tool begins it
    sweep: float = 0.0  # of an arc, as it is now
    fixed: bool = False  # its end is not moved any more


class Cutter:
    """The compensation in force, from G41 or G42 to G40; it writes its moves into the table of blocks.

    radius : of the tool [mm], > 0;  left : on which side of the path it is;  normal : axis normal to the plane
    """

    def __init__(self, state: State, table: BlockTable, *, radius: float, left: bool, normal: int):
        self._state, self._table = state, table
        self._radius, self.sign = radius, 1 if left else -1
        self.normal = normal
        self._open: _Open | None = None
        self._placed = False
        state.actual = state.position.copy()

    @property
    def started(self) -> bool:
        """True if the first move has been made."""
        return self._open is not None

    @property
    def leaving(self) -> complex:
        """Unit tangent of the last move at its end."""
        assert self._open is not None
        return self._open.side.last

    def begin_beside(self, tangent: complex) -> None:
        """The tool stands beside the programmed place already, normal to the first unit tangent."""
        state = self._state
        state.actual = self._at(self._beside(self._plane(state.position), tangent), state.position)
        self._placed = True

    def line(self, target: FloatArray, kind: Kind, line: int) -> None:
        """A straight move to `target` (3,), as programmed. Raises CutterFault if the tool cannot follow."""
        state = self._state
        start, end = self._plane(state.position), self._plane(target)
        length = abs(end - start)
        if length < NOWHERE:
            self._stay(target, kind, line)
            return
        tangent = (end - start) / length
        side = OffsetMove(self._beside(end, tangent), tangent, tangent)
        if self._placed:
            self._placed = False
        elif not self.started:
            if length <= self._radius:
                first = f"the first move of cutter radius compensation is {length:.6g} mm long"
                raise CutterFault(f"{first}; it must be longer than the tool's radius, {self._radius:.6g} mm")
        else:
            self._corner(start, side, kind, line)
        self._add(side, target, kind, line)

    def arc(self, target: FloatArray, arc: Arc, line: int) -> None:
        """An arc to `target` (3,), the programmed end. Raises CutterFault if the tool cannot follow."""
        state = self._state
        start, end, centre = self._plane(state.position), self._plane(target), self._plane(arc.centre)
        turning = 1 if arc.sweep > 0 else -1
        nearer = turning * self.sign * self._radius
        size = abs(end - centre)
        first, last = (1j * turning * (p - centre) / abs(p - centre) for p in (start, end))
        if nearer >= size:
            larger = f"must be larger than the tool's, {self._radius:.6g} mm, where the tool is inside"
            raise CutterFault(f"the arc's radius, {size:.6g} mm, {larger}")
        side = OffsetMove(self._beside(end, last), first, last, turning, centre, size - nearer)
        sweep = arc.sweep
        if self._placed:
            self._placed = False
        elif not self.started:
            side, sweep = self._entry_arc(side, start, sweep)
        else:
            inner = self._corner(start, side, Kind.ARC, line)
            early = STRAIGHT_ON * max(1.0, self._radius / side.radius)
            sweep -= self._left_out(side, allowed_back=early if not inner else _ROUNDING)
        if sweep * turning <= 0:
            raise CutterFault(_GOUGE)
        self._add(side, target, Kind.ARC, line, sweep)

    def fix(self) -> None:
        """The place is fixed: a stop, G40, the end. Raises CutterFault if the last move would gouge."""
        if self._open is not None:
            self._settle(self._open)
            self._open.fixed, self._open.row = True, -1

    def _corner(self, corner: complex, side: OffsetMove, kind: Kind, line: int) -> bool:
        """Join the open move to the next at a programmed corner; True for an inner one."""
        assert self._open is not None
        before = self._open.side
        turn = cmath.phase(side.first / before.last) * self.sign  # towards the tool's side
        back = math.pi - abs(turn) < STRAIGHT_ON
        around = side.turning == self.sign if side.turning else not before.turning
        outer = around if back else turn < -STRAIGHT_ON
        inner = not outer and (back or turn > STRAIGHT_ON)
        if inner:
            self._inner_corner(self._open, side)
        self._settle(self._open)
        if outer:
            self._outer_corner(corner, self._beside(corner, side.first), kind, line)
        return inner

    def _inner_corner(self, open_: _Open, side: OffsetMove) -> None:
        point = meeting(open_.side, side, self.sign)
        if point is None:
            raise CutterFault(_GOUGE)
        if open_.fixed:
            if open_.row >= 0:
                self._move_end(open_.row, point)
            return
        if open_.arc >= 0:
            left_out = _turn(point, open_.side.end, open_.side)
            open_.sweep -= left_out
            if open_.sweep * open_.side.turning <= 0:
                raise CutterFault(_GOUGE)
        open_.side = replace(open_.side, end=point)
        self._move_end(open_.row, point)

    def _outer_corner(self, corner: complex, end: complex, kind: Kind, line: int) -> None:
        """To the offset start of the next move: about the corner, or straight before a rapid."""
        state = self._state
        place = self._at(end, state.place)
        if kind == Kind.RAPID:
            state.actual = place
            self._table.add(Kind.RAPID, line, state)
            return
        spokes = (end - corner) / (self._plane(state.place) - corner)
        sweep = -self.sign * (-self.sign * cmath.phase(spokes) % (2.0 * math.pi))
        state.actual = place
        self._table.add_arc(Arc(self._at(corner, place), sweep), self.normal, line, state)

    def _settle(self, open_: _Open) -> None:
        """See that the open move still leads forward, now that its end is known; write an arc's sweep."""
        if open_.arc >= 0 and not open_.fixed:
            block, centre, normal, _ = self._table.arcs[open_.arc]
            self._table.arcs[open_.arc] = (block, centre, normal, open_.sweep)
        elif not open_.fixed and dot(open_.side.end - open_.begin, open_.side.first) < -NOWHERE:
            raise CutterFault(_GOUGE)

    def _add(self, side: OffsetMove, target: FloatArray, kind: Kind, line: int, sweep: float = 0.0) -> None:
        state, table = self._state, self._table
        begin, before = self._plane(state.place), state.place
        state.position[:] = target
        state.actual = self._at(side.end, target)
        row, arc = table.blocks, -1
        if kind == Kind.ARC:
            arc = len(table.arcs)
            table.add_arc(Arc(self._at(side.centre, before), sweep), self.normal, line, state)
        else:
            table.add(kind, line, state)
        self._open = _Open(side, row, arc, begin, sweep)

    def _left_out(self, side: OffsetMove, allowed_back: float) -> float:
        """Angle that the corner at the start of an arc takes off its sweep [rad]."""
        start = side.centre + side.radius * side.first / (1j * side.turning)
        left_out = _turn(start, self._plane(self._state.place), side)
        if left_out * side.turning < -allowed_back:
            raise CutterFault(_GOUGE)
        return left_out

    def _entry_arc(self, side: OffsetMove, start: complex, sweep: float) -> tuple[OffsetMove, float]:
        """The arc from where the tool is that ends at the offset end with the programmed tangent."""
        inwards = 1j * side.turning * side.last  # from the end towards the centre
        chord = start - side.end
        reach = dot(chord, inwards)
        if abs(self._plane(self._state.position) - side.centre) <= self._radius or reach <= 0.0:
            first = "the first arc of cutter radius compensation must have a radius larger than the tool's"
            room = f"{self._radius:.6g} mm, and leave room for it; begin with a straight move"
            raise CutterFault(f"{first}, {room}")
        radius = abs(chord) ** 2 / (2.0 * reach)
        centre = side.end + radius * inwards
        turn = side.turning * cmath.phase((side.end - centre) / (start - centre))
        full = turn if turn > FULL_TURN else turn + 2.0 * math.pi
        full += 2.0 * math.pi * max(0, math.ceil(abs(sweep) / (2.0 * math.pi) - FULL_TURN) - 1)
        return replace(side, centre=centre, radius=radius), side.turning * full

    def _stay(self, target: FloatArray, kind: Kind, line: int) -> None:
        if not (self.started or self._placed):
            first = "the first move of cutter radius compensation does not move in its plane"
            raise CutterFault(f"{first}; write G41 or G42 after it")
        state = self._state
        place = self._plane(state.place)
        state.position[:] = target
        state.actual = self._at(place, target)
        if self._open is not None and self._open.row < 0:
            self._open.row = self._table.blocks
        self._table.add(kind, line, state)

    def _move_end(self, row: int, point: complex) -> None:
        """All blocks from the open move on end at another place in the plane."""
        state, ends = self._state, self._table.block.end
        for axis, value in zip(IN_PLANE[self.normal], (point.real, point.imag), strict=True):
            ends[row : self._table.blocks, axis] = value
            state.place[axis] = value

    def _plane(self, point: FloatArray) -> complex:
        return in_plane(point, self.normal)

    def _at(self, point: complex, others: FloatArray) -> FloatArray:
        return at_place(point, others, self.normal)

    def _beside(self, point: complex, tangent: complex) -> complex:
        return point + self.sign * self._radius * 1j * tangent


def _turn(start: complex, end: complex, side: OffsetMove) -> float:
    """The angle from one point to another about the centre, at most half a turn either way [rad]."""
    return cmath.phase((end - side.centre) / (start - side.centre))
