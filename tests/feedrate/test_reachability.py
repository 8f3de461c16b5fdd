"""The own kernel: closed forms, linear programmes, laws, and numbers far apart."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_problems import circle, in_units, line, make_problem, random_problem, reversed_problem
from scipy.optimize import linprog
from whole_plans import solve

from benchmarks.jobs import problems
from benchmarks.solvers.ratios import constraint_ratios
from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import (
    Interval,
    Reachability,
    axis_rows,
    largest_feed_sq,
)
from planner.feedrate.solution import FeedrateSolution

JOBS = problems.all_jobs()
RESOLVED = [seed for seed in range(40) if seed % 2 == 0]  # from rest to rest: always solvable


def plan(problem: FeedrateProblem) -> FeedrateSolution:
    solution = Reachability().solve(problem).require()
    assert constraint_ratios(problem, solution)[0].max() <= 1.0 + 1e-9
    return solution


@pytest.mark.shows("solver-reachability", "exact: closed forms")
@given(length=st.floats(0.1, 1e3), v=st.floats(1.0, 1e3), a=st.floats(10.0, 1e5), turn=st.floats(0.0, 6.28))
def test_trapezoid(length: float, v: float, a: float, turn: float) -> None:
    """From rest to rest on a line, the switching points on the grid: T = L/v + v/a, or 2 sqrt(L/a) if v is not reached."""
    ramp = v * v / (2.0 * a)
    switches = [ramp, length - ramp] if 2.0 * ramp < length else [length / 2.0]
    direction = np.array([np.cos(turn), np.sin(turn)])
    d1 = np.tile(direction, (len(switches) + 2, 1))
    limits = a * np.maximum(np.abs(direction), 1e-9)
    problem = make_problem(
        [0.0, *switches, length], d1, np.zeros_like(d1), feed_sq_max=v * v, acceleration=limits
    )
    exact = length / v + v / a if 2.0 * ramp < length else 2.0 * np.sqrt(length / a)
    # a ramp of 6e-6 mm at the end of 513 mm is good to the rounding of 513: 1e-8 of it, 2e-9 of the time
    assert plan(problem).cycle_time == pytest.approx(exact, rel=1e-8)


def test_switching_points_give_the_optimum() -> None:
    """The same through all stages, which put the switching points there themselves."""
    for length in (0.5, 4.9, 5.1, 300.0):  # v^2/a = 5 mm
        program = problems.polyline([[0, 0], [length, 0]])
        exact = length / 100.0 + 0.05 if length > 5.0 else 2.0 * np.sqrt(length / 2000.0)
        assert solve(program, problems.machine()).time == pytest.approx(exact, rel=1e-9)


def test_circle_limited_by_its_axes() -> None:
    """Without another limit, x = a R wherever an axis stands across the path; between, the corner of the box allows up to sqrt2."""
    radius, limit = 5.0, 2000.0
    solution = plan(circle(radius, 6 * np.pi, 3001, feed_sq_max=1e9, acceleration=limit))
    middle = solution.feed_sq[1000:2000] / (limit * radius)
    assert middle.min() == pytest.approx(1.0, rel=1e-2)
    assert 1.0 < middle.max() < np.sqrt(2.0)


def controllable_by_lp(problem: FeedrateProblem, i: int, target: float) -> float:
    """Largest x_i from which x_{i+1} in [0, target] can be reached, by HiGHS in scaled variables."""
    h, limit = problem.s[i + 1] - problem.s[i], problem.acceleration * (1.0 - problem.margin[i])
    x_unit = problem.feed_sq_max.max()
    rows = [[-1.0, -1.0], [1.0, 1.0]]  # 0 <= x + 2 h u <= target
    right = [0.0, target / x_unit]
    left_end, right_end = problem.d1[i], problem.d1[i + 1] + 2 * h * problem.d2_left[i + 1]
    for a, b in ((left_end, problem.d2_right[i]), (right_end, problem.d2_left[i + 1])):
        for k in range(len(limit)):
            row = np.array([b[k] * x_unit, a[k] * x_unit / (2 * h)])
            size = np.abs(row).max()
            rows += [row / size, -row / size]
            right += [limit[k] / size] * 2
    bounds = [(0.0, problem.feed_sq_max[i] / x_unit), (None, None)]
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    found = linprog([-1.0, 0.0], A_ub=rows, b_ub=right, bounds=bounds, method="highs-ds", options=options)
    assert found.status == 0
    return float(found.x[0] * x_unit)


@pytest.mark.parametrize("seed", range(0, 30, 3))
def test_controllable_speeds_are_those_of_a_linear_programme(seed: int) -> None:
    problem = random_problem(seed)
    last = min(problem.piece[1] - 1, 25)
    target = min(0.1 * problem.feed_sq_max.max(), problem.feed_sq_max[last])
    for i in range(last - 1, -1, -1):
        expected = controllable_by_lp(problem, i, target)
        h, share = problem.s[i + 1] - problem.s[i], 1.0 - problem.margin[i]
        target = largest_feed_sq(axis_rows(problem), Interval(i, h, share, target), problem.feed_sq_max[i])
        assert target == pytest.approx(expected, rel=1e-8)


def loosened(problem: FeedrateProblem) -> dict[str, FeedrateProblem]:
    acceleration = problem.acceleration.copy()
    acceleration[0] *= 1.2
    return {
        "feed": dataclasses.replace(problem, feed_sq_max=1.2 * problem.feed_sq_max),
        "acceleration": dataclasses.replace(problem, acceleration=acceleration),
        "margin": dataclasses.replace(problem, margin=0.5 * problem.margin),
    }


@cache
def problem_of(job: str) -> FeedrateProblem:
    return solve(JOBS[job], problems.machine()).problem


@pytest.mark.parametrize("job", JOBS)
def test_laws_on_adaptive_grids(job: str) -> None:
    """Looser limits are never slower; backwards takes as long. Greedy passes keep the second law to O(h) (reachability.py)."""
    problem = problem_of(job)
    cycle_time = plan(problem).cycle_time
    for name, other in loosened(problem).items():
        assert plan(other).cycle_time <= cycle_time * (1 + 1e-9), name
    assert plan(reversed_problem(problem)).cycle_time == pytest.approx(cycle_time, rel=5e-5)


@pytest.mark.parametrize("seed", RESOLVED)
def test_laws_on_random_curves(seed: int) -> None:
    """On coarse grids the greedy passes keep the laws to the share of a per cent."""
    problem = random_problem(seed)
    cycle_time = plan(problem).cycle_time
    for name, other in loosened(problem).items():
        assert plan(other).cycle_time <= cycle_time * (1 + 1e-3), name
    assert plan(reversed_problem(problem)).cycle_time == pytest.approx(cycle_time, rel=1e-2)


UNITS = {"metre": 1e-3, "inch": 1 / 25.4, "kilometre": 1e-6, "micrometre": 1e3}


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("job", JOBS)
def test_units_do_not_matter(job: str, unit: str) -> None:
    problem = problem_of(job)
    cycle_time = plan(problem).cycle_time
    assert plan(in_units(problem, UNITS[unit])).cycle_time == pytest.approx(cycle_time, rel=1e-9)
    assert plan(in_units(problem, UNITS[unit], 60.0)).cycle_time == pytest.approx(60.0 * cycle_time, rel=1e-9)


def test_scaled_lengths_and_limits_keep_the_time() -> None:
    """In binary units not one bit changes."""
    problem = random_problem(4)
    solution, scaled = plan(problem), plan(in_units(problem, 1024.0))
    np.testing.assert_array_equal(scaled.feed_sq, solution.feed_sq * 1024.0**2)
    assert scaled.cycle_time == solution.cycle_time


@pytest.mark.parametrize("step", [1e-9, 1e-12])
@pytest.mark.parametrize("place", [0.0, 2.5, 10.0, 17.5])
def test_tiny_intervals_beside_large_ones(step: float, place: float) -> None:
    """Intervals of a millionth of a micrometre beside 10 mm change nothing, and exceed nothing: T = L/v + v/a."""
    s = np.unique(np.concatenate([[0.0, 2.5, 10.0, 17.5, 20.0], place + step * np.arange(6)]))
    d1 = np.tile([1.0, 0.0], (len(s), 1))
    assert plan(make_problem(s, d1, np.zeros_like(d1))).cycle_time == pytest.approx(0.25, rel=1e-9)


@pytest.mark.parametrize("step", [1e-9, 1e-12])
def test_tiny_intervals_on_a_curve(step: float) -> None:
    radius, angle = 5.0, np.linspace(0.0, 3.0, 100)
    fine = np.unique(np.concatenate([angle, angle[40] + step / radius * np.arange(6)]))
    times = []
    for at in (angle, fine):
        d1 = np.stack([-np.sin(at), np.cos(at)], axis=1)
        d2 = np.stack([-np.cos(at), -np.sin(at)], axis=1) / radius
        times.append(plan(make_problem(radius * at, d1, d2)).cycle_time)
    assert times[1] == pytest.approx(times[0], rel=1e-6)


@pytest.mark.parametrize("noise", [0.0, 1e-300, 1e-17, 1e-13])
def test_rounding_in_the_tangent_costs_nothing(noise: float) -> None:
    """r' of an axis that stands still is rounding of either sign; its r'' may be real."""
    clean = circle(5.0, np.pi, 400, feed_sq_max=1e9)
    exact = plan(clean).cycle_time
    signs = np.random.default_rng(1).choice([-1.0, 1.0], clean.d1.shape)
    d1 = np.where(np.abs(clean.d1) < 1e-9, 0.0, clean.d1) + noise * signs
    assert plan(dataclasses.replace(clean, d1=d1)).cycle_time == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9, 1e12])
def test_limits_far_apart(ratio: float) -> None:
    """A tiny component of a weak axis limits a move of a strong one: T = 2 sqrt(L d / a) with d the component."""
    component = 1.0 / ratio
    direction = np.array([np.sqrt(1 - component**2), component])
    limits = np.array([2e3 * ratio, 1.0])
    a = min(limits / direction)
    d1 = np.tile(direction, (3, 1))
    problem = make_problem([0.0, 5.0, 10.0], d1, np.zeros((3, 2)), feed_sq_max=1e30, acceleration=limits)
    assert plan(problem).cycle_time == pytest.approx(2.0 * np.sqrt(10.0 / a), rel=1e-9)


def test_nearly_parallel_rows() -> None:
    """Axes that move almost alike: rows that differ in the last digits count once."""
    base = circle(5.0, 3.0, 200, feed_sq_max=1e9)
    exact = plan(base).cycle_time
    for difference in (1e-15, 1e-12, 1e-9):
        twice = {
            name: np.hstack([value, value * (1.0 + difference)])
            for name in ("d1", "d2_left", "d2_right")
            if (value := getattr(base, name)) is not None
        }
        problem = make_problem(base.s, **twice, feed_sq_max=1e9)
        assert plan(problem).cycle_time == pytest.approx(exact, rel=10 * difference + 1e-12)


def curvature_peak() -> FloatArray:
    return np.concatenate([np.zeros(20), [1e6], np.zeros(20)])


def test_a_peak_of_curvature_is_crawled_over() -> None:
    """1e6 1/mm at one point (a radius of a nanometre): x = a/r'' there, finite and positive everywhere else."""
    s = np.linspace(0.0, 10.0, 41)
    d1 = np.tile([1.0, 0.0], (41, 1))
    d2 = np.stack([np.zeros(41), curvature_peak()], axis=1)
    solution = plan(make_problem(s, d1, d2))
    assert solution.feed_sq[20] == pytest.approx(2e3 / 1e6)
    assert (solution.feed_sq[1:-1] > 0).all()


def test_rest_to_rest_in_one_interval_never_arrives() -> None:
    """A grid without a point in between has no profile but standing still; the caller sees an infinite time."""
    solution = Reachability().solve(line(1.0, 2))
    assert solution.cycle_time == np.inf
    ratio, _ = constraint_ratios(line(1.0, 2), solution)
    np.testing.assert_array_equal(ratio, 0.0)
