"""Cycles of conversational programs, whose rows are made while the program runs.

    200, 201, 240            drilling, reaming, centring: Q202 infeed, Q206 feed, Q208 feed out (201), Q210 dwell above. Back in the
                             hole it goes at rapid speed to 0.2 mm above the depth already drilled
    1 pecking                of older controls, for which the tool stands at the clearance above the surface
    202 boring               Q208 feed out, Q214 direction in which the tool leaves the wall by 0.2 mm
    203, 205 pecking         Q202 infeed, less by Q212 each time but at least Q205; Q256 retract to break the chip, Q208 feed out;
                             203: Q213 breaks of the chip before a retract; 205: Q257 depth between breaks,
                             Q258 and Q259 how far above the ground rapid speed ends
    206, 207, 209 tapping    at Q206; with the lead Q239; breaking the chip each Q257: back by Q256 leads (0: out), out by Q403
    208 bore milling         Q335 diameter, Q334 infeed per turn
    251 rectangular pocket   Q218 Q219 sides, Q220 corners, Q224 turned by, Q367 where the tool stands in it
    252 circular pocket      Q223 diameter
    253 slot                 Q218 length, Q219 width, Q374 turned by, Q367 where the tool stands in it
    254 slot on a circle     Q219 width, Q375 diameter, Q216 Q217 centre, Q376 start, Q248 opening, Q377 slots every Q378
        Q215 0 all, 1 roughing, 2 finishing; Q368 Q369 allowances; Q202 infeed, Q338 for finishing; Q207 Q206
        Q385 feeds; Q351 1 climb, -1 conventional; Q370 times the tool's radius between two paths
    220 on a circle          Q216 Q217 centre, Q244 diameter, Q245 first angle, Q246 last angle, Q247 step or 0, Q241 how many
    221 on lines             Q225 Q226 first place, Q237 Q238 apart, Q242 columns, Q243 lines (to and fro), Q224 turned by

Patterns act where they are defined, on the cycle that was defined last; Q301 0: between the places at Q200, 1:
at Q204 above the surface. In all cycles Q200 clearance, Q201 depth, Q203 surface, Q204 second clearance, Q211 dwell at the bottom.
"""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

from planner.nc.language.making import (
    BREAK,
    Cycle,
    Given,
    HolePlan,
    Making,
    Pecks,
    Row,
    around,
    drilled,
    equal_steps,
    go,
    left,
    milled,
    pecked,
    tapped,
)
from planner.nc.language.milling import ArcSlot, PocketPlan, RoundedRectangle, pocket_rows
from planner.nc.language.rows import require

_FIRST, _LAST = 200, 403  # Q parameters of cycles
_FEEDS = (206, 207, 208, 385)  # that inch programs give in tenths of an inch per minute
_AWAY = {1: (-1, 0), 2: (0, -1), 3: (1, 0), 4: (0, 1)}  # directions of Q214
_AWAY_BY = 0.2  # mm
_OVERLAP = 1.0  # of the tool's radius between two paths, where Q370 is 0
# Where the tool stands (Q367), in half sides.
_CORNERS = {0: 0j, 1: -1 - 1j, 2: 1 - 1j, 3: 1 + 1j, 4: -1 + 1j}
_PLUNGED = (
    "plunging on a helix or to and fro needs the angle of the control's tool table: planned straight down"
)


def _hole(given: Given, what: str = "hole") -> HolePlan:
    top = given["Q203"]
    clear, second = top + given["Q200"], top + max(given["Q200"], given["Q204"])
    return HolePlan(clear, top, top - abs(given["Q201"]), second, given["Q206"], given["Q211"], what)


def parameters(making: Making) -> dict[str, float]:
    """Q parameters of cycles by name, feeds in the program's unit per minute."""
    scale = 1.0 if making.unit == 1.0 else 0.1
    values = enumerate(making.numbered[_FIRST + 1 : _LAST + 2], start=_FIRST)
    return {f"Q{n}": (value or 0.0) * (scale if n in _FEEDS else 1.0) for n, value in values}


def _pecked(making: Making, hole: HolePlan, given: Given, out: float = 0.0, **pecks: Any) -> Iterator[Row]:
    """Cycles 1, 200, 203 and 205: by infeeds, out at a feed or, where it is 0, at rapid speed."""
    gap = BREAK / making.unit
    usual: dict[str, Any] = {"infeed": given["Q202"], "back": given["Q256"] or gap, "ahead": (gap, gap)}
    yield from pecked(hole, Pecks(**usual | pecks))
    yield go(hole.clear, out or None)


def _old_pecking(making: Making, given: Given) -> Iterator[Row]:
    """The tool stands at the clearance above the surface already."""
    making.numbered[203 + 1], making.numbered[204 + 1] = making.shared["_z"] - given["Q200"], 0.0
    return islice(HOLES[200](making, parameters(making)), 1, None)


def _decreasing(making: Making, hole: HolePlan, given: Given, **pecks: Any) -> Iterator[Row]:
    """Cycles 203 and 205."""
    return _pecked(making, hole, given, given["Q208"], less=given["Q212"], least=given["Q205"], **pecks)


def _breaking(making: Making, hole: HolePlan, given: Given) -> Iterator[Row]:
    return _decreasing(making, hole, given, above=given["Q210"], breaks=round(given["Q213"]))


def _pecking(making: Making, hole: HolePlan, given: Given) -> Iterator[Row]:
    require(not given["Q379"], "Q379, a starting point that is drilled already, is not read")
    return _decreasing(making, hole, given, chip=given["Q257"], ahead=(given["Q258"], given["Q259"]))


def _at_once(hole: HolePlan, out: float) -> Iterator[Row]:
    """Cycles 201 and 240: without infeeds, out at a feed or, where it is 0, at rapid speed."""
    yield from drilled(hole)
    yield go(hole.clear, out if out > 0.0 else None)


def _bored(making: Making, given: Given) -> Iterable[Row]:
    hole, (x, y, _) = _hole(given), making.here()
    yield from drilled(hole)
    yield [("M", 5.0)]
    if given["Q214"]:
        if given["Q214"] not in _AWAY:
            raise ValueError(f"Q214 {given['Q214']:g}, the direction of disengaging, is none of 0 to 4")
        dx, dy = (_AWAY_BY / making.unit * way for way in _AWAY[round(given["Q214"])])
        yield [("G", 1.0), ("X", x + dx), ("Y", y + dy)]
    yield go(hole.clear, given["Q208"] or given["Q206"])
    yield from left(hole)
    yield [("G", 0.0), ("X", x), ("Y", y)]


def _tapped(making: Making, hole: HolePlan, given: Given, lead: float | None = None) -> Iterator[Row]:
    speed = making.interpreter.state.spindle.speed
    lead = (given["Q206"] / speed if speed else 0.0) if lead is None else lead
    return tapped(making, hole, lead, speed)


def _tapped_by_breaks(making: Making, hole: HolePlan, given: Given) -> Iterator[Row]:
    lead, speed, depth = given["Q239"], making.interpreter.state.spindle.speed, hole.top - hole.bottom
    count = equal_steps(depth, given["Q257"])
    for k in range(1, count + 1):
        deep = min(k * given["Q257"], depth) if given["Q257"] else depth
        back = given["Q256"] * abs(lead)
        up = hole.clear if k == count or back == 0.0 else min(hole.top - deep + back, hole.clear)
        faster = given["Q403"] if k == count else 0.0
        part = replace(hole, bottom=hole.top - deep)
        yield from tapped(making, part, lead, speed, back=speed * (faster or 1.0), up=up, start=k == 1)


def _milled(making: Making, hole: HolePlan, given: Given) -> Iterator[Row]:
    require(not given["Q342"], "Q342, the diameter of a bore that is there already, is not read")
    yield from milled(making, hole, given["Q335"], given["Q334"], _turning(making, given))
    yield go(hole.clear)


def _drilling(rows: Callable[[Making, HolePlan, Given], Iterator[Row]]) -> Cycle:
    """The cycle of a hole whose rows lead from its clearance and back to it."""

    def cycle(making: Making, given: Given) -> Iterator[Row]:
        hole = _hole(given)
        yield from rows(making, hole, given)
        yield from left(hole)

    return cycle


def _turning(making: Making, given: Given) -> int:
    """Climb milling inside goes round counter-clockwise with M3; a mirror image does not turn it round."""
    if given["Q351"] not in (1.0, -1.0, 0.0):
        raise ValueError(f"Q351 {given['Q351']:g} is none of 1 (climb) and -1 (conventional)")
    turn = -1 if given["Q351"] < 0.0 else 1
    if making.interpreter.state.spindle.turning < 0:
        turn = -turn
    return -turn if making.travel.mirrored else turn


def _plan(making: Making, given: Given) -> PocketPlan:
    kind, radius = round(given["Q215"]), making.tool_radius()
    require(kind in (0, 1, 2), f"Q215 {given['Q215']:g} is none of 0 (all), 1 (roughing) and 2 (finishing)")
    if given["Q366"]:
        making.assume(_PLUNGED)
    making.assume("pockets: passes and allowances are those of the cycle, the single paths this reader's own")
    return PocketPlan(
        depth=_hole(given, "pocket"),
        radius=radius,
        infeed=given["Q202"],
        step=(given["Q370"] or _OVERLAP) * radius,
        feed=given["Q207"],
        plunge_feed=given["Q206"],
        finish_feed=(given["Q385"] or given["Q207"]),
        turning=_turning(making, given),
        side=given["Q368"],
        floor=given["Q369"],
        rough=kind in (0, 1),
        walls=kind != 1 and given["Q368"] > 0.0,
        base=kind != 1 and given["Q369"] > 0.0,
        finish_infeed=given["Q338"],
    )


def _place(making: Making, given: Given, half: complex, angle: float, names: dict[int, complex]) -> complex:
    """The middle of a pocket whose half sides are given, from where the tool stands in it."""
    stands = names.get(round(given["Q367"]))
    if stands is None:
        raise ValueError(f"Q367 {given['Q367']:g}, where the tool stands in the pocket, is not read")
    x, y, _ = making.here()
    inside = complex(stands.real * half.real, stands.imag * half.imag)
    return complex(x, y) - inside * cmath.rect(1.0, math.radians(angle))


def _rectangle(making: Making, given: Given) -> Iterable[Row]:
    a, b = given["Q218"] / 2.0, given["Q219"] / 2.0
    require(min(a, b) > 0.0, "Q218 and Q219, the sides of the pocket, are to be above 0")
    corner = max(given["Q220"], making.tool_radius())
    require(given["Q220"] <= min(a, b), "Q220, the radius of the corners, is more than half a side")
    shape, angle = RoundedRectangle(a, b, min(corner, a, b)), given["Q224"]
    at = _place(making, given, complex(a, b), angle, _CORNERS)
    return pocket_rows(shape, _plan(making, given), at, angle)


def _circle(making: Making, given: Given) -> Iterable[Row]:
    size = given["Q223"] / 2.0
    require(size > 0.0, "Q223, the diameter of the pocket, is to be above 0")
    at = _place(making, given, 0j, 0.0, {0: 0j})
    return pocket_rows(RoundedRectangle(size, size, size), _plan(making, given), at, 0.0)


def _slot(making: Making, given: Given) -> Iterable[Row]:
    a, b = given["Q218"] / 2.0, given["Q219"] / 2.0
    require(0.0 < b <= a, "a slot has a width Q219 above 0 and a length Q218 of at least that")
    ends = {0: 0j, 1: -1 + 0j, 2: complex(b / a - 1.0), 3: complex(1.0 - b / a), 4: 1 + 0j}
    at = _place(making, given, complex(a, b), given["Q374"], ends)
    return pocket_rows(RoundedRectangle(a, b, b), _plan(making, given), at, given["Q374"])


def _slots_on_circle(making: Making, given: Given) -> Iterable[Row]:
    require(not given["Q367"], "Q367 of cycle 254 other than 0 is not read; give the centre as Q216 and Q217")
    radius, b, sweep = given["Q375"] / 2.0, given["Q219"] / 2.0, math.radians(given["Q248"])
    text = "a slot on a circle has a width above 0, below the diameter, and opens below 360 degrees"
    require(0.0 < b < radius and 0.0 < abs(sweep) < 2.0 * math.pi, text)
    shape, at = ArcSlot(radius, b, math.radians(given["Q376"]), sweep), complex(given["Q216"], given["Q217"])
    for k in range(max(1, equal_steps(given["Q377"], 1.0))):
        yield from pocket_rows(shape, _plan(making, given), at, k * given["Q378"])


HOLES: dict[int, Cycle] = {
    200: _drilling(lambda making, hole, given: _pecked(making, hole, given, above=given["Q210"])),
    201: _drilling(lambda making, hole, given: _at_once(hole, given["Q208"])),
    202: _bored,
    203: _drilling(_breaking),
    205: _drilling(_pecking),
    206: _drilling(_tapped),
    207: _drilling(lambda making, hole, given: _tapped(making, hole, given, given["Q239"])),
    208: _drilling(_milled),
    209: _drilling(_tapped_by_breaks),
    240: _drilling(lambda making, hole, given: _at_once(hole, 0.0)),
}
CYCLES: dict[int, Cycle] = {
    **HOLES,
    **{1: _old_pecking, 251: _rectangle, 252: _circle, 253: _slot, 254: _slots_on_circle},
}


def _look(making: Making) -> None:
    """Keep where the program stands."""
    making.flush()
    making.shared["_x"], making.shared["_y"], making.shared["_z"] = making.here()


def called(making: Making, given: Given) -> Iterator[Row]:
    """The cycle in force at the present place, and the feed as it was before."""
    cycle = round(making.shared["_cycle"])
    if cycle not in CYCLES:
        text = "message: a cycle is called before it is defined: nothing is drilled"
        making.interpreter.findings.note(text, making.place.line)
        return
    yield from around(making, CYCLES[cycle](making, parameters(making)), feed=True)
    _look(making)


def _up(making: Making) -> Iterator[Row]:
    """To the height between the places of a pattern, if the tool is below it."""
    given = parameters(making)
    high = given["Q203"] + max(given["Q204"], given["Q200"])
    if making.shared["_z"] < high:
        yield go(high)


def _pattern(
    making: Making, place: Callable[[Given, int], complex], count: Callable[[Given], float]
) -> Iterator[Row]:
    yield from _up(making)
    given, second = parameters(making), making.numbered[204 + 1]
    if given["Q301"] == 0.0:
        making.numbered[204 + 1] = 0.0
    for n in range(math.ceil(count(given))):
        at = place(given, n)
        making.shared["_x"], making.shared["_y"] = at.real, at.imag
        yield [("G", 0.0), ("X", at.real), ("Y", at.imag)]
        yield from called(making, given)
    making.numbered[204 + 1] = second
    yield from _up(making)
    _look(making)


def _on_circle(given: Given, n: int) -> complex:
    opening = given["Q246"] - given["Q245"]
    parts = max(given["Q241"] - 1.0 + (abs(opening) >= 360.0), 1.0)
    step = given["Q247"] or opening / parts
    angle, half = math.radians(given["Q245"] + n * step), given["Q244"] / 2.0
    return complex(given["Q216"] + half * math.cos(angle), given["Q217"] + half * math.sin(angle))


def _on_lines(given: Given, n: int) -> complex:
    line, column = divmod(n, round(given["Q242"]))
    if line % 2:
        column = round(given["Q242"]) - 1 - column
    place, angle = complex(column * given["Q237"], line * given["Q238"]), math.radians(given["Q224"])
    return complex(given["Q225"], given["Q226"]) + place * cmath.rect(1.0, angle)


def raised(making: Making, given: Given, *, always: bool = True) -> Iterator[Row]:
    """Up to the height between places, else from below the surface alone, with where the tool is now."""
    _look(making)
    if always or making.shared["_z"] < parameters(making)["Q203"]:
        yield from _up(making)
        _look(making)


freed = partial(raised, always=False)
PATTERNS: dict[int, Cycle] = {
    220: lambda making, given: _pattern(making, _on_circle, lambda q: q["Q241"]),
    221: lambda making, given: _pattern(making, _on_lines, lambda q: q["Q242"] * q["Q243"]),
}
