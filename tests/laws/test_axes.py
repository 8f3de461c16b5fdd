"""Closed forms and laws of axes beside x, y and z, and how far a motion leaves its path in lengths and in angles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import planner
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine
from planner.planning.job.plan import Plan

LINEAR = {"velocity": 200.0, "acceleration": 2000.0, "jerk": 40000.0}
ROTARY = {"velocity": 120.0, "acceleration": 900.0, "jerk": 15000.0}
METHODS = ("stop", "kinematic", "second-order", "optimal")
SEARCHED = ("second-order", "optimal")


def machine_of(letters: str, **more) -> Machine:
    axes = {letter: ROTARY if letter in "abc" else LINEAR for letter in letters}
    return Machine(**({"name": "axes", "dt": 0.001, "tolerance": 0.02, "axes": axes} | more))


def planned(text: str, machine: Machine, method: str, **settings) -> Plan:
    program = planner.read_program(text=text, machine=machine)
    plan = planner.plan(program, machine, method=method, **settings).require()
    assert plan.verdict.passed, plan.verdict.faults
    return plan


@pytest.mark.shows("rotary", "exact: pure rotations")
@pytest.mark.parametrize("method", ["stop", pytest.param("optimal", marks=pytest.mark.slow)])
def test_a_pure_rotation_takes_the_time_of_its_joint(method: str) -> None:
    """Rest to rest through an angle that reaches velocity and acceleration: angle/v + v/a + a/j, whatever the radius."""
    v, a, j = ROTARY["velocity"], ROTARY["acceleration"], ROTARY["jerk"]
    for radius in (1.0, 50.0, 700.0):
        plan = planned("G21 F900000\nG1 A300\n", machine_of("xya", rotary_radius=radius), method)
        assert plan.cycle_time == pytest.approx(300.0 / v + v / a + a / j, rel=1e-3)
        last = plan.trajectory.position[-1] * plan.trajectory.in_degrees
        assert last[plan.trajectory.axes.index("a")] == pytest.approx(300.0, abs=1e-9)


def test_f_of_a_pure_rotation_is_in_degrees() -> None:
    """At 60 deg/s (F3600), of limits that are higher: the same with acceleration and jerk alone."""
    a, j = ROTARY["acceleration"], ROTARY["jerk"]
    plan = planned("G21 F3600\nG1 B200\n", machine_of("xyb"), "stop")
    assert plan.cycle_time == pytest.approx(200.0 / 60.0 + 60.0 / a + a / j, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_u_and_v_move_like_x_and_y(method: str) -> None:
    """To 1e-3 where geometry and feed are searched together, which ends a little elsewhere with axes beside that stand still."""
    text = "G21 F6000\nG1 X20\nY15\nX40 Y30\nX0\n"
    xy = planned(text, machine_of("xyuv"), method)
    uv = planned(text.replace("X", "U").replace("Y", "V"), machine_of("xyuv"), method)
    assert uv.cycle_time == pytest.approx(xy.cycle_time, rel=1e-3 if method in SEARCHED else 1e-9)


NINE = "G21 F4000\nG1 X20 A40\nX40 Y10 A60 V3\nY30 B10 Z2\nA120 W4\nC30 U7\nX60 Y10 C60 B0\nX50 A0 U0\n"


@pytest.mark.parametrize("method", ["kinematic", "bezier", "fir"])
def test_axes_that_stand_still_change_nothing(method: str) -> None:
    """On any number of axes, also where records of kernels have room for more of them."""
    text = "G21 F6000\nG1 X20\nY15\nX40 Y30\nG0 X0\n"
    times = [planned(text, machine_of(letters), method).cycle_time for letters in ("xyz", "xyzu", "xyzuvw")]
    assert times[1:] == pytest.approx(times[:1] * 2, rel=1e-9)


# A search has a kernel for five axes, and one of its own for each number above, which takes a minute to compile.
FIVE = "G21 F4000\nG1 X20 A40 U7\nX40 Y10 A60 B10 U10\nY30 U8\n"


@pytest.mark.shows("optimal", "sampled: closed forms and mirrored, turned, scaled jobs in up to five axes")
@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_mirrored_job_in_many_axes_takes_the_same_time(method: str) -> None:
    """In nine, and in five where path and feed are searched."""
    text, letters = (FIVE, "xyabu") if method in SEARCHED else (NINE, "xyzabcuvw")
    mirrored = text.translate(str.maketrans({"A": "A-", "Y": "Y-", "U": "U-"}))
    settings = {"effort": "quick"} if method in SEARCHED else {}
    one, other = (planned(own, machine_of(letters), method, **settings) for own in (text, mirrored))
    assert other.cycle_time == pytest.approx(one.cycle_time, rel=3e-4 if method == "optimal" else 1e-6)


@pytest.mark.slow
def test_linear_and_rotary_axes_that_move_together_are_searched() -> None:
    """Geometry and feed together, with F as the speed in x, y and z: nothing of it is broken, and the mirrored job takes as long."""
    text = "G21 F2700\nG1 X11 A5\nX19 Y7 A12\nX33 Y10 Z2 A16\nX41 Y22 A19\nX28 Y31 A11\n"
    plan = planned(text, machine_of("xyza"), "optimal")
    assert "path and feed optimised together" in plan.sentence
    assert 0.999 < plan.verdict.limits["feed"].ratio <= 1.0
    other = planned(text.replace("Y", "Y-").replace("A", "A-"), machine_of("xyza"), "optimal")
    assert other.cycle_time == pytest.approx(plan.cycle_time, rel=1e-4)
    assert plan.cycle_time < planned(text, machine_of("xyza"), "kinematic").cycle_time


def test_a_slower_machine_takes_longer_by_the_factor() -> None:
    """Time scale: velocities by 1/2, accelerations by 1/4, jerks by 1/8, the feed by 1/2."""
    by = {"velocity": 0.5, "acceleration": 0.25, "jerk": 0.125}
    machine = machine_of("xyzabcuvw")
    slow = machine_of(
        "xyzabcuvw",
        dt=0.002,
        axes={
            letter: {name: getattr(axis, name) * share for name, share in by.items()}
            for letter, axis in machine.axes.items()
        },
    )
    for method in ("stop", "kinematic"):
        fast = planned(NINE, machine, method)
        slower = planned(NINE.replace("F4000", "F2000"), slow, method)
        assert slower.cycle_time == pytest.approx(2.0 * fast.cycle_time, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["kinematic", *SEARCHED])
def test_lengths_and_angles_stay_within_their_tolerances(method: str) -> None:
    """The corridor is measured here, by the distance of each sample from the programmed polyline in x y z u v w, and in a b c, at the
    place of the polyline that is nearest in both."""
    text, letters = (FIVE, "xyabu") if method in SEARCHED else (NINE, "xyzabcuvw")
    machine = machine_of(letters, tolerance=0.05, tolerance_angle=0.1)
    assert machine.radius == pytest.approx(0.05 / (0.1 * RAD_PER_DEG))
    plan = planned(text, machine, method)
    axes = plan.trajectory.axes
    at = plan.trajectory.position * plan.trajectory.in_degrees
    program = planner.read_program(text=text, machine=machine)
    degrees = [1.0 / RAD_PER_DEG if letter in "abc" else 1.0 for letter in axes]
    vertex = np.vstack([program.start, program.end])[:, [program.axes.index(c) for c in axes]] * degrees
    rotary = np.array([letter in "abc" for letter in axes])
    weight = np.where(rotary, 0.05 / 0.1, 1.0)
    best = np.full(len(at), np.inf)
    for a, b in itertools.pairwise(vertex):
        along = (b - a) * weight
        share = np.clip((at - a) * weight @ along / (along @ along), 0.0, 1.0)
        off = np.abs(at - a - share[:, None] * (b - a))
        linear = np.linalg.norm(off[:, ~rotary], axis=1) / 0.05
        angular = np.linalg.norm(off[:, rotary], axis=1) / 0.1
        best = np.minimum(best, np.maximum(linear, angular))
    assert best.max() < 1.0 + 1e-6
    assert best.max() > 0.2, "nothing was rounded"


def test_the_angle_of_the_tolerance_says_the_radius() -> None:
    with pytest.raises(planner.InputError, match="tolerance_angle"):
        machine_of("xya", tolerance_angle=0.0)
    with pytest.raises(planner.InputError, match="write one of them"):
        machine_of("xya", tolerance_angle=0.1, rotary_radius=10.0)
    with pytest.raises(planner.InputError, match="only rotary axes"):
        machine_of("xyu", axes={"x": LINEAR, "y": LINEAR, "u": LINEAR | {"wrapped": True}})
