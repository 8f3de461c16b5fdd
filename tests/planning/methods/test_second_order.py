"""Method `second-order`: fewer limits take less time, and jerk without end is none."""

from __future__ import annotations

import pytest

from benchmarks.jobs import problems
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


@pytest.mark.slow
@pytest.mark.parametrize("name", JOBS)
def test_fewer_limits_take_less_time(name):
    """Faster than on a path first, and than with jerk limits as well."""
    made = plan(JOBS[name], MACHINE, method="second-order").require()
    assert made.verdict.passed, made.verdict.faults
    assert not made.verdict.limits["jerk.x"].limited
    laid = SecondOrderMethod(corner="spline").plan(JOBS[name], MACHINE)
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
