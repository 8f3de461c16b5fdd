"""The jerk-limited reference: closed forms, limits, prices, two solvers with one optimum, and failures that say so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from whole_plans import dense_motion, smooth_path

from benchmarks.jobs import problems
from benchmarks.solvers.jerk_campaign import small_problem
from benchmarks.solvers.ratios import constraint_ratios
from planner.base.point_to_point import rest_to_rest_times
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.slopes import slopes_of
from planner.feedrate.solution import Status, active_names
from planner.machine import Machine
from planner.motion.timing import Motion, law_of_solution
from planner.nc.program import Program
from planner.sensitivity.path_prices import path_prices

SOLVERS = ("ipopt", "fatrop")


def problem_of(program: Program, machine: Machine, finer: float = 1.0) -> FeedrateProblem:
    return feedrate_problem(
        refine_for_jerk(sample_path(smooth_path(program, machine), machine), machine, finer), machine
    )


def line(length: float, **limits: float) -> FeedrateProblem:
    return problem_of(problems.polyline([[0, 0], [length, 0]]), problems.machine(**limits))


@pytest.fixture(scope="module")
def bend() -> FeedrateProblem:
    """One rounded corner between two legs, from rest to rest."""
    return problem_of(problems.polyline([[0, 0], [3, 0], [3.5, 2]]), problems.machine())


@pytest.mark.shows("solver-ipopt", "exact: closed forms of lines")
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("length", "jerk"), [(0.2, 2e4), (0.2, 2e5), (2.0, 2e5), (100.0, 2e5), (100.0, 2e6)])
def test_a_line_takes_the_time_of_the_closed_form(solver, length, jerk):
    problem = line(length, jerk=jerk)
    solution = JerkLimitedNLP(solver=solver).solve(problem).require()
    exact = rest_to_rest_times(*(np.array([x]) for x in (length, 100.0, 2000.0, jerk)))[0]
    # the grid misses the switches of the jerk: slower, never faster, by at most 1.5e-3
    assert exact * (1 - 1e-6) <= solution.cycle_time <= exact * 1.0015


def test_the_grid_of_a_line_converges_to_the_closed_form():
    program, machine = problems.polyline([[0, 0], [0.2, 0]]), problems.machine()
    exact = 4.0 * (0.2 / (2 * 2e5)) ** (1 / 3)
    miss = [
        JerkLimitedNLP().solve(problem_of(program, machine, finer)).cycle_time / exact - 1
        for finer in (1, 2, 4)
    ]
    assert miss[0] < 1.5e-3
    assert miss[1] < 0.5 * miss[0]
    assert miss[2] < 0.15 * miss[0]  # second order, but for where the points happen to lie


def test_points_on_straight_elements_stay_few():
    assert len(line(0.2)) <= 35
    assert len(line(100.0)) <= 80
    assert len(line(1e4)) <= 120


@pytest.mark.parametrize("solver", SOLVERS)
def test_limits_hold_at_grid_points_and_one_is_active_everywhere(bend, solver):
    solution = JerkLimitedNLP(solver=solver).solve(bend).require()
    ratio, which = constraint_ratios(bend, solution)
    assert ratio.max() <= 1 + 1e-6
    assert np.median(ratio) > 0.999  # bang-bang
    assert {active_names(bend)[k].split(".")[0] for k in which} >= {"jerk", "acceleration"}


def test_the_motion_obeys_the_limits_between_grid_points():
    machine = problems.machine()
    path = smooth_path(problems.polyline([[0, 0], [3, 0], [3.5, 2]]), machine)
    samples = refine_for_jerk(sample_path(path, machine), machine)
    solution = JerkLimitedNLP().solve(feedrate_problem(samples, machine))
    law = law_of_solution(samples, solution)
    assert law.end == pytest.approx(solution.cycle_time, rel=1e-12)
    for part in dense_motion(Motion(samples=samples, law=law), machine.dt):
        assert np.abs(part.velocity).max() <= 100.0 * (1 + 1e-6)
        assert np.abs(part.acceleration).max() <= 2000.0 * (1 + 1e-3)
        # jerk rows hold at points only: r'' and r''' are curved in between
        assert np.abs(part.jerk).max() <= 2e5 * 1.02


def test_positions_speeds_and_accelerations_join(bend):
    solution = JerkLimitedNLP().solve(bend)
    v, a, j, h = np.sqrt(solution.feed_sq), solution.acc_s, solution.jerk_s, solution.duration
    ds = np.diff(bend.s)
    assert (v * h + a * h**2 / 2 + j * h**3 / 6)[:-1] == pytest.approx(ds, rel=1e-6)
    assert (v + a * h + j * h**2 / 2)[:-1] == pytest.approx(v[1:], abs=1e-6 * v.max())
    assert (a + j * h)[:-1] == pytest.approx(a[1:], abs=1e-6 * np.abs(a).max())
    assert solution.feed_sq[[0, -1]].tolist() == [0.0, 0.0]
    assert solution.acc_s[[0, -1]].tolist() == [0.0, 0.0]
    assert h[-1] == 0.0


@pytest.mark.shows("solver-ipopt, solver-fatrop", "compared: with each other")
def test_both_solvers_find_the_same_optimum(bend):
    ipopt, fatrop = (JerkLimitedNLP(solver=name).solve(bend) for name in SOLVERS)
    assert fatrop.cycle_time == pytest.approx(ipopt.cycle_time, rel=1e-4)
    slopes = [slopes_of(bend, solution).jerk for solution in (fatrop, ipopt)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-2, abs=1e-6)


def test_loose_jerk_gives_the_second_order_time():
    problem = problem_of(problems.polyline([[0, 0], [3, 0], [3.5, 2]]), problems.machine(jerk=1e8))
    second = Reachability().solve(problem)
    third = JerkLimitedNLP().solve(problem)
    assert third.cycle_time == pytest.approx(second.cycle_time, rel=2e-3)


@pytest.mark.slow
def test_tighter_jerk_is_never_faster(bend):
    times = [JerkLimitedNLP().solve(replace(bend, jerk=bend.jerk * f)).cycle_time for f in (0.5, 1.0, 2.0)]
    assert times == sorted(times, reverse=True)


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1 / 25.4, 1e-3])
def test_inches_and_metres_give_the_same_plan(bend, unit):
    """The iterates are the same but for rounding."""
    lengths = ("s", "velocity", "acceleration", "jerk")
    changed = {name: getattr(bend, name) * unit for name in lengths}
    changed |= {name: getattr(bend, name) / unit for name in ("d2_left", "d2_right")}
    changed |= {name: getattr(bend, name) / unit**2 for name in ("d3_left", "d3_right")}
    there = replace(bend, feed_sq_max=bend.feed_sq_max * unit**2, **changed)
    mine, theirs = JerkLimitedNLP().solve(bend), JerkLimitedNLP().solve(there)
    assert theirs.cycle_time == pytest.approx(mine.cycle_time, rel=1e-7)
    assert theirs.iterations == mine.iterations
    assert theirs.feed_sq / unit**2 == pytest.approx(mine.feed_sq, rel=1e-4, abs=1e-6 * mine.feed_sq.max())


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_prices_are_the_derivatives_of_the_cycle_time(quantity):
    """Centred differences of 1 %; the optimum's switches move between grid points, which costs a few per cent."""
    program = problems.polyline([[0, 0], [12, 0], [14, 8]], feed=200.0)  # faster than the axes allow
    machine = problems.machine()
    samples = refine_for_jerk(sample_path(smooth_path(program, machine), machine), machine)

    def time(axis: str, factor: float) -> float:
        own = machine.axes[axis]
        axes = machine.axes | {axis: own.model_copy(update={quantity: getattr(own, quantity) * factor})}
        return (
            JerkLimitedNLP()
            .solve(feedrate_problem(samples, machine.model_copy(update={"axes": axes})))
            .cycle_time
        )

    problem = feedrate_problem(samples, machine)
    solution = JerkLimitedNLP().solve(problem)
    price = path_prices(samples, problem, solution, machine).limits
    limit = getattr(problem, quantity)
    for k, axis in enumerate("xy"):
        slope = (time(axis, 1.01) - time(axis, 0.99)) / (0.02 * limit[k])
        assert price[f"{quantity}.{axis}"] <= 0.0
        # a price below 1e-4 of the cycle time per unit of ln(limit) is nothing
        assert price[f"{quantity}.{axis}"] == pytest.approx(
            slope, rel=0.05, abs=1e-4 * solution.cycle_time / limit[k]
        )


def test_the_price_of_the_feed_is_its_derivative():
    problem = line(20.0)
    price = slopes_of(problem, JerkLimitedNLP().solve(problem)).feed_sq_max
    up, down = (
        JerkLimitedNLP().solve(replace(problem, feed_sq_max=problem.feed_sq_max * f)).cycle_time
        for f in (1.005, 0.995)
    )
    assert price.sum() == pytest.approx((up - down) / 0.01, rel=0.02)


@pytest.mark.parametrize("solver", SOLVERS)
def test_too_few_iterations_is_a_status_without_numbers(bend, solver):
    solution = JerkLimitedNLP(solver=solver, max_iterations=3).solve(bend)
    assert solution.status is Status.ITERATION_LIMIT
    assert not solution.solved
    assert "max_iterations" in solution.sentence
    for values in (solution.feed_sq, solution.acc_s, solution.jerk_s, solution.duration):
        assert np.isnan(values).all()
    assert solution.multipliers is None


def test_a_guess_that_rests_at_both_ends_of_an_interval_is_no_hindrance():
    """The last interval of this problem is 1e-8 mm; the second-order optimum, the guess, stands still at both its ends."""
    problem = small_problem(8460)
    assert np.isinf(Reachability().solve(problem).duration[-2])
    reference = JerkLimitedNLP().solve(problem).require()
    assert JerkLimited().solve(problem).cycle_time == pytest.approx(reference.cycle_time, rel=1e-4)


def test_two_intervals_cannot_go_from_rest_to_rest():
    coarse = feedrate_problem(
        sample_path(smooth_path(problems.polyline([[0, 0], [3, 0]]), problems.machine()), problems.machine()),
        problems.machine(),
    )
    solution = JerkLimitedNLP().solve(coarse)
    assert solution.status is Status.INFEASIBLE
    assert "refine" in solution.sentence


def test_pieces_between_stops_add_up():
    program = problems.polyline([[0, 0], [2, 0], [2, 2]], path_control=problems.PathControl.EXACT_STOP)
    solution = JerkLimitedNLP().solve(problem_of(program, problems.machine()))
    assert solution.cycle_time == pytest.approx(2 * JerkLimitedNLP().solve(line(2.0)).cycle_time, rel=1e-5)


@pytest.mark.parametrize("settings", [{"solver": "snopt"}, {"tol": 0.0}])
def test_settings_that_make_no_sense_are_refused(settings):
    with pytest.raises(ValueError, match=next(iter(settings))):
        JerkLimitedNLP(**settings)


@pytest.mark.parametrize("solver", SOLVERS)
def test_on_a_coarse_grid_the_feed_keeps_its_bound_between_the_points(solver):
    """With the feed on its bound at a point and acceleration left there, the top of v(t) would be behind it."""
    problem = problem_of(problems.polyline([[0, 0], [20, 0]]), problems.machine(), finer=0.5)
    found = JerkLimitedNLP(solver=solver).solve(problem).require()
    share = np.linspace(0.0, 1.0, 101)[:, None]
    t = share * found.duration
    v = np.sqrt(found.feed_sq) + found.acc_s * t + found.jerk_s * t**2 / 2
    assert v.max() <= np.sqrt(problem.feed_sq_max.max()) * (1 + 1e-6)
