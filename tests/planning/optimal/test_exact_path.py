"""G61: the programmed path itself, with full stops where limited jerk allows no other motion on it."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.base.arrays import FloatArray
from planner.planning.job.plan import Plan

TEXT = "G21 G90 G17 {mode} F3000\nG1 X20\nG3 X30 Y10 J10\nG1 Y30\nG2 X40 Y40 I10\nG1 X60\n"
TANGENT = np.array([[20.0, 0.0], [30.0, 10.0], [30.0, 30.0], [40.0, 40.0]])


def planned(text: str, method: str, **how: object) -> Plan:
    machine = planner.load_machine("mill")
    plan = planner.plan(planner.read_program(text=text, machine=machine), machine, method=method, **how)
    assert plan.verdict is not None
    assert plan.verdict.passed, plan.verdict.faults
    return plan


def off(plan: Plan) -> FloatArray:
    """(T,) distance of each setpoint from the lines and arcs of `TEXT`, whichever is nearest [mm]."""
    assert plan.trajectory is not None
    x, y = plan.trajectory.position[:, :2].T
    first, second = np.abs(np.hypot(x - 20, y - 10) - 10), np.abs(np.hypot(x - 40, y - 30) - 10)
    distances = [
        np.where(x <= 20, np.abs(y), np.inf),
        np.where((x >= 20) & (y <= 10), first, np.inf),
        np.where((y >= 10) & (y <= 30), np.abs(x - 30), np.inf),
        np.where((x <= 40) & (y >= 30), second, np.inf),
        np.where(x >= 40, np.abs(y - 40), np.inf),
    ]
    found: FloatArray = np.min(distances, axis=0)
    return found


def feed_at(plan: Plan, place: FloatArray) -> float:
    """The least feed within a tenth of a millimetre of a place [mm/s]."""
    assert plan.trajectory is not None
    near = np.linalg.norm(plan.trajectory.position[:, :2] - place, axis=1) < 0.1
    return float(plan.trajectory.feed[near].min())


@pytest.mark.shows("exact-path", "sampled: verified within 1 nm of lines, arcs and curves")
def test_optimal_follows_it_and_stops_where_the_curvature_jumps() -> None:
    exact, rounded = (planned(TEXT.format(mode=mode), "optimal", effort="quick") for mode in ("G61", "G64"))
    assert off(exact).max() < 1e-9
    assert off(rounded).max() > 1e-3
    assert max(feed_at(exact, place) for place in TANGENT) < 1.0
    assert min(feed_at(rounded, place) for place in TANGENT) > 20.0
    assert any("line 2: the first of 4 full stops where G61" in note for note in exact.notes)
    assert not any("G61" in note for note in rounded.notes)


def test_without_limited_jerk_tangents_are_passed_on_the_path() -> None:
    plan = planned(TEXT.format(mode="G61"), "second-order")
    assert off(plan).max() < 1e-9
    assert min(feed_at(plan, place) for place in TANGENT) > 20.0


def test_circles_of_one_radius_are_passed() -> None:
    plan = planned("G21 G61 F3000\nG3 X10 Y10 I0 J10\nG3 X0 Y20 I-10 J0\n", "optimal", effort="quick")
    assert feed_at(plan, np.array([10.0, 10.0])) > 20.0
    assert plan.trajectory is not None
    x, y = plan.trajectory.position[:, :2].T
    assert np.abs(np.hypot(x, y - 10) - 10).max() < 1e-9


@pytest.mark.slow
def test_blocks_under_g64_beside_it_use_their_tolerance() -> None:
    text = TEXT.format(mode="G61") + "G64 P0.02\nG1 X80\nY20\nX100\n"
    plan = planned(text, "optimal")
    assert plan.trajectory is not None
    before = plan.trajectory.position[:, 0] <= 60.0
    assert off(plan)[before].max() < 1e-9
    assert plan.verdict is not None
    assert plan.verdict.contour_error_mm is not None
    assert plan.verdict.contour_error_mm > 1e-2
