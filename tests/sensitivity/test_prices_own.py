"""What limits of one's own cost: foretold, and found by planning again."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from benchmarks.solvers.prices import WORTH, compared
from planner import JointLimit, PathLimit
from planner.machine.user_limit import Place, ScaledLimit
from planner.nc.reader import parse_program

JOB = "G21 G90 G64 P0.05\nF6000\nG1 X12 Y3\nX18 Y0\nG3 X24 Y6 I0 J6\nG1 X12 Y12\nM2\n"
MACHINE = problems.machine()


class Soft(PathLimit):
    """A material that takes less beyond a line."""

    name = "soft"

    def velocity(self, at):
        return np.where(at.x < 10.0, 80.0, 40.0)

    def acceleration(self, at):
        return 800.0 + 10.0 * at.y

    def jerk(self, at):
        return 4e4


class Table(JointLimit):
    """A joint that holds nearly all of the motion."""

    name, unit, turn = "table", "rad", 2.0 * np.pi
    velocity, acceleration, jerk = 1.0, 8.0, 300.0

    def joint(self, at):
        return np.arctan2(at.y + 30.0, at.x + 20.0)


class Fast(PathLimit):
    """Bounds one quantity only."""

    name = "fast"

    def velocity(self, at):
        return 30.0


@pytest.fixture(scope="module")
def program():
    return parse_program(JOB, MACHINE)


def named(limits):
    return tuple(f"{q}.{limit.name}" for limit in limits for q in ("velocity", "acceleration", "jerk"))


@pytest.mark.usual_sizes  # grids are thinned less, and plans made more finely
@pytest.mark.parametrize("limits", [[Table()], pytest.param([Soft(), Table()], marks=pytest.mark.slow)])
def test_ten_per_cent_more_saves_what_was_foretold(program, limits):
    """Within its range, the largest within a fifth, through whole plans on single corners."""
    result = compared("own", program, MACHINE.with_own(limits), "bezier", named(limits))
    assert len(result["rows"]) >= 3
    for row in result["rows"]:
        assert row["foretold_s"] >= WORTH * result["cycle_time_s"]
        assert row["right"], row
        assert row["passed"]
    largest = max(result["rows"], key=lambda row: row["found_s"])
    assert largest["ratio"] == pytest.approx(1.0, abs=0.2), largest


@pytest.mark.slow
def test_what_more_speed_saves_the_joint_search_is_foretold(program):
    """Within its range; the jerk of this limit, worth a thousandth of the time, was foretold at twice of it: not held."""
    result = compared("own", program, MACHINE.with_own([Soft()]), "auto", ("velocity.soft",))
    (row,) = result["rows"]
    assert row["found_s"] > 0.05 * result["cycle_time_s"]
    assert row["right"], row


@pytest.mark.slow
def test_on_splines_what_is_found_lies_in_the_range(program):
    result = compared("own", program, MACHINE.with_own([Soft()]), "spline", ("velocity.soft", "jerk.soft"))
    rows = {row["limit"]: row for row in result["rows"]}
    assert rows["velocity.soft"]["found_s"] > 0.01 * result["cycle_time_s"]
    for row in rows.values():
        assert row["right"], row


def test_a_row_for_each_quantity_that_is_bounded_and_none_for_the_others(program):
    plan = planner.plan(program, MACHINE, corner="bezier", limits=[Fast()])
    assert {name for name in plan.prices.limits if name.endswith("fast")} == {"velocity.fast"}
    assert plan.prices.saved["velocity.fast"] > 0.0
    assert "velocity.fast" in dict(plan.prices.ranked())


@pytest.mark.slow
def test_prices_sum_up_to_the_time_with_limits_of_ones_own_too(program):
    """Time k times as fast is velocities times k, accelerations k^2, jerks k^3, feeds k, periods 1/k."""
    machine = problems.machine(dt=4e-5)
    limits = [Soft(), Table()]
    plan = planner.plan(program, machine, corner="bezier", limits=limits)
    order = {"velocity": 1, "acceleration": 2, "jerk": 3}
    least = {"velocity.soft": 40.0, "acceleration.soft": 800.0, "jerk.soft": 4e4}
    total = plan.prices.feed
    for name, price in plan.prices.limits.items():
        quantity, _, of = name.partition(".")
        if of in machine.axes:
            bound = getattr(machine.axes[of], quantity)
        else:
            bound = least[name] if name in least else getattr(Table, quantity)
        total += order[quantity] * price * bound
    assert total == pytest.approx(-plan.trajectory.cycle_time, rel=5e-3)


def test_a_joint_that_is_an_axis_costs_what_the_axis_costs(program):
    """q = 2 x with the limits of x is x with half of them; dT/dq is half of dT/dx."""
    x = MACHINE.axes["x"]

    class Twice(JointLimit):
        name = "twice"
        velocity, acceleration, jerk = x.velocity, x.acceleration, x.jerk

        def joint(self, at):
            return 2.0 * at.x

    halved = x.model_copy(update={"velocity": x.velocity / 2, "jerk": x.jerk / 2})
    slower = MACHINE.model_copy(update={"axes": MACHINE.axes | {"x": halved}})
    by_axis = planner.plan(program, slower, corner="bezier").prices.limits

    class Unpriced(Twice):
        acceleration = np.inf  # more of an axis acceleration changes the corners, too: not the same thing

    by_joint = planner.plan(program, MACHINE, corner="bezier", limits=[Unpriced()]).prices.limits
    for quantity in ("velocity", "jerk"):
        assert by_axis[f"{quantity}.x"] < 0.0
        assert 2.0 * by_joint[f"{quantity}.twice"] == pytest.approx(by_axis[f"{quantity}.x"], rel=0.05)


def test_a_scaled_limit_has_more_of_one_quantity():
    at = Place(("x", "y"), [np.array([0.0, 20.0]), np.zeros(2)], np.zeros((2, 2)))
    scaled = ScaledLimit(Soft(), "velocity", 1.5)
    before, after = Soft().bounds(at), scaled.bounds(at)
    np.testing.assert_allclose(after[0], 1.5 * before[0])
    np.testing.assert_array_equal(after[1], before[1])
    assert after[2] == before[2]
    assert (scaled.name, scaled.unit, scaled.turn) == ("soft", "mm", None)
    assert scaled.value(at) is None
