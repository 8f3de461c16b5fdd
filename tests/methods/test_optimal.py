"""Method `optimal` end to end: every job verified with its jerk limited, and placed between the bound and the full stops."""

from __future__ import annotations

import pytest

import planner
from benchmarks import problems
from planner.methods.optimal import OptimalMethod

JOBS = problems.all_jobs()
MACHINE = problems.machine()


@pytest.mark.parametrize("corner", ["bezier", "fir"])
@pytest.mark.parametrize("name", JOBS)
def test_jobs_are_verified_with_their_jerk_limited(name, corner):
    plan = OptimalMethod(corner=corner).plan(JOBS[name], MACHINE)
    assert plan.verdict.passed, plan.verdict.faults
    assert all(check.limited for check in plan.verdict.limits.values())
    bound = planner.plan(JOBS[name], MACHINE, method="toppra", corner=corner)
    assert bound.trajectory.cycle_time * (1 - 2e-3) <= plan.trajectory.cycle_time <= plan.stop_time
    assert plan.corners.worst_ratio() <= 1 + 1e-9


def test_the_pentagon_is_faster_than_stopping_at_its_corners():
    plan = OptimalMethod().plan(problems.pentagon(), MACHINE)
    assert plan.trajectory.cycle_time == pytest.approx(0.989, rel=2e-3)
    assert plan.stop_time == pytest.approx(1.0651, rel=1e-4)
