"""Limits of one's own: reached and not exceeded, judged by the verdict, and worth what they are."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

import planner
from planner import JointLimit, PathLimit
from planner.base.errors import InputError
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.reader import read_program
from planner.verifier import Given, verify

JOB = """G21 G90 G64 P0.05
F6000
G1 X0 Y0
G1 X20 Y5
G1 X30 Y0
G3 X40 Y10 I0 J10
G1 X20 Y20
G1 X0 Y20
M2
"""


class Soft(PathLimit):
    """Half of the part is of a material that takes less."""

    name = "spindle power"

    def __init__(self, slow=40.0, acceleration=800.0, jerk=2e4):
        self.slow, self.most, self.jerk_max = slow, acceleration, jerk

    def velocity(self, at):
        return np.where(at.x < 10.0, 100.0, self.slow)

    def acceleration(self, at):
        return self.most

    def jerk(self, at):
        return self.jerk_max


class Turntable(JointLimit):
    name, unit = "turntable", "rad"
    velocity, acceleration, jerk, turn = 3.0, 40.0, 2000.0, 2 * np.pi

    def joint(self, at):
        return np.arctan2(at.y + 30.0, at.x + 20.0)


class Behind(Turntable):
    """The same joint, with the jump of arctan2 on the path."""

    def joint(self, at):
        return np.arctan2(-(at.y - 10.0), -(at.x + 20.0))


class Downhill(PathLimit):
    """Slower to the left: a limit that depends on the direction."""

    name = "pull"

    def velocity(self, at):
        return np.where(at.direction[:, 0] < 0.0, 30.0, np.inf)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    file = tmp_path_factory.mktemp("own") / "job.ngc"
    file.write_text(JOB)
    return read_program(file, load_machine("mill"))


def _ratios(plan, name):
    return {key.partition(".")[0]: c.ratio for key, c in plan.verdict.limits.items() if key.endswith(name)}


def test_to_a_solver_it_is_an_axis_as_fast_as_the_path_with_the_same_shares_of_its_limits(job):
    """The turntable by the derivative of its angle, whose largest becomes 1 whatever unit it is in."""
    machine, table = load_machine("mill"), Turntable()
    path = round_corners(toolpath_from_program(job, machine), machine, BezierCorner())
    samples = sample_path(path, machine, 1e-2)
    problem = feedrate_problem(samples, machine.with_own([table]))
    x, y = (samples.position[:, :2] + [20.0, 30.0]).T
    turning = (x * samples.d1[:, 1] - y * samples.d1[:, 0]) / (x**2 + y**2)
    assert np.abs(turning).max() < 0.1
    assert np.abs(problem.d1[:, -1]).max() == pytest.approx(1.0)
    for most, bound in (("acceleration", 40.0), ("jerk", 2000.0)):
        share = problem.d1[:, -1] / getattr(problem, most)[-1]
        np.testing.assert_allclose(share, turning / bound, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("method", ["second-order", "optimal"])
@pytest.mark.parametrize("limit", [Soft(), Turntable(), Behind(), Downhill()], ids=lambda limit: limit.name)
def test_a_limit_is_reached_and_not_exceeded(job, method, limit):
    """It holds the motion somewhere, and nowhere is more of it: the verdict says so from the positions."""
    made = planner.plan(job, method=method, corner="bezier", limits=[limit])
    assert made.verdict.passed, made.verdict.faults
    limited = [c for name, c in made.verdict.limits.items() if name.endswith(limit.name) and c.limited]
    assert limited
    assert max(check.ratio for check in limited) > 0.999
    assert any(name.endswith(limit.name) for name, _ in made.grid.ranked())


@pytest.mark.slow
@pytest.mark.parametrize("limit", [Soft(), Turntable()], ids=lambda limit: limit.name)
def test_splines_keep_it_too(job, limit):
    made = planner.plan(job, method="second-order", corner="spline", limits=[limit])
    assert made.verdict.passed, made.verdict.faults
    assert max(_ratios(made, limit.name)[q] for q in ("velocity", "acceleration")) > 0.999


@pytest.mark.parametrize("limit", [Soft(), Turntable()], ids=lambda limit: limit.name)
def test_a_motion_planned_without_is_faulted(job, limit):
    """By name, in the columns and in the positions alone."""
    made = planner.plan(job, corner="bezier")
    machine = made.machine.with_own([limit])
    found = verify(made.trajectory, made.toolpath, machine)
    assert any(limit.name in fault for fault in found.sentences)
    by_positions = verify(made.trajectory, made.toolpath, machine, given=Given(columns=()))
    assert any(limit.name in fault and "differences" in fault for fault in by_positions.sentences)
    reported = verify(
        made.trajectory, made.toolpath, machine, not_limited=("velocity", "acceleration", "jerk")
    )
    assert not any(limit.name in fault for fault in reported.sentences)


@pytest.mark.slow
def test_loosening_never_costs_and_a_loose_limit_costs_nothing(job):
    plain = planner.plan(job, corner="bezier").trajectory.cycle_time
    times = []
    for by in (1.0, 2.0, 4.0, 1e3):
        limit = Turntable()
        limit.velocity, limit.acceleration, limit.jerk = 3.0 * by, 10.0 * by, 500.0 * by
        times.append(planner.plan(job, corner="bezier", limits=[limit]).trajectory.cycle_time)
    assert all(later <= sooner * (1.0 + 1e-4) for sooner, later in itertools.pairwise(times))
    assert times[-1] == pytest.approx(plain, rel=2e-3)  # a finer grid
    assert times[0] > 1.02 * plain


def test_a_joint_that_is_an_axis_is_that_axis(job):
    """The closed form: a joint q = 2 x with twice the limits of x changes nothing; with less it does what less of x does."""
    machine = load_machine("mill")
    x = machine.axes["x"]

    class Twice(JointLimit):
        name = "twice"
        velocity, acceleration, jerk = x.velocity, x.acceleration, x.jerk

        def joint(self, at):
            return 2.0 * at.x

    halved = {"velocity": x.velocity / 2, "acceleration": x.acceleration / 2, "jerk": x.jerk / 2}
    slower = machine.model_copy(update={"axes": machine.axes | {"x": x.model_copy(update=halved)}})
    by_axis = planner.plan(job, slower, corner="bezier")
    by_joint = planner.plan(job, machine, corner="bezier", limits=[Twice()])
    assert by_joint.trajectory.cycle_time == pytest.approx(by_axis.trajectory.cycle_time, rel=3e-3)


def test_the_path_limit_on_a_line_is_the_ramp(tmp_path):
    """From rest to rest over L with a and v along the path: L/v + v/a, in the second-order method."""
    file = tmp_path / "line.ngc"
    file.write_text("G21 G90\nF6000\nG1 X0 Y0\nG1 X60 Y80\nM2\n")

    class Gentle(PathLimit):
        name = "gentle"

        def velocity(self, at):
            return 50.0

        def acceleration(self, at):
            return 250.0

    made = planner.plan(file, method="second-order", limits=[Gentle()])
    assert made.trajectory.cycle_time == pytest.approx(100.0 / 50.0 + 50.0 / 250.0, rel=1e-6)


def test_other_methods_are_judged_by_it(job):
    made = planner.plan(job, method="kinematic", limits=[Soft()])
    assert any("spindle power" in fault for fault in made.verdict.sentences)


class _Bad(Soft):
    def velocity(self, at):
        return np.where(at.x < 10.0, 100.0, 0.0)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ([_Bad()], "limit 'spindle power': velocity 0 at x"),
        ([Soft(), Soft()], "the name 'spindle power' is taken"),
        ([dataclasses.make_dataclass("Named", [], bases=(Soft,), namespace={"name": "x"})()], "'x' is taken"),
        ([PathLimit()], "PathLimit is called ''"),
        (["power"], "'power' is not a limit"),
    ],
)
def test_limits_that_cannot_be_are_refused(job, limits, said):
    with pytest.raises(InputError, match=said):
        planner.plan(job, corner="bezier", limits=limits)


def test_a_joint_without_derivatives_on_the_path_is_refused(job):
    class Pole(Turntable):
        def joint(self, at):
            return np.arctan2(at.y, at.x)  # the path begins at its pole

    with pytest.raises(InputError, match="has no derivatives at x0 y0"):
        planner.plan(job, corner="bezier", limits=[Pole()])


def test_limits_are_no_part_of_a_machine_file():
    machine = load_machine("mill").with_own([Soft()])
    assert machine.own
    assert "own" not in machine.model_dump()
    assert machine.model_copy(update={"dt": 0.002}).own == machine.own
    assert not machine.with_own(()).own
