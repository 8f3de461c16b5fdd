"""`optimal` is never slower than what it could have been: full stops, method kinematic, any single corner shape."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from quick import slow_but

from benchmarks.random_lines import job
from benchmarks.runner.figures_of_merit import ALLOWED, beaten
from benchmarks.runner.measure import outcome
from benchmarks.runner.rows import ERROR, METHOD, Row
from benchmarks.runner.suites import RANDOM_RIVALS, Job
from benchmarks.runner.ways import way_of
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.solution import Status
from planner.methods.optimal import OptimalMethod
from planner.nc.reader import parse_program
from planner.optimal import loop
from planner.optimal.order import ThirdOrder


# Jobs on which plans of every kind take the place of splines: fir corners 70, method kinematic 86; because of the period bezier
# corners 97, fir corners 197, kinematic corners 167, full stops 99. On 3 and 40 splines stay.
@pytest.mark.slow
@pytest.mark.parametrize("seed", slow_but([3, 86], [3, 40, 70, 86, 97, 99, 167, 197]))
def test_nothing_is_faster_than_optimal(seed):
    program, machine = job(seed)
    one = Job(name="random", program=lambda machine: program, machine=lambda: machine)
    rows = {
        way: outcome(way_of(way), one, Row(suite="", job="", way=way, kind=METHOD, status=ERROR))
        for way in ("optimal", *RANDOM_RIVALS)
    }
    assert rows["optimal"].comparable
    against = beaten({"random": rows})
    assert "stop" in against
    assert [way for way, by in against.items() if by["random"] > ALLOWED] == []


def test_the_plan_says_when_full_stops_take_its_place():
    machine = job(17)[1]
    plan = OptimalMethod().plan(parse_program("G21 G1 X10 F3000\n", machine), machine)
    assert (plan.method, plan.corner) == ("optimal", "auto")
    assert plan.sentence.startswith("full stops at all blocks take less time than splines; ")
    assert plan.trajectory.cycle_time == pytest.approx(plan.stop_time, rel=1e-6)
    assert plan.verdict.passed
    assert plan.prices is not None


def test_a_rival_is_planned_only_where_its_bounds_leave_a_chance(monkeypatch):
    program, machine = job(3)
    plan = OptimalMethod(rounds=0).plan(program, machine)
    assert plan.status is Status.OPTIMAL

    class Asked:
        stop_time = 1.01 * plan.trajectory.cycle_time
        most = np.inf

    settings = loop.Settings(method="optimal", corner="auto", order=ThirdOrder(JerkLimited()))
    monkeypatch.setattr(loop, "plan_on_path", lambda job, settings, stopped: plan)
    monkeypatch.setattr(loop, "chances", lambda best, job, order: iter(()))
    assert loop.fastest_plan(Asked(), settings) is plan
    large = dataclasses.replace(plan, grid_points=loop.RIVAL_POINTS + 1)
    monkeypatch.setattr(loop, "plan_on_path", lambda job, settings, stopped: large)
    monkeypatch.setattr(loop, "chances", None)
    assert loop.fastest_plan(Asked(), settings) is large
