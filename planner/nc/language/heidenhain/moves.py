"""Path functions as rows of words: L, C, CR, CT, LP, CP. Roundings RND and chamfers CHF are made where the rows pass (`corner_moves`).

The position (_x, _y, _z), the pole (_cx, _cy, _cz) and the normal of its plane (_plane), the last polar coordinates (_pr, _pa) and
the direction of the last move in x and y (_dx, _dy) are variables of the running program, since coordinates may be computed and
incremental. Rows carry absolute coordinates.

A pole lies in X/Y, Y/Z or Z/X, as its block names the axes, and PA counts from +X, +Y or +Z to the other axis. Arcs about it, C and CP,
lie in its plane, DR+ from the first axis to the second one, as G3 has it in G17, G19 and G18. (TNC 640, conversational programming,
polar coordinates: pole and angle reference axis.) A program that has poles in other planes than X/Y asks for the plane while it runs.

CT's centre lies on the normal n of the direction at the start, at

    radius = |v|^2 / (2 n v),      v from start to end; positive to the left, where the arc turns counter-clockwise.

Behind CR, whose centre is not computed here, the direction is that of the moves that were executed (`makers.tangent_arc`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from planner.nc.arcs import IN_PLANE
from planner.nc.language.heidenhain.items import (
    DIRECTION,
    PLANE,
    POLAR,
    POLE,
    POSITION,
    Items,
    X,
    Y,
    absolute,
    word,
)
from planner.nc.language.heidenhain.text import ConversationalBlock, minus, of, own, plus, quotient, times
from planner.nc.language.spelling import NEGATIVE
from planner.nc.language.tree import (
    ONE,
    TWO,
    ZERO,
    Expression,
    If,
    Line,
    MadeRows,
    Number,
    Parameter,
    Statement,
    Word,
)

_AXES = "XYZ"
_WORKING = 2  # normal of the working plane: the tool axis is Z
_PLANE_CODES = {0: 19.0, 1: 18.0}


class Moves:
    """Rows of path functions.

    feed_scale : what F is multiplied with: 1, or 0.1 in inch programs, where F is in tenths of an inch per minute
    tilted     : there may be poles in other planes than X/Y
    """

    def __init__(self, feed_scale: float):
        self.feed_scale = feed_scale
        self.tilted = False
        self.automatic: Expression | None = None  # F of the tool call

    def feed_words(self, block: ConversationalBlock, given: Items) -> list[Word]:
        """The F word of a block, if it has one. Raises ProgramFault for F AUTO without a feed in the tool call."""
        feed = given.feed
        if given.automatic:
            feed = self.automatic
            if feed is None:
                raise block.fault("F AUTO, and the tool call before has no F")
        if feed is None:
            return []
        return [word("F", block.place.at, self.scaled(feed))]

    def scaled(self, feed: Expression) -> Expression:
        """A feed in mm or inch per minute."""
        return feed if self.feed_scale == 1.0 else times(feed, Number(self.feed_scale))

    def straight(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression], machine: bool = False
    ) -> list[Statement]:
        """L and LP: a straight move to absolute coordinates."""
        at = block.place.at
        words = [word("G", at, Number(53.0))] if machine else []
        words.append(word("G", at, ZERO if given.fast else ONE))
        words += self.feed_words(block, given)
        words += [word(axis, at, end) for axis, end in ends.items()]
        assigned: list[tuple[Parameter, Expression]] = [
            (POSITION[axis], end) for axis, end in ends.items() if axis in POSITION
        ]
        if "X" in ends or "Y" in ends:
            assigned += [
                (DIRECTION[0], minus(ends.get("X", X), X)),
                (DIRECTION[1], minus(ends.get("Y", Y), Y)),
            ]
        if not ends:
            words = self.feed_words(block, given)
        return [Line(block.place, tuple(words), tuple(assigned))] if words else []

    def by_plane(
        self, block: ConversationalBlock, rows: Callable[[int], list[Statement] | None]
    ) -> list[Statement]:
        """The rows of a block by the normal of the pole's plane; None where it makes no sense in that plane. Raises ProgramFault where
        that is known."""
        found = rows(_WORKING)
        if not self.tilted:
            if found is None:
                raise block.fault(f"a coordinate that lies {OUT_OF_PLANE}")
            return found
        planes = [rows(normal) or [MadeRows(block.place, "out of plane")] for normal in (0, 1)]
        branches = tuple((of("EQ", PLANE, Number(float(n))), rows) for n, rows in enumerate(planes))
        return [If(block.place, branches, found or [MadeRows(block.place, "out of plane")])]

    def circle(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """C: an arc about the pole, in its plane."""
        if not given.turn:
            raise block.fault("an arc needs its direction: DR+ or DR-")
        code = Number(3.0 if given.turn > 0 else 2.0)
        return self.by_plane(
            block,
            lambda normal: (
                None
                if _AXES[normal] in ends
                else self._arc(block, given, ends, code, POLE, given.turn, normal=normal)
            ),
        )

    def _arc(
        self,
        block: ConversationalBlock,
        given: Items,
        ends: dict[str, Expression],
        code: Expression,
        centre: Sequence[Expression],
        turn: int | Expression,
        turns: Expression | None = None,
        normal: int = _WORKING,
    ) -> list[Statement]:
        """An arc about centre, which is a place by axis."""
        if given.fast:
            raise block.fault(_FAST_ARC)
        at = block.place.at
        words = [word("G", at, code), *self.feed_words(block, given)]
        words += [word(axis, at, end) for axis, end in ends.items()]
        first, second = IN_PLANE[normal]
        words += [word("IJK"[a], at, minus(centre[a], POSITION[_AXES[a]])) for a in (first, second)]
        if turns is not None:
            words.append(word("P", at, turns))
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        if normal != _WORKING:
            assigned += [(DIRECTION[0], ZERO), (DIRECTION[1], ZERO)]
            plane, back = (
                Line(block.place, (word("G", at, Number(g)),)) for g in (_PLANE_CODES[normal], 17.0)
            )
            return [plane, Line(block.place, tuple(words), tuple(assigned)), back]
        out = minus(ends.get("X", X), centre[0]), minus(ends.get("Y", Y), centre[1])
        sign = Number(float(turn)) if isinstance(turn, int) else turn
        assigned += [(DIRECTION[0], of(NEGATIVE, times(sign, out[1]))), (DIRECTION[1], times(sign, out[0]))]
        return [Line(block.place, tuple(words), tuple(assigned))]

    def radius_arc(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """CR: an arc of a given radius."""
        if given.radius is None or not given.turn:
            raise block.fault("CR needs R and its direction, DR+ or DR-")
        if given.fast:
            raise block.fault(_FAST_ARC)
        at = block.place.at
        words = [word("G", at, Number(3.0 if given.turn > 0 else 2.0)), *self.feed_words(block, given)]
        words += [word(axis, at, end) for axis, end in ends.items()] + [word("R", at, given.radius)]
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        assigned += [(DIRECTION[0], ZERO), (DIRECTION[1], ZERO)]
        return [Line(block.place, tuple(words), tuple(assigned))]

    def tangent_arc(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """CT: the arc that goes on in the direction of the last move."""
        v = minus(ends.get("X", X), X), minus(ends.get("Y", Y), Y)
        length = of("LEN", *DIRECTION)
        normal = quotient(of(NEGATIVE, DIRECTION[1]), length), quotient(DIRECTION[0], length)
        squared = plus(times(v[0], v[0]), times(v[1], v[1]))
        radius, centre = own("r"), (own("tx"), own("ty"))
        first = Line(
            block.place,
            (),
            ((radius, quotient(squared, times(TWO, plus(times(normal[0], v[0]), times(normal[1], v[1]))))),),
        )
        second = Line(
            block.place,
            (),
            ((centre[0], plus(X, times(radius, normal[0]))), (centre[1], plus(Y, times(radius, normal[1])))),
        )
        left = of("GT", radius, ZERO)
        turn = own("turn")
        third = Line(block.place, (), ((turn, minus(times(TWO, left), ONE)),))
        known: list[Statement] = [
            first, second, third, *self._arc(block, given, ends, plus(TWO, left), centre, turn)
        ]  # fmt: skip
        words = [(chr(one.letter), one.value) for one in self.feed_words(block, given)]
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        looked: list[Statement] = [
            MadeRows(block.place, "tangent arc", (*ends.items(), *words)), Line(block.place, (), tuple(assigned))
        ]  # fmt: skip
        return [If(block.place, ((of("EQ", length, ZERO), looked),), known)]

    def polar(self, block: ConversationalBlock, given: Items) -> list[Statement]:
        """The statement that finds the polar coordinates of LP and CTP."""
        radius, angle = POLAR
        change: list[tuple[Parameter, Expression]] = []
        for name, variable in (("PR", radius), ("PA", angle)):
            if name in given.polar:
                change.append((variable, given.polar[name]))
            elif "I" + name in given.polar:
                change.append((variable, plus(variable, given.polar["I" + name])))
        return [Line(block.place, (), tuple(change))] if change else []

    def polar_ends(
        self, block: ConversationalBlock, given: Items, normal: int = _WORKING
    ) -> dict[str, Expression] | None:
        """The coordinates from the polar ones, and that along the normal; None where the block has a coordinate in the plane."""
        radius, angle = POLAR
        if set(given.axes) & {"X", "Y", "Z"} - {_AXES[normal]}:
            return None
        first, second = IN_PLANE[normal]
        ends: dict[str, Expression] = {
            _AXES[first]: plus(POLE[first], times(radius, of("COS", angle))),
            _AXES[second]: plus(POLE[second], times(radius, of("SIN", angle))),
        }
        ends |= {axis: absolute(axis, end) for axis, end in given.axes.items() if axis == _AXES[normal]}
        return dict(sorted(ends.items()))

    def polar_line(self, block: ConversationalBlock, given: Items) -> list[Statement]:
        """LP: a straight move to polar coordinates."""

        def rows(normal: int) -> list[Statement] | None:
            ends = self.polar_ends(block, given, normal)
            return None if ends is None else self.straight(block, given, ends)

        return [*self.polar(block, given), *self.by_plane(block, rows)]

    def polar_tangent(self, block: ConversationalBlock, given: Items) -> list[Statement]:
        """CTP: the arc to polar coordinates that goes on in the direction of the last move, in the working plane."""

        def rows(normal: int) -> list[Statement] | None:
            ends = None if normal != _WORKING else self.polar_ends(block, given)
            return None if ends is None else self.tangent_arc(block, given, ends)

        return [*self.polar(block, given), *self.by_plane(block, rows)]

    def polar_arc(self, block: ConversationalBlock, given: Items) -> list[Statement]:
        """CP: an arc or a helix about the pole to a polar angle, or by an angle of any number of turns."""
        if not given.turn:
            raise block.fault("an arc needs its direction: DR+ or DR-")
        by = given.polar.get("IPA")
        if isinstance(by, Number) and by.value * given.turn < 0.0:
            raise block.fault("IPA and DR of CP have the same sign")
        if by is None and "PA" not in given.polar:
            raise block.fault("CP needs PA or IPA")
        radius, angle = POLAR
        turns: Expression | None = None
        if by is not None:
            turns = of("UP", minus(quotient(of("ABS", by), Number(360.0)), Number(1e-9)))
        code = Number(3.0 if given.turn > 0 else 2.0)

        def rows(normal: int) -> list[Statement] | None:
            first, second = (minus(POSITION[_AXES[a]], POLE[a]) for a in IN_PLANE[normal])
            to = given.polar["PA"] if by is None else plus(of("ATAN", second, first), by)
            before = Line(block.place, (), ((radius, of("LEN", first, second)), (angle, to)))
            ends = self.polar_ends(block, given, normal)
            if ends is None:
                return None
            return [before, *self._arc(block, given, ends, code, POLE, given.turn, turns, normal)]

        return self.by_plane(block, rows)


OUT_OF_PLANE = "out of the pole's plane, or in it beside polar coordinates, belongs to no such move"
_FAST_ARC = "an arc at rapid (FMAX) is not read; write its F"
