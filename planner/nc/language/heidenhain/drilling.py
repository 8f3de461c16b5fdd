"""Drilling cycles: 200 drilling, 201 reaming, 240 centring to a depth; and cycle 1, pecking
on older controls, for which the tool stands at the clearance above the surface.

    Q200 set-up clearance    Q201 depth (its sign does not matter: into the part)    Q202 infeed    Q206 feed    Q208 feed out (201)
    Q203 surface    Q204 second set-up clearance    Q210 dwell above    Q211 dwell at the bottom

The tool goes to the clearance above the surface at rapid speed, drills one infeed after the other with a retract to the clearance
between them, stands at the bottom, and goes to the larger of the two clearances. Back in the hole it goes at rapid speed to the
clearance above the depth already drilled, but not deeper than 0.2 mm above it.
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import Z, word
from planner.nc.language.heidenhain.moves import Moves
from planner.nc.language.heidenhain.text import ConversationalBlock, minus, of, own, parameter, plus
from planner.nc.language.tree import ONE, ZERO, Expression, If, Line, Loop, Number, Statement

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
    at, place = block.place.at, block.place
    surface, clear = parameter(_SURFACE), plus(parameter(_SURFACE), parameter(_CLEARANCE))
    depth, done = of("ABS", parameter(_DEPTH)), own("done")
    feed = moves.scaled(parameter(_FEED))

    def go(z: Expression, how: Expression | None = None) -> Line:
        words = [word("G", at, ZERO if how is None else ONE)]
        words += [word("F", at, how)] if how is not None else []
        return Line(place, (*words, word("Z", at, z)), ((Z, z),))

    def dwell(seconds: int) -> Statement:
        row = Line(place, (word("G", at, Number(4.0)), word("P", at, parameter(seconds))))
        return If(place, ((of("GT", parameter(seconds), ZERO), [row]),), [])

    found: list[Statement] = [go(clear)]
    if cycle == 1:
        found = [Line(place, (), ((surface, minus(Z, parameter(_CLEARANCE))), (parameter(_SECOND), ZERO)))]
    bottom = minus(surface, depth)
    if cycle in (201, 240):
        out = If(
            place,
            ((of("GT", parameter(_FEED_OUT), ZERO), [go(clear, moves.scaled(parameter(_FEED_OUT)))]),),
            [go(clear)],
        )
        found += [go(bottom, feed), dwell(_DWELL_BELOW), out if cycle == 201 else go(clear)]
    else:
        infeed = own("infeed")
        step = of("MIN", plus(done, infeed), depth)
        last = of("GE", done, depth)
        found += [
            Line(place, (), ((done, ZERO), (infeed, parameter(_INFEED)))),
            If(place, ((of("LE", infeed, ZERO), [Line(place, (), ((infeed, depth),))]),), []),
            Loop(
                place,
                "do",
                f"holes {at}",
                of("LT", done, depth),
                [
                    Line(place, (), ((done, step),)),
                    go(minus(surface, done), feed),
                    If(
                        place,
                        ((last, [dwell(_DWELL_BELOW), go(clear)]),),
                        [
                            go(clear),
                            dwell(_DWELL_ABOVE),
                            go(minus(plus(surface, Number(_BEFORE / unit)), done)),
                        ],
                    ),
                ],
            ),
        ]
    second = plus(surface, parameter(_SECOND))
    found.append(If(place, ((of("GT", parameter(_SECOND), parameter(_CLEARANCE)), [go(second)]),), []))
    return found
