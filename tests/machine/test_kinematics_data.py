"""The table [kinematics] of a machine file: what is read, and what is refused with the key."""

from __future__ import annotations

import pytest

from planner.base.errors import InputError
from planner.machine import KinematicsData, Machine, machine_from_dict
from planner.machine.kinematics import kinematics_of

LIMITS = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 20000.0}


def machine(kinematics: dict | None, axes: str = "xyzac") -> Machine:
    data = {"name": "five", "dt": 0.001, "tolerance": 0.01, "axes": dict.fromkeys(axes, LIMITS)}
    return machine_from_dict(data | ({} if kinematics is None else {"kinematics": kinematics}))


def test_the_table_is_read() -> None:
    found = kinematics_of(machine({"type": "xyzac-trt", "z_offset": 3.0, "tool_length": 40.0}))
    assert (found.axes, found.length, found.data.z_offset) == (("x", "y", "z", "a", "c"), 40.0, 3.0)
    assert kinematics_of(machine({"type": "head-head"}, "xyzbc"), 25.0).length == 25.0


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "kinematics.type"),
        ({"type": "xyzab-trt"}, "'xyzac-trt', 'xyzbc-trt', 'head-table' or 'head-head'"),
        (
            {"type": "xyzac-trt", "x_offset": 1.0},
            "'x_offset' is not used by type xyzac-trt; it has y_offset, z_offset",
        ),
        ({"type": "xyzac-trt", "tilt": "a"}, "'tilt' is not used"),
        ({"type": "head-head", "tilt": "a", "x_rot_point": 1.0}, "its table does not turn"),
        ({"type": "head-table", "tilt": "a", "pivot_length": -1.0}, "must be 0 or more"),
        ({"type": "xyzac-trt", "z_offset": float("inf")}, "must be a finite number"),
        ({"type": "xyzac-trt", "zoffset": 1.0}, "did you mean 'z_offset'"),
        ({"type": "xyzac-trt", "reversed": ["b"]}, "'b' is no axis of type xyzac-trt"),
        ({"type": "xyzbc-trt"}, r"axis 'b' is missing; write a table \[axes.b\]"),
    ],
)
def test_wrong_values_are_refused(table: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        machine(table)


def test_a_machine_without_the_table_has_no_tool_centre_point() -> None:
    with pytest.raises(InputError, match=r"needs a table \[kinematics\]"):
        kinematics_of(machine(None))


@pytest.mark.parametrize("kind", ["xyzac-trt", "xyzbc-trt", "head-table", "head-head"])
def test_written_and_read_again(kind: str) -> None:
    data = KinematicsData(type=kind, tool_length=12.0)
    assert KinematicsData(**data.model_dump(mode="json")) == data
