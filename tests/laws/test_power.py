"""Laws of the limits of the drives' power, and the judge's own view of them."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.machine import Machine
from planner.planning.job.plan import Plan
from planner.report.brief import brief_rows
from planner.report.html.page import report_page
from planner.report.summary import summary
from planner.report.units import UNITS
from planner.verifier import Given, verify

TURNS = "G21\nG64 P0.03 F5400\nG1 X14\nG1 X22 Y9\nG2 X30 Y17 I8 J0\nG1 X9 Y26\n"


def machine_of(power: float | None, acceleration: float = 3000.0, jerk: float = 8e4) -> Machine:
    axis = {"velocity": 150.0, "acceleration": acceleration, "jerk": jerk, "power": power}
    return Machine(name="driven", dt=0.001, tolerance=0.03, axes=dict.fromkeys("xyz", axis))


def planned(text: str, machine: Machine) -> Plan:
    plan = planner.plan(planner.read_program(text=text, machine=machine), machine, effort="quick").require()
    assert plan.verdict.passed, plan.verdict.faults
    return plan


def used(plan: Plan) -> float:
    return max(plan.verdict.limits[f"power.{letter}"].ratio for letter in "xy")


@pytest.mark.shows("power", "exact: a straight line")
def test_a_line_takes_as_long_as_its_drive_needs() -> None:
    """With constant power v = sqrt(2 P t): F is reached after F^2/2P on F^3/3P of the way."""
    length, feed, power = 60.0, 120.0, 0.05
    plan = planned(f"G21 F{60 * feed:g}\nG1 X{length:g}\n", machine_of(power, acceleration=2e4, jerk=1e7))
    per_mass = 1e6 * power  # W/kg in mm2/s3
    least = feed**2 / per_mass + (length - 2.0 * feed**3 / (3.0 * per_mass)) / feed
    assert least < plan.cycle_time < 1.01 * least
    assert used(plan) == pytest.approx(1.0, abs=2e-3)


def test_less_power_takes_longer_and_all_of_it_is_used() -> None:
    """And what no axis can reach changes not one bit."""
    free, far, more, less = (planned(TURNS, machine_of(power)) for power in (None, 0.46, 0.1, 0.04))
    assert free.trajectory.position.tobytes() == far.trajectory.position.tobytes()
    assert free.cycle_time < more.cycle_time < less.cycle_time
    for plan in (more, less):
        assert 0.99 < used(plan) <= 1.0 + 1e-9
        assert plan.prices.saved["power.x"] > 0.0


def test_the_judge_finds_it_in_columns_and_in_positions() -> None:
    free = planned(TURNS, machine_of(None))
    machine, motion = machine_of(0.05), free.trajectory
    power = 1e-6 * np.abs(motion.velocity * motion.acceleration)[:, 0].max()
    verdict = verify(motion, free.toolpath, machine)
    assert not verdict.passed
    assert verdict.limits["power.x"].value == pytest.approx(power)
    seen = verify(motion, free.toolpath, machine, given=Given(columns=()))
    assert 0.9 * power < seen.limits["power.x"].value <= power


@pytest.mark.parametrize("method", ["kinematic", "stop", "bezier", "second-order", "fir"])
def test_methods_that_do_not_keep_it_say_so(method: str) -> None:
    machine = machine_of(0.05)
    program = planner.read_program(text=TURNS, machine=machine)
    with pytest.raises(InputError, match=r"power of axis x to 0.05 W/kg, which .* does not keep; plan with"):
        planner.plan(program, machine, method=method)
    with pytest.raises(InputError, match="power of axis x"):
        planner.plan(program, machine, corner="bezier")


def test_a_plan_says_where_drive_power_holds_it() -> None:
    """As a share of the time, against where the columns are at the limit; in words, and on the page."""
    plan = planned(TURNS, machine_of(0.04))
    free = planned(TURNS, machine_of(None))
    motion = plan.trajectory
    power = np.abs(motion.velocity * motion.acceleration)[:, :2] / (1e6 * 0.04)
    at_limit = (power > 0.98).any(axis=1).mean()
    told = dict(plan.grid.ranked())
    assert at_limit > 0.3
    assert max(told["power.x"], told["power.y"]) <= at_limit + 0.1
    assert told["power.x"] + told["power.y"] >= at_limit - 0.1
    assert not any(name.startswith("power") for name, _ in free.grid.ranked())
    rows = dict(brief_rows(plan, UNITS["mm"]))
    assert "drive power of X" in rows["limited by"]
    assert rows["saved"].startswith("not known"), "no stop at every block keeps the power"
    assert dict(brief_rows(free, UNITS["mm"]))["saved"][0].isdigit()
    page = report_page(plan, summary(plan))
    assert "power.x" in page
