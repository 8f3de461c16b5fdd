"""Klipper's printer.cfg: [printer] with the limits along the path and of z and the law of its corners, [input_shaper] with the modes
of the frame.

Klipper limits velocity and acceleration along the path, a machine file those of each axis: an axis may use them alone. What it does at
corners is in the table [control] of the machine file, for predictions of its times (controls/export/models.py).
"""

from __future__ import annotations

import re

from planner.base.errors import InputError
from planner.controls.machine_import.ini_file import IniFile, read_klipper_config
from planner.controls.machine_import.settings import ControlSettings, FoundMode, Sourced, least, travel_note

_PER_AXIS = ("cartesian", "corexy", "hybrid_corexy", "corexz", "hybrid_corexz", "generic_cartesian")
_DAMPING = 0.1  # [-], Klipper's own where damping_ratio is not set
# Klipper's own where [printer] does not say them (klippy/toolhead.py).
_CORNER_SPEED = 5.0  # [mm/s]
_CRUISE_RATIO = 0.5  # [-]


def recognised(text: str) -> bool:
    """Whether a text is a configuration of Klipper."""
    return re.search(r"^\[(?:printer|stepper_x|include [^\]]+\.cfg)\]", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings of a printer.cfg. Raises InputError for kinematics without limits of their own for x, y and z, and for numbers that
    cannot be read."""
    config = read_klipper_config(text, source)
    kinematics = config.text("printer", "kinematics")
    if kinematics is not None and kinematics not in _PER_AXIS:
        raise InputError(
            f"[printer] kinematics is {kinematics}; limits of x, y and z are known for {', '.join(_PER_AXIS)}",
            source=source,
        )
    along = config.positive("printer", "max_velocity"), config.positive("printer", "max_accel")
    of_z = config.positive("printer", "max_z_velocity"), config.positive("printer", "max_z_accel")
    velocity, acceleration = (
        {letter: found for letter, found in (("x", path), ("y", path), ("z", least(z, path))) if found}
        for path, z in zip(along, of_z, strict=True)
    )
    modes: list[FoundMode] = []
    for letter in "xy":
        frequency = config.positive("input_shaper", f"shaper_freq_{letter}")
        damping = config.positive("input_shaper", f"damping_ratio_{letter}") or Sourced(_DAMPING, "")
        if frequency and all(mode.frequency != frequency.value for mode in modes):
            modes.append(FoundMode(frequency.value, damping.value, frequency.place))
    return ControlSettings(
        control="Klipper",
        velocity=velocity,
        acceleration=acceleration,
        feed_max=along[0],
        law={
            "acceleration": along[1],
            "square_corner_velocity": config.number("printer", "square_corner_velocity")
            or Sourced(_CORNER_SPEED, "Klipper's default"),
            "minimum_cruise_ratio": _cruise_ratio(config, along[1]),
        },
        modes=tuple(modes),
        notes=(*config.notes, *_notes(config)),
    )


def _cruise_ratio(config: IniFile, acceleration: Sourced | None) -> Sourced:
    """The minimum cruise ratio; of older files max_accel_to_decel, the acceleration that is left for what is gained and lost."""
    found = config.number("printer", "minimum_cruise_ratio")
    older = config.positive("printer", "max_accel_to_decel")
    if found is None and older is not None and acceleration is not None:
        return Sourced(1.0 - min(1.0, older.value / acceleration.value), older.place)
    return found or Sourced(_CRUISE_RATIO, "Klipper's default")


def _notes(config: IniFile) -> list[str]:
    """Sentences on what a machine file does not have, and a program may ask for."""
    said = ["velocity and acceleration are limits along the path in Klipper and of each axis here"]
    travel = {}
    for letter in "xyz":
        low, high = (config.number(f"stepper_{letter}", f"position_{end}") for end in ("min", "max"))
        if high is not None:
            travel[letter] = (low.value if low else 0.0, high.value)
    said.append(travel_note(travel))
    if "extruder" in config.names:
        said.append("limits of [extruder] are left out: a table [axes.e] takes them")
    if "gcode_arcs" not in config.names:
        said.append(
            "Klipper reads no G2 and G3 here, for want of [gcode_arcs]: programs with arcs fail on it"
        )
    codes = [
        name.split()[1].upper() for name in config.names if re.match(r"gcode_macro [GMgm]\d+(\.\d+)?$", name)
    ]
    if codes:
        said.append(
            f"codes that macros of this machine replace are read as usual: {', '.join(dict.fromkeys(codes))}"
        )
    return [one for one in said if one]
