"""Patterns of places at which the cycle that was defined last is cut: 220 on a circle, 221 on lines. They act where they are defined.

220    Q216 Q217 centre, Q244 diameter, Q245 first angle, Q246 last angle, Q247 step (0: from the angles), Q241 how many
221    Q225 Q226 first place, Q237 Q238 apart, Q242 columns, Q243 lines, Q224 turned by; every second line backwards

Q200, Q203, Q204 replace those of the cycle; Q301 0: between the places at Q200, 1: at Q204 above the surface
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import X, Y, Z, looked_up, word
from planner.nc.language.heidenhain.text import (
    ConversationalBlock,
    minus,
    of,
    own,
    parameter,
    plus,
    quotient,
    times,
)
from planner.nc.language.tree import ONE, TWO, ZERO, Expression, If, Line, Loop, Named, Number, Statement

PATTERNS = (220, 221)  # cycles
# A full turn [degrees], and what a computed whole number may be short of.
_TURN, _WHOLE = Number(360.0), Number(1e-9)


def pattern(block: ConversationalBlock, cycle: int, called: list[Statement]) -> list[Statement]:
    """Moves to the places with the statements of the cycle behind each."""
    place, n, second = block.place, own("hole"), own("second")
    high = plus(parameter(203), of("MAX", parameter(204), parameter(200)))
    at = place.at
    count = parameter(241) if cycle == 220 else times(parameter(242), parameter(243))
    before, ends = _circle(n) if cycle == 220 else _lines(n)
    x, y = own("px"), own("py")
    turn: list[Statement] = [
        *(Line(place, (), ((name, value),)) for name, value in before),
        Line(place, (), ((x, ends[0]), (y, ends[1]))),
        Line(place, (word("G", at, ZERO), word("X", at, x), word("Y", at, y)), ((X, x), (Y, y))),
        *called,
        Line(place, (), ((n, plus(n, ONE)),)),
    ]
    up = Line(place, (word("G", at, ZERO), word("Z", at, high)), ((Z, high),))
    low = of("EQ", parameter(301), ZERO)
    return [
        If(place, ((of("LT", Z, high), [up]),), []),
        Line(place, (), ((n, ZERO), (second, parameter(204)))),
        If(place, ((low, [Line(place, (), ((parameter(204), ZERO),))]),), []),
        Loop(place, "while", f"pattern {at}", of("LT", n, count), turn),
        Line(place, (), ((parameter(204), second),)),
        If(place, ((of("LT", Z, high), [up]),), []),
        looked_up(block),
    ]


def _circle(n: Expression) -> tuple[list[tuple[Named, Expression]], tuple[Expression, Expression]]:
    step, angle = own("step"), own("angle")
    opening, more = minus(parameter(246), parameter(245)), minus(parameter(241), ONE)
    whole = of("GE", of("ABS", opening), _TURN)
    parts = of("MAX", plus(more, whole), ONE)
    given = of("EQ", parameter(247), ZERO)
    half = quotient(parameter(244), TWO)
    before = [
        (step, plus(parameter(247), times(given, quotient(opening, parts)))),
        (angle, plus(parameter(245), times(n, step))),
    ]
    return before, (
        plus(parameter(216), times(half, of("COS", angle))),
        plus(parameter(217), times(half, of("SIN", angle))),
    )


def _lines(n: Expression) -> tuple[list[tuple[Named, Expression]], tuple[Expression, Expression]]:
    line, column, odd = own("line"), own("column"), own("odd")
    before = [
        (line, of("INT", plus(quotient(n, parameter(242)), _WHOLE))),
        (odd, minus(line, times(TWO, of("INT", plus(quotient(line, TWO), _WHOLE))))),
        (column, minus(n, times(line, parameter(242)))),
        (column, plus(column, times(odd, minus(minus(parameter(242), ONE), times(TWO, column))))),
    ]
    along, across = times(column, parameter(237)), times(line, parameter(238))
    cosine, sine = of("COS", parameter(224)), of("SIN", parameter(224))
    return before, (
        plus(parameter(225), minus(times(along, cosine), times(across, sine))),
        plus(parameter(226), plus(times(along, sine), times(across, cosine))),
    )
