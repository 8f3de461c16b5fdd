"""Settings of a job that can be tried with other values, and values with units: `axes.y.jerk=400 m/s3`,
`tolerance=+10%`.

A setting is a number of the machine file that its motion depends on, named as it stands there, or `feed`, a
factor on every programmed feed. Numbers without a unit are in mm and s (degrees and s for rotary axes), as in
the machine file; percentages are of the present value. Numbers that the reader of programs needs (tool
lengths, work offsets, `feed_default`) are none: with another one the program is another one.
"""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE, number_and_unit
from planner.feedrate.constraints.limits import JERK, LIMITS
from planner.machine import ROTARY_AXES, Machine, machine_from_dict
from planner.nc.program import Program

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan
    from planner.planning.job.trace import Progress


TOLERANCE, FEED = "tolerance", "feed"
G = 9806.65  # standard gravity [mm/s2]

# Units, each in those of a machine file.
_LENGTH = {"mm": 1.0, "um": 1e-3, "µm": 1e-3, "m": 1e3, "in": MM_PER_INCH}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
_SPEED = {"mm/s": 1.0, "m/s": 1e3, "mm/min": 1 / SECONDS_PER_MINUTE, "m/min": 1e3 / SECONDS_PER_MINUTE,
          "in/min": MM_PER_INCH / SECONDS_PER_MINUTE}  # fmt: skip
_ACCELERATION = {"mm/s2": 1.0, "m/s2": 1e3, "g": G}
_JERK = {"mm/s3": 1.0, "m/s3": 1e3}
_ANGLE = {"deg": 1.0}
_NONE: dict[str, float] = {"": 1.0}
_OF_AXIS = {"velocity": _SPEED, "acceleration": _ACCELERATION, "jerk": _JERK}
# A rotary axis is in degrees, as in the machine file; a name alone has that unit too.
_OF_ROTARY = {
    name: {f"deg/s{power}": 1.0} for name, power in (("velocity", ""), ("acceleration", "2"), ("jerk", "3"))
}
_OF_MACHINE = {
    TOLERANCE: _LENGTH,
    "dt": _TIME,
    "feed_max": _SPEED,
    **{limit.key: _JERK if limit.order == JERK.order else _ACCELERATION for limit in LIMITS if limit.key},
    "fir.phase_lag_max": _ANGLE,
    FEED: _NONE,
}


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A setting with a value in the unit of the machine file; of `feed` the factor on programmed feeds."""

    name: str
    value: float

    def __str__(self) -> str:
        return f"{self.name}={self.value:g}"


def setting_names(machine: Machine) -> dict[str, dict[str, float]]:
    """Every setting of a machine, with the units that its value may have and what they are in that of the
    machine file."""
    units: dict[str, dict[str, float]] = {}
    for axis in machine.axes:
        for name, allowed in (_OF_ROTARY if axis in ROTARY_AXES else _OF_AXIS).items():
            units[f"axes.{axis}.{name}"] = allowed
    units |= _OF_MACHINE
    if machine.fir is None:
        del units["fir.phase_lag_max"]
    return units


def parse_setting(text: str, machine: Machine, tolerance: float) -> Setting:
    """A setting of `NAME=VALUE`.

    tolerance : the present contour tolerance [mm], of which a percentage is taken; NaN if the program has
                several

    Raises InputError for a name that is no setting, with one that is near, and for a value that is no
    positive number or has a unit of something else.
    """
    name, value = _named(text, machine, "a value, such as axes.y.jerk=4e5 or tolerance=0.02")
    return Setting(name=name, value=parse_value(name, value, machine, tolerance))


def _named(text: str, machine: Machine, needed: str) -> tuple[str, str]:
    """The setting that `NAME=...` names, and what stands behind it. Raises InputError, saying what is `needed`."""
    name, equals, value = text.partition("=")
    if not equals:
        raise InputError(f"'{text}': write a name and {needed}")
    return known_setting(name.strip(), machine), value


def known_setting(name: str, machine: Machine) -> str:
    """The full name of a setting; `y.jerk` is `axes.y.jerk`. Raises InputError for other names, with one that
    is near."""
    known = setting_names(machine)
    for full in (name, f"axes.{name}"):
        if full in known:
            return full
    full = f"axes.{name}" if name.partition(".")[0] in machine.axes else name
    near = difflib.get_close_matches(full, known, n=1, cutoff=0.5)
    hint = f" (did you mean '{near[0]}'?)" if near else ""
    axes = ",".join(machine.axes)
    others = ", ".join(known_name for known_name in known if not known_name.startswith("axes."))
    raise InputError(
        f"'{name}' cannot be set here{hint}; there are axes.{{{axes}}}.{{velocity,acceleration,jerk}}, {others}"
    )


def parse_value(name: str, text: str, machine: Machine, tolerance: float) -> float:
    """The value of a setting in the unit of the machine file; arguments and errors as of `parse_setting`."""
    units = setting_names(machine)[name]
    allowed = ", ".join(unit for unit in [*units, "%"] if unit)
    found = number_and_unit(text)
    if found is None:
        raise InputError(
            f"{name}={text}: write a number, in {next(iter(units)) or 'times'} or with a unit: {allowed}"
        )
    number, unit = float(found[0]), found[1]
    if unit == "%":
        present = value_of(name, machine, tolerance)
        if present is None or math.isnan(present):
            what = f"the machine has no {name}" if present is None else "the program changes it (G64 P)"
            raise InputError(f"{name}={text}: a percentage of what? {what}; write a number")
        relative = found[0][0] in "+-"
        value = present * (number / 100.0 + (1.0 if relative else 0.0))
    elif found[0][0] == "+":
        raise InputError(f"{name}={text}: changes are in per cent, as {found[0]}%; a value has no sign")
    elif unit and unit not in units:
        near = difflib.get_close_matches(unit, [each for each in units if each], n=1)
        hint = f" (did you mean '{near[0]}'?)" if near else ""
        raise InputError(f"{name}={text}: '{unit}' is no unit of it{hint}; allowed are {allowed}")
    else:
        value = number * (units[unit] if unit else 1.0)
    if not (0.0 < value < math.inf):
        raise InputError(f"{name}={text}: it must be positive and finite")
    return value


def value_of(name: str, machine: Machine, tolerance: float) -> float | None:
    """The present value of a setting in the unit of the machine file; None where the machine has none."""
    if name == TOLERANCE:
        return tolerance
    if name == FEED:
        return 1.0
    value: object = machine.model_dump(mode="python")
    for part in name.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return float(value) if isinstance(value, int | float) else None


def unit_of(name: str, machine: Machine) -> str:
    """The unit of a setting in the machine file."""
    return next(iter(setting_names(machine)[name]))


def with_settings(machine: Machine, settings: Iterable[Setting]) -> Machine:
    """The machine with other values; `tolerance` and `feed`, which are of the job, are passed over. Raises
    InputError where they do not go together."""
    data = machine.model_dump(mode="python", exclude_none=True)
    for setting in settings:
        if setting.name in (TOLERANCE, FEED):
            continue
        *place, last = setting.name.split(".")
        table = data
        for part in place:
            table = table[part]
        table[last] = setting.value
    return machine_from_dict(data, source=machine.name).with_own(machine.own)


LINEAR, LOG = "lin", "log"
POINTS_MAX = 1_000_000  # of a grid: a slip of the keyboard, not a sweep
DIGITS = 9  # significant, of a value between the ends: 0.05 rather than 0.05000000000000001


_DASHED = re.compile(r"\s*[\d.]+\s*(-|\.\.)\s*[\d.]+\s*")  # a range as one might write it


@dataclass(frozen=True, kw_only=True)
class Varied:
    """A setting and its values in the unit of the machine file, each once, in their order; `unit` is empty
    for factors."""

    name: str
    values: tuple[float, ...]
    unit: str = ""


def parse_varied(text: str, machine: Machine, tolerance: float) -> Varied:
    """A setting with values, of `NAME=FIRST:LAST:COUNT`, with `:log` behind it for equal ratios, or of
    `NAME=A,B,C`.

    tolerance : the present one [mm], of which percentages are taken

    Raises InputError for a name that is no setting and for values that are none.
    """
    name, value = _named(text, machine, "a range, such as tolerance=0.005:0.1:10:log or y.jerk=1e5,2e5")
    unit = unit_of(name, machine)
    if _DASHED.fullmatch(value):
        raise InputError(f"{text}: for a range write FIRST:LAST:COUNT, for single values A,B,C")
    if ":" not in value:
        values = [parse_value(name, value, machine, tolerance) for value in value.split(",")]
        return Varied(name=name, values=tuple(dict.fromkeys(values)), unit=unit)
    parts = value.split(":")
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
    """All combinations of values, the last setting changing fastest. Raises InputError for a setting that is
    there twice, and for more than `POINTS_MAX` of them."""
    names = [one.name for one in varied]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name} is varied twice; write all its values in one --vary")
    points = int(np.prod([len(one.values) for one in varied], dtype=float))
    if points > POINTS_MAX:
        raise InputError(f"{points:,} combinations; there must not be more than {POINTS_MAX:,}")
    settings = [[Setting(name=one.name, value=value) for value in one.values] for one in varied]
    return list(itertools.product(*settings))


@dataclass(frozen=True, eq=False, kw_only=True)
class StudiedJob:
    """A program that is planned many times.

    tolerance : contour tolerance that takes precedence over the program's and the machine's [mm], or None
    how       : method and settings of `planner.plan`: method, geometry, corner, solver, effort
    """

    program: Program
    machine: Machine
    tolerance: float | None = None
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def present_tolerance(self) -> float:
        """The contour tolerance [mm]; NaN if the program has several (G64 P)."""
        if self.tolerance is not None:
            return self.tolerance
        of_block = np.where(np.isnan(self.program.tolerance), self.machine.tolerance, self.program.tolerance)
        found = np.unique(of_block) if len(of_block) else np.array([self.machine.tolerance])
        return float(found[0]) if len(found) == 1 else float("nan")

    def changed(self, settings: Sequence[Setting]) -> StudiedJob:
        """The job with other values of some settings. Raises InputError where they do not go together."""
        values, program = {setting.name: setting.value for setting in settings}, self.program
        if FEED in values:
            program = dataclasses.replace(program, feed=program.feed * values[FEED])
        return dataclasses.replace(
            self,
            program=program,
            machine=with_settings(self.machine, settings),
            tolerance=values.get(TOLERANCE, self.tolerance),
        )

    def plan(self, progress: Progress | None = None) -> Plan:
        """Plan the job. Raises InputError as `planner.plan`."""
        from planner.planning.methods.registry import plan

        return plan(self.program, self.machine, tolerance=self.tolerance, progress=progress, **self.how)
