"""Prices where geometry and feed are found together: plans made again confirm them, and their parts add up."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from planner import PathLimit
from planner.commands.study.settings import Setting
from planner.commands.study.what_if import forecast
from planner.feedrate.solution import Status
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod
from planner.sensitivity.found_prices import found_prices
from planner.sensitivity.prices import MORE_LIMIT, more_of

MACHINE = problems.machine()
PROGRAM = problems.polyline([[0, 0], [6, 0], [9, 4], [4, 7]], feed=90.0)
NOISE = 2e-4  # by which plans made again differ [share of the time]
START = OptimalMethod(corner="bezier")


def made(program=PROGRAM, machine=MACHINE, tolerance=None, solver="own") -> Plan:
    method = TubeMethod(start=START, solver=solver)
    return planner.plan(program, machine, method=method, tolerance=tolerance).require()


@cache
def first() -> Plan:
    return made()


def time_of(plan: Plan) -> float:
    return plan.trajectory.cycle_time


def foretold(setting: Setting) -> float:
    told = forecast(first().prices, [setting], MACHINE, MACHINE.tolerance)
    return (told.least + told.most) / 2


@pytest.mark.shows("prices", "sampled: plans made again with that limit changed")
@pytest.mark.parametrize("ratio", [0.98, 1.1])
@pytest.mark.parametrize("limit", ["jerk.x", "acceleration.y"])
def test_a_plan_with_another_limit_takes_what_was_foretold(limit, ratio):
    quantity, _, axis = limit.partition(".")
    value = ratio * getattr(MACHINE.axes[axis], quantity)
    again = made(machine=more_of(MACHINE, limit, ratio - 1.0))
    change = time_of(again) - time_of(first())
    told = foretold(Setting(name=f"axes.{axis}.{quantity}", value=value))
    assert told == pytest.approx(change, rel=0.1, abs=NOISE * time_of(first()))


def test_a_plan_with_more_feed_or_tolerance_takes_what_was_foretold():
    faster = made(dataclasses.replace(PROGRAM, feed=PROGRAM.feed * 1.05))
    wider = made(tolerance=1.1 * MACHINE.tolerance)
    for again, setting in (
        (faster, Setting(name="feed", value=1.05)),
        (wider, Setting(name="tolerance", value=1.1 * MACHINE.tolerance)),
    ):
        change = time_of(again) - time_of(first())
        assert foretold(setting) == pytest.approx(change, rel=0.1, abs=NOISE * time_of(first()))


def test_more_tolerance_at_one_corner_saves_what_its_price_says():
    """G64 P of the block before the dearest corner."""
    dear, toolpath = first().prices.corners, first().toolpath
    assert len(dear) == 2
    block = int(toolpath.block[toolpath.line == dear.line[0]][-1])
    tolerance = np.full(len(PROGRAM), MACHINE.tolerance)
    tolerance[block] *= 1.1
    again = made(dataclasses.replace(PROGRAM, tolerance=tolerance))
    change = time_of(again) - time_of(first())
    told = dear.price[0] * 0.1 * MACHINE.tolerance
    assert told == pytest.approx(change, rel=0.1, abs=NOISE * time_of(first()))


def test_parts_add_up():
    prices = first().prices
    share = 1.0 - 1.0 / (1.0 + MORE_LIMIT)
    assert 0.5 * -share * prices.feed < prices.places.feed.sum() <= -share * prices.feed * (1 + 1e-9)
    assert prices.places.tolerance.sum() == pytest.approx(prices.tolerance, rel=1e-9)
    assert (prices.places.limits >= prices.places.feed).all()
    assert (prices.places.limits > 0.0).all()  # on every leg
    for name, saved in prices.saved.items():
        least, most = prices.ranges[name]
        assert least <= saved <= most


def test_a_search_made_again_ends_elsewhere_by_so_much_that_ranges_are_as_wide():
    """2e-4 of the time on both sides, where a limit is worth next to nothing."""
    ranges = first().prices.ranges
    width = [most - least for least, most in ranges.values()]
    assert min(width) == pytest.approx(2.0 * NOISE * time_of(first()), rel=1e-6)


def test_equal_feed_and_velocity_are_worth_nothing_alone():
    """One line along x with F at the velocity of x; of all limits together it is worth the same as with either alone."""
    line, fast = (problems.polyline([[0, 0], [30, 0]], feed=feed) for feed in (100.0, 200.0))
    both, alone, axis = made(line), made(line, problems.machine(velocity=200.0)), made(fast)
    assert abs(both.prices.feed) < 1e-3 * time_of(both)
    assert -alone.prices.feed > 0.5 * time_of(alone)
    assert -axis.prices.limits["velocity.x"] * 100.0 == pytest.approx(-alone.prices.feed, rel=1e-2)
    for other in (alone, axis):
        assert both.prices.places.limits.sum() == pytest.approx(other.prices.places.limits.sum(), rel=1e-2)


class Slower(PathLimit):
    """A speed that falls along y, and holds nearly all of a motion."""

    name = "slower"

    def velocity(self, at):
        return 40.0 - 1.5 * at.y


def test_a_limit_of_ones_own_has_its_least_bound_and_all_of_the_time_that_it_holds():
    """T goes with 1/limit but for the begin and the end: the price by the least bound, at the end in y, is -T/10."""
    line = problems.polyline([[0, 0, 0], [2, 8, 3], [3, 20, 0]], feed=90.0)
    plan = made(line, MACHINE.with_own([Slower()]))
    assert -10.0 * plan.prices.limits["velocity.slower"] == pytest.approx(time_of(plan), rel=0.05)


def test_where_accelerations_take_from_the_tolerance_that_is_priced_too():
    """Eq. (20) at a period of 4 ms: more acceleration along an axis leaves less to round with; planned again."""
    machine = MACHINE.model_copy(update={"dt": 0.004})
    before = made(machine=machine)
    again = made(machine=more_of(machine, "acceleration.y", 0.05))
    told = before.prices.limits["acceleration.y"] * 0.05 * machine.axes["y"].acceleration
    # the reserve follows the motion that is found (joint/refine.py), which the price does not know
    assert told == pytest.approx(time_of(again) - time_of(before), rel=0.2, abs=NOISE * time_of(before))


class FailsBehind(TubeOwn):
    """Finds nothing on the second of two runs."""

    def search(self, run, guess):
        if run.first[0] == 0:
            return (yield from super().search(run, guess))
        return TubeSolution(status=Status.ITERATION_LIMIT, sentence="not here", iterations=0, solve_time=0.0)


def test_what_has_no_prices_is_said():
    """Half of the motion stays that of the start: its prices are left out, and a note says of how much; nothing at all has none."""
    stops = parse_program("G21 G90 F4800\nG1 X6\nY6\nG4 P0.5\nX2\nY8\nM2\n")
    plan = made(stops, solver=FailsBehind())
    assert plan.prices is not None
    assert [note for note in plan.notes if "leaves out 0.4" in note or "of the motion before" in note]
    assert found_prices(plan.toolpath, MACHINE, [], 1.0) is None
    assert plan.grid.ranked()[-1] == ("rest", pytest.approx(0.5 / time_of(plan), rel=1e-2))
