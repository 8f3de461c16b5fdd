"""Long pieces in windows, and pieces side by side: the motion as in one go, the same bytes on any number of threads."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.solvers.jerk_campaign import faults
from benchmarks.solvers.random_paths import long_path
from planner.base.threads import use_threads
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk import solver
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.slopes import slopes_of
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import load_machine

MACHINE = load_machine("mill")
COLUMNS = ("feed_sq", "acc_s", "jerk_s", "duration")

pytestmark = pytest.mark.usefixtures("threads_as_before")


@pytest.fixture(scope="module")
def pieces() -> FeedrateProblem:
    """A zig-zag with two full stops inside."""
    toolpath = toolpath_from_program(problems.zigzag(), MACHINE).with_joints(np.array([3, 6]), Joint.STOP)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    samples = refine_for_jerk(sample_path(path, MACHINE, 3e-2, third_order=True), MACHINE)
    problem = feedrate_problem(samples, MACHINE, measured=True)
    assert len(problem.piece) - 1 == 3
    return problem


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
@pytest.mark.parametrize("points", [2000, 5000])
def test_a_long_piece_in_windows_is_what_it_is_in_one(points):
    problem = long_path(points)
    whole = JerkLimited(window=100_000).solve(problem).require()
    found = JerkLimited(window=points // 10).solve(problem)
    assert whole.effort["windows"] == 1 < found.effort["windows"]
    assert not faults(problem, found)
    assert found.cycle_time == pytest.approx(whole.cycle_time, rel=1e-4)
    values = [slopes_of(problem, solution).jerk.sum() for solution in (found, whole)]
    assert values[0] == pytest.approx(values[1], rel=0.02)


@pytest.mark.parametrize("count", [2, 5])
def test_any_number_of_threads_gives_the_same_bytes(pieces, monkeypatch, count):
    monkeypatch.setattr(solver, "POINTS_SHARED", 0)
    solutions = []
    for threads in (1, count):
        use_threads(threads)
        solutions.append(JerkLimited().solve(pieces))
    one, many = solutions
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    for name in ("rows", "feed", "dynamics"):
        np.testing.assert_array_equal(getattr(one.multipliers, name), getattr(many.multipliers, name))
    assert (one.sentence, one.effort) == (many.sentence, many.effort)


def test_a_piece_is_solved_as_if_it_were_alone(pieces):
    together, alone = JerkLimited().solve(pieces), JerkLimited().solve(pieces.part(np.array([1])))
    own = slice(int(pieces.piece[1]), int(pieces.piece[2]))
    for name in COLUMNS:
        np.testing.assert_allclose(getattr(together, name)[own], getattr(alone, name), rtol=1e-9, atol=1e-9)


def test_progress_is_told_in_the_calling_thread_and_ends_with_all(pieces, monkeypatch):
    monkeypatch.setattr(solver, "POINTS_SHARED", 0)
    told: list[float] = []
    for threads in (1, 2):
        use_threads(threads)
        told.clear()
        JerkLimited().solve(pieces, told.append)
        assert told == sorted(told)
        assert 0.9 < told[-1] <= 1.0
