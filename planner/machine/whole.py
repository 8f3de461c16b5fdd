"""The record of a whole machine: what a machine file says, checked, and limits of one's own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field, PrivateAttr, ValidationError, field_validator, model_validator

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.constraints.own import OwnLimit, check_names
from planner.machine.faults import faults_in_words
from planner.machine.kinematics_data import KinematicsData
from planner.machine.parts import (
    Axis,
    DialectData,
    Finite,
    Fir,
    Mode,
    Plotter,
    Positive,
    Record,
    Times,
    ToolData,
)

LINEAR_AXES = ("x", "y", "z")
ROTARY_AXES = ("a", "b", "c")
EXTRUDER = "e"  # follows the path, and is no axis of it
TOOL_DIGITS = 9  # of a tool number: more do not fit the 32 bits of a control
_FURTHER_OFFSET = re.compile(r"g54\.1p([1-9]|[1-9]\d|[12]\d\d|300)")  # G54.1 P1 to P300
WORK_OFFSETS = ("g54", "g55", "g56", "g57", "g58", "g59", "g59.1", "g59.2", "g59.3")


class Machine(Record):
    """A machine. The template explains every key. Raises InputError for all faults at once.

    name                : of the machine
    axes                : limits by axis letter, at least x and y; "e" is the extruder of a 3-D printer, in mm of filament
    dt                  : interpolation period [s]
    tolerance           : contour tolerance eps [mm]
    path_control        : what holds before the first G61, G61.1 or G64 of a program
    feed_max            : largest feed along the path [mm/s], or None
    feed_default        : feed of moves before the first F word of a program [mm/s], or None: they are refused
    normal_acceleration : largest normal acceleration [mm/s2], A_max of paper 002 eq. (19), or None
    blend_rapids        : whether joints between G0 and feed moves are rounded
    kinematics          : how rotary axes carry workpiece and tool, or None: the tool centre point is not known
    """

    name: str
    dt: Positive
    tolerance: Positive
    path_control: Literal["blend", "exact_path", "exact_stop"] = "blend"
    axes: dict[str, Axis]
    feed_max: Positive | None = None
    feed_default: Positive | None = None
    normal_acceleration: Positive | None = None
    blend_rapids: bool = False
    fir: Fir | None = None
    modes: tuple[Mode, ...] = ()
    plotter: Plotter | None = None
    dialect: DialectData | None = None
    times: Times | None = None
    kinematics: KinematicsData | None = None
    tools: dict[str, ToolData] = Field(default_factory=dict)
    positions: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    work_offsets: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    _own: tuple[OwnLimit, ...] = PrivateAttr(default=())

    def __init__(self, **data: Any):
        try:
            super().__init__(**data)
        except ValidationError as fault:
            raise InputError(faults_in_words(fault, _KEYS)) from None

    @field_validator("axes")
    @classmethod
    def _axes_known(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        known = (*LINEAR_AXES, *ROTARY_AXES, EXTRUDER)
        for letter in axes:
            if letter not in known:
                raise ValueError(f"axis '{letter}' is not known; allowed are {', '.join(known)}")
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

    @model_validator(mode="after")
    def _names_known(self) -> Machine:
        for table, allowed in (("positions", ("g28", "g30")), ("work_offsets", WORK_OFFSETS)):
            for key, values in getattr(self, table).items():
                if key not in allowed and not (table == "work_offsets" and _FURTHER_OFFSET.fullmatch(key)):
                    raise ValueError(f"{table}: '{key}' is not known; allowed are {', '.join(allowed)}")
                for letter in values:
                    if letter not in LINEAR_AXES:
                        raise ValueError(f"{table}.{key}: axis '{letter}' is not known; allowed are x, y, z")
        for letter in self.kinematics.axes if self.kinematics else ():
            if letter not in self.axes:
                raise ValueError(f"kinematics: axis '{letter}' is missing; write a table [axes.{letter}]")
        for tool in self.tools:
            if not tool.isdecimal() or len(tool) > TOOL_DIGITS:
                raise ValueError(f"tools: '{tool[:TOOL_DIGITS]}' is not a tool number; write e.g. 1 = 25.0")
        return self

    def limits(
        self, quantity: Literal["velocity", "acceleration", "jerk"], axes: tuple[str, ...]
    ) -> FloatArray:
        """Limits (A,) of the axes for one quantity, in mm or rad and s.

        Raises InputError if the machine lacks one of the axes.
        """
        for letter in axes:
            if letter not in self.axes:
                raise InputError(
                    f"machine '{self.name}' has no axis '{letter}', which the program uses; add a table "
                    f"[axes.{letter}] with velocity, acceleration and jerk"
                )
        scale = [RAD_PER_DEG if letter in ROTARY_AXES else 1.0 for letter in axes]
        return np.array([getattr(self.axes[letter], quantity) for letter in axes]) * scale

    @property
    def own(self) -> tuple[OwnLimit, ...]:
        """Limits beside those of a machine file (constraints/own.py)."""
        return self._own

    def with_own(self, limits: Sequence[OwnLimit]) -> Machine:
        """The machine with these limits of one's own, and no others.

        Raises InputError for limits without a name, and for a name that is there already.
        """
        check_names(limits, [*self.axes])
        machine = self.model_copy()
        machine._own = tuple(limits)
        return machine


# The keys of the machine, under "", and of each table, that an unknown one may be meant for.
_KEYS = {
    "": [*Machine.model_fields],
    "axes": [*Axis.model_fields],
    "fir": [*Fir.model_fields],
    "modes": [*Mode.model_fields],
    "plotter": [*Plotter.model_fields],
    "dialect": [*DialectData.model_fields],
    "times": [*Times.model_fields],
    "kinematics": [*KinematicsData.model_fields],
    "tools": [*ToolData.model_fields],
}
