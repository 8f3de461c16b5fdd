"""Chords of a planned motion: none misses a setpoint by more than it may, whatever the curvature does."""

from __future__ import annotations

import re

import numpy as np
import pytest

import planner
from planner.controls.export.chords import DECIMALS, planned_polyline
from planner.controls.export.controls import CONTROLS
from planner.controls.export.program import Candidates

# Curvature jumps at corners, turns back, and is very different on two arcs.
TURNS = "G21 G64 P0.02 F3000\nG1 X10\nG1 X10.4 Y6\nG3 X6.4 Y10 I-4 J0\nG2 X6.6 Y10.2 I0.2 J0\nG1 X2\nG1 X9\nG1 Y9\nM2\n"


@pytest.mark.parametrize("switches", [False, True])
@pytest.mark.parametrize("within", [5e-4, 2e-3, 2e-2])
def test_no_chord_misses_a_setpoint_by_more(within: float, switches: bool) -> None:
    plan = planner.plan(planner.read_program(text=TURNS), "mill", method="kinematic")
    blocks = np.arange(len(plan.program) + 1 if switches else 0)
    line = planned_polyline(plan, within, blocks)
    assert line.miss <= within
    points, position = line.points, np.asarray(plan.trajectory.position)
    step = np.diff(points, axis=0)
    size = (step**2).sum(axis=1)
    share = np.clip(((position[:, None] - points[:-1]) * step).sum(axis=2) / size, 0.0, 1.0)
    far = np.linalg.norm(position[:, None] - points[:-1] - share[..., None] * step, axis=2).min(axis=1)
    assert far.max() <= within
    assert len(line.feed) < 0.7 * len(position)  # they are not the setpoints themselves
    vertices = {tuple(row) for row in np.round(position, DECIMALS)}
    assert switches or all(tuple(point) in vertices for point in points)


def test_what_is_switched_between_chords_is_switched_where_the_program_says() -> None:
    """It was at the setpoint before, up to a period early: 0.4 mm at 400 mm/s."""
    ends = [20, 30, 41, 50, 67]
    moves = "".join(f"X{x} S{100 * (k % 2)}\n" for k, x in enumerate(ends))
    text = f"G21 G90 G94\nG0 X0 Y0\nM4 S0\nG1 X10 F24000\n{moves}X100 Y10 S5\nY50 S7\nM5\nM2\n"
    made = planner.plan(
        planner.read_program(text=text, machine="mill"), "mill", tolerance=0.04, method="kinematic"
    )
    job = Candidates(made, CONTROLS["grbl"], 0.05)
    (one,) = job.chords(0.005)
    assert one.line.miss <= 0.005
    said = re.findall(r"X([\d.]+).* S\d", job.written(one)[0].decode())
    assert [float(x) for x in said[:4]] == ends[:4]
