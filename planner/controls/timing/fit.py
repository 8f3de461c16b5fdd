"""The settings of a machine and its control, found from how long test programs took: acceleration of each axis, how fast
corners are passed, and one factor.

Five programs, each of some `LASTS` seconds: moves to and fro along x, y and z, too short for the full speed, so that the
acceleration decides; a small square round and round, in which the corners do (LinuxCNC's are those of G64 P, which is not
found); a large square at a low feed, which tells the factor. The least squares of the relative differences between the
model's times and the measured ones, over the logarithms of what is sought, within a factor `RANGE` of what the machine
file says. Velocities stay as they are there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import SECONDS_PER_MINUTE
from planner.controls.timing.models import CONTROLS, as_set
from planner.controls.timing.times import LINUXCNC, control_times
from planner.machine import Machine, machine_from_dict
from planner.nc.program import Program
from planner.nc.reader import read_program

KLIPPER = "klipper"
LASTS = 60.0  # [s]: long beside the tenths of a stopwatch
# of the way v^2 / a on which an axis reaches its speed and brakes: moves that tell the acceleration
SHARE = 0.25
FAR = 40.0  # longest move [mm]
LOW = 0.1  # of the smallest velocity: the feed that tells the factor
LEAST = 0.05  # shortest side of the small square [mm]
ROOM = 8.0  # the same on Klipper, of v^2 / a: it passes no corner faster than v^2 = a side / 2
RANGE = 10.0  # how far settings may be from those of the file
FACTORS = (0.5, 2.0)  # within which the factor is sought
HEAD = "G21 G90 G94"


@dataclass(frozen=True, kw_only=True)
class Found:
    """What was fitted."""

    machine: Machine  # with the settings found
    settings: tuple[tuple[str, float, float], ...]  # name, value before, value found
    residuals: tuple[tuple[str, float, float], ...]  # name of each program, measured and predicted seconds

    def residual_texts(self) -> list[str]:
        """The residuals in words."""
        return [
            f"{name}: {took:.3f} s measured, {said:.3f} s predicted ({100.0 * (said / took - 1.0):+.2f} %)"
            for name, took, said in self.residuals
        ]


def programs_to_time(machine: Machine, control: str) -> dict[str, str]:
    """The texts of the five programs by the names of their files, for a machine and its control. They begin at X0 Y0 Z0."""
    programs = {}
    for letter in "xyz":
        if letter in machine.axes:
            axis = machine.axes[letter]
            size = min(SHARE * axis.velocity**2 / axis.acceleration, FAR)
            there = f"G1 {letter.upper()}{size:.4f} F{axis.velocity * SECONDS_PER_MINUTE:.1f}"
            way = [there, f"G0 {letter.upper()}0"]  # LinuxCNC rounds nothing between G1 and G0
            programs[f"{letter}.nc"] = _repeated(way, machine, control)
    slow, accel = (min(getattr(machine.axes[c], of) for c in "xy") for of in ("velocity", "acceleration"))
    planner = as_set(CONTROLS[control], machine) if control != LINUXCNC else None
    deviation = (planner.junction_deviation if planner else None) or 0.01
    corner = planner.square_corner_velocity if planner else None
    side = max(LEAST, ROOM * corner**2 / accel if corner else 5.0 * deviation)
    programs["corners.nc"] = _repeated(_square(side, slow), machine, control)
    programs["feed.nc"] = _repeated(_square(FAR, LOW * slow), machine, control)
    return programs


def _square(side: float, feed: float) -> list[str]:
    first = f"G1 X{side:.4f} F{feed * SECONDS_PER_MINUTE:.1f}"
    return [first, f"G1 Y{side:.4f}", "G1 X0", "G1 Y0"]


def _repeated(way: list[str], machine: Machine, control: str) -> str:
    """The program of a way so often that it lasts."""

    def text(turns: int) -> str:
        return "\n".join([HEAD, "G1 X0 Y0 F600", *(way * turns), "M2", ""])

    few, more = (control_times(read_program(text=text(n)), machine, control).seconds for n in (10, 20))
    return text(max(1, round(10 * LASTS / (more - few))))


def fitted(measured: Mapping[str, tuple[Program, float]], machine: Machine, control: str) -> Found:
    """The settings with which the model comes nearest to `measured` times, program and seconds by name.

    Raises InputError for fewer times than settings, and for times that no settings within the range explain.
    """
    from scipy.optimize import least_squares  # 0.3 s, for this command alone

    names, start = _sought(measured, machine, control)
    if len(measured) < len(names):
        raise InputError(
            f"{len(measured)} times for {len(names)} settings ({', '.join(names)}): run all of the test programs (--write makes them)"
        )
    seconds = np.array([took for _, took in measured.values()])

    def times(log: FloatArray) -> FloatArray:
        found = _with(machine, control, dict(zip(names, start * np.exp(log), strict=True)))
        return np.array([control_times(program, found, control).seconds for program, _ in measured.values()])

    most = np.log([FACTORS[1] if name == "factor" else RANGE for name in names])
    done = least_squares(
        lambda log: times(log) / seconds - 1.0, np.zeros(len(names)), bounds=(-most, most), x_scale=0.1
    )
    values = start * np.exp(done.x)
    if (np.abs(done.x) > 0.999 * most).any():
        name = names[int(np.argmax(np.abs(done.x) / most))]
        said = f"the times lead to a {name} out of range: are they of these programs, in s, at 100 % feed?"
        raise InputError(said)
    return Found(
        machine=_with(machine, control, dict(zip(names, values, strict=True))),
        settings=tuple(zip(names, start.tolist(), values.tolist(), strict=True)),
        residuals=tuple(zip(measured, seconds.tolist(), times(done.x).tolist(), strict=True)),
    )


def _sought(
    measured: Mapping[str, tuple[Program, float]], machine: Machine, control: str
) -> tuple[list[str], FloatArray]:
    """What is sought, and what the machine says of it: of axes that the programs move."""
    programs = [program for program, _ in measured.values()]
    moved = {c for p in programs for c, d in zip(p.axes, np.ptp(p.end, axis=0), strict=True) if d > 0}
    start = {f"{c}.acceleration": axis.acceleration for c, axis in machine.axes.items() if c in moved}
    if control == KLIPPER:  # which has one along the path for x and y
        both = [start.pop(f"{c}.acceleration") for c in "xy" if c in moved]
        start |= {"acceleration": min(both)} if both else {}
    if control != LINUXCNC:
        planner = as_set(CONTROLS[control], machine)
        if planner.corner_jump:
            said = (
                "corner_jump, M205 X Y Z, is not found from times; take it from the settings of the control"
            )
            raise InputError(said)
        names = ("square_corner_velocity", "junction_deviation")
        start |= {name: value for name in names if (value := getattr(planner, name))}
    return [*start, "factor"], np.array([*start.values(), 1.0])


def _with(machine: Machine, control: str, values: Mapping[str, float]) -> Machine:
    """The machine with other settings: what the control allows along the path grows with its axes."""
    data = machine.model_dump(exclude_defaults=True)
    before, axes = data.get("control", {}), data["axes"]
    given = data["control"] = {**(before if before.get("name") == control else {}), "name": control}
    for name, value in values.items():
        letter, dot, _ = name.partition(".")
        if dot:
            axes[letter]["acceleration"] = value
        else:
            given[name] = value
    if control == KLIPPER:
        for letter in "xy":
            axes[letter]["acceleration"] = given.get("acceleration", machine.axes[letter].acceleration)
    elif "acceleration" in given:
        given["acceleration"] = max(axes[letter]["acceleration"] for letter in "xy")
    return machine_from_dict(data)


def machine_text(machine: Machine, settings: Sequence[tuple[str, float, float]], said: Sequence[str]) -> str:
    """The machine file of what was found: settings (name, before, now), and what there is to say of them."""
    lines = [f"# Measured: {name} {now:.6g}, before {was:.6g}." for name, was, now in settings]
    lines += [f"# {text}." for text in said]
    return "\n".join([*lines, *_toml(machine.model_dump(exclude_defaults=True))]) + "\n"


def _toml(data: Mapping[str, object], name: str = "") -> list[str]:
    """The lines of a table: its values, then its tables."""
    tables = {key: value for key, value in data.items() if isinstance(value, Mapping)}
    lines = [f"{_inline(key)} = {_inline(value)}" for key, value in data.items() if key not in tables]
    for key, table in tables.items():
        place = f"{name}.{_inline(key)}" if name else _inline(key)
        lines += ["", f"[{place}]", *_toml(table, place)]
    return lines


def _inline(value: object) -> str:
    """A value as TOML has it, which but for tables is as in JSON."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_inline(key)} = {_inline(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
