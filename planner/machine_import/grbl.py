"""grbl's settings, as `$$` prints them: $110-$115 largest rates [mm/min], $120-$125 accelerations [mm/s2]."""

from __future__ import annotations

import re

from planner.base.units import SECONDS_PER_MINUTE
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.machine_import.numbers import finite_number, positive
from planner.machine_import.settings import ControlSettings, Sourced

_SETTING = re.compile(r"^\s*(\$\d+)\s*=\s*([^\s(;]+)", re.MULTILINE)
_RATE, _ACCELERATION = 110, 120  # + axis
_JUNCTION_DEVIATION, _REPORTS_IN_INCHES = "$11", "$13"


def recognised(text: str) -> bool:
    """Whether a text holds settings of grbl."""
    return len(_SETTING.findall(text)) >= 2


def settings(text: str, source: str) -> ControlSettings:
    """The settings that `$$` printed. Raises InputError for numbers that cannot be read."""
    given = {
        found.group(1): (found.group(2), text.count("\n", 0, found.start(1)) + 1)
        for found in _SETTING.finditer(text)
    }
    velocity: dict[str, Sourced] = {}
    acceleration: dict[str, Sourced] = {}
    for k, letter in enumerate((*LINEAR_AXES, *ROTARY_AXES)):
        for first, scale, found in (
            (_RATE, 1.0 / SECONDS_PER_MINUTE, velocity),
            (_ACCELERATION, 1.0, acceleration),
        ):
            key = f"${first + k}"
            if key in given:
                value, line = given[key]
                found[letter] = Sourced(positive(value, key, source, line) * scale, key)
    notes = []
    if _JUNCTION_DEVIATION in given:
        value, line = given[_JUNCTION_DEVIATION]
        deviation = finite_number(value, _JUNCTION_DEVIATION, source, line)
        notes.append(
            f"$11, a junction deviation of {deviation:g} mm, sets corner speeds in grbl and is no tolerance: grbl stays on the path"
        )
    return ControlSettings(control="grbl", velocity=velocity, acceleration=acceleration, notes=tuple(notes))
