"""Method `second-order`: multipliers of its motion, and what reshaping by them gains."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from whole_plans import solve

from benchmarks.jobs import problems
from planner.feedrate.costates import second_order_multipliers
from planner.feedrate.reachability import Reachability
from planner.planning.methods.registry import plan
from planner.planning.methods.second_order import SecondOrderMethod

MACHINE = problems.machine()
JOBS = {
    "pentagon": problems.pentagon(),
    "zigzag": problems.zigzag(5),
    "circle": problems.chord_circle(60),
    "spiral": problems.star_spiral(60),
    "five points": problems.five_points(),
}


@pytest.mark.parametrize("name", ["zigzag", "spiral", "five points"])
def test_multipliers_are_what_the_acceleration_limits_cost(name):
    """-dT/d(ln a) by differences, where nothing but acceleration limits."""
    solved = solve(problems.all_jobs()[name], MACHINE)
    found = second_order_multipliers(solved.problem, solved.solution)
    step = 1e-3
    slower, faster = (
        Reachability().solve(
            dataclasses.replace(solved.problem, acceleration=solved.problem.acceleration * by)
        )
        for by in (1 - step, 1 + step)
    )
    cost = (slower.cycle_time - faster.cycle_time) / (2 * step)
    assert np.abs(found.rows).sum() == pytest.approx(cost, rel=0.1)
    assert (found.feed >= 0).all()


@pytest.mark.parametrize("name", JOBS)
def test_all_multipliers_together_are_half_of_the_time(name):
    """Limits of x and of accelerations larger by the same factor make every speed larger by its root: dT/d(ln limits) = -T/2."""
    solved = solve(JOBS[name], MACHINE)
    found = second_order_multipliers(solved.problem, solved.solution)
    assert np.abs(found.rows).sum() + found.feed.sum() == pytest.approx(
        solved.solution.cycle_time / 2, rel=0.1
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", JOBS)
def test_fewer_limits_take_less_time(name):
    """Faster than on a path first, and than with jerk limits as well."""
    made = plan(JOBS[name], MACHINE, method="second-order").require()
    assert made.verdict.passed, made.verdict.faults
    assert not made.verdict.limits["jerk.x"].limited
    laid = SecondOrderMethod(rounds=0).plan(JOBS[name], MACHINE)
    assert made.trajectory.cycle_time < laid.trajectory.cycle_time
    assert made.trajectory.cycle_time < plan(JOBS[name], MACHINE).trajectory.cycle_time


@pytest.mark.parametrize("effort", ["quick", "normal"])
def test_more_jerk_than_matters_is_no_limit(effort):
    """`optimal` tends to `second-order` as the jerk limits grow, and is never faster."""
    job = JOBS["pentagon"]
    axes = {name: axis.model_copy(update={"jerk": 1e4 * axis.jerk}) for name, axis in MACHINE.axes.items()}
    most = MACHINE.model_copy(update={"axes": axes})
    near = plan(job, most, effort=effort).require().cycle_time
    limit = plan(job, MACHINE, method="second-order", effort=effort).require().cycle_time
    assert limit == pytest.approx(near, rel=1e-3)
    assert plan(job, MACHINE, effort=effort).require().cycle_time > 1.005 * limit
