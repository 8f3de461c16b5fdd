"""`limit_scale`: slower by a factor is speeds over it, accelerations over its square, jerks over its cube; in every solver."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from oracles import needs_toppra
from random_problems import random_problem

from benchmarks.solvers.jerk_campaign import small_problem
from benchmarks.solvers.ratios import constraint_ratios
from benchmarks.solvers.sequential_convex import SequentialConvex
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.solution import ratios_by_limit
from planner.feedrate.toppra_adapter import ToppraSolver

BY = 1.3


def scaled(problem: FeedrateProblem, scale) -> FeedrateProblem:
    return dataclasses.replace(problem, limit_scale=scale)


def some_scale(problem: FeedrateProblem) -> np.ndarray:
    """Ones, but for a stretch in the middle and some single points."""
    scale = np.ones(len(problem))
    scale[len(problem) // 3 : len(problem) // 2] = BY
    scale[np.random.default_rng(1).integers(0, len(problem), 3)] = 1.1
    return scale


def test_it_is_one_where_nothing_is_said_and_the_limits_are_those_of_the_machine():
    problem = random_problem(1)
    assert (problem.limit_scale == 1.0).all()
    np.testing.assert_array_equal(problem.feed_sq_limit, problem.feed_sq_max)
    np.testing.assert_array_equal(problem.acceleration_limit[3], problem.acceleration)
    np.testing.assert_array_equal(problem.jerk_limit[3], problem.jerk)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("solver", "make", "rel"),
    [
        (Reachability(), random_problem, 1e-9),
        pytest.param(ToppraSolver(), random_problem, 1e-6, marks=needs_toppra),
        (JerkLimited(), small_problem, 2e-4),
        (JerkLimitedNLP(), small_problem, 1e-6),
        (SequentialConvex(), small_problem, 1e-5),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_same_scale_everywhere_slows_the_whole_motion(solver, make, rel):
    problem = make(4)
    once = solver.solve(problem).require()
    slow = solver.solve(scaled(problem, np.full(len(problem), BY))).require()
    np.testing.assert_allclose(slow.duration, BY * once.duration, rtol=0, atol=50 * rel * once.duration.max())
    assert slow.cycle_time == pytest.approx(BY * once.cycle_time, rel=rel)


@pytest.mark.parametrize("seed", range(0, 12, 3))
def test_at_second_order_it_is_a_stretched_path(seed):
    """|r' u + r'' x| <= a/lam^2 is |lam^2 r' u + lam^2 r'' x| <= a: the same rows, whichever way they are said."""
    problem = random_problem(seed)
    scale = some_scale(problem)
    by = scale[:, None] ** 2
    same = dataclasses.replace(
        problem,
        d1=problem.d1 * by,
        d2_left=problem.d2_left * by,
        d2_right=problem.d2_right * by,
        feed_sq_max=problem.feed_sq_max / scale**2,
    )
    expected = Reachability().solve(same).require()
    # In the row of an interval's right end r' + 2 h r'' has one scale, as the limit has.
    found = Reachability().solve(scaled(problem, scale)).require()
    np.testing.assert_allclose(found.feed_sq, expected.feed_sq, rtol=1e-9, atol=1e-9)
    assert found.cycle_time > Reachability().solve(problem).require().cycle_time * (1.0 + 1e-3)


@needs_toppra
@pytest.mark.parametrize("seed", [0, 6])
def test_at_second_order_both_solvers_take_the_same_time(seed):
    problem = random_problem(seed)
    local = scaled(problem, some_scale(problem))
    own, other = Reachability().solve(local).require(), ToppraSolver().solve(local).require()
    assert other.cycle_time == pytest.approx(own.cycle_time, rel=1e-6)


@pytest.mark.slow
def test_the_jerk_limited_solvers_agree_and_keep_the_scaled_limits():
    problem = small_problem(4)
    local = scaled(problem, some_scale(problem))
    free = JerkLimited().solve(problem).require()
    own, reference = JerkLimited().solve(local).require(), JerkLimitedNLP().solve(local).require()
    assert own.cycle_time == pytest.approx(reference.cycle_time, rel=3e-3)  # feed rows differ between points
    assert own.cycle_time > free.cycle_time * (1.0 + 1e-2)
    for solution in (own, reference):
        assert constraint_ratios(local, solution)[0].max() <= 1.0 + 1e-6
        assert constraint_ratios(problem, solution)[0].max() <= 1.0 + 1e-6  # never looser
    held = constraint_ratios(local, own)[0] > 1.0 - 1e-3
    assert held[local.limit_scale > 1.2].mean() > 0.5  # in the middle of the slower stretch too
    convex = SequentialConvex().solve(local).require()
    assert convex.cycle_time == pytest.approx(reference.cycle_time, rel=0.05)


def test_ratios_are_to_the_limits_of_each_point():
    """Ratios of one profile, with a scale at one point: those of the rows at that point, in both intervals that meet there."""
    problem = small_problem(4)
    solution = JerkLimited().solve(problem).require()
    at = len(problem) // 2
    scale = np.ones(len(problem))
    scale[at] = BY
    pairs = zip(
        ratios_by_limit(problem, solution), ratios_by_limit(scaled(problem, scale), solution), strict=True
    )
    first = len(problem.bound_names)
    for (limit, plain), (_, there) in pairs:
        away = np.delete(np.arange(len(problem)), [at - 1, at])
        np.testing.assert_array_equal(plain[away], there[away])
        if limit < first:
            assert there[at] == pytest.approx(BY**2 * plain[at])
        else:
            power = 2 if limit < first + len(problem.axes) else 3
            assert (there[[at - 1, at]] <= BY**power * plain[[at - 1, at]] * (1 + 1e-12)).all()
            assert (there[[at - 1, at]] >= plain[[at - 1, at]]).all()
