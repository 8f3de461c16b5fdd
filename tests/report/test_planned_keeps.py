"""`planned.ngc` is the program with other F words: machine coordinates, offsets, first moves, tools and everything else stay."""

from __future__ import annotations

import re

import pytest

import planner
from planner.machine import Machine
from planner.report.planned import planned_program

AXIS = {"velocity": 200.0, "acceleration": 800.0, "jerk": 8000.0}
TEXT = (
    "G21 G90 G17 G54\nG53 G0 Z-2\nG0 X0 Y0\nZ4\nG1 Z-1 F300\nX25 F9000\nX31 Y9 (a)\nG0 Z4\nG53 G0 Z-2\nG91 G30 X0\nG90\nG0 X3 Y3\n"
    "G43 H1 Z1\nG92 X0\nG55\nG1 X4 Y5\nT1 M6\nM2\n"
)


@pytest.mark.shows("planned-ngc", "exact: nothing but F words changes")
def test_nothing_but_f_words_changes() -> None:
    machine = Machine(
        name="m",
        dt=0.002,
        tolerance=0.03,
        axes={"x": AXIS, "y": AXIS, "z": AXIS},
        work_offsets={"g54": {"x": 90.0, "z": -150.0}},
    )
    plan = planner.plan(planner.read_program(text=TEXT, machine=machine), machine, method="stop")
    text = planned_program(plan)[0].decode()
    assert text != TEXT
    assert re.sub(r" ?F[\d.]+", "", text) == re.sub(r" ?F[\d.]+", "", TEXT)
