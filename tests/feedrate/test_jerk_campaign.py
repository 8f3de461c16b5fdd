"""The first problems of the campaign (benchmarks/solvers/jerk_campaign.py): every one is solved, and every answer holds."""

from __future__ import annotations

import pytest

from benchmarks.solvers.jerk_campaign import faults, small_problem
from planner.feedrate.jerk.solver import JerkLimited


@pytest.mark.shows("solver-own", "sampled: the first of ten thousand random problems")
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_nasty_small_problems_are_solved(first: int) -> None:
    for seed in range(first, first + 20):
        problem = small_problem(seed)
        assert not faults(problem, JerkLimited().solve(problem)), f"seed {seed}"
