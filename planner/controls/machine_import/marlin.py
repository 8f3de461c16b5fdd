"""Marlin's settings, as M503 prints them: M203 velocities [mm/s], M201 accelerations of the axes and M204 along the path [mm/s2],
M205 the law of corners, M593 input shaping. In inches after G20. RepRapFirmware's config.g has the same commands, but velocities in
mm/min, M566 for M205 and M208 for the travel; it is known by M566 or M584, which Marlin has not.

M204 P is for moves that print, T for the others; S, of older firmware, is for both, and T beside S is for filament alone (Marlin 1.0,
Marlin_main.cpp: "S normal moves T filament only moves"). Corners have a junction deviation (M205 J), or a jump of velocity by axis that
they may have (M205 X Y Z, M566), which Marlin calls jerk.
"""

from __future__ import annotations

import re

from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.controls.machine_import.numbers import finite_number, positive
from planner.controls.machine_import.settings import ControlSettings, FoundMode, Sourced, least, travel_note
from planner.machine import LINEAR_AXES

_COMMAND = re.compile(r"^(?:\s*echo:)?\s*([GM]\d+)\b([^;\n]*)", re.MULTILINE)
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_RANGE = re.compile(r"([A-Z])\s*([-+]?[\d.]+):([-+]?[\d.]+)")
_DAMPING = 0.15  # [-], Marlin's own where M593 has no D
_LIMITS, _JUMPS = "M208", ("M566", "M205")


def recognised(text: str) -> bool:
    """Whether a text holds the settings that M503 prints."""
    return re.search(r"^(?:\s*echo:)?\s*M20[13]\s+X", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings that M503 printed. Raises InputError for numbers that cannot be used."""
    return _Commands(text, source).settings()


class _Commands:
    """The commands of a text, each word with the last value that it was given, in mm."""

    def __init__(self, text: str, source: str):
        self.source, self.unit = source, 1.0
        self.given: dict[str, dict[str, float]] = {}
        self.lines: dict[str, int] = {}
        self.shapers: list[dict[str, float]] = []
        self.travel: dict[str, tuple[float | None, float | None]] = {}
        for command in _COMMAND.finditer(text):
            code, line = command.group(1), text.count("\n", 0, command.start(1)) + 1
            words = {letter: float(value) for letter, value in _WORD.findall(command.group(2))}
            if code in ("G20", "G21"):
                self.unit = MM_PER_INCH if code == "G20" else 1.0
            elif code == "M593":
                self.shapers.append(words)
            elif code == _LIMITS:
                self._range(command.group(2), words)
            else:
                self.given[code] = {**self.given.get(code, {}), **words}
                self.lines[code] = line
        self.reprap = bool(self.given.keys() & {"M566", "M584"})

    def _range(self, text: str, words: dict[str, float]) -> None:
        """M208 X0:200, or X200, which is the upper end, and the lower one with S1."""
        for letter, low, high in _RANGE.findall(text):
            self.travel[letter.lower()] = (
                finite_number(low, _LIMITS, self.source),
                finite_number(high, _LIMITS, self.source),
            )
            words.pop(letter, None)
        for letter in LINEAR_AXES:
            if letter.upper() in words:
                low_end, high_end = self.travel.get(letter, (None, None))
                found = words[letter.upper()]
                self.travel[letter] = (found, high_end) if words.get("S") == 1 else (low_end, found)

    def length(self, code: str, letter: str) -> Sourced | None:
        """A word of a command in mm; None where it has none. Raises InputError if it is not above 0."""
        if letter not in self.given.get(code, {}):
            return None
        place = f"{code} {letter}"
        value = positive(str(self.given[code][letter]), place, self.source, self.lines[code])
        return Sourced(value * self.unit, place)

    def settings(self) -> ControlSettings:
        """Everything that a machine file takes, and notes on what it does not."""
        both = self.length("M204", "S")
        printing = self.length("M204", "P") or both
        travelling = both if both and "P" not in self.given["M204"] else self.length("M204", "T")
        along = least(travelling, printing)
        per_second = 1.0 / SECONDS_PER_MINUTE if self.reprap else 1.0
        velocity, acceleration = {}, {}
        for letter in LINEAR_AXES:
            speed, own = self.length("M203", letter.upper()), self.length("M201", letter.upper())
            if speed:
                velocity[letter] = Sourced(speed.value * per_second, speed.place)
            if own:
                acceleration[letter] = least(own, along) or own
        deviation = None if self.reprap else self.length("M205", "J")
        modes = {words["F"]: words.get("D", _DAMPING) for words in self.shapers if words.get("F", 0.0) > 0}
        return ControlSettings(
            control="RepRapFirmware" if self.reprap else "Marlin",
            velocity=velocity,
            acceleration=acceleration,
            law={"acceleration": along, "junction_deviation": deviation},
            corner_jump={} if deviation else self._jumps(per_second),
            modes=tuple(FoundMode(frequency, damping, "M593") for frequency, damping in modes.items()),
            notes=tuple(self._notes(printing, travelling)),
        )

    def _jumps(self, per_second: float) -> dict[str, Sourced]:
        """The jump of velocity by axis [mm/s] that a corner may have; y has x's where M205 does not say it."""
        code = next((code for code in _JUMPS if code in self.given), "")
        found = {letter: self.length(code, letter.upper()) for letter in LINEAR_AXES}
        found["y"] = found["y"] or found["x"]
        return {
            letter: Sourced(jump.value * per_second, jump.place) for letter, jump in found.items() if jump
        }

    def _notes(self, printing: Sourced | None, travelling: Sourced | None) -> list[str]:
        said = ["M203 is in mm/min: M566 and M584 are commands of RepRapFirmware"] if self.reprap else []
        if printing and travelling and printing.value != travelling.value:
            said.append(
                f"{printing.place} {printing.value:g} and {travelling.place} {travelling.value:g} mm/s2 are for moves that print and "
                "for the others: the smaller one is taken for both"
            )
        if {"E"} & (self.given.get("M203", {}).keys() | self.given.get("M201", {}).keys()):
            said.append(
                "limits of the extruder, E of M203 and M201, are left out: a table [axes.e] takes them"
            )
        return [one for one in (*said, travel_note(self.travel)) if one]
