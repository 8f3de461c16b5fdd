"""Marlin's settings, as M503 prints them: M203 velocities [mm/s], M201 accelerations of the axes and M204
along the path [mm/s2], M205 the law of corners, M593 input shaping. In inches after G20. RepRapFirmware's
config.g has the same commands, but velocities in mm/min, M566 for M205 and M208 for the travel; it is known
by M566 or M584, which Marlin has not.

M204 P is for moves that print, T for the others; S, of older firmware, is for both, and T beside S is for
filament alone (Marlin 1.0, Marlin_main.cpp: "S normal moves T filament only moves"). Corners have a junction
deviation (M205 J), or a jump of velocity by axis that they may have (M205 X Y Z, M566), which Marlin calls
jerk.
"""

import re

from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.controls.machine_import.settings import (
    ControlSettings,
    FoundMode,
    Setting,
    Settings,
    Sourced,
    least,
)
from planner.machine import LINEAR_AXES

_COMMAND = re.compile(r"^(?:\s*echo:)?\s*([GM]\d+)\b([^;\n]*)", re.MULTILINE)
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_RANGE = re.compile(r"([A-Z])\s*([-+]?[\d.]+):([-+]?[\d.]+)")
# What M211 prints beside M503: the ends, where they are in force.
_ENDS = re.compile(r"soft endstops:\s*(?:on|1)\b.*?min:(.*?)max:([^\n]*)", re.IGNORECASE | re.DOTALL)
_LETTERS = "".join(LINEAR_AXES)
_DAMPING = 0.15  # [-], Marlin's own where M593 has no D


def recognised(text: str) -> bool:
    """Whether a text holds the settings that M503 prints."""
    return re.search(r"^(?:\s*echo:)?\s*M20[13]\s+X", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings that M503 printed. Raises InputError for numbers that cannot be used."""
    given, travel, unit = Settings("{table} {key}"), Settings("M208"), 1.0
    modes: dict[float, float] = {}
    ends: list[tuple[str, str, str]] = []
    for command in _COMMAND.finditer(text):
        code, said = command.groups()
        line = text.count("\n", 0, command.start(1)) + 1
        words = dict(_WORD.findall(said))
        if code in ("G20", "G21"):
            unit = MM_PER_INCH if code == "G20" else 1.0
        elif code == "M593":
            if float(words.get("F", 0.0)) > 0:
                modes[float(words["F"])] = float(words.get("D", _DAMPING))
        elif code == "M208":
            ends += _ends(said, words)
        else:
            for letter, number in words.items():
                given.add(code, letter, Setting(number, source, line))
    if found := _ENDS.search(text):
        for end, said in zip(("low", "high"), found.groups(), strict=True):
            ends += [(letter, end, number) for letter, number in _WORD.findall(said)]
    for letter, end, number in ends:
        travel.add(letter.lower(), end, Setting(number, source))
        travel.names += [letter.lower()]
    given.counts_last()
    travel.counts_last()
    return _settings(given, unit, travel, tuple(FoundMode(*mode, "M593") for mode in modes.items()))


def _ends(said: str, words: dict[str, str]) -> list[tuple[str, str, str]]:
    """Axis, end and number of M208 X0:200, or X200, which is the upper end, and the lower one with S1."""
    ranges = _RANGE.findall(said)
    end = "low" if float(words.get("S", 0.0)) == 1 else "high"
    named = {letter for letter, *_ in ranges}
    both = [(c, *one) for c, *two in ranges for one in zip(("low", "high"), two, strict=True)]
    return both + [(c, end, words[c]) for c in _LETTERS.upper() if c in words and c not in named]


def _settings(
    given: Settings, unit: float, travel: Settings, modes: tuple[FoundMode, ...]
) -> ControlSettings:
    """Everything that a machine file takes, and notes on what it does not."""
    reprap = given.has("M566") or given.has("M584")
    speed = unit / SECONDS_PER_MINUTE if reprap else unit
    both = given.positive("M204", "S", unit)
    printing = given.positive("M204", "P", unit) or both
    alone = both and not given.text("M204", "P")
    travelling = both if alone else given.positive("M204", "T", unit)
    along = least(travelling, printing)
    deviation = None if reprap else given.positive("M205", "J", unit)
    jumps = dict(given.limits(_LETTERS, "{letter}", speed, table="M566" if given.has("M566") else "M205"))
    if "x" in jumps:
        jumps = {"x": jumps["x"], "y": jumps.get("y", jumps["x"]), **jumps}
    acceleration = given.limits(_LETTERS, "{letter}", unit, table="M201")
    return ControlSettings(
        control="RepRapFirmware" if reprap else "Marlin",
        velocity=dict(given.limits(_LETTERS, "{letter}", speed, table="M203")),
        acceleration={letter: least(own, along) or own for letter, own in acceleration},
        law={"acceleration": along, "junction_deviation": deviation},
        corner_jump={} if deviation else jumps,
        modes=modes,
        travel={c: (travel.number(c, "low"), travel.number(c, "high")) for c in dict.fromkeys(travel.names)},
        notes=tuple(_notes(given, reprap, printing, travelling)),
    )


def _notes(given: Settings, reprap: bool, printing: Sourced | None, travelling: Sourced | None) -> list[str]:
    said = ["M203 is in mm/min: M566 and M584 are commands of RepRapFirmware"] if reprap else []
    if printing and travelling and printing.value != travelling.value:
        said.append(
            f"{printing.place} {printing.value:g} and {travelling.place} {travelling.value:g} mm/s2 are for moves that print and "
            "for the others: the smaller one is taken for both"
        )
    if given.text("M203", "E") or given.text("M201", "E"):
        said.append("limits of the extruder, E of M203 and M201, are left out: a table [axes.e] takes them")
    return said
