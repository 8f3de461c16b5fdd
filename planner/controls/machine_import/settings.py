"""Settings of a control as they stand in its text, and what they say about a machine."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from planner.base.errors import InputError

_BEGINS = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class Sourced(NamedTuple):
    """A number and where it stands in the settings, such as "$120" or "[AXIS_X] MAX_ACCELERATION"."""

    value: float
    place: str


Ends = tuple[Sourced | None, Sourced | None]  # the lower and the upper one


class FoundMode(NamedTuple):
    """A vibration mode: frequency [Hz], damping ratio [-], and where it stands."""

    frequency: float
    damping: float
    place: str


@dataclass(frozen=True, kw_only=True)
class ControlSettings:
    """The settings of one control, in mm (rotary axes: degrees) and s; mappings are by axis letter."""

    control: str
    velocity: Mapping[str, Sourced]
    acceleration: Mapping[str, Sourced]
    jerk: Mapping[str, Sourced] = field(default_factory=dict)
    travel: Mapping[str, Ends] = field(default_factory=dict)  # in machine coordinates [mm, deg]
    wrapped: str = ""  # letters of rotary axes whose places are within a turn
    feed_max: Sourced | None = None  # largest feed along the path [mm/s]
    dt: Sourced | None = None  # interpolation period [s]
    tolerance: Sourced | None = None  # of G64 P [mm]
    path_control: str | None = None  # "blend", "exact_path" or "exact_stop", of a start-up code
    inch: bool = False  # whether programs without G20 and G21 are in inches
    lathe: bool = False  # whether it is a lathe whose programs have radii until G7
    # keys of the tables [control] and [kinematics] of a machine file; "type" is a text
    law: Mapping[str, Sourced | None] = field(default_factory=dict)
    kinematics: Mapping[str, Sourced | str] = field(default_factory=dict)
    corner_jump: Mapping[str, Sourced] = field(default_factory=dict)  # of velocity, at a corner [mm/s]
    macros: Mapping[str, str] = field(default_factory=dict)  # lines of commands by their names
    modes: tuple[FoundMode, ...] = ()  # vibration modes that the control suppresses
    notes: tuple[str, ...] = ()  # what has no counterpart in a machine file, one sentence each


class Setting(NamedTuple):
    """The text of one setting and where it stands."""

    text: str
    source: str
    line: int | None = None


class Settings:
    """Settings by table and key. A message names one by `place`; `begins` says whether a number is what a
    text begins with ("3 mm", as C's scanf reads it), not all of it."""

    def __init__(self, place: str = "[{table}] {key}", *, begins: bool = False) -> None:
        self._place, self._begins = place, begins
        self._found: dict[tuple[str, str], list[Setting]] = {}
        self.names: list[str] = []  # of the tables
        self.notes: list[str] = []  # what was left out, one sentence each

    def add(self, table: str, key: str, setting: Setting) -> None:
        """Take in a setting behind those of the same key that are there."""
        self._found.setdefault((table, key), []).append(setting)

    def go_on(self, table: str, key: str, text: str) -> None:
        """Add a line to the last setting of a key."""
        found = self._found[table, key]
        found[-1] = found[-1]._replace(text=f"{found[-1].text}\n{text}")

    def counts_last(self) -> None:
        """Of equal keys keep the last."""
        self._found = {key: found[-1:] for key, found in self._found.items()}

    def take_missing(self, other: Settings) -> None:
        """Take in what another one has and this one has not."""
        self._found = {**other._found, **self._found}
        self.names += [name for name in other.names if name not in self.names]

    def texts(self, table: str, key: str) -> list[str]:
        """The texts of all equal keys."""
        return [found.text for found in self._found.get((table, key), [])]

    def keys(self, table: str) -> list[str]:
        """The keys of a table."""
        return [key for name, key in self._found if name == table]

    def text(self, table: str, key: str) -> str | None:
        """The text of a setting, the first of equal keys; None where it is not set."""
        return next(iter(self.texts(table, key)), None)

    def has(self, table: str) -> bool:
        """Whether a table has settings."""
        return any(name == table for name, _ in self._found)

    def number(self, table: str, key: str, scale: float = 1.0) -> Sourced | None:
        """A setting's number, times `scale`; None where it is not set. Raises InputError if it is none."""
        found = self._found.get((table, key))
        if found is None or not found[0].text:
            return None
        text, source, line = found[0]
        place = self._place.format(table=table, key=key)
        value = leading_number(text) if self._begins else None
        if value is None:
            try:
                value = float(text.strip())
            except ValueError:
                value = math.nan
        if not math.isfinite(value):
            said = f"{place}: a number is needed, found {text.strip()[:40]!r}"
            raise InputError(said, source=source, line=line)
        return Sourced(value * scale, place)

    def positive(self, table: str, key: str, scale: float = 1.0) -> Sourced | None:
        """As `number`, which must be above 0. Raises InputError if it is not."""
        found = self.number(table, key, scale)
        if found is not None and found.value <= 0:
            text, source, line = self._found[table, key][0]
            said = f"{found.place}: must be above 0, found {text.strip()}"
            raise InputError(said, source=source, line=line)
        return found

    def limits(
        self, letters: str, key: str, scale: float = 1.0, *, table: str = ""
    ) -> Iterator[tuple[str, Sourced]]:
        """The axes that have a number above 0 under a key, and it; "{letter}" and "{axis}", its number in
        `letters`, are filled in."""
        for k, letter in enumerate(letters):
            if found := self.positive(table, key.format(letter=letter.upper(), axis=k), scale):
                yield letter, found


def leading_number(text: str) -> float | None:
    """The number with which a text begins, as C's scanf reads "3 mm"; None where it begins with none."""
    found = _BEGINS.match(text.strip())
    return float(found.group()) if found else None


def least(*found: Sourced | None) -> Sourced | None:
    """The smallest of some numbers; None where there is none."""
    known = [one for one in found if one is not None]
    return min(known, key=lambda one: one.value) if known else None
