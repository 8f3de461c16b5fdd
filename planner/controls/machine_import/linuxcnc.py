"""LinuxCNC's INI file: limits of axes and joints, units, servo period, kinematics, start-up codes.

Read are [TRAJ] LINEAR_UNITS, ANGULAR_UNITS, COORDINATES, MAX_LINEAR_VELOCITY, MAX_LINEAR_ACCELERATION and MAX_LINEAR_JERK, [AXIS_x]
and [JOINT_n] MAX_VELOCITY, MAX_ACCELERATION and MAX_JERK, [AXIS_x] WRAPPED_ROTARY and OFFSET_AV_RATIO, [KINS] KINEMATICS, [EMCMOT]
SERVO_PERIOD and [RS274NGC] RS274NGC_STARTUP_CODE. The axes are those of COORDINATES. An axis gets the smallest of the limits of its
own section, of those along the path and of the joints that move it alone. A limit that is said nowhere is LinuxCNC's default, one
unit a second (src/emc/nml_intf/emccfg.h). Files of LinuxCNC 2.7 and older have [AXIS_0] for x, [AXIS_1] for y and so on, and
[TRAJ] MAX_VELOCITY and MAX_ACCELERATION (docs/src/config/ini-config of 2.7).

Which joint moves which axis is what the kinematics say: one after the other the letters of `coordinates=`, or of the module's own
list, `_JOINTS`, whatever COORDINATES says: joint 2 of a lathe with plain trivkins is z.
"""

from __future__ import annotations

import math
import re

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, RAD_PER_DEG
from planner.controls.machine_import.hal import kinematics_of
from planner.controls.machine_import.ini_file import IniFile, read_linuxcnc_ini
from planner.controls.machine_import.numbers import leading_number
from planner.controls.machine_import.settings import ControlSettings, Sourced, least, travel_note
from planner.machine import ROTARY_AXES
from planner.machine.parts import AXIS_LIMIT_MAX

_LETTERS = "xyzabcuvw"  # in the order of LinuxCNC's axes
# mm in a LINEAR_UNITS and degrees in an ANGULAR_UNITS; a number is units per mm, and per degree (src/emc/ini/emcIniFile.cc).
_MM = {"mm": 1.0, "metric": 1.0, "inch": MM_PER_INCH, "in": MM_PER_INCH, "imperial": MM_PER_INCH}
_DEGREES = {
    "deg": 1.0,
    "degree": 1.0,
    "grad": 0.9,
    "gon": 0.9,
    "rad": 1.0 / RAD_PER_DEG,
    "radian": 1.0 / RAD_PER_DEG,
}
_JOINTS = {"trivkins": _LETTERS, "xyzac-trt-kins": "xyzac", "xyzbc-trt-kins": "xyzbc"}
_DEFAULT = 1.0  # [units/s and units/s2] of a limit that is not set
_NANOSECOND = 1e-9  # [s]: periods of HAL's threads are in them
_SAME = 1e-3  # of two units: numbers such as 0.03937 are inches
_TABLES = r"EMC|EMCMOT|TRAJ|KINS|DISPLAY|JOINT_\d+|AXIS_\w"
# Start-up codes that are those of every program's start or have a key of the machine file.
_USUAL = {
    "G17",
    "G21",
    "G20",
    "G40",
    "G49",
    "G54",
    "G61",
    "G61.1",
    "G64",
    "G80",
    "G90",
    "G91.1",
    "G92.1",
    "G94",
    "G97",
    "G98",
    "G99",
}


def recognised(text: str) -> bool:
    """Whether a text is an INI file of LinuxCNC."""
    return re.search(rf"^\s*\[(?:{_TABLES})\]|^#INCLUDE\s", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings of an INI file. Raises InputError for units and numbers that cannot be read."""
    ini = read_linuxcnc_ini(text, source)
    return _Found(ini, source).settings()


class _Found:
    """An INI file with what its limits are measured in, and which joints move what."""

    def __init__(self, ini: IniFile, source: str):
        self.ini, self.source, self.notes = ini, source, list(ini.notes)
        self.unit = _unit(ini, "LINEAR_UNITS", _MM, source)
        turn = _unit(ini, "ANGULAR_UNITS", _DEGREES, source, otherwise=1.0)
        self.old = "AXIS_0" in ini.names and "AXIS_X" not in ini.names
        found = ini.text("TRAJ", "COORDINATES") or "xyz"
        self.letters = [letter for letter in _LETTERS if letter in found.lower()]
        self.scale = {letter: turn if letter in ROTARY_AXES else self.unit for letter in _LETTERS}
        words = (ini.text("KINS", "KINEMATICS") or "trivkins").split()
        self.module = words[0].lower()
        given = re.search(r"coordinates\s*=\s*([a-z]+)", " ".join(words[1:]), re.IGNORECASE)
        self.joints = given.group(1).lower() if given else _JOINTS.get(self.module, "")
        self.alone = self.module in _JOINTS and not self.old

    def settings(self) -> ControlSettings:
        """Everything that a machine file takes, and notes on what it does not."""
        ini, unit = self.ini, self.unit
        kinematics, said = kinematics_of(ini, self.module, self.source, unit)
        path = "MAX_VELOCITY" if self.old else "MAX_LINEAR_VELOCITY"
        acceleration = "MAX_ACCELERATION" if self.old else "MAX_LINEAR_ACCELERATION"
        tolerance, path_control, inch = self._startup()
        found = ControlSettings(
            control="LinuxCNC",
            velocity=self._limits("MAX_VELOCITY", None, _DEFAULT),
            acceleration=self._limits("MAX_ACCELERATION", acceleration, _DEFAULT),
            jerk=self._limits("MAX_JERK", "MAX_LINEAR_JERK", None),
            wrapped="".join(letter for letter in self.letters if self._is_wrapped(letter)),
            feed_max=_possible(ini.positive("TRAJ", path, unit)),
            dt=ini.positive("EMCMOT", "SERVO_PERIOD", _NANOSECOND),
            tolerance=tolerance,
            path_control=path_control,
            inch=inch,
            lathe="y" not in self.letters,
            kinematics=kinematics,
            notes=(*self.notes, *said, *self._left_out()),
        )
        return found

    def _tables(self, letter: str) -> str:
        """The table of an axis."""
        return f"AXIS_{_LETTERS.index(letter)}" if self.old else f"AXIS_{letter.upper()}"

    def _moved_by(self, letter: str) -> list[str]:
        """The tables of the joints that move an axis alone."""
        return [f"JOINT_{n}" for n, moved in enumerate(self.joints) if moved == letter and self.alone]

    def _limits(self, key: str, along: str | None, default: float | None) -> dict[str, Sourced]:
        """The smallest limit of each axis: its own, those of its joints, and that along the path."""
        limits, by_default = {}, []
        for letter in self.letters:
            scale, table = self.scale[letter], self._tables(letter)
            own = self.ini.positive(table, key, scale)
            if own is None and default is not None:
                by_default.append(letter)
                own = Sourced(default * scale, f"[{table}] {key}, not set: LinuxCNC's default")
            ratio = self.ini.number(
                table, "OFFSET_AV_RATIO"
            )  # the share that an offset from outside has for itself
            if own is not None and default is not None and ratio is not None:
                own = Sourced(own.value * (1.0 - ratio.value), f"{own.place}, less OFFSET_AV_RATIO")
            path = (
                self.ini.positive("TRAJ", along, self.unit) if along and letter not in ROTARY_AXES else None
            )
            joints = [self.ini.positive(joint, key, scale) for joint in self._moved_by(letter)]
            found = least(*map(_possible, (own, *joints, path)))
            if found:
                limits[letter] = found
        if by_default:
            self.notes.append(
                f"{key} of {', '.join(by_default)} is not set; LinuxCNC's default is {default:g} unit a second"
                + (" squared" if "ACC" in key else "")
            )
        return limits

    def _is_wrapped(self, letter: str) -> bool:
        found = self.ini.number(self._tables(letter), "WRAPPED_ROTARY")
        return letter in ROTARY_AXES and found is not None and found.value != 0

    def _startup(self) -> tuple[Sourced | None, str | None, bool]:
        """Tolerance, path control and whether programs begin in inches; notes on the other start-up codes."""
        code = re.sub(r"\([^)]*\)|;.*", "", self.ini.text("RS274NGC", "RS274NGC_STARTUP_CODE") or "").upper()
        codes = [f"{letter}{float(n):g}" for letter, n in re.findall(r"([GM])\s*(\d+(?:\.\d+)?)", code)]
        inch = "G20" in codes if {"G20", "G21"} & {*codes} else abs(self.unit / MM_PER_INCH - 1.0) < _SAME
        other = [one for one in codes if one not in _USUAL]
        place = "[RS274NGC] RS274NGC_STARTUP_CODE"
        if other:
            self.notes.append(f"{place}: {' '.join(other)} is left out; programs have to say it")
        modes = [one for one in codes if one in ("G61", "G61.1", "G64")]
        path_control = (
            {"G64": "blend", "G61": "exact_path", "G61.1": "exact_stop"}[modes[-1]] if modes else None
        )
        given = re.search(r"G\s*64\s*P\s*(\d*\.?\d+)", code)
        scale = MM_PER_INCH if inch else 1.0
        tolerance = Sourced(float(given.group(1)) * scale, f"{place}, G64 P") if given else None
        return tolerance if tolerance and tolerance.value > 0 else None, path_control, inch

    def _left_out(self) -> list[str]:
        """Sentences on what a machine file does not have, and a program may ask for."""
        ini = self.ini
        travel = {}
        for letter in self.letters:
            ends = tuple(ini.number(self._tables(letter), key) for key in ("MIN_LIMIT", "MAX_LIMIT"))
            low, high = (
                end.value * self.scale[letter] if end and abs(end.value) < AXIS_LIMIT_MAX else None
                for end in ends
            )
            travel[letter] = (low, high)
        said = [travel_note(travel)]
        for letter in self.letters:
            if (found := ini.number(self._tables(letter), "LOCKING_INDEXER_JOINT")) and found.value >= 0:
                said.append(
                    f"{letter} is a locking indexer in LinuxCNC, which moves by G0 alone: here it is an axis like others"
                )
        for table, key, what in (
            (
                "RS274NGC",
                "PARAMETER_FILE",
                "work offsets and the places of G28 and G30|[work_offsets] and [positions] take",
            ),
            ("EMCIO", "TOOL_TABLE", "lengths and diameters of tools|[tools] takes"),
        ):
            if name := ini.text(table, key):
                things, takes = what.split("|")
                said.append(f"{things} are in {name} and are left out: {takes} them")
        codes = [remap.split()[0].upper() for remap in ini.texts("RS274NGC", "REMAP") if remap.split()]
        codes = [code for code in codes if self.module not in _JOINTS or code not in ("M428", "M429")]
        if codes:
            said.append(f"codes that this machine has of its own are left out: {', '.join(codes)} (REMAP)")
        return [one for one in said if one]


def _possible(found: Sourced | None) -> Sourced | None:
    """A limit; None for numbers that mean none, such as 1e99."""
    return found if found is not None and found.value <= AXIS_LIMIT_MAX else None


def _unit(
    ini: IniFile, key: str, named: dict[str, float], source: str, otherwise: float | None = None
) -> float:
    """mm or degrees per unit of the file: a name, or a number of units per mm or degree."""
    text = ini.text("TRAJ", key)
    if text is None:
        if otherwise is None:
            raise InputError(f"[TRAJ] {key} is missing: mm or inch?", source=source)
        return otherwise
    number = leading_number(text)
    if number is not None and 0.0 < number < math.inf:
        per_inch = 1.0 / MM_PER_INCH
        return MM_PER_INCH if named is _MM and abs(number / per_inch - 1.0) < _SAME else 1.0 / number
    name = text.split()[0].lower()
    if name not in named:
        raise InputError(
            f"[TRAJ] {key} is {text!r}; allowed are {', '.join(named)} and numbers of units per {'mm' if named is _MM else 'degree'}",
            source=source,
        )
    return named[name]
