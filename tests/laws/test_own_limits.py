"""Laws of limits of the user in the joint search: those that never bind cost nothing, and those that do are kept."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.planning.job.plan import Plan

TURNS = "G21\nG64 P0.02 F6000\nG1 X14\nG1 X22 Y9\nG2 X30 Y17 I8 J0\nG1 X9 Y26\nG1 X0 Y4\n"
TOGETHER = "path and feed optimised together"


class Guard(planner.PathLimit):
    """Half of the feed from a plane on, and a gentle push."""

    name = "guard"

    def __init__(self, slow: float = 45.0, push: float = 1200.0):
        self.slow, self.push = slow, push

    def velocity(self, at):
        return np.where(at.x < 12.3, self.slow, 3.0 * self.slow)

    def acceleration(self, at):
        return self.push


class Slope(planner.PathLimit):
    """A speed that grows with the distance from a wall."""

    name = "slope"

    def velocity(self, at):
        return 30.0 + 2.0 * np.abs(at.y - 8.0)


class Arm(planner.JointLimit):
    """The angle of an arm."""

    name, unit, turn = "arm", "rad", 2.0 * np.pi

    def __init__(self, by: float = 1.0):
        self.velocity, self.acceleration, self.jerk = 0.4 * by, 4.0 * by, 120.0 * by

    def joint(self, at):
        return np.arctan2(at.y + 90.0, at.x + 130.0)


def planned(*limits: object, **settings) -> Plan:
    machine = planner.load_machine("mill")
    program = planner.read_program(text=TURNS, machine=machine)
    plan = planner.plan(program, machine, limits=limits, **({"effort": "quick"} | settings)).require()
    assert plan.verdict.passed, plan.verdict.faults
    return plan


class Gate(planner.PathLimit):
    """Slow on one side of a plane, and without a limit on the other."""

    name = "gate"

    def __init__(self, left: float, right: float):
        self.left, self.right = left, right

    def velocity(self, at):
        return np.where(at.x < 12.3, self.left, self.right)


@pytest.mark.parametrize("sides", [(45.0, np.inf), (np.inf, 45.0)])
def test_no_limit_on_one_side_is_one_that_never_binds_there(sides: tuple[float, float]) -> None:
    none, far = planned(Gate(*sides)), planned(Gate(*np.minimum(sides, 1e6)))
    assert none.sentence.startswith(TOGETHER)
    assert none.cycle_time == pytest.approx(far.cycle_time, rel=1e-3)


@pytest.mark.parametrize("limit", [Guard(slow=1e4, push=1e6), Arm(by=100.0)])
def test_what_never_binds_changes_nothing(limit: object) -> None:
    assert planned(limit).cycle_time == pytest.approx(planned().cycle_time, rel=1e-4)
    assert TOGETHER in planned(limit).sentence


@pytest.mark.shows("own-limits", "sampled: kept, reached, judged, by all solvers")
@pytest.mark.parametrize("limit", [Guard(), Slope(), Arm()])
def test_what_binds_is_kept_used_and_found_together(limit: object) -> None:
    plan = planned(limit)
    assert TOGETHER in plan.sentence
    ratios = [check.ratio for name, check in plan.verdict.limits.items() if name.endswith(limit.name)]
    assert 0.999 < max(ratios) <= 1.0 + 1e-9
    assert plan.cycle_time < planned(limit, corner="bezier").cycle_time
    saved = [saved for name, saved in plan.prices.saved.items() if name.endswith(limit.name)]
    assert max(saved) > 0.0
