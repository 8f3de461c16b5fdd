"""What a feedrate solver returns: a status with a sentence, and a profile or NaN, never a plausible number."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from planner.arrays import Array, FloatArray, freeze
from planner.constraints.problem import FeedrateProblem
from planner.errors import NotSolvedError


class Status(Enum):
    """How a solver ended."""

    OPTIMAL = "optimal"
    INFEASIBLE = "infeasible"
    NUMERICAL_ERROR = "numerical error"


@dataclass(frozen=True, eq=False, kw_only=True)
class FeedrateSolution:
    """The profile of a `FeedrateProblem` with P points.

    status     : see `Status`
    sentence   : what happened and, on failure, what to do
    solver     : repr of the solver
    feed_sq    : (P,) x [mm2/s2]; all NaN unless solved
    acc_s      : (P,) u on the interval to the right of each point [mm/s2]; 0 at the last point of a piece
    solve_time : [s]
    """

    status: Status
    sentence: str
    solver: str
    feed_sq: FloatArray
    acc_s: FloatArray
    solve_time: float

    def __post_init__(self) -> None:
        points = len(self.feed_sq)
        freeze(self, "feed_sq", np.float64, (points,), finite=self.solved)
        freeze(self, "acc_s", np.float64, (points,), finite=self.solved)

    @property
    def solved(self) -> bool:
        """True if the arrays hold a profile."""
        return self.status is Status.OPTIMAL

    def require(self) -> FeedrateSolution:
        """Return self, or raise NotSolvedError with the sentence."""
        if not self.solved:
            raise NotSolvedError(self.sentence)
        return self

    @classmethod
    def failed(
        cls, problem: FeedrateProblem, status: Status, sentence: str, solver: str, solve_time: float
    ) -> FeedrateSolution:
        """A failure: every number is NaN."""
        nan = np.full(len(problem), np.nan)
        return cls(
            status=status, sentence=sentence, solver=solver, feed_sq=nan, acc_s=nan, solve_time=solve_time
        )


class FeedrateSolver(Protocol):
    """A solver is its settings; its repr is its row label in every table."""

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Solve all pieces of the problem; failures are a status, not an exception."""
        ...


def interval_times(problem: FeedrateProblem, feed_sq: FloatArray) -> FloatArray:
    """(P,) time [s] of the interval to the right of each point (0 at the end of a piece): 2 h / (feed_i + feed_{i+1})."""
    feed = np.sqrt(feed_sq)
    times = np.zeros(len(problem))
    inner = np.flatnonzero(problem.interval)
    with np.errstate(divide="ignore"):
        times[inner] = 2.0 * (problem.s[inner + 1] - problem.s[inner]) / (feed[inner] + feed[inner + 1])
    return times


def cycle_time(problem: FeedrateProblem, solution: FeedrateSolution) -> float:
    """Duration of the motion without dwells [s]. Raises NotSolvedError without a solution."""
    return float(interval_times(problem, solution.require().feed_sq).sum())


def constraint_ratios(problem: FeedrateProblem, solution: FeedrateSolution) -> tuple[FloatArray, Array]:
    """How close the profile comes to its limits, and to which.

    Returns the largest ratio (P,) of any constraint at each point or on the interval to its right (1 = active), and the
    constraint's index (P,) in `active_names`. Solver-independent: computed from the profile alone.
    """
    x, u = solution.require().feed_sq, solution.acc_s
    worst = x / problem.feed_sq_max
    which = problem.feed_sq_bound.copy()
    inner = np.flatnonzero(problem.interval)
    scale = 1.0 - problem.margin[inner]
    ends = (
        (problem.d1[inner], problem.d2_right[inner], x[inner]),
        (problem.d1[inner + 1], problem.d2_left[inner + 1], x[inner + 1]),
    )
    for k in range(len(problem.axes)):
        limit = problem.acceleration[k] * scale
        ratio = np.maximum(*(np.abs(d1[:, k] * u[inner] + d2[:, k] * xs) / limit for d1, d2, xs in ends))
        better = ratio > worst[inner]
        worst[inner[better]] = ratio[better]
        which[inner[better]] = len(problem.bound_names) + k
    return worst, which


def active_names(problem: FeedrateProblem) -> tuple[str, ...]:
    """Names for the indices of `constraint_ratios`."""
    return problem.bound_names + tuple(f"acceleration.{axis}" for axis in problem.axes)
