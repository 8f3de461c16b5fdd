"""Long pieces from both ends at a time, and pieces side by side: the motion as in one go, the same bytes on any number of threads."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.solvers.jerk_campaign import faults, small_problem
from benchmarks.solvers.random_paths import long_path, random_path
from planner.base.threads import use_threads
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk import part, solver
from planner.feedrate.jerk.columns import columns_of
from planner.feedrate.jerk.profile import Profile, backward
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.jerk.window import ScaledWindow
from planner.feedrate.lagrangian import lagrangian
from planner.feedrate.solution import FeedrateSolution, Multipliers

SEEDS = [0, 2, 4]


pytestmark = pytest.mark.usefixtures("threads_as_before")


def window_of(problem: FeedrateProblem) -> int:
    """So small that the problem is solved from both ends."""
    return (len(problem) - 2) // part.LONG


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
@pytest.mark.parametrize("points", [2000, 3000, 5000])
def test_a_long_piece_is_joined_in_the_middle(points):
    problem = long_path(points)
    whole = JerkLimited(window=100_000).solve(problem).require()
    found = JerkLimited(window=window_of(problem)).solve(problem)
    assert found.effort["joined"] == 1
    assert whole.effort["joined"] == 0
    assert not faults(problem, found)
    assert found.cycle_time == pytest.approx(whole.cycle_time, rel=1e-4)
    values = [lagrangian(problem, solution).jerk.sum() for solution in (found, whole)]
    assert values[0] == pytest.approx(values[1], rel=0.02)


@pytest.mark.parametrize("seed", [1343, 1373, 1378])
def test_the_joined_profile_has_both_given_states(seed):
    """Here the two ways overlap: either is the faster one at the other's end."""
    problem = small_problem(seed)
    found = JerkLimited(window=20).solve(problem)
    assert found.effort["joined"] == 1
    assert not faults(problem, found)


@pytest.mark.parametrize("count", [2, 5])
def test_any_number_of_threads_gives_the_same_bytes(monkeypatch, count):
    monkeypatch.setattr(solver, "POINTS_SHARED", 0)
    problem = long_path(2000)
    solutions = []
    for threads in (1, count):
        use_threads(threads)
        solutions.append(JerkLimited(window=window_of(problem)).solve(problem))
    one, many = solutions
    for name in ("feed_sq", "acc_s", "jerk_s", "duration"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    for name in ("rows", "feed", "dynamics"):
        np.testing.assert_array_equal(getattr(one.multipliers, name), getattr(many.multipliers, name))
    assert (one.sentence, one.effort) == (many.sentence, many.effort)


def test_where_the_middle_does_not_converge_the_profile_goes_on_from_the_start(monkeypatch):
    monkeypatch.setattr(ScaledWindow, "between", lambda *_: (None, 7, 3))
    problem = long_path(2000)
    solve = JerkLimited(window=window_of(problem)).solve
    found = solve(problem)
    assert found.effort["joined"] == 0
    monkeypatch.setattr(part, "LONG", len(problem))
    forward = solve(problem)
    assert not faults(problem, found)
    assert found.cycle_time == pytest.approx(forward.cycle_time, rel=1e-4)


def test_progress_is_told_in_the_calling_thread_and_ends_with_all(monkeypatch):
    monkeypatch.setattr(solver, "POINTS_SHARED", 0)
    problem, told = long_path(2000), []
    for threads in (1, 2):
        use_threads(threads)
        told.clear()
        JerkLimited(window=window_of(problem)).solve(problem, told.append)
        assert told == sorted(told)
        assert 0.9 < told[-1] <= 1.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_problem_passed_backward_has_the_same_solution(seed):
    """The profile turned round keeps every limit, and its multipliers give the same prices."""
    problem = random_path(seed)
    n = len(problem) - 1
    turned = backward(columns_of(problem), 0, n)
    mirrored = dataclasses.replace(
        problem,
        s=turned.s,
        d1=turned.d1,
        d2_left=turned.d2_left,
        d2_right=turned.d2_right,
        d3_left=turned.d3_left,
        d3_right=turned.d3_right,
        feed_sq_max=problem.feed_sq_max[::-1],
        feed_sq_bound=problem.feed_sq_bound[::-1],
        margin=np.append(problem.margin[-2::-1], 0.0),
    )
    forward, back = JerkLimited().solve(problem), JerkLimited().solve(mirrored)
    found = Profile.at_rest(n + 1, len(problem.axes))
    found.put_backward(n, profile_of(back), n)
    solution = turned_solution(back, found)
    assert not faults(problem, solution)
    assert solution.cycle_time == pytest.approx(forward.cycle_time, rel=1e-4)
    ours, theirs = lagrangian(problem, solution), lagrangian(mirrored, back)
    for name in ("acceleration", "jerk"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-9, atol=1e-12)
    assert ours.value.sum() == pytest.approx(theirs.value.sum(), rel=1e-9)


def profile_of(solution: FeedrateSolution) -> Profile:
    found = solution.multipliers
    assert found is not None
    return Profile(
        x=solution.feed_sq,
        u=solution.acc_s,
        jerk=solution.jerk_s,
        duration=solution.duration,
        rows=found.rows,
        feed=found.feed,
        dynamics=found.dynamics,
    )


def turned_solution(solution: FeedrateSolution, found: Profile) -> FeedrateSolution:
    return dataclasses.replace(
        solution,
        feed_sq=found.x,
        acc_s=found.u,
        jerk_s=found.jerk,
        duration=found.duration,
        multipliers=Multipliers(rows=found.rows, feed=found.feed, dynamics=found.dynamics),
    )
