"""Two solvers, one problem: our kernel and the package toppra, on random problems and on real programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles import needs_toppra
from quick import slow_but
from random_problems import circle, line, random_problem
from whole_plans import solve

from benchmarks.jobs import problems
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability, controllable_sets
from planner.feedrate.solution import FeedrateSolution, Status, constraint_ratios
from planner.feedrate.toppra_adapter import ToppraSolver
from planner.nc.reader import read_program

pytestmark = needs_toppra

TIME = 1e-6  # difference of the cycle times [relative]; asked for: 1e-4. The passes are the same, so only rounding is left
PROFILE = 1e-5  # difference of the feeds [share of the largest]; asked for: 1e-3
RATIO = 1e-9  # by which rounding may exceed a limit [relative]
SEEDS = range(200)
REAL = (
    "LinuxCNC__linuxcnc__tort.ngc",
    "LinuxCNC__linuxcnc__arcspiral.ngc",
    "winder__Universal-G-Code-Sender__arc_rword_test.gcode",
)


def both(problem: FeedrateProblem) -> tuple[FeedrateSolution, FeedrateSolution]:
    """Solve with both, compare, and check every limit."""
    own, other = Reachability().solve(problem), ToppraSolver().solve(problem)
    assert own.status is other.status, (own.sentence, other.sentence)
    if own.solved:
        assert other.cycle_time == pytest.approx(own.cycle_time, rel=TIME)
        feed, feed_other = np.sqrt(own.feed_sq), np.sqrt(other.feed_sq)
        np.testing.assert_allclose(feed_other, feed, rtol=0, atol=PROFILE * feed.max())
        for solution in (own, other):
            keeps_limits(problem, solution)
    return own, other


def keeps_limits(problem: FeedrateProblem, solution: FeedrateSolution) -> None:
    """No limit exceeded; and of two neighbouring intervals at least one is at a limit.

    The exceptions to "every point is at a limit" are these: an interval in which the profile falls from full acceleration onto
    the curve K of what can still be braked holds the switch and touches nothing; the next one starts on K, where something
    always acts. And a piece of one interval from rest to rest, where nothing moves.
    """
    ratio, _ = constraint_ratios(problem, solution)
    assert ratio.max() <= 1.0 + RATIO
    free = problem.interval & (ratio < 1.0 - 1e-6)
    assert not (free[:-1] & free[1:]).any()


@pytest.mark.shows(
    "solver-reachability, solver-toppra", "compared: with each other, on random problems and real programs"
)
@pytest.mark.parametrize("seed", slow_but([0, 3, 6, 9], range(0, 40, 3)))
def test_controllable_sets(seed: int) -> None:
    """Their upper ends; from rest to rest the lower ones are 0."""
    problem = random_problem(seed)
    own, other = controllable_sets(problem), ToppraSolver().controllable_sets(problem)
    assert np.isfinite(own).all()
    np.testing.assert_allclose(other[:, 1], own, rtol=1e-6, atol=1e-9 * own.max())
    if not problem.feed_sq_end.any():
        assert other[:, 0].max() <= 1e-9 * own.max()


@pytest.mark.shows(
    "solver-reachability, solver-toppra", "compared: with each other, on random problems and real programs"
)
@pytest.mark.parametrize("part", slow_but([0, 1], range(10)))
def test_random_problems(part: int) -> None:
    solved = [both(random_problem(seed))[0].solved for seed in SEEDS if seed % 10 == part]
    assert sum(solved) >= 18  # the others ask for speeds at their ends that cannot be joined


@pytest.mark.parametrize("job", slow_but(("pentagon", "arcs"), problems.all_jobs()))
def test_jobs(job: str) -> None:
    both(solve(problems.all_jobs()[job], problems.machine()).problem)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a_pentagon", "b_zigzag", "c_circle", "d_starspiral", "e_chips", "x_arcs"])
def test_programs_of_the_peers(name: str, shared_dir: Path) -> None:
    file = shared_dir / "peers" / "programs" / f"{name}.ngc"
    if not file.is_file():
        pytest.skip(f"no program {file}")
    both(solve(read_program(file, problems.machine()), problems.machine(), resolution=2e-2).problem)


@pytest.mark.shows(
    "solver-reachability, solver-toppra", "compared: with each other, on random problems and real programs"
)
@pytest.mark.slow
@pytest.mark.parametrize("name", REAL)
def test_real_programs(name: str, shared_dir: Path) -> None:
    file = shared_dir / "nc" / name
    if not file.is_file():
        pytest.skip(f"no program {file}")
    both(solve(read_program(file, problems.machine()), problems.machine(), resolution=2e-2).problem)


@pytest.mark.parametrize(
    ("ends", "where"),
    [
        ({"feed_sq_end": [2e4]}, "above the feed limit at the end"),
        ({"feed_sq_end": [5e3]}, "more than the length allows"),
        ({"feed_sq_start": [5e3]}, "cannot stop in time"),
        ({"feed_sq_start": [2e4]}, "above the feed limit at the start"),
    ],
)
def test_ends_that_cannot_be_joined(ends: dict[str, list[float]], where: str) -> None:
    own, other = both(line(1.0, 11, **ends))
    for solution in (own, other):
        assert solution.status is Status.INFEASIBLE, where
        assert "piece 0" in solution.sentence
        assert "lower them or loosen the limits" in solution.sentence
        for array in (solution.feed_sq, solution.acc_s, solution.jerk_s, solution.duration):
            assert np.isnan(array).all()


def test_ends_within_reach() -> None:
    """2 a L = 4000 mm2/s2 is the most that 1 mm gives."""
    for share, solved in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
        assert both(line(1.0, 11, feed_sq_end=[4000.0 * share]))[0].solved is solved
    own, _ = both(circle(5.0, 2.0, 50, feed_sq_start=[100.0], feed_sq_end=[900.0]))
    assert own.feed_sq[[0, -1]] == pytest.approx([100.0, 900.0])


def test_toppra_gives_up_with_a_status(monkeypatch: pytest.MonkeyPatch) -> None:
    """A failure that toppra reports is a status with a remedy, whatever its arrays hold."""
    import toppra.algorithm as algorithm
    from toppra.algorithm.algorithm import ParameterizationReturnCode

    def fail(self: algorithm.TOPPRA, *_: object) -> None:
        self.problem_data.return_code = ParameterizationReturnCode.ErrUnknown

    monkeypatch.setattr(algorithm.TOPPRA, "compute_parameterization", fail)
    solution = ToppraSolver().solve(line(10.0, 5))
    assert solution.status is Status.NUMERICAL_ERROR
    assert "ErrUnknown; use the solver Reachability" in solution.sentence
    assert np.isnan(solution.feed_sq).all()


def test_silent(capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
    """toppra's own messages do not reach the user: the status says it all."""
    ToppraSolver().solve(line(1.0, 11, feed_sq_start=[5e3]))
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
