"""Limits of one's own with every solver: they are axes more of the same problem, so that all find the same motion."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from benchmarks.solvers.ratios import constraint_ratios
from planner import JointLimit, PathLimit
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import SWITCH_MIN, refine_for_jerk
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solvers import OWN, REACHABILITY, SECOND_ORDER, THIRD_ORDER
from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import OptimalMethod

CORNER = "G21 G90 G64 P0.05 F6000\nG1 X2\nX3 Y2\nM2\n"
MILL = load_machine("mill")
CLOSE = {"ipopt": 1e-4, "fatrop": 1e-4}  # cycle times beside that of the own solver [-]


class Jump(PathLimit):
    """The end of the part is of a harder material."""

    name = "hard"

    def velocity(self, at):
        return np.where(at.x < 1.5, 40.0, 25.0)

    def acceleration(self, at):
        return 800.0

    def jerk(self, at):
        return 2e4


class Arm(JointLimit):
    """An arm behind the part."""

    name, unit, turn = "arm", "rad", 2.0 * np.pi
    velocity, acceleration, jerk = 0.4, 6.0, 150.0

    def joint(self, at):
        return np.arctan2(at.y + 60.0, at.x + 20.0)


@pytest.fixture(scope="module")
def program():
    return parse_program(CORNER, MILL)


def planned(program, limits, **settings):
    """A plan that passes, with all limits reached."""
    plan = planner.plan(program, MILL, corner="bezier", effort="quick", limits=limits, **settings).require()
    assert plan.verdict.passed, plan.verdict.faults
    for limit in limits:
        checks = [c for name, c in plan.verdict.limits.items() if name.endswith(limit.name) and c.limited]
        assert max(check.ratio for check in checks) > 0.98
    return plan


def grid_and_problem(program, machine):
    """The grid of the path, the one for a solver with jerk limits, and its problem."""
    path = round_corners(
        toolpath_from_program(program, machine), machine, BezierCorner(), blend_tangents=True
    )
    before = sample_path(path, machine, third_order=True)
    after = refine_for_jerk(before, machine)
    return before, after, feedrate_problem(after, machine)


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
def test_every_solver_has_its_test():
    assert {OWN, *CLOSE} == set(THIRD_ORDER)
    assert {REACHABILITY, "toppra"} == set(SECOND_ORDER)


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
@pytest.mark.slow
@pytest.mark.parametrize("name", CLOSE)
def test_solvers_with_jerk_limits_keep_them_in_the_same_time(name, program):
    own, other = (planned(program, [Jump(), Arm()], solver=solver) for solver in (OWN, name))
    cycle_time = own.trajectory.cycle_time
    assert other.trajectory.cycle_time == pytest.approx(cycle_time, rel=CLOSE[name])
    for limit, price in own.prices.limits.items():  # multipliers come with all of them
        if limit.endswith(("hard", "arm")) and own.prices.saved[limit] > 2e-3 * cycle_time:
            assert other.prices.limits[limit] == pytest.approx(price, rel=0.05)


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
def test_solvers_without_jerk_limits_find_the_same_time(program):
    times = [
        planned(program, [Jump(), Arm()], method="second-order", solver=name).trajectory.cycle_time
        for name in SECOND_ORDER
    ]
    assert times[1] == pytest.approx(times[0], rel=1e-9)


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
@pytest.mark.slow
def test_a_solver_of_ones_own_gives_a_motion_with_exact_kinematics(program):
    """On intervals of a um, too, where the tolerance of ipopt would show as jerk."""
    machine = MILL.with_own([Jump()])
    plan = planner.plan(
        program, machine, method=OptimalMethod(solver=JerkLimitedNLP(tol=1e-7), corner="bezier")
    )
    assert plan.require().verdict.passed, plan.verdict.faults
    assert plan.verdict.limits["velocity.hard"].ratio > 0.98
    problem = grid_and_problem(program, machine)[2]
    found = JerkLimitedNLP(tol=1e-7).solve(problem).require()
    v, u, jerk, h = np.sqrt(found.feed_sq), found.acc_s, found.jerk_s, found.duration
    last = slice(0, -1)
    assert (v + u * h + jerk * h**2 / 2)[last] == pytest.approx(v[1:], abs=1e-12 * v.max())
    assert (v * h + u * h**2 / 2 + jerk * h**3 / 6)[last] == pytest.approx(np.diff(problem.s), abs=1e-14)
    assert constraint_ratios(problem, found)[0].max() <= 1.0 + 1e-12


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
def test_points_beside_a_jump_are_not_nearer_than_rounding_tells_apart(program):
    before, after, _ = grid_and_problem(program, MILL.with_own([Jump()]))
    shortest = [np.diff(samples.s)[samples.intervals].min() for samples in (before, after)]
    assert shortest[1] > SWITCH_MIN * shortest[0]


@pytest.mark.parametrize("push", [np.inf, 1e9], ids=["velocity", "acceleration"])
def test_what_never_binds_leaves_grid_and_profile_alone(program, push):
    """On a bend, where what the axes allow changes from point to point: no point and no row more."""

    class Never(PathLimit):
        name = "never"

        def velocity(self, at):
            return 1e4

        def acceleration(self, at):
            return push

    toolpath = toolpath_from_program(program, MILL)
    path = round_corners(toolpath, MILL, BezierCorner(), blend_tangents=True)
    found = []
    for machine in (MILL, MILL.with_own([Never()])):
        samples = sample_path(path, machine, third_order=True)
        problem = feedrate_problem(samples, machine)
        found.append((samples.s, THIRD_ORDER[OWN].solve(problem)))
    (s, plain), (s_never, never) = found
    np.testing.assert_array_equal(s, s_never)
    np.testing.assert_array_equal(plain.feed_sq, never.feed_sq)
    assert never.multipliers.rows.shape[1] == plain.multipliers.rows.shape[1] + 1
    assert not never.multipliers.rows[:, -1].any()
