"""The cycle in force called at a place, and patterns of places.

Patterns of places at which the cycle that was defined last is cut; they act where they are defined. Q200,
Q203, Q204 replace those of the cycle; Q301 0: between the places at Q200, 1: at Q204 above the surface.

    220 on a circle    Q216 Q217 centre, Q244 diameter, Q245 first angle, Q246 last angle, Q247 step (0: from the angles), Q241 how many
    221 on lines       Q225 Q226 first place, Q237 Q238 apart, Q242 columns, Q243 lines, Q224 turned by; every second line backwards
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from planner.nc.language.heidenhain.cycles import CYCLES, parameters
from planner.nc.language.making import Maker, Making, Row, around, go


def _look(making: Making) -> None:
    """Keep where the program stands."""
    making.flush()
    making.shared["_x"], making.shared["_y"], making.shared["_z"] = making.here()


def _called(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
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
    making: Making, place: Callable[[dict[str, float], int], complex], count: float
) -> Iterator[Row]:
    yield from _up(making)
    given, second = parameters(making), making.numbered[204 + 1]
    if given["Q301"] == 0.0:
        making.numbered[204 + 1] = 0.0
    n = 0
    while n < count:
        at = place(given, n)
        making.shared["_x"], making.shared["_y"] = at.real, at.imag
        yield [("G", 0.0), ("X", at.real), ("Y", at.imag)]
        yield from _called(making, given)
        n += 1
    making.numbered[204 + 1] = second
    yield from _up(making)
    _look(making)


def _on_circle(given: Mapping[str, float], n: int) -> complex:
    opening = given["Q246"] - given["Q245"]
    parts = max(given["Q241"] - 1.0 + (abs(opening) >= _TURN), 1.0)
    step = given["Q247"] + (given["Q247"] == 0.0) * (opening / parts)
    angle, half = math.radians(given["Q245"] + n * step), given["Q244"] / 2.0
    return complex(given["Q216"] + half * math.cos(angle), given["Q217"] + half * math.sin(angle))


def _on_lines(given: Mapping[str, float], n: int) -> complex:
    line, column = divmod(n, round(given["Q242"]))
    if line % 2:
        column = round(given["Q242"]) - 1 - column
    along, across, angle = column * given["Q237"], line * given["Q238"], math.radians(given["Q224"])
    x, y = (
        along * math.cos(angle) - across * math.sin(angle),
        along * math.sin(angle) + across * math.cos(angle),
    )
    return complex(given["Q225"] + x, given["Q226"] + y)


PATTERNS = (220, 221)
_TURN = 360.0  # [degrees]


def _places(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
    q = parameters(making)
    if given["cycle"] == 220.0:
        return _pattern(making, _on_circle, q["Q241"])
    return _pattern(making, _on_lines, q["Q242"] * q["Q243"])


MAKERS: dict[str, Maker] = {"cycle in force": _called, "pattern": _places}
