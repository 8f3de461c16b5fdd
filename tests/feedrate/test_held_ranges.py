"""Stretches on which the feed is held: the motion as if all of it were solved, with the same prices, and only the rest is solved."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.solvers.jerk_campaign import faults
from benchmarks.solvers.random_paths import long_path
from planner.base.threads import use_threads
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk import held, solver
from planner.feedrate.jerk.columns import columns_of
from planner.feedrate.jerk.held import held_ranges
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.jerk.window import ScaledWindow
from planner.feedrate.solution import FeedrateSolution

SLOW = (
    slice(400, 1200),
    slice(1500, 2300),
    slice(2300, 2900),
)  # points with a bound of the feed of their own


pytestmark = pytest.mark.usefixtures("threads_as_before")


@pytest.fixture(scope="module")
def problem() -> FeedrateProblem:
    """A long path that on three parts may be passed so slowly that curves hardly matter."""
    path = long_path(3200)
    by_curve = path.acceleration / np.maximum(np.abs(path.d2_left), np.abs(path.d2_right))
    by_twist = path.jerk / np.maximum(np.abs(path.d3_left), np.abs(path.d3_right))
    limit = path.feed_sq_max.copy()
    for own, share in zip(SLOW, (0.9, 0.5, 0.9), strict=True):
        free = np.minimum((0.5 * by_curve[own]).min(), (0.5 * by_twist[own]).min() ** (2.0 / 3.0))
        limit[own] = share * min(free, limit[own].min())
    return dataclasses.replace(path, feed_sq_max=limit)


@pytest.fixture(scope="module")
def found(problem) -> FeedrateSolution:
    return JerkLimited().solve(problem).require()


@pytest.fixture(scope="module")
def whole(problem) -> FeedrateSolution:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(held, "POINTS", len(problem))
        return JerkLimited().solve(problem).require()


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
def test_the_motion_is_that_of_the_whole_problem(problem, found, whole):
    assert whole.effort["held"] == 0
    assert found.effort["held"] > 1000
    assert not faults(problem, found)
    assert found.cycle_time == pytest.approx(whole.cycle_time, rel=2e-5)
    np.testing.assert_allclose(found.feed_sq, whole.feed_sq, rtol=0.02, atol=1e-3 * whole.feed_sq.max())


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
def test_its_prices_are_those_of_the_whole_problem(found, whole):
    ours, theirs = found.prices, whole.prices
    for name in ("acceleration", "jerk"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0.02, atol=1e-12)


def test_on_a_held_range_the_bound_has_the_price_of_all_its_time(problem, found):
    """dT/d(ln X) = -T/2 there."""
    columns = columns_of(problem)
    ranges = held_ranges(columns, 0, len(problem) - 1)
    assert len(ranges) == len(SLOW)
    for first, last, x in ranges:
        assert x == pytest.approx(columns.x_max[first], rel=1e-5)
        inside = slice(first + 1, last)
        price = (found.prices.feed_sq_max[inside] * problem.feed_sq_max[inside]).sum()
        time = found.duration[first:last].sum() - 0.5 * (found.duration[first] + found.duration[last - 1])
        assert price == pytest.approx(-0.5 * time, rel=1e-4)


def test_curves_that_need_more_than_half_of_a_limit_are_not_held(problem):
    """With a tenth less of what is free at one place of a held range it is divided there."""
    first, last, x = held_ranges(columns_of(problem), 0, len(problem) - 1)[0]
    middle = (first + last) // 2
    bent = problem.d2_right.copy()
    bent[middle, 0] = 0.51 * problem.acceleration[0] / x
    ranges = held_ranges(columns_of(dataclasses.replace(problem, d2_right=bent)), 0, len(problem) - 1)
    assert not any(one.first <= middle <= one.last for one in ranges)
    bent[middle, 0] = 0.49 * problem.acceleration[0] / x
    assert held_ranges(columns_of(dataclasses.replace(problem, d2_right=bent)), 0, len(problem) - 1)[0] == (
        first,
        last,
        x,
    )


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
def test_where_a_part_has_no_solution_the_piece_is_solved_as_a_whole(monkeypatch, problem, whole):
    monkeypatch.setattr(ScaledWindow, "between", lambda *_: (None, 7, 3))
    again = JerkLimited().solve(problem)
    assert again.effort["held"] == 0
    assert not faults(problem, again)
    np.testing.assert_array_equal(again.feed_sq, whole.feed_sq)


def test_any_number_of_threads_gives_the_same_bytes(monkeypatch, problem):
    monkeypatch.setattr(solver, "POINTS_SHARED", 0)
    solutions = []
    for threads in (1, 3):
        use_threads(threads)
        solutions.append(JerkLimited().solve(problem))
    one, many = solutions
    for name in ("feed_sq", "acc_s", "jerk_s", "duration"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    for name in ("rows", "feed", "dynamics"):
        np.testing.assert_array_equal(getattr(one.multipliers, name), getattr(many.multipliers, name))
