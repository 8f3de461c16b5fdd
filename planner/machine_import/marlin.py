"""Marlin's settings, as M503 prints them: M203 velocities [mm/s], M201 accelerations of the axes and M204 along the path [mm/s2],
M593 input shaping. In inches after G20. Marlin's "jerk" (M205 X Y Z) is a jump of velocity at a corner, not a jerk. RepRapFirmware's
config.g has the same commands, but velocities in mm/min; it is known by M566 or M584, which Marlin has not."""

from __future__ import annotations

import re

from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.machine import LINEAR_AXES
from planner.machine_import.numbers import positive
from planner.machine_import.settings import ControlSettings, FoundMode, Sourced, least

_COMMAND = re.compile(r"^(?:\s*echo:)?\s*([GM]\d+)\b([^;\n]*)", re.MULTILINE)
_WORD = re.compile(r"([A-Z])\s*([-+]?\d*\.?\d+)")
_DAMPING = 0.15  # [-], Marlin's own where M593 has no D


def recognised(text: str) -> bool:
    """Whether a text holds the settings that M503 prints."""
    return re.search(r"^(?:\s*echo:)?\s*M20[13]\s+X", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings that M503 printed. Raises InputError for numbers that cannot be used."""
    unit = 1.0
    given: dict[str, dict[str, float]] = {}
    lines: dict[str, int] = {}
    shapers: list[dict[str, float]] = []
    for command in _COMMAND.finditer(text):
        code, line = command.group(1), text.count("\n", 0, command.start(1)) + 1
        words = {letter: float(value) for letter, value in _WORD.findall(command.group(2))}
        if code in ("G20", "G21"):
            unit = MM_PER_INCH if code == "G20" else 1.0
        elif code == "M593":
            shapers.append(words)
        else:
            given[code] = {**given.get(code, {}), **words}
            lines[code] = line

    def length(code: str, letter: str) -> Sourced | None:
        if letter not in given.get(code, {}):
            return None
        place = f"{code} {letter}"
        return Sourced(positive(str(given[code][letter]), place, source, lines[code]) * unit, place)

    along = least(length("M204", "T"), length("M204", "P"))
    per_minute = bool(given.keys() & {"M566", "M584"})
    velocity, acceleration = {}, {}
    for letter in LINEAR_AXES:
        speed, own = length("M203", letter.upper()), length("M201", letter.upper())
        if speed:
            velocity[letter] = Sourced(speed.value / SECONDS_PER_MINUTE, speed.place) if per_minute else speed
        if own:
            acceleration[letter] = least(own, along) or own
    notes = ["M203 is in mm/min: M566 and M584 are commands of RepRapFirmware"] if per_minute else []
    if given.get("M205", {}).keys() & {"X", "Y"}:
        notes.append("M205 X Y Z are jumps of velocity at corners: here velocity never jumps")
    if "J" in given.get("M205", {}):
        notes.append(
            "M205 J, a junction deviation, sets corner speeds in Marlin and is no tolerance: Marlin stays on the path"
        )
    modes = {words["F"]: words.get("D", _DAMPING) for words in shapers if words.get("F", 0.0) > 0}
    return ControlSettings(
        control="Marlin",
        velocity=velocity,
        acceleration=acceleration,
        modes=tuple(FoundMode(frequency, damping, "M593") for frequency, damping in modes.items()),
        notes=tuple(notes),
    )
