"""Chords of a planned motion: none misses a setpoint by more than it may, whatever the curvature does."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.controls.export.chords import DECIMALS, planned_polyline

# Curvature jumps at corners, turns back, and is very different on two arcs.
TURNS = "G21 G64 P0.02 F3000\nG1 X10\nG1 X10.4 Y6\nG3 X6.4 Y10 I-4 J0\nG2 X6.6 Y10.2 I0.2 J0\nG1 X2\nG1 X9\nG1 Y9\nM2\n"


@pytest.mark.parametrize("within", [5e-4, 2e-3, 2e-2])
def test_no_chord_misses_a_setpoint_by_more(within: float) -> None:
    plan = planner.plan(planner.read_program(text=TURNS), "mill", method="kinematic")
    line = planned_polyline(plan, within, np.zeros(0, dtype=int))
    assert line.miss <= within
    points, position = line.points, np.asarray(plan.trajectory.position)
    step = np.diff(points, axis=0)
    size = (step**2).sum(axis=1)
    share = np.clip(((position[:, None] - points[:-1]) * step).sum(axis=2) / size, 0.0, 1.0)
    far = np.linalg.norm(position[:, None] - points[:-1] - share[..., None] * step, axis=2).min(axis=1)
    assert far.max() <= within
    assert len(line.feed) < 0.7 * len(position)  # they are not the setpoints themselves
    vertices = {tuple(row) for row in np.round(position, DECIMALS)}
    assert all(tuple(point) in vertices for point in points)
