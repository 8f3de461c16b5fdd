"""Klipper's printer.cfg: [printer] with the limits along the path and of z and the law of its corners,
[input_shaper] with the modes of the frame.

Klipper limits velocity and acceleration along the path, a machine file those of each axis: an axis may use
them alone. What it does at corners goes to the table [control], for predictions (controls/timing/models.py).
"""

import re

from planner.base.errors import InputError
from planner.controls.machine_import.ini_file import read_klipper_config
from planner.controls.machine_import.settings import (
    ControlSettings,
    Ends,
    FoundMode,
    Settings,
    Sourced,
    least,
)

_PER_AXIS = ("cartesian", "corexy", "hybrid_corexy", "corexz", "hybrid_corexz", "generic_cartesian")
_MACRO = re.compile(r"gcode_macro\s+(\w+(?:\.\d+)?)", re.IGNORECASE | re.ASCII)
# Klipper's own values where the file does not say them (klippy/toolhead.py).
_DAMPING = 0.1  # [-]
_CORNER_SPEED = Sourced(5.0, "Klipper's default")  # [mm/s]
_CRUISE_RATIO = Sourced(0.5, "Klipper's default")  # [-]


def recognised(text: str) -> bool:
    """Whether a text is a configuration of Klipper."""
    return re.search(r"^\[(?:printer|stepper_x|include [^\]]+\.cfg)\]", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """Of a printer.cfg. Raises InputError for kinematics without limits of their own for x, y and z."""
    config = read_klipper_config(text, source)
    kinematics = config.text("printer", "kinematics")
    if kinematics is not None and kinematics not in _PER_AXIS:
        known = ", ".join(_PER_AXIS)
        said = f"[printer] kinematics is {kinematics}; limits of x, y and z are known for {known}"
        raise InputError(said, source=source)
    limits = {}
    for key in ("velocity", "accel"):
        path, z = (config.positive("printer", f"max_{which}{key}") for which in ("", "z_"))
        axes = {"x": path, "y": path, "z": least(z, path)}
        limits[key] = {letter: found for letter, found in axes.items() if found}
    along = config.positive("printer", "max_accel")
    modes: dict[float, FoundMode] = {}
    for letter in "xy":
        damping = config.positive("input_shaper", f"damping_ratio_{letter}")
        if frequency := config.positive("input_shaper", f"shaper_freq_{letter}"):
            found = FoundMode(frequency.value, damping.value if damping else _DAMPING, frequency.place)
            modes.setdefault(frequency.value, found)
    cruise = config.number("printer", "minimum_cruise_ratio")
    older = config.positive("printer", "max_accel_to_decel")  # what is left for what is gained and lost
    if cruise is None and older is not None and along is not None:
        cruise = Sourced(1.0 - min(1.0, older.value / along.value), older.place)
    return ControlSettings(
        control="Klipper",
        velocity=limits["velocity"],
        acceleration=limits["accel"],
        feed_max=config.positive("printer", "max_velocity"),
        law={
            "acceleration": along,
            "square_corner_velocity": config.number("printer", "square_corner_velocity") or _CORNER_SPEED,
            "minimum_cruise_ratio": cruise or _CRUISE_RATIO,
        },
        travel=_travel(config),
        macros=_macros(config),
        modes=tuple(modes.values()),
        notes=(*config.notes, *_notes(config)),
    )


def _notes(config: Settings) -> list[str]:
    """Sentences on what a machine file does not have, and a program may ask for."""
    said = ["velocity and acceleration are limits along the path in Klipper and of each axis here"]
    if "extruder" in config.names:
        said.append("limits of [extruder] are left out: a table [axes.e] takes them")
    if "gcode_arcs" not in config.names:
        arcs = "Klipper reads no G2 and G3 here, for want of [gcode_arcs]: programs with arcs fail on it"
        said.append(arcs)
    macros = [_MACRO.fullmatch(name) for name in config.names]
    renamed = [macro[1].upper() for macro in macros if macro and config.text(macro[0], "rename_existing")]
    if renamed:
        said.append(f"commands that macros of this machine replace are read as usual: {', '.join(renamed)}")
    return said


def _macros(config: Settings) -> dict[str, str]:
    """The lines of macros by their names; without those that replace a command. Their variables stand in
    front, where no macro changes them."""
    macros: dict[str, str] = {}
    fixed = not any("SET_GCODE_VARIABLE" in (config.text(table, "gcode") or "") for table in config.names)
    for table in dict.fromkeys(config.names):
        macro, lines = _MACRO.fullmatch(table), config.text(table, "gcode")
        if macro and lines is not None and config.text(table, "rename_existing") is None:
            own = [key for key in config.keys(table) if fixed and key.startswith("variable_")]
            sets = (f"{{% set {key[9:]} = {config.text(table, key)} %}}" for key in own)
            macros[macro[1].upper()] = "".join(sets) + lines.strip("\n")
    return macros


def _travel(config: Settings) -> dict[str, Ends]:
    travel: dict[str, Ends] = {}
    for letter in "xyz":
        low, high = (config.number(f"stepper_{letter}", f"position_{end}") for end in ("min", "max"))
        if high is not None:
            travel[letter] = low or Sourced(0.0, "Klipper's default"), high
    return travel
