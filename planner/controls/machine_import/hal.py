"""The table [kinematics] from the commands of LinuxCNC's HAL: what sets the pins of its kinematics.

Commands are those of [HAL] HALCMD and of the files that [HAL] HALFILE and POSTGUI_HALFILE name, where they are beside the INI file:
`setp PIN VALUE`, and `sets SIGNAL VALUE` for pins that `net` joins to the signal; a value may be `[TABLE]KEY`. Pins that nothing sets
are 0, as in LinuxCNC (src/emc/kinematics/trtfuncs.c).
"""

from __future__ import annotations

import re
from pathlib import Path

from planner.base.errors import InputError
from planner.controls.machine_import.ini_file import IniFile, read_settings
from planner.controls.machine_import.numbers import finite_number
from planner.controls.machine_import.settings import Sourced
from planner.machine.kinematics_data import XYZAC, XYZBC

_TYPES = {f"{XYZAC}-kins": XYZAC, f"{XYZBC}-kins": XYZBC}  # module of LinuxCNC: type of a machine file
_DISTANCES = {
    XYZAC: ("x-rot-point", "y-rot-point", "z-rot-point", "y-offset", "z-offset"),
    XYZBC: ("x-rot-point", "y-rot-point", "z-rot-point", "x-offset", "z-offset"),
}
_TURNED = "conventional-directions"
_STRAIGHT = "trivkins"


def kinematics_of(
    ini: IniFile, module: str, source: str, unit: float
) -> tuple[dict[str, Sourced | str], list[str]]:
    """The table [kinematics], empty for other modules than tilting rotary tables, and notes on what it does not say.

    module : of [KINS] KINEMATICS
    unit   : mm per unit of length of the file

    Raises InputError for a distance that is no number.
    """
    if module == _STRAIGHT:
        return {}, []
    if module not in _TYPES:
        return {}, [f"[KINS] KINEMATICS is {module}: limits are those of the axes, joints move otherwise"]
    kind = _TYPES[module]
    pins = _pins(ini, source)
    found: dict[str, Sourced | str] = {"type": kind}
    for name in _DISTANCES[kind]:
        text = pins.get(f"{module}.{name}", "0")
        place = f"{module}.{name}"
        found[name.replace("-", "_")] = Sourced(finite_number(text, place, source) * unit, place)
    notes = []
    if pins.get(f"{module}.{_TURNED}", "0").lower() not in ("0", "false"):
        notes.append(f"{module}.{_TURNED} is set: write the axes that turn left-handed here under `reversed`")
    if "identityfirst" not in (ini.text("KINS", "KINEMATICS") or ""):
        notes.append(
            f"{module} begins with the tool centre point on; here a program switches it on by M428 or G43.4"
        )
    return found, notes


def _pins(ini: IniFile, source: str) -> dict[str, str]:
    """What pins are set to, by name."""
    lines = ini.texts("HAL", "HALCMD")
    for name in ini.texts("HAL", "HALFILE") + ini.texts("HAL", "POSTGUI_HALFILE"):
        try:
            lines += read_settings(Path(source).parent / name.split()[0]).splitlines()
        except InputError:
            continue  # of LinuxCNC's library, or not here
    pins: dict[str, str] = {}
    signals: dict[str, str] = {}
    joined: dict[str, str] = {}
    for line in lines:
        words = re.split(r"#", line)[0].split()
        words = [word for word in words if word not in ("=>", "<=", "<=>")]
        if len(words) >= 3 and words[0] == "setp":
            pins[words[1]] = _value(words[2], ini)
        elif len(words) >= 3 and words[0] == "sets":
            signals[words[1]] = _value(words[2], ini)
        elif len(words) >= 3 and words[0] == "net":
            joined |= dict.fromkeys(words[2:], words[1])
    return pins | {pin: signals[signal] for pin, signal in joined.items() if signal in signals}


def _value(text: str, ini: IniFile) -> str:
    """A value, or the setting that `[TABLE]KEY` names."""
    named = re.fullmatch(r"\[(\w+)\]\(?(\w+)\)?", text)
    return (ini.text(named.group(1), named.group(2)) or "0") if named else text
