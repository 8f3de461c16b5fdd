"""Method `stop`, the baseline: every block from rest to rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planner
from benchmarks.jobs import problems
from planner.base.point_to_point import rest_to_rest_times
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.geometry.build import toolpath_from_program
from planner.nc.reader import parse_program
from planner.planning.methods.stop import StopMethod

JOBS = problems.all_jobs()
MACHINE = problems.machine()


@pytest.fixture(scope="module", params=["pentagon", "arcs", "five points"])
def planned(request):
    return StopMethod().plan(JOBS[request.param], MACHINE)


def test_the_pentagon_takes_what_the_papers_setting_gives():
    assert StopMethod().plan(JOBS["pentagon"], MACHINE).trajectory.cycle_time == pytest.approx(
        1.065, abs=5e-4
    )


@pytest.mark.shows("stop", "exact: the closed form of every block")
def test_the_plan_is_verified_and_as_long_as_the_closed_form(planned):
    assert planned.require().verdict.passed, planned.verdict.faults
    assert planned.trajectory.cycle_time == pytest.approx(planned.stop_time, rel=1e-6)


def test_every_programmed_point_is_met_at_rest(planned):
    path, got = planned.toolpath, planned.trajectory
    ends = np.cumsum(rest_to_rest_times(path.length, *block_limits(path, MACHINE)))
    for end, point in zip(ends, path.end, strict=True):
        near = np.abs(got.t - end).argmin()
        gap = abs(got.t[near] - end)
        reach = 2e5 * np.sqrt(3) * gap**3 / 6 + 1e-3 * np.sqrt(3) * 100 * (gap > 1e-3)
        assert np.linalg.norm(got.position[near] - point) <= reach + 1e-6
        assert np.abs(got.velocity[near]).max() <= 2e5 * np.sqrt(3) * gap**2 / 2 + 1e-6


def test_limits_hold_with_jerk(planned):
    got = planned.trajectory
    assert np.abs(got.velocity).max() <= 100 * (1 + 1e-9)
    assert np.abs(got.acceleration).max() <= 2000 * (1 + 1e-9)
    assert np.abs(got.jerk).max() <= 2e5 * (1 + 1e-9)


def test_dwells_add_up():
    with_dwells = StopMethod().plan(
        parse_program("G21 F6000\nG4 P0.5\nG1 X10\nG4 P1\nY10\nG4 P0.25\n"), MACHINE
    )
    without = StopMethod().plan(parse_program("G21 F6000\nG1 X10\nY10\n"), MACHINE)
    extra = with_dwells.trajectory.cycle_time - without.trajectory.cycle_time
    assert extra == pytest.approx(1.75, rel=1e-9)
    still = with_dwells.trajectory.t < 0.499
    assert not with_dwells.trajectory.velocity[still].any()


def test_jerk_limits_on_arcs_are_safe_for_every_direction():
    """block_limits on a circle: acceleration and jerk vectors stay within the smallest axis limit."""
    program = parse_program("G21 G17 F60000\nG2 X0 Y0 I1 J0\n")
    path = toolpath_from_program(program, MACHINE)
    v, a, j = block_limits(path, MACHINE)
    kappa = path.curvature
    assert (np.hypot(kappa * v**2, a) <= 2000 * (1 + 1e-12)).all()
    assert (np.hypot(kappa**2 * v**3 + j, 3 * kappa * v * a) <= 2e5 * (1 + 1e-12)).all()


@pytest.mark.parametrize("plane", ["G17", "G18", "G19"])
def test_axes_that_stand_still_do_not_limit_an_arc(plane):
    """Found by fuzzing: on a machine with a slow z an arc in x and y took seven times as long."""
    ends = {"G17": "X0 Y0 I3 J0", "G18": "X0 Z0 I3 K0", "G19": "Y0 Z0 J3 K0"}
    program = parse_program(f"G21 {plane} F6000\nG2 {ends[plane]}\n")
    still = {"G17": "z", "G18": "y", "G19": "x"}[plane]
    slow = MACHINE.axes["x"].model_copy(update={"velocity": 1.0, "acceleration": 10.0, "jerk": 100.0})
    machine = MACHINE.model_copy(update={"axes": MACHINE.axes | {still: slow}})
    for method in ("stop", "kinematic", "bezier"):
        made, usual = (planner.plan(program, one, method=method) for one in (machine, MACHINE))
        assert made.verdict.passed, made.verdict.faults
        assert made.cycle_time == pytest.approx(usual.cycle_time, rel=1e-9)


def test_an_axis_limits_a_helix_by_its_rise():
    """z rises by 1 mm in a turn of 12 pi mm: a limit of a tenth of the others' does not matter there, one of a hundredth does."""
    program = parse_program("G21 G17 F6000\nG2 X0 Y0 Z1 I6 J0\n")
    times = []
    for share in (1.0, 0.1, 0.01):
        axis = MACHINE.axes["z"]
        limits = {name: share * getattr(axis, name) for name in ("velocity", "acceleration", "jerk")}
        machine = MACHINE.model_copy(update={"axes": MACHINE.axes | {"z": axis.model_copy(update=limits)}})
        made = StopMethod().plan(program, machine)
        assert made.verdict.passed, made.verdict.faults
        times.append(made.trajectory.cycle_time)
    assert times[1] == pytest.approx(times[0], rel=1e-9)
    assert times[2] > 1.2 * times[1]


@given(
    radius=st.floats(0.02, 50.0), sweep=st.floats(0.1, 12.0), velocity=st.floats(10.0, 1000.0), acceleration=st.floats(100.0, 1e5),
    jerk=st.floats(1e4, 1e7), looser=st.sampled_from(["velocity", "acceleration", "jerk"]), by=st.floats(1.01, 3.0),
)  # fmt: skip
@settings(max_examples=30)
def test_looser_limits_never_make_an_arc_take_longer(radius, sweep, velocity, acceleration, jerk, looser, by):
    """Found by the campaign of random jobs: with 1.6 times the acceleration a job took 1.5 times as long."""
    limits = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
    turns, last = int(sweep // (2 * np.pi)) + 1, radius * np.exp(1j * (sweep % (2 * np.pi)))
    text = f"G21 G17 G90 F1000000\nG1 X{radius:.9f}\nG3 X{last.real:.9f} Y{last.imag:.9f} I{-radius:.9f} J0 P{turns}\n"
    times = []
    for more in (1.0, by):
        machine = problems.machine(**(limits | {looser: limits[looser] * more}))
        path = toolpath_from_program(parse_program(text), machine)
        v, a, j = (limit[-1] for limit in block_limits(path, machine))
        smallest, kappa = acceleration * (more if looser == "acceleration" else 1.0), path.curvature[-1]
        assert np.hypot(kappa * v**2, a) <= smallest * (1 + 1e-9)
        largest = jerk * (more if looser == "jerk" else 1.0)
        assert np.hypot(kappa**2 * v**3 + j, 3 * kappa * v * a) <= largest * (1 + 1e-9)
        times.append(rest_to_rest_times(path.length[-1:], *(np.array([x]) for x in (v, a, j)))[0])
    assert times[1] <= times[0] * (1 + 1e-5)


def test_an_arc_with_an_acceleration_far_beyond_its_jerk_takes_seconds():
    """Found by benchmarks/fuzz: a quarter of a circle was planned at 0.003 mm/s, half an hour of samples for the verifier."""
    machine = problems.machine(velocity=100.0, acceleration=9e7, jerk=1.0)
    path = toolpath_from_program(parse_program("G21 G17 G90 F900\nG1 X5 Y1\nG2 X9 Y5 R4\n"), machine)
    times = rest_to_rest_times(path.length, *block_limits(path, machine))
    assert times[-1] < 20.0
