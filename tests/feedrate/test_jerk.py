"""The interior-point kernel: closed forms, limits at the grid points, windows, and the second-order optimum as its limit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from random_problems import in_units, make_problem

from benchmarks.jobs import problems
from benchmarks.solvers.jerk_campaign import small_problem
from benchmarks.solvers.random_paths import random_path
from benchmarks.solvers.ratios import constraint_ratios
from planner.base.point_to_point import rest_to_rest_times
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.jerk.window import ScaledWindow
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.slopes import slopes_of
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program


def third_order(program, machine):
    """The feedrate problem of a job on a grid for jerk limits."""
    toolpath = toolpath_from_program(program, machine)
    samples = sample_path(
        round_corners(toolpath, machine, BezierCorner(), blend_tangents=True), machine, third_order=True
    )
    return feedrate_problem(refine_for_jerk(samples, machine), machine)


@pytest.mark.shows("solver-own", "exact: closed forms of lines")
@pytest.mark.parametrize("length", [1e-3, 0.05, 1.0, 30.0, 500.0])
def test_a_line_from_rest_to_rest_takes_the_closed_form(length):
    problem = third_order(problems.polyline([[0, 0], [length, 0]]), problems.machine())
    one = np.ones(1)
    closed = rest_to_rest_times(length * one, 100 * one, 2000 * one, 2e5 * one)[0]
    found = JerkLimited().solve(problem).require().cycle_time
    assert (
        closed * (1 - 1e-6) <= found <= closed * 1.005
    )  # the grid does not hit the switches of the optimum exactly


@pytest.mark.parametrize("name", ["pentagon", "zigzag", "five points", "arcs"])
def test_limits_and_kinematics_hold_at_the_grid_points(name):
    problem = third_order(problems.all_jobs()[name], problems.machine())
    solution = JerkLimited().solve(problem).require()
    inner = np.flatnonzero(problem.interval)
    v, a, j, h = np.sqrt(solution.feed_sq), solution.acc_s, solution.jerk_s[inner], solution.duration[inner]
    v0, a0 = v[inner], a[inner]
    ds = problem.s[inner + 1] - problem.s[inner]
    np.testing.assert_allclose(v0 * h + a0 * h**2 / 2 + j * h**3 / 6, ds, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(v0 + a0 * h + j * h**2 / 2, v[inner + 1], atol=1e-5)
    np.testing.assert_allclose(a0 + j * h, a[inner + 1], atol=1e-6 * 2000)
    assert (solution.feed_sq <= problem.feed_sq_max * (1 + 1e-6)).all()
    for points, d2, d3 in (
        (inner, problem.d2_right, problem.d3_right),
        (inner + 1, problem.d2_left, problem.d3_left),
    ):
        d1, d2, d3 = problem.d1[points], d2[points], d3[points]
        feed, acc = v[points, None], a[points, None]
        assert np.abs(d1 * acc + d2 * feed**2).max() <= 2000 * (1 + 1e-6)
        assert np.abs(d1 * j[:, None] + 3 * d2 * feed * acc + d3 * feed**3).max() <= 2e5 * (1 + 1e-6)


def test_windows_give_the_profile_of_one_piece():
    problem = third_order(problems.zigzag(), problems.machine())
    whole = JerkLimited(window=100_000).solve(problem).require()
    windows = JerkLimited(window=1500).solve(problem).require()
    assert windows.cycle_time == pytest.approx(whole.cycle_time, rel=1e-4)  # the solver's own gap
    np.testing.assert_allclose(np.sqrt(windows.feed_sq), np.sqrt(whole.feed_sq), atol=0.01 * 100)


def test_a_loose_jerk_gives_nearly_the_second_order_time():
    machine = problems.machine(jerk=5e6)
    problem = third_order(problems.pentagon(), machine)
    third = JerkLimited().solve(problem).require().cycle_time
    second = Reachability().solve(problem).require().cycle_time
    assert second * (1 - 1e-3) <= third <= second * 1.02


def test_a_tighter_jerk_is_never_faster():
    times = [
        JerkLimited()
        .solve(third_order(problems.pentagon(), problems.machine(jerk=jerk)))
        .require()
        .cycle_time
        for jerk in (1e6, 2e5, 5e4)
    ]
    assert times == sorted(times)


def test_prices_are_the_derivatives_of_the_time():
    machine = problems.machine()
    problem = third_order(problems.pentagon(), machine)
    solution = JerkLimited(tol=1e-6).solve(problem).require()
    slopes = slopes_of(problem, solution)
    for name in ("acceleration", "jerk"):
        limit = getattr(problem, name)
        times = [
            JerkLimited(tol=1e-6)
            .solve(dataclasses.replace(problem, **{name: limit * by}))
            .require()
            .cycle_time
            for by in (0.99, 1.01)
        ]
        along = (times[1] - times[0]) / 0.02  # d T / d log(limit), all axes together
        assert getattr(slopes, name).sum() == pytest.approx(along, rel=0.05)


def test_without_convergence_the_profile_stops_more_often_and_says_where():
    problem = third_order(problems.pentagon(), problems.machine())
    solution = JerkLimited(iterations=3).solve(problem)
    assert solution.status is Status.ACCEPTABLE
    assert "full stops where the method did not converge, at s = " in solution.sentence
    ratio, _ = constraint_ratios(problem, solution)
    assert ratio.max() <= 1 + 1e-6
    best = JerkLimited().solve(problem)
    assert best.status is Status.OPTIMAL
    assert best.cycle_time < solution.cycle_time


@pytest.mark.parametrize("intervals", range(99, 107))
def test_a_window_that_does_not_converge_is_divided_to_an_end(intervals):
    """Of 101 to 104 intervals the smaller window was the same one again, without end."""
    s = np.linspace(0.0, 50.0, intervals + 1)
    direction = np.stack([np.cos(s / 8), np.sin(s / 8)], axis=1)
    problem = make_problem(s, direction, np.stack([-direction[:, 1], direction[:, 0]], axis=1) / 8)
    solution = JerkLimited(iterations=1).solve(problem)
    assert solution.status is Status.ACCEPTABLE
    assert np.isfinite(solution.cycle_time)


def test_a_piece_with_too_few_intervals_is_refused():
    problem = make_problem([0.0, 1.0, 2.0], np.ones((3, 1)), np.zeros((3, 1)))
    solution = JerkLimited().solve(problem)
    assert solution.status is Status.INFEASIBLE
    assert "fewer than 4 intervals" in solution.sentence
    assert np.isnan(solution.feed_sq).all()


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
@pytest.mark.parametrize("length", [1.0 / 25.4, 1e-3])
def test_inches_and_metres_give_the_same_motion(length):
    for seed in range(12):
        problem = small_problem(seed)
        here, there = (JerkLimited().solve(p).require() for p in (problem, in_units(problem, length)))
        assert there.cycle_time == pytest.approx(here.cycle_time, rel=1e-6)
        np.testing.assert_allclose(
            np.sqrt(there.feed_sq) / length, np.sqrt(here.feed_sq), rtol=1e-3, atol=1e-6
        )


def test_lengths_and_limits_scaled_alike_keep_the_time_and_slower_clocks_stretch_it():
    problem = small_problem(3)
    time = JerkLimited().solve(problem).require().cycle_time
    assert JerkLimited().solve(in_units(problem, 1.0, 60.0)).require().cycle_time == pytest.approx(
        60.0 * time, rel=1e-6
    )


def test_the_time_converges_with_the_grid():
    """First order: half the step, half the distance to the limit of the times."""
    machine = problems.machine()
    toolpath = toolpath_from_program(problems.pentagon(), machine)
    times = []
    for finer in (1.0, 2.0, 4.0, 8.0):
        path = round_corners(toolpath, machine, BezierCorner(), blend_tangents=True)
        samples = refine_for_jerk(
            sample_path(path, machine, 2e-3 / finer**2, third_order=True), machine, finer
        )
        times.append(JerkLimited(tol=1e-6).solve(feedrate_problem(samples, machine)).require().cycle_time)
    distance = np.abs(np.array(times[:-1]) - times[-1]) / times[-1]
    assert distance[0] < 2e-3
    assert distance[2] < 0.5 * distance[0]


@pytest.mark.parametrize(
    ("feed", "window"), [(0.01, 5000), (0.01, 1000), (0.1, 5000), (0.1, 800), (1.0, 800)]
)
def test_feeds_far_below_what_the_axes_can_do_converge(feed, window):
    """At 0.1 mm/s the ramps are a nanometre of a path of millimetres."""
    side = 2.0 * np.array([np.cos(np.pi / 12), np.sin(np.pi / 12)])
    points = np.vstack([np.zeros(2), np.cumsum([side * [1, (-1) ** k] for k in range(12)], axis=0)])
    problem = third_order(problems.polyline(points, feed=feed), problems.machine())
    solution = JerkLimited(window=window).solve(problem)
    assert solution.status is Status.OPTIMAL, solution.sentence
    length = problem.s[-1] - problem.s[0]
    assert length / feed <= solution.cycle_time <= length / feed * 1.001


@pytest.mark.parametrize("window", [90, 200, 450])
def test_windows_shorter_than_the_way_to_brake_are_made_longer(window):
    problem = third_order(problems.star_spiral(60), problems.machine())
    whole = JerkLimited(window=100_000).solve(problem).require()
    windows = JerkLimited(window=window).solve(problem).require()
    assert whole.cycle_time * (1 - 1e-4) <= windows.cycle_time <= whole.cycle_time * 1.01


def test_a_window_behind_motion_that_does_not_converge_ends_in_the_stop_before(monkeypatch):
    problem = third_order(problems.zigzag(), problems.machine())
    solve, rest = ScaledWindow.solve, []

    def failing(window, behind, tol, iterations):
        if behind is not None and not rest:
            rest.append(len(behind.x))
            return None, 0, 1
        return solve(window, behind, tol, iterations)

    monkeypatch.setattr(ScaledWindow, "solve", failing)
    solution = JerkLimited(window=1000).solve(problem)
    assert solution.status is Status.ACCEPTABLE
    assert "except 1 full stops where the method did not converge" in solution.sentence
    assert constraint_ratios(problem, solution)[0].max() <= 1.0 + 1e-6


@pytest.mark.parametrize(("window", "slower"), [(150, 4e-4), (300, 1e-5)])
@pytest.mark.parametrize("seed", [0, 2, 4])
def test_short_windows_join_where_the_motion_has_room(seed, window, slower):
    """Joined wherever the end is not felt, seed 2 takes 1e-4 longer, and multipliers near a join may be a hundred times too large."""
    problem = random_path(seed)
    whole = JerkLimited(window=100_000).solve(problem).require()
    windows = JerkLimited(window=window).solve(problem).require()
    assert windows.cycle_time == pytest.approx(whole.cycle_time, rel=slower)
    rows, expected = np.abs(windows.multipliers.rows), np.abs(whole.multipliers.rows)
    assert rows.sum() == pytest.approx(expected.sum(), rel=0.05)
    assert rows.max() <= 2.0 * expected.max()
