"""Path functions as rows of words: L, C, CR, CT, LP, CP, and the roundings RND and chamfers CHF between two straight moves.

The position (_x, _y, _z), the pole (_cx, _cy), the last polar coordinates (_pr, _pa) and the direction of the last move (_dx, _dy) are
variables of the running program, since coordinates may be computed and incremental. Rows carry absolute coordinates.

With a = P1 - P0 and b = P2 - P1 before and after the corner P1, the tangent length of a rounding with radius R is R tan(turn / 2), that
of a chamfer its own number; both moves end and begin there. CT's centre lies on the normal n of the direction at the start, at

    radius = |v|^2 / (2 n v),      v from start to end; positive to the left, where the arc turns counter-clockwise.
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import (
    CORNER,
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
    Named,
    Number,
    Parameter,
    SourcePlace,
    Statement,
    Word,
)

STRAIGHT = 1e-9  # turn below which there is nothing to round [sine of the angle]


class Moves:
    """Rows of path functions.

    feed_scale : what F is multiplied with: 1, or 0.1 in inch programs, where F is in tenths of an inch per minute
    """

    def __init__(self, feed_scale: float):
        self.feed_scale = feed_scale
        self.automatic: Expression | None = None  # F of the tool call
        self.cut = False  # a corner was cut off before: the next move names x and y

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
        named = dict(ends)
        if self.cut:
            named = {"X": named.get("X", X), "Y": named.get("Y", Y)} | {
                k: v for k, v in named.items() if k == "Z"
            }
            self.cut = False
        words = [word("G", at, Number(53.0))] if machine else []
        words.append(word("G", at, ZERO if given.fast else ONE))
        words += self.feed_words(block, given)
        words += [word(axis, at, end) for axis, end in named.items()]
        assigned: list[tuple[Parameter, Expression]] = [(POSITION[axis], end) for axis, end in ends.items()]
        if "X" in ends or "Y" in ends:
            assigned += [
                (DIRECTION[0], minus(ends.get("X", X), X)),
                (DIRECTION[1], minus(ends.get("Y", Y), Y)),
            ]
        return [Line(block.place, tuple(words), tuple(assigned))] if named else []

    def circle(
        self, block: ConversationalBlock, given: Items, ends: dict[str, Expression]
    ) -> list[Statement]:
        """C: an arc about the pole."""
        self._no_cut(block)
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
        self._no_cut(block)
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
        self._no_cut(block)
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
        return [first, second, third, self._arc(block, given, ends, plus(TWO, left), centre, turn)]

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
        self._no_cut(block)
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

    def cut_corner(
        self,
        first: ConversationalBlock,
        given: Items,
        ends: dict[str, Expression],
        corner: tuple[ConversationalBlock, Expression, bool],
        after: dict[str, Expression],
    ) -> list[Statement]:
        """A straight move, and the rounding or chamfer at its end.

        corner : the block RND or CHF, its number, and True for RND
        after  : where the straight move behind it leads; incremental coordinates count from the corner
        """
        block, number, rounded = corner
        if "Z" in ends or "Z" in after:
            raise block.fault("a rounding or chamfer stands between two moves in x and y")
        a, b = (own("ax"), own("ay")), (own("bx"), own("by"))
        size, turn, cut = own("size"), own("turn"), own("cut")
        p = CORNER
        lines: list[Statement] = [
            Line(first.place, (), ((p[0], ends.get("X", X)), (p[1], ends.get("Y", Y)))),
            Line(first.place, (), ((a[0], minus(p[0], X)), (a[1], minus(p[1], Y)), (X, p[0]), (Y, p[1]))),
            Line(
                block.place,
                (),
                ((b[0], minus(after.get("X", p[0]), p[0])), (b[1], minus(after.get("Y", p[1]), p[1]))),
            ),
            _unit(block.place, a),
            _unit(block.place, b),
            Line(block.place, (), ((turn, minus(times(a[0], b[1]), times(a[1], b[0]))),)),
        ]
        half = of(
            "TAN", quotient(of("ACOS", of("MIN", plus(times(a[0], b[0]), times(a[1], b[1])), ONE)), TWO)
        )
        lines.append(
            Line(block.place, (), ((size, number), (cut, times(number, half) if rounded else number)))
        )
        at = first.place.at
        move = [word("G", at, ZERO if given.fast else ONE), *self.feed_words(first, given)]
        move += [word("X", at, minus(p[0], times(cut, a[0]))), word("Y", at, minus(p[1], times(cut, a[1])))]
        lines.append(Line(first.place, tuple(move)))
        at = block.place.at
        end = [word("X", at, plus(p[0], times(cut, b[0]))), word("Y", at, plus(p[1], times(cut, b[1])))]
        if rounded:
            code = plus(TWO, of("GT", turn, ZERO))
            row = Line(block.place, (word("G", at, code), *end, word("R", at, size)))
            lines.append(If(block.place, ((of("GT", of("ABS", turn), Number(STRAIGHT)), [row]),), []))
        else:
            lines.append(Line(block.place, (word("G", at, ONE), *end)))
        self.cut = True
        return lines

    def _no_cut(self, block: ConversationalBlock) -> None:
        if self.cut:
            raise block.fault("after RND or CHF a straight move is expected; write the tangent points out")


def _unit(place: SourcePlace, vector: tuple[Named, Named]) -> Line:
    """Divide a vector by its length."""
    length = of("LEN", *vector)
    return Line(
        place, (), ((vector[0], quotient(vector[0], length)), (vector[1], quotient(vector[1], length)))
    )
