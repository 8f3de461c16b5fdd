"""What both papers share: the measured deviation, slowing down, and the choice between plans."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from guides import distance_to_polyline, guide_through, machine_of

from benchmarks.jobs import problems
from planner.baselines.fir.chord_guide import guide_of_path
from planner.baselines.fir.chord_speeds import first_plan
from planner.baselines.fir.fastest_schedule import plan_for
from planner.baselines.fir.slow_down import RATIO_ROUNDING, SpeedPlan, fastest_of, make, slow_down
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine

MACHINE = machine_of()
# Three runs: the path turns back twice.
POINTS = np.array([[0, 0], [20, 0], [30, 10], [20, 0], [20, 15], [22, 18], [20, 15], [30, 8], [35, 8]], float)


def plans_along(paper: str, machine: Machine = MACHINE) -> list[SpeedPlan]:
    """Plans that promise to be fast, not yet slowed down."""
    if paper == "000":
        guide = guide_through(POINTS, machine)
        ones = np.ones(guide.runs)
        return [plan_for(guide, machine, speed * ones, 1.0) for speed in (100.0, 60.0, 30.0)]
    toolpath = toolpath_from_program(problems.polyline(POINTS), machine)
    path = round_corners(
        dataclasses.replace(toolpath, tolerance=0.1 * toolpath.tolerance), machine, BezierCorner()
    )
    path = dataclasses.replace(path, toolpath=toolpath, tol=path.tol / 0.1)
    guide = guide_of_path(sample_path(path, machine, 0.05), machine)
    return [first_plan(guide, machine, share * guide.largest(guide.feed)) for share in (1.0, 0.5, 0.2)]


@pytest.fixture(scope="module", params=["000", "001"])
def plans(request) -> list[SpeedPlan]:
    return plans_along(request.param)


def test_the_measured_error_bounds_the_distance_from_the_path(plans):
    """By brute force at many times, for the motion of a plan that breaks the tolerance."""
    plan = plans[0]
    made = make(plan, MACHINE)
    motion, guide = made.motion, plan.guide
    t = np.linspace(0.0, motion.ends[-1] - 1e-9, 4000)
    m = np.clip(np.searchsorted(motion.t, t, side="right") - 1, 0, len(motion.t) - 1)
    h = (t - motion.t[m])[:, None]
    p, v, a, j = motion.state[:, m, :-1]
    apart = distance_to_polyline(p + h * (v + h * (a / 2 + h * j / 6)), guide.point)
    assert apart.max() > 1e-3
    assert apart.max() <= (made.seen.error.max() * guide.budget.max()) * (1 + 1e-9)


def test_slowed_down_a_plan_keeps_everything(plans):
    for plan in plans:
        slower = slow_down(plan, MACHINE)
        assert make(slower, MACHINE).seen.worst.max() <= 1 + RATIO_ROUNDING
        assert (slower.time() >= plan.time() * (1 - 1e-12)).all()


def test_each_run_gets_the_plan_that_is_fastest_for_it(plans):
    alone = np.array([slow_down(plan, MACHINE).time() for plan in plans])
    best = fastest_of(plans, MACHINE)
    np.testing.assert_allclose(best.time(), alone.min(axis=0), rtol=1e-12)
    assert make(best, MACHINE).seen.worst.max() <= 1 + RATIO_ROUNDING


def test_runs_that_exceed_nothing_stay_as_they_are(plans):
    """Two of three runs are done: only the other gets slower, also in the rounds that end it in any case."""
    done = slow_down(plans[-1], MACHINE)
    wrong = np.array([False, True, False])
    fast = dataclasses.replace(
        done, T1=np.where(wrong, done.T1 / 2, done.T1), T2=np.where(wrong, done.T2 / 2, done.T2)
    )
    made = make(fast, MACHINE)
    assert (made.wrong == wrong).all()
    for n in (0, 60):
        slower = fast.slower(made, MACHINE, n).time()
        np.testing.assert_allclose(slower[~wrong], fast.time()[~wrong], rtol=1e-12)
        assert slower[1] > fast.time()[1]
