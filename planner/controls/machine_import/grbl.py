"""grbl's settings, as `$$` prints them: $110-$115 largest rates [mm/min], $120-$125 accelerations [mm/s2], $11 junction deviation [mm],
$130-$135 travel [mm], always in mm ($13 is the unit of reports)."""

from __future__ import annotations

import re

from planner.base.units import SECONDS_PER_MINUTE
from planner.controls.machine_import.numbers import finite_number, positive
from planner.controls.machine_import.settings import ControlSettings, Sourced, travel_note
from planner.machine import LINEAR_AXES, ROTARY_AXES

_SETTING = re.compile(r"^\s*(\$\d+)\s*=\s*([^\s(;]+)", re.MULTILINE)
_RATE, _ACCELERATION, _TRAVEL = 110, 120, 130  # + axis
_JUNCTION_DEVIATION, _LASER = "$11", "$32"


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
    travel = {}
    for k, letter in enumerate((*LINEAR_AXES, *ROTARY_AXES)):
        key = f"${_TRAVEL + k}"
        if key in given and (length := abs(finite_number(given[key][0], key, source, given[key][1]))):
            travel[letter] = (-length, 0.0)  # machine coordinates of grbl end at 0
    law = {}
    if _JUNCTION_DEVIATION in given:
        value, line = given[_JUNCTION_DEVIATION]
        deviation = abs(finite_number(value, _JUNCTION_DEVIATION, source, line))
        law["junction_deviation"] = Sourced(deviation, _JUNCTION_DEVIATION)
    notes = [travel_note(travel)]
    if finite_number(given.get(_LASER, ("0", 0))[0], _LASER, source):
        notes.append("$32, laser mode, is left out: M4 and S words change no times here")
    return ControlSettings(
        control="grbl",
        velocity=velocity,
        acceleration=acceleration,
        law=law,
        notes=tuple(note for note in notes if note),
    )
