"""LinuxCNC's INI file: limits of axes and joints, units, servo period, start-up codes.

Read are [TRAJ] LINEAR_UNITS, COORDINATES, MAX_LINEAR_VELOCITY, MAX_LINEAR_ACCELERATION and MAX_LINEAR_JERK, [AXIS_x] and [JOINT_n]
MAX_VELOCITY, MAX_ACCELERATION and MAX_JERK, [KINS] KINEMATICS with its coordinates, [EMCMOT] SERVO_PERIOD and [RS274NGC]
RS274NGC_STARTUP_CODE. An axis gets the smallest of the limits of its
own section, of those along the path and, with trivial kinematics, of the joints that move it.
"""

from __future__ import annotations

import re

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.machine_import.ini_file import IniFile, read_ini
from planner.machine_import.settings import ControlSettings, Sourced, least

# mm in a LINEAR_UNITS.
_MM = {"mm": 1.0, "metric": 1.0, "inch": MM_PER_INCH, "in": MM_PER_INCH, "imperial": MM_PER_INCH}
_NANOSECOND = 1e-9  # [s]: periods of HAL's threads are in them
_INCLUDE = re.compile(r"^#INCLUDE\s+(\S+)", re.IGNORECASE)


def recognised(text: str) -> bool:
    """Whether a text is an INI file of LinuxCNC."""
    return re.search(r"^\s*\[(?:EMC|TRAJ|EMCMOT|KINS|JOINT_0|AXIS_X)\]", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings of an INI file. Raises InputError for units and numbers that cannot be read."""
    ini = read_ini(text, source, first_counts=True, saved_mark="", indented_goes_on=False, included=_INCLUDE)
    unit = _unit(ini, source)
    letters = _letters(ini)
    trivial = re.match(r"\s*trivkins", ini.text("KINS", "KINEMATICS") or "trivkins") is not None
    notes = [_other_axes(letters)]
    if not trivial:
        notes.append(
            f"[KINS] KINEMATICS is {ini.text('KINS', 'KINEMATICS')}: limits are those of the axes, joints move otherwise"
        )
    period = ini.positive("EMCMOT", "SERVO_PERIOD", _NANOSECOND)
    tolerance, path_control = _startup(ini.text("RS274NGC", "RS274NGC_STARTUP_CODE") or "", unit)
    return ControlSettings(
        control="LinuxCNC",
        velocity=_limits(ini, "MAX_VELOCITY", None, letters, trivial, unit),
        acceleration=_limits(ini, "MAX_ACCELERATION", "MAX_LINEAR_ACCELERATION", letters, trivial, unit),
        jerk=_limits(ini, "MAX_JERK", "MAX_LINEAR_JERK", letters, trivial, unit),
        feed_max=ini.positive("TRAJ", "MAX_LINEAR_VELOCITY", unit),
        dt=period,
        tolerance=tolerance,
        path_control=path_control,
        notes=tuple(note for note in notes if note),
    )


def _limits(
    ini: IniFile, key: str, along: str | None, letters: str, trivial: bool, unit: float
) -> dict[str, Sourced]:
    """The smallest limit of each axis: its own, those of its joints with trivial kinematics, and that along the path."""
    limits = {}
    for letter in LINEAR_AXES + ROTARY_AXES:
        if letter not in letters and f"axis_{letter}" not in ini.names:
            continue
        linear = letter in LINEAR_AXES
        scale = unit if linear else 1.0
        moved_by = [n for n, moved in enumerate(letters) if moved == letter and trivial]
        joints = [ini.positive(f"JOINT_{n}", key, scale) for n in moved_by]
        path = ini.positive("TRAJ", along, unit) if along and linear else None
        found = least(ini.positive(f"AXIS_{letter.upper()}", key, scale), *joints, path)
        if found:
            limits[letter] = found
    return limits


def _unit(ini: IniFile, source: str) -> float:
    """mm per length unit of the file."""
    text = ini.text("TRAJ", "LINEAR_UNITS")
    if text is None:
        raise InputError("[TRAJ] LINEAR_UNITS is missing: mm or inch?", source=source)
    if text.lower() not in _MM:
        raise InputError(f"[TRAJ] LINEAR_UNITS is {text!r}; allowed are {', '.join(_MM)}", source=source)
    return _MM[text.lower()]


def _letters(ini: IniFile) -> str:
    """The axis that each joint moves, in the order of the joints."""
    kinematics = re.search(
        r"coordinates\s*=\s*([a-z ]+?)(?:\s+\w+\s*=|$)", ini.text("KINS", "KINEMATICS") or "", re.IGNORECASE
    )
    found = kinematics.group(1) if kinematics else ini.text("TRAJ", "COORDINATES") or "xyz"
    return re.sub(r"[^a-z]", "", found.lower())


def _other_axes(letters: str) -> str:
    other = sorted({letter for letter in letters if letter not in LINEAR_AXES + ROTARY_AXES})
    return f"axes left out, which a machine file does not have: {', '.join(other)}" if other else ""


def _startup(code: str, unit: float) -> tuple[Sourced | None, str | None]:
    """Tolerance and path control of the start-up codes."""
    place = "[RS274NGC] RS274NGC_STARTUP_CODE"
    scale = MM_PER_INCH if re.search(r"G20(?!\d)", code) else 1.0 if re.search(r"G21(?!\d)", code) else unit
    modes = re.findall(r"G(64|61\.1|61)(?![\d.])", code)
    path_control = {"64": "blend", "61": "exact_path", "61.1": "exact_stop"}[modes[-1]] if modes else None
    given = re.search(r"G64\s*P\s*([\d.]+)", code)
    if given and float(given.group(1)) > 0:
        return Sourced(float(given.group(1)) * scale, f"{place}, G64 P"), path_control
    return None, path_control
