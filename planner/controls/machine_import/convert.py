"""From a control's settings to the text of a machine file: every number with its place, and what is assumed
said aloud.

grbl, Klipper, Marlin and LinuxCNC 2.9 know no jerk. A machine file needs one, since a time-optimal motion
without it would step in acceleration at every switch. It is assumed from the time in which a drive builds up
its acceleration, jerk = acceleration / ramp time. `RAMP_TIME` is that of the built-in mill. A shorter time is
right for light and stiff machines, a longer one where the frame rings: a ramp excites a vibration of
frequency f by |sin(pi f T) / (pi f T)| of what a step would. Only LinuxCNC has a tolerance in its settings
(G64 P of the start-up codes).
"""

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.controls.machine_import import grbl, klipper, linuxcnc, marlin
from planner.controls.machine_import.ini_file import read_settings
from planner.controls.machine_import.settings import ControlSettings, Sourced
from planner.machine import ALL_AXES, Machine, machine_from_dict

RAMP_TIME = 0.04  # [s]
# [mm], as of the built-in mill and router
TOLERANCE = {"LinuxCNC": 0.02, "grbl": 0.05, "Klipper": 0.05, "Marlin": 0.05, "RepRapFirmware": 0.05}
NEEDED = ("velocity", "acceleration")
DERIVATIVES = (*NEEDED, "jerk")
DT = 0.001  # [s], where the control does not say: setpoints of offline plans

# In the order in which a text is tried: Klipper's and LinuxCNC's sections are told apart by their names.
CONTROLS: dict[str, ModuleType] = {"linuxcnc": linuxcnc, "klipper": klipper, "marlin": marlin, "grbl": grbl}


@dataclass(frozen=True)
class Imported:
    """A machine file made of a control's settings."""

    text: str  # of the file
    machine: Machine  # what it holds
    assumed: tuple[str, ...]  # what the settings do not say, one sentence each


def import_machine(
    path: str | Path,
    *,
    control: str | None = None,
    ramp_time: float = RAMP_TIME,
    tolerance: float | None = None,
    given: Mapping[str, float] | None = None,
) -> Imported:
    """A machine file from the settings of a control.

    path      : LinuxCNC's INI file, what `$$` of grbl or M503 of Marlin printed, or Klipper's printer.cfg
    control   : whose settings it is: "linuxcnc", "grbl", "klipper" or "marlin"; None to recognise it
    ramp_time : in which an axis builds up its acceleration [s], > 0, for jerks that the control does not know
    tolerance : contour tolerance [mm]; None for that of the settings
    given     : limits that the settings lack or that replace theirs, such as {"z.jerk": 1e4}, in mm (deg) and
                s

    Raises InputError for files that hold no settings of these controls, for limits that are missing, and for
    names of `given` that are none.
    """
    text, source = read_settings(Path(path)), str(path)
    found, lathe = _with_y(_settings_of(text, source, control))
    axes, assumed = _axes(found, ramp_time, given or {}, source)
    assumed += lathe
    eps, dt = found.tolerance, found.dt
    if tolerance is not None:
        eps = Sourced(tolerance, "given")
    if eps is None:
        eps = Sourced(TOLERANCE[found.control], "assumed")
        assumed.append(f"tolerance {eps.value:g} mm: the settings have none; --tolerance gives another")
    if dt is None:
        dt = Sourced(DT, "assumed")
        assumed.append(f"interpolation period {dt.value * 1e3:g} ms: the settings do not say it")
    written = _text(found, Path(path), axes, eps, dt, [*found.notes, *assumed])
    machine = machine_from_dict(tomllib.loads(written), source=source)
    return Imported(written, machine, (*found.notes, *assumed))


def is_settings(path: Path) -> bool:
    """Whether a file holds settings of a control. Raises InputError if it cannot be read."""
    text = read_settings(path)
    return any(reader.recognised(text) for reader in CONTROLS.values())


def _settings_of(text: str, source: str, control: str | None) -> ControlSettings:
    if control is not None:
        known_name("control", control, CONTROLS)
    for name, reader in CONTROLS.items():
        if control == name or (control is None and reader.recognised(text)):
            found: ControlSettings = reader.settings(text, source)
            return found
    raise InputError(
        "no settings found of LinuxCNC (an INI file), grbl (what $$ prints), Klipper (printer.cfg), Marlin (what M503 prints) "
        "or RepRapFirmware (config.g)",
        source=source,
    )


def _with_y(found: ControlSettings) -> tuple[ControlSettings, list[str]]:
    """The settings; of a lathe, which says nothing of y, with those of x for y, and that this is assumed."""
    limits = (found.velocity, found.acceleration)
    if not all("z" in limit and "x" in limit and "y" not in limit for limit in limits):
        return found, []
    of_x = [{**limit, "y": Sourced(limit["x"].value, "x's: the machine has no y")} for limit in limits]
    said = "y: the machine has none; its limits are those of x, and a program that moves y is not refused"
    return dataclasses.replace(found, velocity=of_x[0], acceleration=of_x[1]), [said]


def _axes(
    found: ControlSettings, ramp_time: float, given: Mapping[str, float], source: str
) -> tuple[dict[str, dict[str, Sourced]], list[str]]:
    """Limits by axis and quantity, and what of them is assumed. Raises InputError for what is missing."""
    limits = {name: dict(getattr(found, name)) for name in DERIVATIVES}
    for name, value in given.items():
        letter, _, quantity = name.partition(".")
        if letter not in ALL_AXES or quantity not in limits:
            raise InputError(f"'{name}' is no limit of an axis; write e.g. x.acceleration=500")
        limits[quantity][letter] = Sourced(value, "given")
    axes: dict[str, dict[str, Sourced]] = {}
    missing, no_jerk = [], []
    for letter in ALL_AXES:
        own = {name: limits[name][letter] for name in DERIVATIVES if letter in limits[name]}
        if not own.keys() & {*NEEDED} and letter not in "xy":
            continue
        missing += [f"{letter}.{name}" for name in NEEDED if name not in own]
        if own.keys() >= {*NEEDED}:
            if "jerk" not in own:
                no_jerk.append(letter)
                own["jerk"] = Sourced(own["acceleration"].value / ramp_time, "assumed")
            low, high = found.travel.get(letter, (None, None))
            if not low or not high or low.value < high.value:  # equal ends are those of an axis that has none
                own |= {name: end for name, end in (("travel_min", low), ("travel_max", high)) if end}
            axes[letter] = own
    if missing:
        said = f"{found.control}'s settings do not say {', '.join(missing)}; give them in mm and s: "
        raise InputError(f"{said}planner machine import, --set {missing[0]}=500", source=source)
    if not no_jerk:
        return axes, []
    said = f"jerk of {', '.join(no_jerk)}: acceleration / {ramp_time * 1e3:g} ms"
    return axes, [f"{said}: the settings have none; --ramp-time or --set x.jerk=... give another"]


def _text(
    found: ControlSettings,
    path: Path,
    axes: Mapping[str, Mapping[str, Sourced]],
    tolerance: Sourced,
    dt: Sourced,
    said: Sequence[str],
) -> str:
    """The text of the machine file."""
    name = "".join(c if c not in '"\\' else "-" for c in path.stem) or "machine"
    lines = [f"# From the settings of {found.control}. Lengths in mm, rotary axes in degrees, times in s."]
    lines += [f"# Note: {sentence}." for sentence in said]
    lines += ["", f'name = "{name}"', _line("dt", dt), _line("tolerance", tolerance)]
    lines.append(f'path_control = "{found.path_control or "blend"}"')
    lines += [_line("feed_max", found.feed_max)] if found.feed_max else []
    for letter, limits in axes.items():
        lines += _table(f"axes.{letter}", limits)
        lines += ["wrapped = true  # WRAPPED_ROTARY"] * (letter in found.wrapped)
    if found.inch or found.lathe:
        lines += ["", "[dialect]", *["inch = true  # G20 is in force at the start"] * found.inch]
        lines += ["lathe = false  # X is a radius until G7"] * found.lathe
    # what its planner does, and how it carries the tool
    law = {key: value for key, value in found.law.items() if value is not None}
    lines += _table("control", {"name": found.control.lower(), **law})
    for table, values in (("control.corner_jump", found.corner_jump), ("kinematics", found.kinematics)):
        lines += _table(table, values) if values else []
    lines += ["", "[gcode_macros]"] if found.macros else []
    for name, text in found.macros.items():
        escaped = text.expandtabs().replace("\\", "\\\\").replace('"', '\\"')
        lines += [f'"{name}" = """', *escaped.split("\n"), '"""']
    for mode in found.modes:
        lines += [
            "",
            "[[modes]]",
            f"frequency = {mode.frequency!r}  # {mode.place}",
            f"damping = {mode.damping!r}",
        ]
    # TOML takes nothing else in names and comments, and settings may have any character in a value that is quoted
    return "".join(c if c.isprintable() or c == "\n" else "-" for line in lines for c in f"{line}\n")


def _table(name: str, values: Mapping[str, Sourced | str]) -> list[str]:
    return ["", f"[{name}]", *(_line(*pair) for pair in values.items())]


def _line(key: str, found: Sourced | str) -> str:
    if isinstance(found, str):
        return f'{key} = "{found}"'
    return f"{key} = {float(f'{found.value:.12g}')!r}  # {found.place}"
