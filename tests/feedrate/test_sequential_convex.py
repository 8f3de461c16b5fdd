"""The jerk-limited problem in the path domain: passes that keep all limits and only gain, rest, exact times, and the same optimum."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest
from random_problems import in_units, line, reversed_problem
from scipy.integrate import quad

from benchmarks.solvers.near_rest import NEAR
from benchmarks.solvers.random_paths import nurbs, random_path
from benchmarks.solvers.sequential_convex import SequentialConvex
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.solution import FeedrateSolution, Status

ROWS = 1e-6  # by which a row may exceed its limit [relative]
POINTS = 80  # of the random paths


@pytest.fixture(scope="module")
def trident() -> FeedrateProblem:
    """A curve on which jerk limits most of the way."""
    return nurbs("trident", POINTS, jerk=2e4)


class Shape:
    """u on interval i of a solution, as the module's text describes it: linear in the cube root of the distance to the nearer
    end of the path on intervals nearer to it than `NEAR` times their length, linear in s elsewhere."""

    def __init__(self, problem: FeedrateProblem, solution: FeedrateSolution, i: int):
        s, self.u = problem.s, solution.acc_s[i : i + 2]
        self.x0, self.s0, self.s1 = solution.feed_sq[i], s[i], s[i + 1]
        from_start, to_end = s[i] - s[0], s[-1] - s[i + 1]
        self.end = s[0] if from_start <= to_end else s[-1]
        self.rooted = min(from_start, to_end) <= NEAR * (self.s1 - self.s0)

    def along(self, s: float) -> float:
        return np.cbrt(s - self.end) if self.rooted else s

    def rate(self) -> float:
        return (self.u[1] - self.u[0]) / (self.along(self.s1) - self.along(self.s0))

    def acc(self, s: float) -> float:
        return self.u[0] + self.rate() * (self.along(s) - self.along(self.s0))

    def slope(self, s: float) -> float:
        return self.rate() * (abs(s - self.end) ** (-2 / 3) / 3 if self.rooted else 1.0)

    def feed_sq(self, s: float) -> float:
        return self.x0 + 2 * quad(self.acc, self.s0, s, epsabs=0, epsrel=1e-11)[0]


def worst_row(problem: FeedrateProblem, solution: FeedrateSolution) -> float:
    """Largest ratio to any limit at either end of any interval of the one piece, with the jerk w sqrt(x) of this formulation; on
    the first and the last interval the jerk is constant: what brings the feed from 0 to v on the length d, 2 v^3/(9 d^2)."""
    x, u, s = solution.feed_sq, solution.acc_s, problem.s
    v, n = np.sqrt(x), len(x) - 1
    assert problem.piece.tolist() == [0, n + 1]
    shapes = [Shape(problem, solution, i) for i in range(1, n - 1)]
    worst = [(x / problem.feed_sq_max).max()]
    for to, d2, d3 in ((0, problem.d2_right, problem.d3_right), (1, problem.d2_left, problem.d3_left)):
        at = np.arange(to, n + to)
        jerk = np.zeros(n)
        jerk[0] = 2 * v[1] ** 3 / (9 * (s[1] - s[0]) ** 2)
        jerk[-1] = 2 * v[n - 1] ** 3 / (9 * (s[n] - s[n - 1]) ** 2)
        jerk[1:-1] = [shape.slope(s[i + to]) * v[i + to] for i, shape in enumerate(shapes, start=1)]
        d1, d2, d3 = problem.d1[at], d2[at], d3[at]
        acc_axes = d1 * u[at, None] + d2 * x[at, None]
        jerk_axes = d1 * jerk[:, None] + v[at, None] * (3 * d2 * u[at, None] + d3 * x[at, None])
        worst += [
            (np.abs(acc_axes) / (problem.acceleration * (1 - problem.margin[:-1, None]))).max(),
            (np.abs(jerk_axes) / problem.jerk).max(),
        ]
    return max(worst)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 19])
def test_every_pass_keeps_all_limits_and_is_not_slower_than_the_last(seed: int) -> None:
    problem = random_path(seed, POINTS)
    times = []
    for passes in range(1, 7):
        solution = SequentialConvex(max_passes=passes, tol=1e-7).solve(problem).require()
        assert worst_row(problem, solution) <= 1 + ROWS
        times.append(solution.cycle_time)
        if solution.status is Status.OPTIMAL:
            break
        assert solution.status is Status.ACCEPTABLE
        assert "max_passes" in solution.sentence
    assert (np.diff(times) <= 1e-6 * times[0]).all()  # the solver's tolerance
    assert times[-1] < times[0] * (1 - 1e-5)  # the passes are needed


def test_rows_are_active(trident: FeedrateProblem) -> None:
    assert worst_row(trident, SequentialConvex().solve(trident)) >= 1 - 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5, 11])
def test_random_paths_take_the_time_of_the_other_solvers(seed: int) -> None:
    """On grids this coarse the transcriptions differ by up to 2 %."""
    problem = random_path(seed, POINTS)
    convex, ipopt, own = (
        solver.solve(problem).require().cycle_time
        for solver in (SequentialConvex(), JerkLimitedNLP(), JerkLimited())
    )
    assert convex == pytest.approx(ipopt, rel=2e-2)
    assert own == pytest.approx(ipopt, rel=2e-2)


@pytest.mark.slow
def test_the_optimum_converges_to_that_of_the_other_formulation() -> None:
    gap = []
    for points in (40, 80, 160):
        problem = nurbs("trident", points, jerk=2e4)
        convex, ipopt = (
            solver.solve(problem).require().cycle_time for solver in (SequentialConvex(), JerkLimitedNLP())
        )
        gap.append(abs(convex / ipopt - 1))
    assert gap[0] < 4e-2
    assert gap[1] < 0.6 * gap[0]
    assert gap[2] < 0.6 * gap[1]


@pytest.mark.slow
def test_a_line_converges_to_the_closed_form() -> None:
    """Where all of the motion is limited by jerk, at first order; with constant w next to the first and the last interval it
    is 3 % above on all of these grids."""
    exact = 4 * (1.0 / (2 * 2e4)) ** (1 / 3)
    miss = []
    for points in (33, 65, 129):
        problem = line(1.0, points, jerk=np.full(2, 2e4))
        miss.append(SequentialConvex().solve(problem).require().cycle_time / exact - 1)
    assert 0 < miss[0] < 1e-2
    assert 0 < miss[1] < 0.6 * miss[0]
    assert 0 < miss[2] < 0.6 * miss[1]


def test_a_motion_leaves_rest_with_all_the_jerk_there_is() -> None:
    """Constant jerk on the first intervals, of which the text-book treatment, constant w, would never leave the first."""
    problem = line(1.0, 129, jerk=np.full(2, 2e4))
    solution = SequentialConvex().solve(problem).require()
    t = np.cumsum(solution.duration)[:4]
    np.testing.assert_allclose(t, (6 * problem.s[1:5] / 2e4) ** (1 / 3), rtol=1e-4)
    np.testing.assert_allclose(solution.acc_s[1:5], 2e4 * t, rtol=1e-4)
    np.testing.assert_allclose(solution.jerk_s[[0, 1, 2, -4, -3, -2]], 2e4, rtol=1e-4)


@pytest.mark.slow
def test_one_row_at_rest_is_enough_to_slow_the_start(trident: FeedrateProblem) -> None:
    """The jerk rows next to rest are bounds on x there; without them a start on a coarse grid would break the jerk limits."""
    tight = replace(trident, jerk=trident.jerk * 1e-3)
    solution = SequentialConvex().solve(tight).require()
    assert worst_row(tight, solution) <= 1 + ROWS
    d = tight.s[1]
    assert (np.abs(tight.d1[0]) * 2 * solution.feed_sq[1] ** 1.5 / (9 * d**2) / tight.jerk).max() > 0.5


@pytest.mark.parametrize("reverse", [False, True])
def test_feed_and_time_are_integrals_of_the_acceleration(trident: FeedrateProblem, reverse: bool) -> None:
    """x from u, and the time from x, on every interval: Gauss's rule in the solver, an adaptive one here."""
    problem = reversed_problem(trident) if reverse else trident
    solution = SequentialConvex().solve(problem).require()
    x, h, n = solution.feed_sq, solution.duration, len(problem) - 1
    assert h[0] == pytest.approx(3 * problem.s[1] / np.sqrt(x[1]), rel=1e-12)
    for i in range(n):
        shape = Shape(problem, solution, i)
        assert shape.feed_sq(shape.s1) == pytest.approx(x[i + 1], rel=1e-5, abs=1e-7 * x.max())
        if 0 < i < n - 1:
            exact, _ = quad(lambda s, own=shape: own.feed_sq(s) ** -0.5, shape.s0, shape.s1, epsrel=1e-8)
            assert h[i] == pytest.approx(exact, rel=1e-4)


def test_both_directions_take_the_same_time(trident: FeedrateProblem) -> None:
    back = SequentialConvex().solve(reversed_problem(trident)).cycle_time
    assert back == pytest.approx(SequentialConvex().solve(trident).cycle_time, rel=1e-6)


def test_the_delivered_jerk_is_the_mean_of_the_interval(trident: FeedrateProblem) -> None:
    solution = SequentialConvex().solve(trident).require()
    u, j, h = solution.acc_s, solution.jerk_s, solution.duration
    np.testing.assert_allclose(u[:-1] + j[:-1] * h[:-1], u[1:], atol=1e-9 * np.abs(u).max())
    assert h[-1] == 0.0
    assert solution.feed_sq[[0, -1]].tolist() == [0.0, 0.0]
    assert solution.acc_s[[0, -1]].tolist() == [0.0, 0.0]
    assert solution.jerk_limited


@pytest.mark.slow
@pytest.mark.parametrize(("length", "time"), [(1 / 25.4, 1.0), (1e-3, 60.0)])
def test_other_units_give_the_same_plan(trident: FeedrateProblem, length: float, time: float) -> None:
    here = SequentialConvex().solve(trident)
    there = SequentialConvex().solve(in_units(trident, length, time))
    assert there.cycle_time / time == pytest.approx(here.cycle_time, rel=1e-7)
    assert there.iterations == pytest.approx(here.iterations, abs=3)


def test_pieces_add_up() -> None:
    one = line(1.0, 21, jerk=np.full(2, 2e5))
    both = line(2.0, 42, jerk=np.full(2, 2e5), piece=[0, 21, 42])
    both = replace(both, s=np.concatenate([one.s, 1.0 + one.s]))
    assert SequentialConvex().solve(both).cycle_time == pytest.approx(
        2 * SequentialConvex().solve(one).cycle_time, rel=1e-7
    )


def test_too_few_iterations_is_a_status_without_numbers(trident: FeedrateProblem) -> None:
    solution = SequentialConvex(max_iterations=3).solve(trident)
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.sentence.startswith("piece 0")
    assert "max_iterations" in solution.sentence
    for values in (solution.feed_sq, solution.acc_s, solution.jerk_s, solution.duration):
        assert np.isnan(values).all()


class Failing:
    """A solver like casadi's, which says that it has failed from the given call on, whatever numbers it returns."""

    def __init__(self, solver: casadi.Function, fails: int):
        self.solver, self.fails, self.calls = solver, fails, 0

    def __call__(self, **given: object) -> dict[str, casadi.DM]:
        self.calls += 1
        return self.solver(**given)

    def stats(self) -> dict[str, object]:
        said = self.solver.stats()
        return said | {"return_status": "Restoration_Failed"} if self.calls >= self.fails else said


@pytest.mark.parametrize(("fails", "status"), [(1, Status.NUMERICAL_ERROR), (2, Status.ACCEPTABLE)])
def test_a_failing_pass_is_a_status_and_what_was_found_before_it_counts(
    trident: FeedrateProblem, monkeypatch: pytest.MonkeyPatch, fails: int, status: Status
) -> None:
    first = SequentialConvex(max_passes=1).solve(trident)
    real = casadi.nlpsol
    monkeypatch.setattr(casadi, "nlpsol", lambda *given: Failing(real(*given), fails))
    solution = SequentialConvex().solve(trident)
    assert solution.status is status
    assert "broke down" in solution.sentence
    assert solution.solved is (fails == 2)
    if solution.solved:
        assert "1 passes" in solution.sentence
        np.testing.assert_array_equal(solution.feed_sq, first.feed_sq)


def test_two_intervals_cannot_go_from_rest_to_rest() -> None:
    solution = SequentialConvex().solve(line(1.0, 3))
    assert solution.status is Status.INFEASIBLE
    assert "refine" in solution.sentence
    three = SequentialConvex().solve(line(1.0, 4)).require()
    assert three.cycle_time > 0


@pytest.mark.parametrize("settings", [{"tol": 0.0}, {"max_passes": 0}])
def test_settings_that_make_no_sense_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(settings))):
        SequentialConvex(**settings)
