"""Solve only the pieces of a problem that changed: pieces are independent, so one that was solved before need
not be solved again.

A piece is the same if its rows are, to the last digit. Its place s along the job moves when a piece before it
changes its length; the lengths of its intervals are then the same but for the rounding of s.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import ROWS, FeedrateProblem
from planner.feedrate.lagrangian import lagrangian
from planner.feedrate.solution import FeedrateSolution, Multipliers, Prices, Status

ROUNDING = 1e-9  # of the length of an interval [-]: metres into a job it is known no better


class Known(NamedTuple):
    """A problem and its solution."""

    problem: FeedrateProblem
    solution: FeedrateSolution


class _Solved(NamedTuple):
    """Where the solution of one piece is: from the point `begin` of a solution on."""

    solution: FeedrateSolution
    begin: int


def solve_changed(
    problem: FeedrateProblem, known: Sequence[Known], solve: Callable[[FeedrateProblem], FeedrateSolution]
) -> FeedrateSolution:
    """The solution of a problem: the pieces that one of the known problems has too, in the same place among
    its pieces, are taken over, the others are solved. A failure of these is the solution's status."""
    pieces = len(problem.piece) - 1
    known = [one for one in known if one.solution.solved and _comparable(problem, one.problem)]
    found: dict[int, _Solved] = {}
    for g in range(pieces):
        for one in known:
            if _same(problem, one.problem, g):
                found[g] = _Solved(one.solution, int(one.problem.piece[g]))
                break
    if not found:
        return solve(problem)
    changed = np.array([g for g in range(pieces) if g not in found], dtype=np.int64)
    if len(changed):
        part = problem.part(changed)
        solved = solve(part)
        if not solved.solved:
            return FeedrateSolution.failed(
                problem, solved.status, solved.sentence, solved.solver, solved.solve_time, solved.iterations
            )
        found |= {int(g): _Solved(solved, int(at)) for g, at in zip(changed, part.piece[:-1], strict=True)}
    return _joined(problem, [found[g] for g in range(pieces)])


def _comparable(problem: FeedrateProblem, other: FeedrateProblem) -> bool:
    """Whether two problems have as many pieces, and the same limits."""
    same = len(problem.piece) == len(other.piece) and problem.axes == other.axes
    limits = ("velocity", "acceleration", "jerk")
    return same and all(np.array_equal(getattr(problem, name), getattr(other, name)) for name in limits)


def _same(problem: FeedrateProblem, other: FeedrateProblem, g: int) -> bool:
    """Whether piece g of two problems is the same."""
    a, b = (slice(int(one.piece[g]), int(one.piece[g + 1])) for one in (problem, other))
    if a.stop - a.start != b.stop - b.start:
        return False
    if not all(np.array_equal(getattr(problem, name)[a], getattr(other, name)[b]) for name in ROWS):
        return False
    here, there = problem.own_here, other.own_here
    if here is not None and there is not None and not np.array_equal(here[:, a], there[:, b]):
        return False
    return np.allclose(np.diff(problem.s[a]), np.diff(other.s[b]), rtol=ROUNDING, atol=0.0)


def _joined(problem: FeedrateProblem, solved: Sequence[_Solved]) -> FeedrateSolution:
    """One solution of all pieces; its status is the worst of theirs."""
    sizes = np.diff(problem.piece)

    def points(values: Callable[[FeedrateSolution], FloatArray]) -> FloatArray:
        return np.concatenate(
            [values(one.solution)[one.begin : one.begin + n] for one, n in zip(solved, sizes, strict=True)]
        )

    solutions = {id(one.solution): one.solution for one in solved}.values()
    worst = next((one for one in solutions if one.status is not Status.OPTIMAL), solved[-1].solution)
    solution = replace(
        worst,
        feed_sq=points(lambda one: one.feed_sq),
        acc_s=points(lambda one: one.acc_s),
        jerk_s=points(lambda one: one.jerk_s),
        duration=points(lambda one: one.duration),
        multipliers=None,
        prices=None,
    )
    if any(one.multipliers is None for one in solutions):
        return solution

    def of(name: str) -> FloatArray:
        return points(lambda one: getattr(one.multipliers, name))

    multipliers = Multipliers(rows=of("rows"), feed=of("feed"), dynamics=of("dynamics"))
    solution = replace(solution, multipliers=multipliers)
    price = lagrangian(problem, solution)
    return replace(
        solution, prices=Prices.from_relative(problem, price.acceleration, price.jerk, price.feed_sq_max)
    )
