"""A problem that became tighter in places, solved again around them: the motion as if all of it were solved, and the rest stays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.solvers.jerk_campaign import faults
from benchmarks.solvers.random_paths import long_path
from planner.base.threads import use_threads
from planner.feedrate.jerk import solver
from planner.feedrate.jerk.again import ranges_of
from planner.feedrate.jerk.chain import Chain
from planner.feedrate.jerk.solver import JerkLimited

TIGHTER = 1.01
PLACES = (700, 710, 1900, 3190)  # two that are near to each other, one by itself, one near the end


@pytest.fixture(autouse=True)
def _threads_as_before():
    yield
    use_threads(None)


@pytest.fixture(scope="module")
def before():
    """A long path and its solution."""
    problem = long_path(3200)
    return problem, JerkLimited().solve(problem)


@pytest.fixture(scope="module")
def tighter(before):
    """The problem with smaller limits in some places."""
    problem, _ = before
    scale = problem.limit_scale.copy()
    scale[list(PLACES)] *= TIGHTER
    return dataclasses.replace(problem, limit_scale=scale)


@pytest.fixture(scope="module")
def again(before, tighter):
    use_threads(1)
    return JerkLimited().again(*before, tighter)


def same(one, other):
    pairs = [
        (getattr(one, name), getattr(other, name)) for name in ("feed_sq", "acc_s", "jerk_s", "duration")
    ]
    pairs.append((one.multipliers.rows, other.multipliers.rows))
    return all(np.array_equal(a, b) for a, b in pairs)


def test_it_keeps_all_limits_and_takes_the_time_that_solving_everything_takes(before, tighter, again):
    problem, solution = again
    assert np.array_equal(problem.limit_scale, tighter.limit_scale)
    assert not faults(problem, solution)
    whole = JerkLimited().solve(tighter)
    costs = whole.cycle_time / before[1].cycle_time - 1.0
    assert costs > 1e-5  # else this test shows nothing
    assert solution.cycle_time == pytest.approx(whole.cycle_time, rel=0.1 * costs)
    # the multipliers are those from before the limits became tighter
    np.testing.assert_allclose(solution.prices.jerk, whole.prices.jerk, rtol=5e-2)


def test_outside_the_ranges_the_motion_is_as_before_but_for_the_slowing_down_of_the_end(
    before, tighter, again
):
    problem, known = before
    ranges = ranges_of(problem, known, tighter.limit_scale != problem.limit_scale)
    assert len(ranges) == 3
    inside = np.zeros(len(problem), dtype=bool)
    for own in ranges:
        inside[own.first : own.last + 1] = True
    assert inside[list(PLACES)].all()
    assert 0.02 < inside.mean() < 0.6
    slower = known.feed_sq[~inside][1:-1] / again[1].feed_sq[~inside][1:-1]
    np.testing.assert_allclose(slower, slower[0], rtol=1e-12)
    assert 1.0 <= slower[0] < 1.0 + 1e-4


def test_a_range_ends_where_its_piece_does(before):
    problem, known = before
    changed = np.zeros(len(problem), dtype=bool)
    changed[[1, len(problem) - 2]] = True
    ranges = ranges_of(problem, known, changed)
    assert ranges[0].first == 0
    assert ranges[-1].last == len(problem) - 1
    assert not ranges_of(problem, known, np.zeros(len(problem), dtype=bool))


def test_it_is_the_same_on_any_number_of_threads(before, tighter, again, monkeypatch):
    monkeypatch.setattr(solver, "POINTS_SHARED", 10)
    use_threads(3)
    _, solution = JerkLimited().again(*before, tighter)
    assert same(solution, again[1])


def test_where_no_solution_is_found_motion_and_limits_are_as_before(before, tighter, monkeypatch):
    run = Chain.run

    def fails_at_the_end(self, room, until):
        run(self, room, until)
        self.failed = self.last > PLACES[2]

    monkeypatch.setattr(Chain, "run", fails_at_the_end)
    problem, solution = JerkLimited().again(*before, tighter)
    assert (problem.limit_scale[list(PLACES)] > 1.0).tolist() == [True, True, False, False]
    assert not faults(problem, solution)
    at = np.arange(PLACES[2] - 20, PLACES[2] + 20)
    slower = before[1].feed_sq[at] / solution.feed_sq[at]
    np.testing.assert_allclose(slower, slower[0], rtol=1e-12)


def test_a_range_without_a_solution_is_tried_wider(before, tighter, again, monkeypatch):
    run, tried = Chain.run, []

    def fails_where_narrow(self, room, until):
        run(self, room, until)
        tried.append((self.first, self.last))
        self.failed |= len(tried) <= 3

    monkeypatch.setattr(Chain, "run", fails_where_narrow)
    problem, solution = JerkLimited().again(*before, tighter)
    narrow, wide = tried[:3], tried[3:]
    assert wide
    for first, last in narrow:
        assert any(begin <= first and last <= end for begin, end in wide)
    assert sum(last - first for first, last in wide) > sum(last - first for first, last in narrow)
    assert np.array_equal(problem.limit_scale, tighter.limit_scale)
    assert solution.effort["kept again"] == 0
    assert not faults(problem, solution)
    assert solution.cycle_time == pytest.approx(again[1].cycle_time, rel=1e-5)


def test_a_piece_that_changed_nearly_everywhere_is_solved_as_a_whole(before):
    problem, known = before
    scale = np.full(len(problem), TIGHTER)
    tighter = dataclasses.replace(problem, limit_scale=scale)
    _, solution = JerkLimited().again(problem, known, tighter)
    assert same(solution, JerkLimited().solve(tighter))
    assert solution.effort["pieces again"] == 1


def test_what_changed_by_much_is_not_solved_in_places(before, tighter):
    problem, known = before
    much = dataclasses.replace(problem, limit_scale=tighter.limit_scale**20)
    assert JerkLimited().again(problem, known, much) is None


def test_nothing_is_solved_where_nothing_changed(before):
    problem, known = before
    _, solution = JerkLimited().again(problem, known, problem)
    assert same(solution, known)
