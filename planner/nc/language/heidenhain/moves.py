"""Path functions as rows of words: L, C, CR, CT, LP, CP. Roundings RND and chamfers CHF are made where the rows pass (`corner_moves`).

The position (_x, _y, _z), the pole (_cx, _cy), the last polar coordinates (_pr, _pa) and the direction of the last move (_dx, _dy) are
variables of the running program, since coordinates may be computed and incremental. Rows carry absolute coordinates.

CT's centre lies on the normal n of the direction at the start, at

    radius = |v|^2 / (2 n v),      v from start to end; positive to the left, where the arc turns counter-clockwise.

Behind CR, whose centre is not computed here, the direction is that of the moves that were executed (`makers.tangent_arc`).
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import (
    DIRECTION,
    POLAR,
    POLE,
    POSITION,
    Items,
    X,
    Y,
    absolute,
    word,
)
from planner.nc.language.heidenhain.text import (
    ConversationalBlock,
    minus,
    of,
    own,
    plus,
    quotient,
    times,
)
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


class Moves:
    """Rows of path functions.

    feed_scale : what F is multiplied with: 1, or 0.1 in inch programs, where F is in tenths of an inch per minute
    """

    def __init__(self, feed_scale: float):
        self.feed_scale = feed_scale
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
        return [Line(block.place, tuple(words), tuple(assigned))] if ends else []

    def circle(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """C: an arc about the pole."""
        if not given.turn:
            raise block.fault("an arc needs its direction: DR+ or DR-")
        return [self._arc(block, given, ends, Number(3.0 if given.turn > 0 else 2.0), POLE, given.turn)]

    def _arc(
        self,
        block: ConversationalBlock,
        given: Items,
        ends: dict[str, Expression],
        code: Expression,
        centre: tuple[Expression, Expression],
        turn: int | Expression,
        turns: Expression | None = None,
    ) -> Line:
        at = block.place.at
        words = [word("G", at, code), *self.feed_words(block, given)]
        words += [word(axis, at, end) for axis, end in ends.items()]
        words += [word("I", at, minus(centre[0], X)), word("J", at, minus(centre[1], Y))]
        if turns is not None:
            words.append(word("P", at, turns))
        out = minus(ends.get("X", X), centre[0]), minus(ends.get("Y", Y), centre[1])
        sign = Number(float(turn)) if isinstance(turn, int) else turn
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        assigned += [(DIRECTION[0], of(NEGATIVE, times(sign, out[1]))), (DIRECTION[1], times(sign, out[0]))]
        return Line(block.place, tuple(words), tuple(assigned))

    def radius_arc(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """CR: an arc of a given radius."""
        if given.radius is None or not given.turn:
            raise block.fault("CR needs R and its direction, DR+ or DR-")
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
            first, second, third, self._arc(block, given, ends, plus(TWO, left), centre, turn)
        ]  # fmt: skip
        words = [(chr(one.letter), one.value) for one in self.feed_words(block, given)]
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        looked: list[Statement] = [
            MadeRows(block.place, "tangent arc", (*ends.items(), *words)), Line(block.place, (), tuple(assigned))
        ]  # fmt: skip
        return [If(block.place, ((of("EQ", length, ZERO), looked),), known)]

    def polar_ends(
        self, block: ConversationalBlock, given: Items
    ) -> tuple[list[Statement], dict[str, Expression]]:
        """LP: the statement that finds the polar coordinates, and the coordinates from them."""
        radius, angle = POLAR
        change: list[tuple[Parameter, Expression]] = []
        for name, variable in (("PR", radius), ("PA", angle)):
            if name in given.polar:
                change.append((variable, given.polar[name]))
            elif "I" + name in given.polar:
                change.append((variable, plus(variable, given.polar["I" + name])))
        ends: dict[str, Expression] = {
            "X": plus(POLE[0], times(radius, of("COS", angle))),
            "Y": plus(POLE[1], times(radius, of("SIN", angle))),
        }
        if "Z" in given.axes:
            ends["Z"] = absolute("Z", given.axes["Z"])
        return [Line(block.place, (), tuple(change))] if change else [], ends

    def polar_arc(self, block: ConversationalBlock, given: Items) -> list[Statement]:
        """CP: an arc or a helix about the pole to a polar angle, or by an angle of any number of turns."""
        if not given.turn:
            raise block.fault("an arc needs its direction: DR+ or DR-")
        radius, angle = POLAR
        now = of("ATAN", minus(Y, POLE[1]), minus(X, POLE[0]))
        turns: Expression | None = None
        if "IPA" in given.polar:
            to = plus(now, given.polar["IPA"])
            turns = of("UP", minus(quotient(of("ABS", given.polar["IPA"]), Number(360.0)), Number(1e-9)))
        elif "PA" in given.polar:
            to = given.polar["PA"]
        else:
            raise block.fault("CP needs PA or IPA")
        before = Line(
            block.place, (), ((radius, of("LEN", minus(X, POLE[0]), minus(Y, POLE[1]))), (angle, to))
        )
        _, ends = self.polar_ends(block, Items(axes={k: v for k, v in given.axes.items() if k == "Z"}))
        code = Number(3.0 if given.turn > 0 else 2.0)
        return [before, self._arc(block, given, ends, code, POLE, given.turn, turns)]
