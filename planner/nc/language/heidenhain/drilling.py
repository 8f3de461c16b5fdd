"""Drilling cycles: 200 drilling, 201 reaming, 240 centring to a depth; and cycle 1, pecking
on older controls, for which the tool stands at the clearance above the surface.

    Q200 set-up clearance    Q201 depth (its sign does not matter: into the part)    Q202 infeed    Q206 feed    Q208 feed out (201)
    Q203 surface    Q204 second set-up clearance    Q210 dwell above    Q211 dwell at the bottom

The tool goes to the clearance above the surface at rapid speed, drills one infeed after the other with a retract to the clearance
between them, stands at the bottom, and goes to the larger of the two clearances. Back in the hole it goes at rapid speed to the
clearance above the depth already drilled, but not deeper than 0.2 mm above it.

Patterns of places at which the cycle that was defined last is cut: 220 on a circle, 221 on lines. They act where they are defined.

220    Q216 Q217 centre, Q244 diameter, Q245 first angle, Q246 last angle, Q247 step (0: from the angles), Q241 how many
221    Q225 Q226 first place, Q237 Q238 apart, Q242 columns, Q243 lines, Q224 turned by; every second line backwards

Q200, Q203, Q204 replace those of the cycle; Q301 0: between the places at Q200, 1: at Q204 above the surface
"""

from __future__ import annotations

from planner.nc.language.heidenhain.moves import Moves
from planner.nc.language.heidenhain.text import ConversationalBlock, X, Y, Z, looked_up, own
from planner.nc.language.heidenhain.text import parameter as q
from planner.nc.language.tree import (
    ONE,
    TWO,
    ZERO,
    Expression,
    If,
    Line,
    Loop,
    Number,
    Parameter,
    Statement,
    assign,
    op,
    row,
)

PATTERNS = (220, 221)  # cycles
# A full turn [degrees], and what a computed whole number may be short of.
_TURN, _WHOLE = Number(360.0), Number(1e-9)
Steps = list[tuple[Parameter, Expression]]


def pattern(block: ConversationalBlock, cycle: int, called: list[Statement]) -> list[Statement]:
    """Moves to the places with the statements of the cycle behind each."""
    place, n, second = block.place, own("hole"), own("second")
    high = q(203) + op("MAX", q(204), q(200))
    count = q(241) if cycle == 220 else q(242) * q(243)
    steps, ends = _circle(n) if cycle == 220 else _lines(n)
    x, y = own("px"), own("py")
    turn: list[Statement] = [
        *(assign(place, step) for step in steps),
        assign(place, (x, ends[0]), (y, ends[1])),
        row(place, ("G", ZERO), ("X", x), ("Y", y), assigned=((X, x), (Y, y))),
        *called,
        assign(place, (n, n + ONE)),
    ]
    up = If(place, ((op("LT", Z, high), [row(place, ("G", ZERO), ("Z", high), assigned=((Z, high),))]),), [])
    return [
        up,
        assign(place, (n, ZERO), (second, q(204))),
        If(place, ((op("EQ", q(301), ZERO), [assign(place, (q(204), ZERO))]),), []),
        Loop(place, "while", f"pattern {place.at}", op("LT", n, count), turn),
        assign(place, (q(204), second)),
        up,
        looked_up(block),
    ]


def _circle(n: Expression) -> tuple[Steps, tuple[Expression, Expression]]:
    step, angle = own("step"), own("angle")
    opening, half = q(246) - q(245), q(244) / TWO
    parts = op("MAX", q(241) - ONE + op("GE", op("ABS", opening), _TURN), ONE)
    steps: Steps = [(step, q(247) + op("EQ", q(247), ZERO) * (opening / parts)), (angle, q(245) + n * step)]
    return steps, (q(216) + half * op("COS", angle), q(217) + half * op("SIN", angle))


def _lines(n: Expression) -> tuple[Steps, tuple[Expression, Expression]]:
    line, column, odd = own("line"), own("column"), own("odd")
    steps: Steps = [
        (line, op("INT", n / q(242) + _WHOLE)),
        (odd, line - TWO * op("INT", line / TWO + _WHOLE)),
        (column, n - line * q(242)),
        (column, column + odd * (q(242) - ONE - TWO * column)),
    ]
    along, across = column * q(237), line * q(238)
    cosine, sine = op("COS", q(224)), op("SIN", q(224))
    return steps, (q(225) + (along * cosine - across * sine), q(226) + (along * sine + across * cosine))


CYCLES = (1, 200, 201, 240)  # that are read
# Q parameters (module text).
_CLEARANCE, _DEPTH, _INFEED, _SURFACE, _SECOND, _FEED = 200, 201, 202, 203, 204, 206
PECKING = (_CLEARANCE, _DEPTH, _INFEED, 211, _FEED)  # what the lines 1.1 to 1.5 of cycle 1 give
# ... and those of some cycles only.
_FEED_OUT, _DWELL_ABOVE, _DWELL_BELOW = 208, 210, 211
_BEFORE = 0.2  # mm above the depth already drilled, where feed begins again


def drilled(block: ConversationalBlock, cycle: int, moves: Moves, unit: float) -> list[Statement]:
    """A cycle at the present place; the parameters have been assigned before.

    unit : mm per unit of the program
    """
    place, surface, clear = block.place, q(_SURFACE), q(_SURFACE) + q(_CLEARANCE)
    depth, done, infeed = op("ABS", q(_DEPTH)), own("done"), own("infeed")
    feed = moves.scaled(q(_FEED))

    def go(z: Expression, how: Expression | None = None) -> Line:
        fed = [("G", ZERO)] if how is None else [("G", ONE), ("F", how)]
        return row(place, *fed, ("Z", z), assigned=((Z, z),))

    def dwell(seconds: int) -> Statement:
        return If(place, ((op("GT", q(seconds), ZERO), [row(place, ("G", 4.0), ("P", q(seconds)))]),), [])

    found: list[Statement] = [go(clear)]
    if cycle == 1:
        found = [assign(place, (surface, Z - q(_CLEARANCE)), (q(_SECOND), ZERO))]
    if cycle in (201, 240):
        slowly = go(clear, moves.scaled(q(_FEED_OUT)))
        out = If(place, ((op("GT", q(_FEED_OUT), ZERO), [slowly]),), [go(clear)])
        found += [go(surface - depth, feed), dwell(_DWELL_BELOW), out if cycle == 201 else go(clear)]
    else:
        between = [go(clear), dwell(_DWELL_ABOVE), go(surface + Number(_BEFORE / unit) - done)]
        turn: list[Statement] = [
            assign(place, (done, op("MIN", done + infeed, depth))),
            go(surface - done, feed),
            If(place, ((op("GE", done, depth), [dwell(_DWELL_BELOW), go(clear)]),), between),
        ]
        found += [
            assign(place, (done, ZERO), (infeed, q(_INFEED))),
            If(place, ((op("LE", infeed, ZERO), [assign(place, (infeed, depth))]),), []),
            Loop(place, "do", f"holes {place.at}", op("LT", done, depth), turn),
        ]
    high = op("GT", q(_SECOND), q(_CLEARANCE))
    return [*found, If(place, ((high, [go(surface + q(_SECOND))]),), [])]
