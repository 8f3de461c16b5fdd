"""Pieces that were solved before are taken over: the same motion as solving everything, and only the changed pieces are solved."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.changed import Known, solve_changed
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import FeedrateSolution, Status
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import load_machine

MACHINE = load_machine("mill")


@pytest.fixture(scope="module")
def known() -> Known:
    """A zig-zag with two full stops."""
    toolpath = toolpath_from_program(problems.zigzag(), MACHINE).with_joints(np.array([3, 6]), Joint.STOP)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    samples = refine_for_jerk(sample_path(path, MACHINE, 3e-2, third_order=True), MACHINE)
    problem = feedrate_problem(samples, MACHINE, measured=True)
    assert len(problem.piece) - 1 == 3
    return Known(problem, JerkLimited().solve(problem))


class Counting:
    """A solver that keeps the problems it is asked for."""

    def __init__(self):
        self.problems = []

    def __call__(self, problem):
        self.problems.append(problem)
        return JerkLimited().solve(problem)


def slower(known, piece):
    """The problem with half of the feed that is reached on one piece, and everything behind it moved along."""
    problem = known.problem
    own = slice(problem.piece[piece], problem.piece[piece + 1])
    limit, s = problem.feed_sq_max.copy(), problem.s.copy()
    limit[own] = np.minimum(limit[own], 0.25 * known.solution.feed_sq[own].max())
    s[problem.piece[piece + 1] :] += 0.125
    return dataclasses.replace(problem, feed_sq_max=limit, s=s)


def test_nothing_is_solved_where_nothing_changed(known):
    solver = Counting()
    again = solve_changed(known.problem, [known], solver)
    assert not solver.problems
    for name in ("feed_sq", "acc_s", "jerk_s", "duration"):
        assert (getattr(again, name) == getattr(known.solution, name)).all()
    assert again.prices.jerk == pytest.approx(known.solution.prices.jerk)


@pytest.mark.slow
@pytest.mark.parametrize("piece", [0, 1, 2])
def test_only_the_changed_piece_is_solved_and_the_motion_is_that_of_solving_all(known, piece):
    problem, solver = slower(known, piece), Counting()
    found, whole = solve_changed(problem, [known], solver), JerkLimited().solve(problem)
    assert [len(one) for one in solver.problems] == [np.diff(problem.piece)[piece]]
    assert found.status is Status.OPTIMAL
    assert found.jerk_s == pytest.approx(whole.jerk_s, rel=1e-6, abs=1e-3)
    assert found.cycle_time == pytest.approx(whole.cycle_time, rel=1e-9)
    assert found.cycle_time > known.solution.cycle_time
    assert found.multipliers.rows == pytest.approx(whole.multipliers.rows, rel=1e-6, abs=1e-9)
    assert found.prices.acceleration == pytest.approx(whole.prices.acceleration, rel=1e-6)


def test_pieces_come_from_whichever_problem_has_them(known):
    first, last = slower(known, 0), slower(known, 2)
    sources = [Known(problem, JerkLimited().solve(problem)) for problem in (first, last)]
    limit = np.where(np.arange(len(first)) < first.piece[1], first.feed_sq_max, last.feed_sq_max)
    both, solver = dataclasses.replace(first, feed_sq_max=limit), Counting()
    found = solve_changed(both, sources, solver)
    assert not solver.problems
    assert found.cycle_time == pytest.approx(JerkLimited().solve(both).cycle_time, rel=1e-9)


@pytest.mark.parametrize("name", ["jerk", "acceleration", "velocity"])
def test_other_limits_are_another_problem(known, name):
    solver = Counting()
    other = dataclasses.replace(known.problem, **{name: 0.5 * getattr(known.problem, name)})
    solve_changed(other, [known], solver)
    assert [len(one) for one in solver.problems] == [len(other)]


@pytest.mark.parametrize("row", ["d1", "d2_left", "d3_right", "limit_scale", "margin"])
def test_another_row_is_another_piece(known, row):
    values, solver = getattr(known.problem, row).copy(), Counting()
    values[5] = 1.01 * values[5] + 1e-3
    solve_changed(dataclasses.replace(known.problem, **{row: values}), [known], solver)
    assert [len(one) for one in solver.problems] == [known.problem.piece[1]]


def test_a_failure_of_the_changed_piece_is_the_status(known):
    def fail(problem):
        return FeedrateSolution.failed(problem, Status.NUMERICAL_ERROR, "lost", "none", 0.0)

    found = solve_changed(slower(known, 1), [known], fail)
    assert found.status is Status.NUMERICAL_ERROR
    assert found.sentence == "lost"
    assert len(found.feed_sq) == len(known.problem)
