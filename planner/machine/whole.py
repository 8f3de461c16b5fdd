"""The record of a whole machine: what a machine file says, checked, and limits of one's own."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field, PrivateAttr, ValidationError, field_validator, model_validator

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine.parts import (
    Axis,
    ControlData,
    DialectData,
    Finite,
    Fir,
    KinematicsData,
    Mode,
    Plotter,
    Positive,
    Record,
    Times,
    Tolerance,
    ToolData,
)
from planner.machine.user_limit import OwnLimit, check_names

LINEAR_AXES = ("x", "y", "z")
ROTARY_AXES = ("a", "b", "c")
PARALLEL_AXES = ("u", "v", "w")  # linear too, beside x, y and z
ALL_AXES = LINEAR_AXES + ROTARY_AXES + PARALLEL_AXES
# Distance from a rotary axis at which turning counts as a length, where the machine says none [mm]: half of a
# workpiece of 100 mm.
ROTARY_RADIUS = 50.0
TANGENTIAL = "tangential"  # what the acceleration of x, y and z together is called: "acceleration.tangential"
MM2_PER_M2 = 1e6  # 1 W/kg is 1 m2/s3
EXTRUDER = "e"  # follows the path, and is no axis of it
TOOL_DIGITS = 9  # of a tool number: more do not fit the 32 bits of a control
_FURTHER_OFFSET = re.compile(r"g54\.1p([1-9]|[1-9]\d|[12]\d\d|300)")  # G54.1 P1 to P300
_MACRO_OF, _MACRO = re.compile(r"M[1-9]\d{0,3}|M0"), re.compile(r"[A-Za-z_]\w*(\.\d)?")
_COMMAND = re.compile(r"[A-Za-z_]\w*(\.\d+)?", re.ASCII)
WORK_OFFSETS = ("g54", "g55", "g56", "g57", "g58", "g59", "g59.1", "g59.2", "g59.3")


class Machine(Record):
    """A machine. The template explains every key. Raises InputError for all faults at once.

    name                : of the machine
    axes                : limits by axis letter, at least x and y; "e" is the extruder of a 3-D printer, in mm of filament
    dt                  : interpolation period [s]
    interpolation       : what it does between two setpoints: "linear", "cubic" or "hold" (docs/files.md)
    tolerance           : contour tolerance eps [mm]
    path_control        : what holds before the first G61, G61.1 or G64 of a program
    feed_max            : largest feed along the path [mm/s], or None
    feed_default        : feed of moves before the first F word of a program [mm/s], or None: they are refused
    normal_acceleration : largest normal acceleration [mm/s2], A_max of paper 002 eq. (19), or None
    tangential_acceleration : largest acceleration along the path, of x, y and z together [mm/s2], or None
    tangential_jerk     : how fast that may change at most [mm/s3], or None
    blend_rapids        : whether joints between G0 and feed moves are rounded
    rotary_radius       : [mm] at which an angle of a rotary axis is a length inside, or None: `ROTARY_RADIUS`. A machine
                          file may say `tolerance_angle` [deg] instead, the angle that is worth the tolerance
    macros              : the macros that the control runs for M codes, by the code ("M6"), for exports
    gcode_macros        : lines that Klipper runs for a command of that name
    kinematics          : how rotary axes carry workpiece and tool, or None: the tool centre point is not known
    control             : what is set in the control's own planner, or None: its defaults
    """

    name: str
    dt: Positive
    interpolation: Literal["linear", "cubic", "hold"] = "linear"
    tolerance: Tolerance
    path_control: Literal["blend", "exact_path", "exact_stop"] = "blend"
    axes: dict[str, Axis]
    feed_max: Positive | None = None
    feed_default: Positive | None = None
    normal_acceleration: Positive | None = None
    tangential_acceleration: Positive | None = None
    tangential_jerk: Positive | None = None
    blend_rapids: bool = False
    rotary_radius: Positive | None = None
    fir: Fir | None = None
    modes: tuple[Mode, ...] = ()
    plotter: Plotter | None = None
    dialect: DialectData | None = None
    times: Times | None = None
    kinematics: KinematicsData | None = None
    control: ControlData | None = None
    tools: dict[str, ToolData] = Field(default_factory=dict)
    macros: dict[str, str] = Field(default_factory=dict)
    gcode_macros: dict[str, str] = Field(default_factory=dict)
    positions: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    work_offsets: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    _own: tuple[OwnLimit, ...] = PrivateAttr(default=())

    def __init__(self, **data: Any):
        try:
            super().__init__(**data)
        except ValidationError as fault:
            raise InputError(faults_in_words(fault)) from None

    @classmethod
    def of(
        cls,
        axes: str,
        velocity: float | Sequence[float],
        acceleration: float | Sequence[float],
        jerk: float | Sequence[float],
        **others: Any,
    ) -> Machine:
        """A machine in one line: `Machine.of("xyz", 500.0, 4000.0, 100_000.0)`.

        axes                         : letters of its A axes
        velocity, acceleration, jerk : one for all axes, or (A,) [mm/s, mm/s2, mm/s3; of rotary axes in degrees]
        others                       : further fields; a period of 1 ms, a tolerance of 0.02 mm and the name "machine" unless given

        Raises InputError as `Machine` does, and where there are not as many limits as axes.
        """
        limits = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        columns = {}
        for name, given in limits.items():
            values = np.asarray(given, dtype=np.float64)
            if values.shape not in ((), (len(axes),)):
                said = f"{name}: {values.size} limits for the axes '{axes}'; give one, or one for each"
                raise InputError(said)
            columns[name] = np.broadcast_to(values, len(axes)).tolist()
        if len(set(axes)) < len(axes):
            raise InputError(f"axes '{axes}': give each letter once")
        rows = zip(*columns.values(), strict=True)
        given_axes = {c: dict(zip(columns, row, strict=True)) for c, row in zip(axes, rows, strict=True)}
        return cls(**{"name": "machine", "dt": 0.001, "tolerance": 0.02, "axes": given_axes, **others})

    @model_validator(mode="before")
    @classmethod
    def _angle_as_radius(cls, data: Any) -> Any:
        """`tolerance_angle` [deg], which stands for the radius at which it is the tolerance."""
        if not isinstance(data, dict) or "tolerance_angle" not in data:
            return data
        rest = dict(data)
        angle, tolerance = rest.pop("tolerance_angle"), data.get("tolerance")
        if not isinstance(angle, int | float) or not 0 < angle < float("inf"):
            raise ValueError(f"tolerance_angle: must be above 0 [deg], found {angle!r}")
        if "rotary_radius" in data:
            raise ValueError("tolerance_angle and rotary_radius say the same thing; write one of them")
        if not isinstance(tolerance, int | float):
            return rest
        return rest | {"rotary_radius": tolerance / (angle * RAD_PER_DEG)}

    @field_validator("axes")
    @classmethod
    def _axes_known(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        known = (*ALL_AXES, EXTRUDER)
        for letter in axes:
            if letter not in known:
                raise ValueError(f"axis '{letter}' is not known; allowed are {', '.join(known)}")
            if axes[letter].wrapped and letter not in ROTARY_AXES:
                raise ValueError(f"{letter}.wrapped: only rotary axes (a, b, c) can be wrapped")
        if EXTRUDER in axes and axes[EXTRUDER].model_fields_set & {"travel_min", "travel_max"}:
            raise ValueError(f"{EXTRUDER}: an extruder has no travel; leave travel_min and travel_max out")
        for letter in ("x", "y"):
            if letter not in axes:
                raise ValueError(f"axis '{letter}' is missing; write a table [axes.{letter}]")
        return {letter: axes[letter] for letter in known if letter in axes}

    @field_validator("tools", mode="before")
    @classmethod
    def _lengths_alone(cls, tools: object) -> object:
        """A number alone is a tool's length."""
        if not isinstance(tools, dict):
            return tools
        return {n: {"length": t} if isinstance(t, int | float | str) else t for n, t in tools.items()}

    @field_validator("gcode_macros")
    @classmethod
    def _commands(cls, macros: dict[str, str]) -> dict[str, str]:
        for name in macros:
            if not _COMMAND.fullmatch(name):
                raise ValueError(f"'{name}' is no command of Klipper; write e.g. PRINT_START")
        return {name.upper(): lines for name, lines in macros.items()}

    @model_validator(mode="after")
    def _names_known(self) -> Machine:
        for table, allowed in (("positions", ("g28", "g30")), ("work_offsets", WORK_OFFSETS)):
            for key, values in getattr(self, table).items():
                if key not in allowed and not (table == "work_offsets" and _FURTHER_OFFSET.fullmatch(key)):
                    raise ValueError(f"{table}: '{key}' is not known; allowed are {', '.join(allowed)}")
                for letter in values:
                    if letter not in ALL_AXES:
                        known = ", ".join(ALL_AXES)
                        raise ValueError(f"{table}.{key}: axis '{letter}' is not known; allowed are {known}")
        for letter in self.kinematics.axes if self.kinematics else ():
            if letter not in self.axes:
                raise ValueError(f"kinematics: axis '{letter}' is missing; write a table [axes.{letter}]")
        for code, name in self.macros.items():
            if not _MACRO_OF.fullmatch(code) or not _MACRO.fullmatch(name):
                said = f'macros: {code} = "{name}" is not known; write an M code and the name of a macro'
                raise ValueError(f'{said}, e.g. M6 = "TOOL_CHANGE"')
        for tool in self.tools:
            if not tool.isdecimal() or len(tool) > TOOL_DIGITS:
                raise ValueError(f"tools: '{tool[:TOOL_DIGITS]}' is not a tool number; write e.g. 1 = 25.0")
        return self

    def limits(
        self, quantity: Literal["velocity", "acceleration", "jerk"], axes: tuple[str, ...]
    ) -> FloatArray:
        """Limits (A,) of the axes for one quantity, in mm and s; of rotary axes at `radius`. Raises
        InputError if the machine lacks one of the axes."""
        for letter in axes:
            if letter not in self.axes:
                raise InputError(
                    f"machine '{self.name}' has no axis '{letter}', which the program uses; add a table "
                    f"[axes.{letter}] with velocity, acceleration and jerk"
                )
        scale = [RAD_PER_DEG * self.radius if letter in ROTARY_AXES else 1.0 for letter in axes]
        return np.array([getattr(self.axes[letter], quantity) for letter in axes]) * scale

    def powers(self, axes: tuple[str, ...]) -> FloatArray:
        """(A,) limits of the drives' power over the mass that each moves [mm2/s3], of rotary axes at
        `radius`; inf where none is named."""
        named = [self.axes[letter].power or np.inf for letter in axes]
        scale = [self.radius**2 if letter in ROTARY_AXES else MM2_PER_M2 for letter in axes]
        return np.array(named) * scale

    @property
    def radius(self) -> float:
        """At which angles of rotary axes are lengths [mm]."""
        return self.rotary_radius or ROTARY_RADIUS

    @property
    def own(self) -> tuple[OwnLimit, ...]:
        """Limits beside those of a machine file (machine/user_limit.py)."""
        return self._own

    def check(self) -> None:
        """Raise InputError for keys and values that no machine file may have: `model_copy` takes any."""
        Machine(**_tables(self))

    def with_own(self, limits: Sequence[OwnLimit]) -> Machine:
        """The machine with these limits of one's own, and no others. Raises InputError for limits without a
        name, and for a name that is there already."""
        check_names(limits, [*self.axes, TANGENTIAL])
        machine = self.model_copy()
        machine._own = tuple(limits)
        return machine


def _tables(value: Any) -> Any:
    """A record as the nested tables that it could be made of, with the keys that were given."""
    if isinstance(value, Record):
        return {key: _tables(value.__dict__[key]) for key in sorted(value.model_fields_set)}
    if isinstance(value, dict):
        return {key: _tables(one) for key, one in value.items()}
    return [_tables(one) for one in value] if isinstance(value, list | tuple) else value


_TABLES: dict[str, type[Record]] = {
    **{"axes": Axis, "fir": Fir, "modes": Mode, "plotter": Plotter, "dialect": DialectData},
    **{"times": Times, "kinematics": KinematicsData, "control": ControlData, "tools": ToolData},
}
# The keys of the machine, under "", and of each table, that an unknown one may be meant for.
_KEYS = {
    "": [*Machine.model_fields, "tolerance_angle"],
    **{table: [*record.model_fields] for table, record in _TABLES.items()},
}


FAULTS_SAID = 20  # the others are counted
SHOWN = 60  # characters of a name or a value
# What is needed where pydantic finds a fault of a type; {gt} and so on are its context.
_NEEDED = {
    "greater_than": "above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "below {lt:g}",
    "finite_number": "a finite number",
    **dict.fromkeys(("float_type", "float_parsing"), "a number"),
    **dict.fromkeys(("int_type", "int_parsing"), "a whole number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type"), "a table"),
    "string_type": "a text",
    "literal_error": "{expected}",
    "tuple_type": "a list",
}


def faults_in_words(fault: ValidationError) -> str:
    """The faults of a machine, each with the key, what is needed and what was found."""
    faults: list[str] = []
    found = fault.errors()
    for error in found:
        if len(faults) == FAULTS_SAID:
            faults.append(f"and {len(found) - FAULTS_SAID:,} more")
            break
        place = [part if len(part) <= SHOWN else f"{part[:SHOWN]}..." for part in map(str, error["loc"])]
        key = ".".join(place)
        if error["type"] == "missing":
            faults.append(f"{key}: missing")
        elif error["type"] == "extra_forbidden":
            known = _KEYS.get("" if len(place) == 1 else place[0], ())
            near = difflib.get_close_matches(place[-1], known, n=1)
            faults.append(f"{key}: unknown key" + (f" (did you mean '{near[0]}'?)" if near else ""))
        elif error["type"] == "value_error":
            text = error["msg"].removeprefix("Value error, ")
            faults.append(f"{key}: {text}" if key else text)
        else:
            needed = f"must be {_NEEDED[error['type']]}" if error["type"] in _NEEDED else error["msg"]
            if error["type"] == "too_short":
                needed = "must have at least {min_length} entry"
            needed = needed.format(**error.get("ctx", {}))
            faults.append(f"{key}: {needed}, found {shown(error['input'])}")
    return "; ".join(faults)


def shown(value: object) -> str:
    """A value as it is named, at most `SHOWN` characters of it."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
