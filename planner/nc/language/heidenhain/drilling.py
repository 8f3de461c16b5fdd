"""Drilling cycles: 200 drilling, 201 reaming, 240 centring to a depth; and cycle 1, pecking
on older controls, for which the tool stands at the clearance above the surface.

    Q200 set-up clearance    Q201 depth (its sign does not matter: into the part)    Q202 infeed    Q206 feed    Q208 feed out (201)
    Q203 surface    Q204 second set-up clearance    Q210 dwell above    Q211 dwell at the bottom

The tool goes to the clearance above the surface at rapid speed, drills one infeed after the other with a retract to the clearance
between them, stands at the bottom, and goes to the larger of the two clearances. Back in the hole it goes at rapid speed to the
clearance above the depth already drilled, but not deeper than 0.2 mm above it.
"""

from __future__ import annotations

from planner.nc.language.heidenhain.items import Z
from planner.nc.language.heidenhain.moves import Moves
from planner.nc.language.heidenhain.text import ConversationalBlock, own
from planner.nc.language.heidenhain.text import parameter as q
from planner.nc.language.tree import ONE, ZERO, Expression, If, Line, Loop, Number, Statement, assign, op, row

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
