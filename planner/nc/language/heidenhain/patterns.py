"""Patterns of places at which the cycle that was defined last is cut: 220 on a circle, 221 on lines. They act where they are defined.

220    Q216 Q217 centre, Q244 diameter, Q245 first angle, Q246 last angle, Q247 step (0: from the angles), Q241 how many
221    Q225 Q226 first place, Q237 Q238 apart, Q242 columns, Q243 lines, Q224 turned by; every second line backwards

Q200, Q203, Q204 replace those of the cycle; Q301 0: between the places at Q200, 1: at Q204 above the surface
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import X, Y, Z, looked_up
from planner.nc.language.heidenhain.text import ConversationalBlock, own
from planner.nc.language.heidenhain.text import parameter as q
from planner.nc.language.tree import (
    ONE,
    TWO,
    ZERO,
    Expression,
    If,
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
    steps: Steps = [
        (step, q(247) + op("EQ", q(247), ZERO) * (opening / parts)),
        (angle, q(245) + n * step),
    ]
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
