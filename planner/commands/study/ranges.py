"""The values over which a setting is varied: `tolerance=0.005:0.1:10:log`, `axes.x.jerk=1e5,2e5,4e5`, and their grid."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.errors import InputError
from planner.commands.study.settings import Setting, known_setting, parse_value, unit_of
from planner.machine import Machine

LINEAR, LOG = "lin", "log"
POINTS_MAX = 1_000_000  # of a grid: a slip of the keyboard, not a sweep
DIGITS = 9  # significant, of a value between the ends: 0.05 rather than 0.05000000000000001


_DASHED = re.compile(r"\s*[\d.]+\s*(-|\.\.)\s*[\d.]+\s*")  # a range as one might write it


@dataclass(frozen=True, kw_only=True)
class Varied:
    """A setting and its values in the unit of the machine file, each once, in their order; `unit` is empty for factors."""

    name: str
    values: tuple[float, ...]
    unit: str = ""


def parse_varied(text: str, machine: Machine, tolerance: float) -> Varied:
    """A setting with values, of `NAME=FIRST:LAST:COUNT`, with `:log` behind it for equal ratios, or of `NAME=A,B,C`.

    tolerance : the present one [mm], of which percentages are taken

    Raises InputError for a name that is no setting and for values that are none.
    """
    name, equals, said = text.partition("=")
    if not equals:
        raise InputError(
            f"'{text}': write a name and a range, such as tolerance=0.005:0.1:10:log or y.jerk=1e5,2e5"
        )
    name = known_setting(name.strip(), machine)
    unit = unit_of(name, machine)
    if _DASHED.fullmatch(said):
        raise InputError(f"{text}: for a range write FIRST:LAST:COUNT, for single values A,B,C")
    if ":" not in said:
        values = [parse_value(name, value, machine, tolerance) for value in said.split(",")]
        return Varied(name=name, values=tuple(dict.fromkeys(values)), unit=unit)
    parts = said.split(":")
    spacing = parts[3].strip() if len(parts) == 4 else LINEAR
    if len(parts) not in (3, 4) or spacing not in (LINEAR, LOG):
        raise InputError(f"{text}: write FIRST:LAST:COUNT or FIRST:LAST:COUNT:{LOG}")
    first, last = (parse_value(name, value, machine, tolerance) for value in parts[:2])
    count = int(parts[2]) if parts[2].strip().isdecimal() else 0
    if not 1 <= count <= POINTS_MAX:
        raise InputError(f"{text}: '{parts[2]}' values; their number must be 1 to {POINTS_MAX:,}")
    spread = np.geomspace if spacing == LOG else np.linspace
    found = [float(f"{value:.{DIGITS}g}") for value in spread(first, last, count)]
    inner = found[1:-1] if count > 1 else []
    last = last if count > 1 else first
    return Varied(name=name, values=tuple(dict.fromkeys([first, *inner, last])), unit=unit)


def grid_of(varied: Sequence[Varied]) -> list[tuple[Setting, ...]]:
    """All combinations of values, the last setting changing fastest. Raises InputError for a setting that is there twice, and for more
    than `POINTS_MAX` of them."""
    names = [one.name for one in varied]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name} is varied twice; write all its values in one --vary")
    points = int(np.prod([len(one.values) for one in varied], dtype=float))
    if points > POINTS_MAX:
        raise InputError(f"{points:,} combinations; there must not be more than {POINTS_MAX:,}")
    settings = [[Setting(name=one.name, value=value) for value in one.values] for one in varied]
    return list(itertools.product(*settings))
