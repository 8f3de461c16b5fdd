"""Points of any named axes, splines through points, and plans that are run slower."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.machine import Machine, load_machine
from planner.motion.trajectory import Trajectory
from planner.nc.program import Kind
from planner.nc.reader import read_program

MILL = load_machine("mill")
LETTERS = "xyzabcuvw"


@pytest.fixture(scope="module")
def nine() -> Machine:
    """Axes of all letters."""
    turning = MILL.axes["x"].model_copy(update={"velocity": 90.0, "acceleration": 900.0, "jerk": 20_000.0})
    axes = {letter: turning if letter in "abc" else MILL.axes["x"] for letter in LETTERS}
    return MILL.model_copy(update={"axes": axes})


WAY = np.array([[0, 0, 0, 0, 0, 0, 0, 0, 0], [5, 3, 1, 10, 5, 2, 3, 4, 5], [9, 9, 0, 0, 9, 9, 1, 1, 9.0]])


def test_nine_axes_pass_their_points_in_order(nine: Machine) -> None:
    plan = planner.plan(planner.path(WAY, 20.0, axes=LETTERS), nine)
    assert plan.verdict.passed
    trajectory = plan.trajectory
    assert trajectory.axes == tuple(LETTERS)
    place = trajectory.position * trajectory.in_degrees
    np.testing.assert_allclose(place[[0, -1]], WAY[[0, -1]], atol=1e-6)
    middle = np.linalg.norm(trajectory.position - WAY[1] / trajectory.in_degrees, axis=1)
    assert middle.min() <= plan.toolpath.tolerance.max() + 0.1


def test_columns_stand_where_their_letters_say() -> None:
    program = planner.path([[0.0, 1.0], [90.0, 2.0]], 30.0, axes="cy")
    assert program.axes == ("x", "y", "z", "c")
    np.testing.assert_allclose(program.start, [0.0, 1.0, 0.0, 0.0])
    np.testing.assert_allclose(program.end, [[0.0, 2.0, 0.0, np.pi / 2]])
    alone = planner.path([[0.0], [90.0]], 30.0, axes="c")
    np.testing.assert_allclose(alone.feed, np.deg2rad(30.0))


@pytest.mark.parametrize("spline", [False, True])
def test_a_plan_of_named_axes_is_read_back(tmp_path: Path, nine: Machine, spline: bool) -> None:
    program = planner.path(WAY[:, [0, 1, 5]], 20.0, axes="xyc", spline=spline)
    plan = planner.plan(program, nine, method="stop")
    plan.save(tmp_path / "out")
    again = read_program(tmp_path / "out" / "program.json")
    assert again.axes == program.axes
    np.testing.assert_array_equal(again.end, program.end)
    np.testing.assert_array_equal(again.splines.points, program.splines.points)


def test_a_spline_passes_its_points_with_one_tangent_and_curvature() -> None:
    points = np.array([[0, 0], [10, 4], [18, -3], [30, 0], [36, 9.0]])
    program = planner.path(points, 40.0, spline=True)
    assert (program.kind == Kind.SPLINE).all()
    np.testing.assert_allclose(program.end[:, :2], points[1:])
    p = program.splines.points[:, :, :2]
    h = np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None]
    leaves, arrives = 3 * (p[:, 1] - p[:, 0]) / h, 3 * (p[:, 3] - p[:, 2]) / h
    np.testing.assert_allclose(arrives[:-1], leaves[1:], atol=1e-12)
    begins = 6 * (p[:, 2] - 2 * p[:, 1] + p[:, 0]) / h**2
    ends = 6 * (p[:, 3] - 2 * p[:, 2] + p[:, 1]) / h**2
    np.testing.assert_allclose(ends[:-1], begins[1:], atol=1e-12)
    np.testing.assert_allclose([begins[0], ends[-1]], 0.0, atol=1e-12)
    plan = planner.plan(program, "mill")
    assert plan.verdict.passed
    for point in points:
        near = np.linalg.norm(plan.trajectory.position[:, :2] - point, axis=1).min()
        assert near <= plan.toolpath.tolerance.max() + 40.0 * plan.machine.dt


def test_a_spline_of_a_tool_and_an_angle(nine: Machine) -> None:
    plan = planner.plan(planner.path(WAY[:, [0, 1, 5]], 20.0, axes="xyc", spline=True), nine)
    assert plan.verdict.passed


@pytest.mark.parametrize("factor", [1.0, 1.003, 1.7, 20.0])
def test_a_stretched_plan_is_the_same_way_slower(factor: float) -> None:
    plan = planner.plan(planner.path([[0, 0], [20, 0], [20, 20], [3, 9]], feed=80.0), "mill")
    was: Trajectory = plan.trajectory
    slower = planner.stretched(plan, factor * plan.cycle_time)
    now: Trajectory = slower.trajectory
    assert slower.cycle_time == pytest.approx(factor * plan.cycle_time, abs=1e-9)
    assert slower.verdict.passed
    at = [np.interp(now.t / factor, was.t, was.position[:, k]) for k in range(3)]
    np.testing.assert_allclose(now.position, np.transpose(at), atol=0.13 * 4000 * was.dt**2)
    ratio = slower.verdict.limits["acceleration.x"].ratio / plan.verdict.limits["acceleration.x"].ratio
    assert ratio == pytest.approx(factor**-2, rel=0.03)


def test_what_cannot_be_is_refused() -> None:
    plan = planner.plan(planner.path([[0, 0], [20, 0]], feed=80.0), "mill", method="stop")
    for duration in (0.5 * plan.cycle_time, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="duration"):
            planner.stretched(plan, duration)
    line = [[0.0, 0.0], [1.0, 0.0]]
    for given, said in (
        ({"axes": "xx"}, "each letter once"),
        ({"axes": "xq"}, "each letter once"),
        ({"axes": "xyz"}, r"\(n, 3\)"),
        ({"spline": True}, "needs a feed"),
    ):
        with pytest.raises(InputError, match=said):
            planner.path(line, **given)
    with pytest.raises(InputError, match="twice running"):
        planner.path([[0, 0], [0, 0], [1, 1]], 10.0, spline=True)
