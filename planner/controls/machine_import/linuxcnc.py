"""LinuxCNC's INI file: limits of axes and joints, units, servo period, kinematics, start-up codes.

Read are [TRAJ] LINEAR_UNITS, ANGULAR_UNITS, COORDINATES, MAX_LINEAR_VELOCITY, MAX_LINEAR_ACCELERATION and
MAX_LINEAR_JERK, [AXIS_x] and [JOINT_n] MAX_VELOCITY, MAX_ACCELERATION and MAX_JERK, [AXIS_x] WRAPPED_ROTARY
and OFFSET_AV_RATIO, [KINS] KINEMATICS, [EMCMOT] SERVO_PERIOD and [RS274NGC] RS274NGC_STARTUP_CODE. The axes
are those of COORDINATES. An axis gets the smallest of the limits of its own section, of those along the path
and of the joints that move it alone. A limit that is said nowhere is LinuxCNC's default, one unit a second
(src/emc/nml_intf/emccfg.h). Files of LinuxCNC 2.7 and older have [AXIS_0] for x, [AXIS_1] for y and so on,
and [TRAJ] MAX_VELOCITY and MAX_ACCELERATION (docs/src/config/ini-config of 2.7).

Which joint moves which axis is what the kinematics say: one after the other the letters of `coordinates=`, or
of the module's own list, `_JOINTS`, whatever COORDINATES says: joint 2 of a lathe with plain trivkins is z.

The table [kinematics] is what the commands of HAL set the pins of the kinematics to. Commands are those of
[HAL] HALCMD and of the files that [HAL] HALFILE and POSTGUI_HALFILE name, where they are beside the INI file:
`setp PIN VALUE`, and `sets SIGNAL VALUE` for pins that `net` joins to the signal; a value may be
`[TABLE]KEY`. Pins that nothing sets are 0, as in LinuxCNC (src/emc/kinematics/trtfuncs.c).
"""

import math
import re
from contextlib import suppress
from pathlib import Path

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, RAD_PER_DEG
from planner.controls.machine_import.ini_file import read_linuxcnc_ini, read_settings
from planner.controls.machine_import.settings import (
    ControlSettings,
    Setting,
    Settings,
    Sourced,
    leading_number,
    least,
)
from planner.machine import ROTARY_AXES
from planner.machine.parts import AXIS_LIMIT_MAX, XYZAC, XYZBC

_LETTERS = "xyzabcuvw"  # in the order of LinuxCNC's axes
# mm in a LINEAR_UNITS and degrees in an ANGULAR_UNITS; a number is units per mm, and per degree
# (src/emc/ini/emcIniFile.cc).
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
_USUAL = {f"G{code}" for code in (17, 20, 21, 40, 49, 54, 61, 61.1, 64, 80, 90, 91.1, 92.1, 94, 97, 98, 99)}
_PATH_CONTROL = {"G64": "blend", "G61": "exact_path", "G61.1": "exact_stop"}
# Files that a machine file does not have: what they hold, and the table that takes it.
_FILES = {
    ("RS274NGC", "PARAMETER_FILE"): (
        "work offsets and the places of G28 and G30", "[work_offsets] and [positions] take"
    ),
    ("EMCIO", "TOOL_TABLE"): ("lengths and diameters of tools", "[tools] takes"),
}  # fmt: skip
_STARTUP = "RS274NGC", "RS274NGC_STARTUP_CODE"
_TYPES = {f"{XYZAC}-kins": XYZAC, f"{XYZBC}-kins": XYZBC}  # module of LinuxCNC: type of a machine file
_ROTATION = "x-rot-point", "y-rot-point", "z-rot-point"
_DISTANCES = {XYZAC: (*_ROTATION, "y-offset", "z-offset"), XYZBC: (*_ROTATION, "x-offset", "z-offset")}


def recognised(text: str) -> bool:
    """Whether a text is an INI file of LinuxCNC."""
    return re.search(rf"^\s*\[(?:{_TABLES})\]|^#INCLUDE\s", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings of an INI file. Raises InputError for units and numbers that cannot be read."""
    return _Found(read_linuxcnc_ini(text, source), source).settings()


class _Found:
    """An INI file with what its limits are measured in, and which joints move what."""

    def __init__(self, ini: Settings, source: str):
        self.ini, self.source, self.notes = ini, source, list(ini.notes)
        self.unit = _unit(ini, "LINEAR_UNITS", _MM, source)
        turn = _unit(ini, "ANGULAR_UNITS", _DEGREES, source, otherwise=1.0)
        self.old = "AXIS_0" in ini.names and "AXIS_X" not in ini.names
        found = ini.text("TRAJ", "COORDINATES") or "xyz"
        self.letters = [letter for letter in _LETTERS if letter in found.lower()]
        self.scale = {letter: turn if letter in ROTARY_AXES else self.unit for letter in _LETTERS}
        names = enumerate(_LETTERS)
        self.table = {c: f"AXIS_{k}" if self.old else f"AXIS_{c.upper()}" for k, c in names}
        self.module, *words = (ini.text("KINS", "KINEMATICS") or "trivkins").split()
        self.module = self.module.lower()
        given = re.search(r"coordinates\s*=\s*([a-z]+)", " ".join(words), re.IGNORECASE)
        joints = given.group(1).lower() if given else _JOINTS.get(self.module, "")
        self.joints = joints if self.module in _JOINTS and not self.old else ""  # that move an axis alone

    def settings(self) -> ControlSettings:
        """Everything that a machine file takes, and notes on what it does not."""
        ini, unit = self.ini, self.unit
        kinematics = self._kinematics()
        linear = "" if self.old else "LINEAR_"
        tolerance, path_control, inch = self._startup()
        wrapped = {letter: ini.number(self.table[letter], "WRAPPED_ROTARY") for letter in self.letters}
        return ControlSettings(
            control="LinuxCNC",
            velocity=self._limits("MAX_VELOCITY", None, _DEFAULT),
            acceleration=self._limits("MAX_ACCELERATION", f"MAX_{linear}ACCELERATION", _DEFAULT),
            jerk=self._limits("MAX_JERK", "MAX_LINEAR_JERK", None),
            travel={letter: self._travel(letter) for letter in self.letters},
            wrapped="".join(c for c, found in wrapped.items() if c in ROTARY_AXES and found and found.value),
            feed_max=_possible(ini.positive("TRAJ", f"MAX_{linear}VELOCITY", unit)),
            dt=ini.positive("EMCMOT", "SERVO_PERIOD", _NANOSECOND),
            tolerance=tolerance,
            path_control=path_control,
            inch=inch,
            lathe="y" not in self.letters,
            kinematics=kinematics,
            notes=(*self.notes, *self._left_out()),
        )

    def _limits(self, key: str, along: str | None, default: float | None) -> dict[str, Sourced]:
        """The smallest limit of each axis: its own, those of its joints, and that along the path."""
        limits, by_default = {}, []
        for letter in self.letters:
            scale, table = self.scale[letter], self.table[letter]
            own = self.ini.positive(table, key, scale)
            if own is None and default is not None:
                by_default.append(letter)
                own = Sourced(default * scale, f"[{table}] {key}, not set: LinuxCNC's default")
            # the share that an offset from outside has for itself
            ratio = self.ini.number(table, "OFFSET_AV_RATIO")
            if own is not None and default is not None and ratio is not None:
                own = Sourced(own.value * (1.0 - ratio.value), f"{own.place}, less OFFSET_AV_RATIO")
            linear = along is not None and letter not in ROTARY_AXES
            path = self.ini.positive("TRAJ", along or "", self.unit) if linear else None
            numbers = (n for n, c in enumerate(self.joints) if c == letter)
            joints = [self.ini.positive(f"JOINT_{n}", key, scale) for n in numbers]
            if found := least(*map(_possible, (own, *joints, path))):
                limits[letter] = found
        if by_default:
            said = f"{key} of {', '.join(by_default)} is not set; LinuxCNC's default is {default:g} unit a second"
            self.notes.append(said + " squared" * ("ACC" in key))
        return limits

    def _startup(self) -> tuple[Sourced | None, str | None, bool]:
        """Tolerance, path control and whether programs begin in inches; notes on the other start-up codes."""
        code = re.sub(r"\([^)]*\)|;.*", "", self.ini.text(*_STARTUP) or "").upper()
        codes = [f"{letter}{float(n):g}" for letter, n in re.findall(r"([GM])\s*(\d+(?:\.\d+)?)", code)]
        inch = "G20" in codes if {"G20", "G21"} & {*codes} else abs(self.unit / MM_PER_INCH - 1.0) < _SAME
        place = "[{}] {}".format(*_STARTUP)
        if other := [one for one in codes if one not in _USUAL]:
            self.notes.append(f"{place}: {' '.join(other)} is left out; programs have to say it")
        modes = [_PATH_CONTROL[one] for one in codes if one in _PATH_CONTROL]
        given = re.search(r"G\s*64\s*P\s*(\d*\.?\d+)", code)
        tolerance = float(given.group(1)) * (MM_PER_INCH if inch else 1.0) if given else 0.0
        said = Sourced(tolerance, f"{place}, G64 P") if tolerance > 0 else None
        return said, modes[-1] if modes else None, inch

    def _kinematics(self) -> dict[str, Sourced | str]:
        """The table [kinematics], empty for other modules than tilting rotary tables; notes on what it does
        not say. Raises InputError for a distance that is no number."""
        module = self.module
        if jointless := [letter for letter in self.letters if self.joints and letter not in self.joints]:
            named = ", ".join(jointless)
            self.notes.append(f"[KINS] KINEMATICS moves no axis {named}, which COORDINATES names")
        if module == "trivkins":
            return {}
        if module not in _TYPES:
            said = f"[KINS] KINEMATICS is {module}: limits are those of the axes, joints move otherwise"
            self.notes.append(said)
            return {}
        kind, pins = _TYPES[module], self._pins()
        found: dict[str, Sourced | str] = {"type": kind}
        for name in _DISTANCES[kind]:
            place = f"{module}.{name}"
            found[name.replace("-", "_")] = pins.number("", place, self.unit) or Sourced(0.0, place)
        turned = f"{module}.conventional-directions"
        if (pins.text("", turned) or "0").lower() not in ("0", "false"):
            self.notes.append(f"{turned} is set: write the axes that turn left-handed here under `reversed`")
        if "identityfirst" not in (self.ini.text("KINS", "KINEMATICS") or ""):
            said = f"{module} begins with the tool centre point on; here a program switches it on by M428 or G43.4"
            self.notes.append(said)
        return found

    def _pins(self) -> Settings:
        """The values of pins, by name."""
        ini = self.ini
        lines = ini.texts("HAL", "HALCMD")
        for name in ini.texts("HAL", "HALFILE") + ini.texts("HAL", "POSTGUI_HALFILE"):
            with suppress(InputError):  # of LinuxCNC's library, or not here
                lines += read_settings(Path(self.source).parent / name.split()[0]).splitlines()
        said: dict[str, dict[str, str]] = {"setp": {}, "sets": {}}
        joined: dict[str, str] = {}
        for line in lines:
            words = [word for word in line.partition("#")[0].split() if word not in ("=>", "<=", "<=>")]
            if len(words) >= 3 and words[0] in said:
                named = re.fullmatch(r"\[(\w+)\]\(?(\w+)\)?", words[2])
                value = (ini.text(*named.groups()) or "0") if named else words[2]
                said[words[0]][words[1]] = value
            elif len(words) >= 3 and words[0] == "net":
                joined |= dict.fromkeys(words[2:], words[1])
        signals = said["sets"]
        pins = Settings("{key}")
        of_signals = {pin: signals[signal] for pin, signal in joined.items() if signal in signals}
        for pin, value in (said["setp"] | of_signals).items():
            pins.add("", pin, Setting(value, self.source))
        return pins

    def _left_out(self) -> list[str]:
        """Sentences on what a machine file does not have, and a program may ask for."""
        ini, said = self.ini, []
        for letter in self.letters:
            if (found := ini.number(self.table[letter], "LOCKING_INDEXER_JOINT")) and found.value >= 0:
                other = "is a locking indexer in LinuxCNC, which moves by G0 alone: here it is an axis like others"
                said.append(f"{letter} {other}")
        for key, (things, takes) in _FILES.items():
            if name := ini.text(*key):
                said.append(f"{things} are in {name} and are left out: {takes} them")
        codes = [remap.split()[0].upper() for remap in ini.texts("RS274NGC", "REMAP") if remap.split()]
        codes = [code for code in codes if self.module not in _JOINTS or code not in ("M428", "M429")]
        if codes:
            said.append(f"codes that this machine has of its own are left out: {', '.join(codes)} (REMAP)")
        return said

    def _travel(self, letter: str) -> tuple[Sourced | None, Sourced | None]:
        """The ends of an axis, and of the joints that move it alone; None for what means none, such as 1e99."""
        scale = self.scale[letter]
        tables = [self.table[letter], *(f"JOINT_{n}" for n, c in enumerate(self.joints) if c == letter)]

        def ends(key: str) -> list[Sourced]:
            found = [self.ini.number(table, key, scale) for table in tables]
            return [one for one in found if one and abs(one.value) < AXIS_LIMIT_MAX * scale]

        return max(ends("MIN_LIMIT"), default=None), min(ends("MAX_LIMIT"), default=None)


def _possible(found: Sourced | None) -> Sourced | None:
    """A limit; None for numbers that mean none, such as 1e99."""
    return found if found is not None and found.value <= AXIS_LIMIT_MAX else None


def _unit(
    ini: Settings, key: str, named: dict[str, float], source: str, otherwise: float | None = None
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
        known = f"{', '.join(named)} and numbers of units per {'mm' if named is _MM else 'degree'}"
        raise InputError(f"[TRAJ] {key} is {text!r}; allowed are {known}", source=source)
    return named[name]
