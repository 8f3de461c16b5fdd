"""Path functions as rows of words: L, C, CR, CT, LP, CP. Roundings RND and chamfers CHF are made where the
rows pass (`corner_moves`).

The position (_x, _y, _z), the pole (_cx, _cy, _cz) and the normal of its plane (_plane), the last polar
coordinates (_pr, _pa) and the direction of the last move in x and y (_dx, _dy) are variables of the running
program, since coordinates may be computed and incremental. Rows carry absolute coordinates.

A pole lies in X/Y, Y/Z or Z/X, as its block names the axes, and PA counts from +X, +Y or +Z to the other
axis. Arcs about it, C and CP, lie in its plane, DR+ from the first axis to the second one, as G3 has it in
G17, G19 and G18. (TNC 640, conversational programming, polar coordinates: pole and angle reference axis.) A
program that has poles in other planes than X/Y asks for the plane while it runs.

CT's centre lies on the normal n of the direction at the start, at

    radius = |v|^2 / (2 n v),      v from start to end; positive to the left, where the arc turns counter-clockwise.

Behind CR, whose centre is not computed here, the direction is that of the moves that were executed
(`makers.tangent_arc`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from planner.nc.arcs import IN_PLANE
from planner.nc.language.heidenhain.text import (
    DIRECTION,
    PLANE,
    POLAR,
    POLE,
    POSITION,
    Block,
    Items,
    Rows,
    X,
    Y,
    absolute,
    own,
)
from planner.nc.language.tree import (
    ONE,
    TWO,
    ZERO,
    Expression,
    If,
    MadeRows,
    Number,
    Parameter,
    assign,
    op,
    row,
)

Words = list[tuple[str, Expression]]
Assigned = list[tuple[Parameter, Expression]]
Ends = dict[str, Expression]  # absolute coordinates by axis
_AXES = "XYZ"
_WORKING = 2  # normal of the working plane: the tool axis is Z
_PLANE_CODES = {0: 19.0, 1: 18.0}


class Moves:
    """Rows of path functions."""

    def __init__(self, feed_scale: float):
        # what F is multiplied with: 1, or 0.1 in inch programs, where F is in tenths of an inch per minute
        self.feed_scale = feed_scale
        self.tilted = False  # there may be poles in other planes than X/Y
        self.automatic: Expression | None = None  # F of the tool call

    def feed_words(self, block: Block, given: Items) -> Words:
        """The F word of a block, if it has one. Raises ProgramFault for F AUTO without a feed in the tool
        call."""
        feed = given.feed
        if given.automatic:
            feed = self.automatic
            if feed is None:
                raise block.fault("F AUTO, and the tool call before has no F")
        return [] if feed is None else [("F", self.scaled(feed))]

    def scaled(self, feed: Expression) -> Expression:
        """A feed in mm or inch per minute."""
        return feed if self.feed_scale == 1.0 else feed * Number(self.feed_scale)

    def straight(self, block: Block, given: Items, ends: Ends, machine: bool = False) -> Rows:
        """L and LP: a straight move to absolute coordinates."""
        feed = self.feed_words(block, given)
        assigned = _assigned(ends)
        if "X" in ends or "Y" in ends:
            assigned += [(DIRECTION[0], ends.get("X", X) - X), (DIRECTION[1], ends.get("Y", Y) - Y)]
        if not ends:
            return [row(block.place, *feed)] if feed else []
        codes: Words = [("G", Number(53.0))] if machine else []
        codes.append(("G", ZERO if given.fast else ONE))
        return [row(block.place, *codes, *feed, *ends.items(), assigned=tuple(assigned))]

    def by_plane(self, block: Block, rows: Callable[[int], Rows | None]) -> Rows:
        """The rows of a block by the normal of the pole's plane; None where it makes no sense in that plane.
        Raises ProgramFault where that is known."""
        found = rows(_WORKING)
        if not self.tilted:
            if found is None:
                raise block.fault(f"a coordinate that lies {OUT_OF_PLANE}")
            return found
        planes = [rows(normal) or [MadeRows(block.place, "out of plane")] for normal in (0, 1)]
        branches = tuple((op("EQ", PLANE, Number(float(n))), rows) for n, rows in enumerate(planes))
        return [If(block.place, branches, found or [MadeRows(block.place, "out of plane")])]

    def circle(self, block: Block, given: Items, ends: Ends) -> Rows:
        """C: an arc about the pole, in its plane."""
        code = _arc_code(block, given)

        def rows(normal: int) -> Rows | None:
            if _AXES[normal] in ends:
                return None
            return self._arc(block, given, ends, code, POLE, given.turn, normal=normal)

        return self.by_plane(block, rows)

    def _arc(
        self,
        block: Block,
        given: Items,
        ends: Ends,
        code: Expression,
        centre: Sequence[Expression],
        turn: int | Expression,
        turns: Expression | None = None,
        normal: int = _WORKING,
    ) -> Rows:
        """An arc about centre, which is a place by axis."""
        if given.fast:
            raise block.fault(_FAST_ARC)
        words: Words = [("G", code), *self.feed_words(block, given), *ends.items()]
        words += [("IJK"[a], centre[a] - POSITION[_AXES[a]]) for a in IN_PLANE[normal]]
        if turns is not None:
            words.append(("P", turns))
        assigned = _assigned(ends)
        if normal != _WORKING:
            assigned += _NO_DIRECTION
            plane, back = (row(block.place, ("G", g)) for g in (_PLANE_CODES[normal], 17.0))
            return [plane, row(block.place, *words, assigned=tuple(assigned)), back]
        out = ends.get("X", X) - centre[0], ends.get("Y", Y) - centre[1]
        sign = Number(float(turn)) if isinstance(turn, int) else turn
        assigned += [(DIRECTION[0], -(sign * out[1])), (DIRECTION[1], sign * out[0])]
        return [row(block.place, *words, assigned=tuple(assigned))]

    def radius_arc(self, block: Block, given: Items, ends: Ends) -> Rows:
        """CR: an arc of a given radius."""
        if given.radius is None or not given.turn:
            raise block.fault("CR needs R and its direction, DR+ or DR-")
        if given.fast:
            raise block.fault(_FAST_ARC)
        words = [
            ("G", _arc_code(block, given)),
            *self.feed_words(block, given),
            *ends.items(),
            ("R", given.radius),
        ]
        return [row(block.place, *words, assigned=(*_assigned(ends), *_NO_DIRECTION))]

    def tangent_arc(self, block: Block, given: Items, ends: Ends) -> Rows:
        """CT: the arc that goes on in the direction of the last move."""
        v = ends.get("X", X) - X, ends.get("Y", Y) - Y
        length = op("LEN", *DIRECTION)
        normal = -DIRECTION[1] / length, DIRECTION[0] / length
        radius, centre, turn = own("r"), (own("tx"), own("ty")), own("turn")
        left = op("GT", radius, ZERO)
        known: Rows = [
            assign(
                block.place,
                (radius, (v[0] * v[0] + v[1] * v[1]) / (TWO * (normal[0] * v[0] + normal[1] * v[1]))),
            ),
            assign(block.place, (centre[0], X + radius * normal[0]), (centre[1], Y + radius * normal[1])),
            assign(block.place, (turn, TWO * left - ONE)),
            *self._arc(block, given, ends, TWO + left, centre, turn),
        ]
        looked: Rows = [
            MadeRows(block.place, "tangent arc", (*ends.items(), *self.feed_words(block, given))),
            assign(block.place, *_assigned(ends)),
        ]
        return [If(block.place, ((op("EQ", length, ZERO), looked),), known)]

    def polar(self, block: Block, given: Items) -> Rows:
        """The statement that finds the polar coordinates of LP and CTP."""
        change: Assigned = []
        for name, variable in zip(("PR", "PA"), POLAR, strict=True):
            if name in given.polar:
                change.append((variable, given.polar[name]))
            elif "I" + name in given.polar:
                change.append((variable, variable + given.polar["I" + name]))
        return [assign(block.place, *change)] if change else []

    def polar_ends(self, block: Block, given: Items, normal: int = _WORKING) -> Ends | None:
        """The coordinates from the polar ones, and that along the normal; None where the block has a
        coordinate in the plane."""
        radius, angle = POLAR
        if set(given.axes) & {"X", "Y", "Z"} - {_AXES[normal]}:
            return None
        first, second = IN_PLANE[normal]
        ends: Ends = {
            _AXES[first]: POLE[first] + radius * op("COS", angle),
            _AXES[second]: POLE[second] + radius * op("SIN", angle),
        }
        ends |= {axis: absolute(axis, end) for axis, end in given.axes.items() if axis == _AXES[normal]}
        return dict(sorted(ends.items()))

    def polar_line(self, block: Block, given: Items) -> Rows:
        """LP: a straight move to polar coordinates."""

        def rows(normal: int) -> Rows | None:
            ends = self.polar_ends(block, given, normal)
            return None if ends is None else self.straight(block, given, ends)

        return [*self.polar(block, given), *self.by_plane(block, rows)]

    def polar_tangent(self, block: Block, given: Items) -> Rows:
        """CTP: the arc to polar coordinates that goes on in the direction of the last move, in the working
        plane."""

        def rows(normal: int) -> Rows | None:
            ends = None if normal != _WORKING else self.polar_ends(block, given)
            return None if ends is None else self.tangent_arc(block, given, ends)

        return [*self.polar(block, given), *self.by_plane(block, rows)]

    def polar_arc(self, block: Block, given: Items) -> Rows:
        """CP: an arc or a helix about the pole to a polar angle, or by an angle of any number of turns."""
        code, by = _arc_code(block, given), given.polar.get("IPA")
        if isinstance(by, Number) and by.value * given.turn < 0.0:
            raise block.fault("IPA and DR of CP have the same sign")
        if by is None and "PA" not in given.polar:
            raise block.fault("CP needs PA or IPA")
        radius, angle = POLAR
        turns = None if by is None else op("FUP", op("ABS", by) / Number(360.0) - Number(1e-9))

        def rows(normal: int) -> Rows | None:
            first, second = (POSITION[_AXES[a]] - POLE[a] for a in IN_PLANE[normal])
            to = given.polar["PA"] if by is None else op("ATAN", second, first) + by
            before = assign(block.place, (radius, op("LEN", first, second)), (angle, to))
            ends = self.polar_ends(block, given, normal)
            if ends is None:
                return None
            return [before, *self._arc(block, given, ends, code, POLE, given.turn, turns, normal)]

        return self.by_plane(block, rows)


def _arc_code(block: Block, given: Items) -> Expression:
    """G3 or G2. Raises ProgramFault without a direction."""
    if not given.turn:
        raise block.fault("an arc needs its direction: DR+ or DR-")
    return Number(3.0 if given.turn > 0 else 2.0)


def _assigned(ends: Ends) -> Assigned:
    """The position at the end of a move."""
    return [(POSITION[axis], end) for axis, end in ends.items() if axis in POSITION]


_NO_DIRECTION = ((DIRECTION[0], ZERO), (DIRECTION[1], ZERO))  # behind arcs whose end has no direction here
OUT_OF_PLANE = "out of the pole's plane, or in it beside polar coordinates, belongs to no such move"
_FAST_ARC = "an arc at rapid (FMAX) is not read; write its F"
