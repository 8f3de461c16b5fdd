"""Klipper's printer.cfg: [printer] with the limits along the path and of z, [input_shaper] with the modes of the frame.

Klipper limits velocity and acceleration along the path, a machine file those of each axis: an axis may use them alone. Settings that
SAVE_CONFIG wrote below "#*#" count like the others, and the last of two equal ones.
"""

from __future__ import annotations

import re

from planner.base.errors import InputError
from planner.machine_import.ini_file import read_ini
from planner.machine_import.settings import ControlSettings, FoundMode, Sourced

_INCLUDE = re.compile(r"^\[include\s+([^\]]+?)\s*\]", re.IGNORECASE)
_PER_AXIS = ("cartesian", "corexy", "hybrid_corexy", "corexz", "hybrid_corexz", "generic_cartesian")
_DAMPING = 0.1  # [-], Klipper's own where damping_ratio is not set
_CORNER_SPEED = "square_corner_velocity"


def recognised(text: str) -> bool:
    """Whether a text is a configuration of Klipper."""
    return re.search(r"^\[(?:printer|stepper_x|include [^\]]+\.cfg)\]", text, re.MULTILINE) is not None


def settings(text: str, source: str) -> ControlSettings:
    """The settings of a printer.cfg. Raises InputError for kinematics without limits of their own for x, y and z, and for numbers that
    cannot be read."""
    config = read_ini(
        text, source, first_counts=False, saved_mark="#*#", indented_goes_on=True, included=_INCLUDE
    )
    kinematics = config.text("printer", "kinematics")
    if kinematics is not None and kinematics.lower() not in _PER_AXIS:
        raise InputError(
            f"[printer] kinematics is {kinematics}; limits of x, y and z are known for {', '.join(_PER_AXIS)}",
            source=source,
        )
    along = config.positive("printer", "max_velocity"), config.positive("printer", "max_accel")
    of_z = config.positive("printer", "max_z_velocity"), config.positive("printer", "max_z_accel")
    velocity, acceleration = (
        {letter: found for letter, found in (("x", path), ("y", path), ("z", z or path)) if found}
        for path, z in zip(along, of_z, strict=True)
    )
    modes: list[FoundMode] = []
    for letter in "xy":
        frequency = config.positive("input_shaper", f"shaper_freq_{letter}")
        damping = config.positive("input_shaper", f"damping_ratio_{letter}") or Sourced(_DAMPING, "")
        if frequency and all(mode.frequency != frequency.value for mode in modes):
            modes.append(FoundMode(frequency.value, damping.value, frequency.place))
    notes = ["velocity and acceleration are limits along the path in Klipper and of each axis here"]
    if config.text("printer", _CORNER_SPEED):
        notes.append(
            f"[printer] {_CORNER_SPEED} sets corner speeds in Klipper and is no tolerance: Klipper stays on the path"
        )
    return ControlSettings(
        control="Klipper",
        velocity=velocity,
        acceleration=acceleration,
        feed_max=along[0],
        modes=tuple(modes),
        notes=tuple(notes),
    )
