"""Two solvers, one problem: our kernel and the package toppra, on random problems and on real programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles import needs_toppra
from quick import slow_but
from random_problems import line, random_problem
from whole_plans import solve

from benchmarks.jobs import problems
from benchmarks.solvers.ratios import constraint_ratios
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.solution import FeedrateSolution, Status
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
@pytest.mark.parametrize("part", slow_but([0, 1], range(10)))
def test_random_problems(part: int) -> None:
    solved = [both(random_problem(seed))[0].solved for seed in SEEDS if seed % 10 == part]
    assert all(solved)


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
    ToppraSolver().solve(line(1.0, 11))
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
