"""What both papers share: runs picked and put back, the measured deviation, slowing down, and the choice between plans."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from guides import distance_to_polyline, guide_through, machine_of

from benchmarks.jobs import problems
from planner.baselines.fir.chord_guide import guide_of_path
from planner.baselines.fir.chord_speeds import promised
from planner.baselines.fir.fastest_schedule import plan_for
from planner.baselines.fir.guide import per
from planner.baselines.fir.slow_down import RATIO_ROUNDING, WORTH, SpeedPlan, make, settled_fastest, slow_down
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
        return [plan_for(guide, machine, speed * ones, ones) for speed in (100.0, 60.0, 30.0)]
    toolpath = toolpath_from_program(problems.polyline(POINTS), machine)
    path = round_corners(
        dataclasses.replace(toolpath, tolerance=0.1 * toolpath.tolerance), machine, BezierCorner()
    )
    path = dataclasses.replace(path, toolpath=toolpath, tol=path.tol / 0.1)
    return list(promised(guide_of_path(sample_path(path, machine, 0.05), machine), machine)[0])[::8]


@pytest.fixture(scope="module", params=["000", "001"])
def plans(request) -> list[SpeedPlan]:
    return plans_along(request.param)


def test_runs_picked_and_put_back_are_the_plan(plans):
    one, other = plans[0], plans[-1]
    assert one.guide.runs == 3
    chosen = np.array([True, False, True])
    part = other.pick(chosen)
    assert len(part.guide) == np.diff(other.guide.first)[chosen].sum()
    np.testing.assert_allclose(part.time(), other.time()[chosen], rtol=1e-12)
    np.testing.assert_allclose(
        one.put(chosen, part).time(), np.where(chosen, other.time(), one.time()), rtol=1e-12
    )
    whole = one.put(chosen, one.pick(chosen))
    for field in dataclasses.fields(one):
        if "rows" in field.metadata:
            np.testing.assert_array_equal(getattr(whole, field.name), getattr(one, field.name))


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
    times = np.array([plan.time() for plan in plans])
    alone = np.array([slow_down(plan, MACHINE).time() for plan in plans])
    best = settled_fastest(plans, times, MACHINE).time()
    assert (best >= alone.min(axis=0) * (1 - 1e-9)).all()
    assert (best <= alone.min(axis=0) * (1 + WORTH) * (1 + 1e-9)).all()


def test_columns_of_the_wrong_length_are_refused(plans):
    assert per("leg").metadata["rows"] == "leg"
    with pytest.raises(ValueError, match="expected"):
        dataclasses.replace(plans[0], T1=np.ones(7))
