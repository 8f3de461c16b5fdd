"""The table [kinematics] of a machine file: which rotary axes carry the table and the tool, and how far they are from each other."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from planner.machine.parts import Finite, NotNegative, Record

XYZAC, XYZBC, HEAD_TABLE, HEAD_HEAD = "xyzac-trt", "xyzbc-trt", "head-table", "head-head"
TILTING = ("a", "b")  # letters of the axis that tilts; the other one is c
# What each type has beside the point of rotation and the tool's length.
_KEYS = {
    XYZAC: ("y_offset", "z_offset"),
    XYZBC: ("x_offset", "z_offset"),
    HEAD_TABLE: ("x_offset", "y_offset", "pivot_length", "tilt"),
    HEAD_HEAD: ("x_offset", "y_offset", "pivot_length", "tilt"),
}


class KinematicsData(Record):
    """How the rotary axes carry the workpiece and the tool; machine/kinematics/chain.py has the formulas.

    type         : "xyzac-trt", "xyzbc-trt" (both axes turn the table), "head-table" (the head tilts, the table turns about z) or
                   "head-head" (an axis c carries the axis that tilts the tool)
    x_rot_point, y_rot_point, z_rot_point : point on the axis of c where it turns the table, in machine coordinates [mm]
    x_offset, y_offset, z_offset : tables: from that point to the tilting axis; heads: from the tilting axis to the tool's axis [mm]
    pivot_length : heads: from the tilting axis down to the spindle's nose [mm]
    tool_length  : where the program names no tool of another length [mm]
    tilt         : heads: letter of the tilting axis, "a" or "b"
    reversed     : letters of axes whose positive direction is the left-handed one
    """

    type: Literal["xyzac-trt", "xyzbc-trt", "head-table", "head-head"]
    x_rot_point: Finite = 0.0
    y_rot_point: Finite = 0.0
    z_rot_point: Finite = 0.0
    x_offset: Finite = 0.0
    y_offset: Finite = 0.0
    z_offset: Finite = 0.0
    pivot_length: NotNegative = 0.0
    tool_length: Finite = 0.0
    tilt: Literal["a", "b"] = "b"
    reversed: tuple[Literal["a", "b", "c"], ...] = ()

    @model_validator(mode="after")
    def _of_this_type(self) -> KinematicsData:
        allowed = _KEYS[self.type]
        for key in ("x_offset", "y_offset", "z_offset", "pivot_length", "tilt"):
            if key in self.model_fields_set and key not in allowed:
                raise ValueError(f"'{key}' is not used by type {self.type}; it has {', '.join(allowed)}")
        if self.type == HEAD_HEAD:
            for key in ("x_rot_point", "y_rot_point", "z_rot_point"):
                if key in self.model_fields_set:
                    raise ValueError(f"'{key}' is not used by type {self.type}: its table does not turn")
        for letter in self.reversed:
            if letter not in self.rotary:
                raise ValueError(f"reversed: '{letter}' is no axis of type {self.type}; it has {self.axes}")
        return self

    @model_serializer(mode="wrap")
    def _keys_of_this_type(self, written: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The keys that its type has, as they are read again."""
        found: dict[str, Any] = written(self)
        absent = {key for keys in _KEYS.values() for key in keys} - {*_KEYS[self.type]}
        if self.type == HEAD_HEAD:
            absent |= {"x_rot_point", "y_rot_point", "z_rot_point"}
        return {key: value for key, value in found.items() if key not in absent}

    @property
    def rotary(self) -> tuple[str, str]:
        """Letters of the tilting axis and of the one that turns about z."""
        return {XYZAC: "a", XYZBC: "b"}.get(self.type, self.tilt), "c"

    @property
    def axes(self) -> str:
        """All five letters: "xyzac"."""
        return "xyz" + "".join(self.rotary)
