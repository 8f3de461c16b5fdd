"""Chords between samples keep the tolerance too, whatever the period: closed forms of what they miss, and the law over all methods."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from quick import slow_but

from benchmarks.jobs import problems
from planner.delivery import mending, periods
from planner.delivery.periods import ABOVE, USED, missed, with_less_tolerance
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.motion.axis_motion import AxisMotion
from planner.motion.timing import sample_motion
from planner.motion.trajectory import joined
from planner.motion.vertex_times import passing_times, passing_times_of, standstills
from planner.nc.reader import parse_program
from planner.planning.job import job as jobs
from planner.planning.job import less_tolerance
from planner.planning.methods.fir import FirMethod
from planner.planning.methods.registry import plan

LEG = 10.0  # [mm]


def corner(theta: float):
    """Along x, then turned by theta."""
    return problems.polyline([[0, 0], [LEG, 0], [LEG + LEG * np.cos(theta), LEG * np.sin(theta)]])


def axis_motion(h, position, velocity, acceleration) -> AxisMotion:
    rows = [np.pad(np.asarray(x, float), ((0, 0), (0, 1))) for x in (position, velocity, acceleration)]
    return AxisMotion(
        axes=("x", "y", "z"), t=np.append(0.0, np.cumsum(h))[:-1], end=float(np.sum(h)), jerk=np.zeros_like(rows[0]),
        block=np.arange(len(h)), line=np.arange(1, len(h) + 1),
        **dict(zip(("position", "velocity", "acceleration"), rows, strict=True)),
    )  # fmt: skip


@pytest.mark.shows("tolerance", "exact: what chords miss of kinks and parabolas")
@pytest.mark.parametrize("degrees", [30, 90, 150])
def test_chords_cut_a_kink_by_half_a_period_s_way(degrees):
    """Both samples V dt/2 from the vertex: the chord passes it at V dt/2 cos(half the inner angle); the motion hits it."""
    theta, V, dt = np.deg2rad(degrees), 50.0, 0.01
    u = np.array([[1.0, 0.0], [np.cos(theta), np.sin(theta)]])
    motion = axis_motion([LEG / V] * 2, [[0, 0], [LEG, 0]], V * u, np.zeros((2, 2)))
    near, far = missed(motion, toolpath_from_program(corner(theta), problems.machine()), dt)
    np.testing.assert_allclose(near, 0.0, atol=1e-9)
    assert far[1] == pytest.approx(V * dt / 2 * np.cos((np.pi - theta) / 2), rel=1e-9)


@pytest.mark.shows("tolerance", "exact: what chords miss of kinks and parabolas")
def test_chords_leave_a_parabola_by_its_bow():
    """|q''| dt^2/8 where a sample lies on either side of the vertex, half a period away."""
    a, V, dt = 1000.0, 40.0, 0.01
    way = a * 0.1**2 / 2
    motion = axis_motion([0.1, 0.1], [[0, way], [0.1 * V, 0]], [[V, -0.1 * a], [V, 0]], [[0, a], [0, a]])
    program = problems.polyline([[0, way], [0.1 * V, 0], [0.2 * V, way]])
    near, far = missed(motion, toolpath_from_program(program, problems.machine()), dt)
    assert near[1] == pytest.approx(0.0, abs=1e-9)
    assert far[1] == pytest.approx(a * dt**2 / 8, rel=1e-6)


def test_corners_over_their_tolerance_get_less_and_hopeless_ones_are_stopped_at():
    path = toolpath_from_program(problems.zigzag(4), problems.machine())
    eps = path.tolerance[0]
    assert with_less_tolerance(path, path, np.zeros(5), np.full(5, (USED + ABOVE) * eps)) is None
    near, far = (np.array(x) * eps for x in ([0, 0.5, 0.5, 0.5, 0], [0, 0.9, 1.1, 1.6, 0]))
    less = with_less_tolerance(path, path, near, far)
    assert list(less.joint) == [Joint.STOP, Joint.CORNER, Joint.CORNER, Joint.STOP, Joint.STOP]
    assert less.tolerance[1] == eps
    assert 0.5 * eps < less.tolerance[2] < 0.9 * eps


# --- places in time -----------------------------------------------------------------------------------------------------------


def test_vertices_are_passed_in_order_and_full_circles_are_not_skipped():
    """Start, circle and end share a point; the dwell there is seen as one standstill."""
    job = parse_program("G21 G17 G90 F3000\nG1 X5\nG3 X5 Y0 I0 J3\nG4 P0.2\nG1 X0\nM2\n")
    made = plan(job, problems.machine(), method="stop").require()
    times = passing_times(made.trajectory, made.toolpath)
    assert (np.diff(times) > 0).all()
    count = len(made.trajectory)
    parts = (
        made.trajectory.rows(np.arange(k, min(k + 8, count))) for k in range(0, count, 7)
    )  # that share their ends
    np.testing.assert_array_equal(passing_times_of(parts, made.toolpath), times)
    at = made.trajectory.position[np.searchsorted(made.trajectory.t, times)]
    np.testing.assert_allclose(at, [[0, 0, 0], [5, 0, 0], [5, 0, 0], [0, 0, 0]], atol=0.06)
    arrival, departure = standstills(made.trajectory, made.toolpath, times)
    assert departure[-2] - arrival[-2] == pytest.approx(0.2, abs=2e-3)


def test_waiting_shifts_what_follows():
    made = plan(corner(np.pi / 2), problems.machine(), method="stop")
    half = made.trajectory.cycle_time / 2
    pieces = axis_motion(
        [0.1, 0.1, 0.1, 0.1],
        [[0, 0], [5, 0], [10, 0], [10, 5]],
        [[0, 0], [100, 0], [0, 0], [0, 100]],
        [[1000, 0], [-1000, 0], [0, 1000], [0, -1000]],
    )
    job = jobs.Job(program=made.program, machine=made.machine, toolpath=made.toolpath, stages=jobs.Stages())
    path_motion = _motion_of(made, job)
    for motion, at in ((pieces, 0.2), (path_motion, half)):
        longer = motion.waiting(np.array([at]), np.array([0.013]))
        assert longer.end == pytest.approx(motion.end + 0.013, abs=1e-12)
        t = np.linspace(0.0, motion.end, 301)
        then = np.where(t > at, t + 0.013, t)
        np.testing.assert_allclose(longer.at(then, 1e-3).position, motion.at(t, 1e-3).position, atol=1e-9)
        inside = longer.at(at + np.linspace(1e-4, 0.0129, 5), 1e-3)
        assert not inside.velocity.any()
        assert not inside.acceleration.any()


def _motion_of(made, job):
    """The motion along a path that method `stop` delivers."""
    from planner.planning.methods.stop import StopMethod

    return StopMethod().plan_job(job).making.motion


def test_chunks_that_share_their_ends_are_joined():
    motion = axis_motion([0.1], [[0, 0]], [[10, 0]], [[0, 0]])
    whole = sample_motion(motion, 0.01)
    parts = [motion.at(whole.t[:5], 0.01), motion.at(whole.t[4:], 0.01)]
    np.testing.assert_array_equal(joined(parts).t, whole.t)


# --- the law ------------------------------------------------------------------------------------------------------------------

PERIODS = [(0.004, 5e-3), (0.008, 20e-3), (0.016, 10e-3), (0.020, 50e-3)]  # dt [s], eps [mm]
TURNS = np.deg2rad([30.0, -90.0, 150.0])
CORNERS = "".join(
    f"G1 X{x:.5f} Y{y:.5f}\n"
    for x, y in np.cumsum(8.0 * np.stack([f(np.append(0.0, np.cumsum(TURNS))) for f in (np.cos, np.sin)], axis=1), axis=0)
)  # fmt: skip
LAW_JOB = parse_program(f"G21 G17 G90 F6000\n{CORNERS}G91 G3 X0 Y4 I0 J2\nG1 X-6\nM2\n")


ARC_JOB = parse_program("G21 G17 G90 F6000\nG1 X5\nG91 G3 X0 Y4 I0 J2\nG1 X-6\nM2\n")
# At such periods the search of `second-order` takes 20 s with the usual effort, and a tenth of it with this one.
LEAST_EFFORT = {"second-order": {"effort": "quick"}}


def coarse(dt: float, eps: float):
    return problems.machine(dt=dt, tolerance=eps, jerk=1e5)


@pytest.mark.shows("tolerance", "sampled: every method at every period")
@pytest.mark.slow
@pytest.mark.parametrize(("dt", "eps"), PERIODS)
@pytest.mark.parametrize(
    "method",
    slow_but(("stop", "second-order"), ["stop", "kinematic", "bezier", "fir", "fir-spline", "second-order"]),
)
def test_every_period_keeps_the_tolerance(method, dt, eps):
    made = plan(LAW_JOB, coarse(dt, eps), method=method, **LEAST_EFFORT.get(method, {})).require()
    assert made.verdict.passed, made.verdict.faults


@pytest.mark.slow
@pytest.mark.parametrize(("dt", "eps"), PERIODS[::3])
def test_the_optimum_keeps_the_tolerance_at_every_period(dt, eps):
    made = plan(LAW_JOB, coarse(dt, eps)).require()
    assert made.verdict.passed, made.verdict.faults


def test_stops_wait_less_than_a_period():
    made = plan(LAW_JOB, coarse(0.02, 5e-3), method="stop")
    assert made.stop_time < made.trajectory.cycle_time < made.stop_time + 0.02 * (len(made.toolpath) - 1)
    fine = plan(LAW_JOB, problems.machine(), method="stop")
    assert fine.trajectory.cycle_time == pytest.approx(fine.stop_time, rel=1e-9)


@pytest.mark.slow
def test_what_the_period_takes_is_said_and_the_programmed_path_is_what_is_judged():
    made = plan(ARC_JOB, coarse(0.02, 2e-3), geometry="spline")
    assert any(note.startswith("samples 20 ms apart") for note in made.notes)
    np.testing.assert_array_equal(made.toolpath.tolerance, 2e-3)
    assert (made.toolpath.joint[1:-1] != Joint.STOP).all()


@pytest.mark.slow
def test_without_it_chords_leave_the_tolerance(monkeypatch):
    """What the law would say of a planner that forgot its period."""
    monkeypatch.setattr(less_tolerance, "PERIOD_ROUNDS", 0)
    monkeypatch.setattr(mending, "ROUNDS", 0)
    assert not plan(ARC_JOB, coarse(0.02, 2e-3), geometry="spline").verdict.passed
    nothing = periods.Standing(np.empty(0), np.empty(0))
    monkeypatch.setattr(periods, "standing", lambda *given: nothing)
    assert not plan(LAW_JOB, coarse(0.02, 5e-3), method="stop").verdict.passed


def test_methods_that_promise_no_tolerance_are_delivered_as_they_are():
    assert not FirMethod(plain=True).keeps_tolerance
    made = plan(dataclasses.replace(LAW_JOB), coarse(0.02, 5e-3), method="fir-plain")
    assert not any("apart" in note for note in made.notes)
