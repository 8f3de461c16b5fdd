"""Machines with kinematics, and programs of points of the tip with rotary angles."""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.machine import Machine
from planner.nc.points import program_of_points
from planner.nc.program import Program

AXES = ("x", "y", "z", "a", "c")


def limits(velocity: float, acceleration: float, jerk: float) -> dict[str, float]:
    return {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}


def table_machine(**kinematics: float) -> Machine:
    """Tilting rotary table, xyzac-trt."""
    return Machine(
        name="five",
        dt=0.001,
        tolerance=0.01,
        axes={
            "x": limits(300.0, 3000.0, 60000.0),
            "y": limits(300.0, 3000.0, 60000.0),
            "z": limits(200.0, 2000.0, 40000.0),
            "a": limits(90.0, 900.0, 18000.0),
            "c": limits(180.0, 1800.0, 36000.0),
        },
        kinematics={"type": "xyzac-trt"} | kinematics,
    )


def tip_program(machine: Machine, points: np.ndarray, feed: float, tolerance: float) -> Program:
    """Straight moves between points x y z a c (n, 5) of the tip [mm, rad]."""
    plain = program_of_points(np.ascontiguousarray(points[:, :3]), np.full(len(points) - 1, feed), tolerance)
    known = {f.name: getattr(plain, f.name) for f in dataclasses.fields(plain) if f.name != "splines"}
    return Program(
        **(known | {"axes": AXES, "start": points[0], "end": points[1:], "arc_center": np.zeros((0, 5))})
    )
