"""The result of a feedrate solver: a status with a sentence, and a profile or NaN."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.base.errors import NotSolvedError
from planner.feedrate.constraints.limit import RowLimit, RowPoint
from planner.feedrate.constraints.limits import ACCELERATION, JERK, ROWS
from planner.feedrate.constraints.problem import FeedrateProblem


class Status(Enum):
    """How a solver ended. Only the first two come with a profile; both keep every limit."""

    OPTIMAL = "optimal"
    ACCEPTABLE = "acceptable"  # feasible, and optimal to a coarser tolerance than the one asked for
    INFEASIBLE = "infeasible"
    ITERATION_LIMIT = "iteration limit"
    NUMERICAL_ERROR = "numerical error"
    TOO_LARGE = "too large"  # for this solver, which was not tried


@dataclass(frozen=True, eq=False, kw_only=True)
class Multipliers:
    """Multipliers of the interval to the right of each point [s]; 0 where there is no interval."""

    # (P, A, 4) of the axis limits, as shares of the limits: acceleration at the interval's start, jerk there,
    # jerk at its end, acceleration there; negative where the lower side is the one that holds
    rows: FloatArray
    feed: FloatArray  # (P, 2) of x / feed_sq_max at the point and in the middle of the interval
    dynamics: FloatArray  # (P,) of the kinematics of x [s per mm2/s2]

    def __post_init__(self) -> None:
        points, axes, _ = np.shape(self.rows)
        freeze(self, "rows", np.float64, (points, axes, 4))
        freeze(self, "feed", np.float64, (points, 2))
        freeze(self, "dynamics", np.float64, (points,))


@dataclass(frozen=True, eq=False, kw_only=True)
class FeedrateSolution:
    """The profile of a `FeedrateProblem` with P points: constant jerk along the path on every interval."""

    status: Status  # see `Status`
    sentence: str  # what happened and, on failure, what to do
    solver: str  # repr of the solver
    feed_sq: FloatArray  # (P,) x [mm2/s2]; all NaN unless solved, like the next three
    # (P,) acceleration along the path just after each point [mm/s2]; 0 at the end of a piece at rest
    acc_s: FloatArray
    # (P,) jerk along the path to the right of each point [mm/s3]; 0 everywhere at second order
    jerk_s: FloatArray
    # (P,) time there [s]; 0 where a piece ends; inf where a second-order profile rests at both ends
    duration: FloatArray
    solve_time: float  # [s]
    iterations: int = 0  # of an iterative solver; the largest of all pieces
    effort: dict[str, int] = field(default_factory=dict)  # what else the solver counted, by name
    jerk_limited: bool = False  # True if the jerk limits of the problem were kept
    # of limits and kinematics, if the solver knows; see feedrate/slopes.py
    multipliers: Multipliers | None = None

    def __post_init__(self) -> None:
        points = len(self.feed_sq)
        freeze(self, "feed_sq acc_s jerk_s", np.float64, (points,), finite=self.solved)
        freeze(self, "duration", np.float64, (points,), finite=False)

    @property
    def solved(self) -> bool:
        """True if the arrays hold a profile."""
        return self.status in (Status.OPTIMAL, Status.ACCEPTABLE)

    @property
    def cycle_time(self) -> float:
        """Duration of the motion without dwells [s]; NaN unless solved."""
        return float(self.duration.sum())

    def require(self) -> FeedrateSolution:
        """Return self, or raise NotSolvedError with the sentence."""
        if not self.solved:
            raise NotSolvedError(self.sentence)
        return self

    @classmethod
    def second_order(
        cls,
        problem: FeedrateProblem,
        *,
        feed_sq: FloatArray,
        acc_s: FloatArray,
        sentence: str,
        solver: str,
        solve_time: float,
    ) -> FeedrateSolution:
        """A second-order optimum: constant acceleration `acc_s` (P,) on the interval to the right [mm/s2], `feed_sq`
        (P,) [mm2/s2]."""
        return cls(
            status=Status.OPTIMAL,
            sentence=sentence,
            solver=solver,
            feed_sq=feed_sq,
            acc_s=acc_s,
            jerk_s=np.zeros(len(problem)),
            duration=interval_times(problem, feed_sq),
            solve_time=solve_time,
        )

    @classmethod
    def failed(
        cls,
        problem: FeedrateProblem,
        status: Status,
        sentence: str,
        solver: str,
        solve_time: float,
        iterations: int = 0,
    ) -> FeedrateSolution:
        """A failure: every number is NaN."""
        nan = np.full(len(problem), np.nan)
        return cls(
            status=status,
            sentence=sentence,
            solver=solver,
            feed_sq=nan,
            acc_s=nan,
            jerk_s=nan,
            duration=nan,
            solve_time=solve_time,
            iterations=iterations,
        )


class FeedrateSolver(Protocol):
    """A solver is its settings; its repr is its row label in every table."""

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Solve all pieces of the problem; failures are a status, not an exception."""
        ...


def interval_times(problem: FeedrateProblem, feed_sq: FloatArray) -> FloatArray:
    """(P,) time [s] to the right of each point at constant acceleration, 2 h / (feed_i + feed_{i+1}), 0 at the
    end of a piece; `feed_sq` (P,) [mm2/s2]."""
    feed = np.sqrt(feed_sq)
    times = np.zeros(len(problem))
    inner = np.flatnonzero(problem.interval)
    with np.errstate(divide="ignore"):
        times[inner] = 2.0 * (problem.s[inner + 1] - problem.s[inner]) / (feed[inner] + feed[inner + 1])
    return times


def ratios_by_limit(problem: FeedrateProblem, solution: FeedrateSolution) -> Iterator[tuple[int, FloatArray]]:
    """For every constraint its index in `active_names` and how close the profile comes to it (1 = active): the
    ratio (P,) at each point or at either end of the interval to its right, computed from the profile alone. Of
    the bounds on feed^2 only the smallest at each point has a ratio there; jerk counts for jerk-limited solutions
    only."""
    x, u = solution.require().feed_sq, solution.acc_s
    for bound in range(len(problem.bound_names)):
        yield bound, np.where(problem.feed_sq_bound == bound, x / problem.feed_sq_limit, 0.0)
    inner = np.flatnonzero(problem.interval)
    jerk = solution.jerk_s[inner]
    # Without jerk no duration is needed: it is infinite where a second-order profile rests at both ends.
    gained = jerk * np.where(jerk == 0.0, 0.0, solution.duration[inner])
    ends = (
        (inner, u[inner], problem.d2_right, problem.d3_right),
        (inner + 1, u[inner] + gained, problem.d2_left, problem.d3_left),
    )
    first, axes = len(problem.bound_names), len(problem.axes)
    rows: list[tuple[RowLimit, FloatArray, FloatArray | float]] = [
        (ACCELERATION, problem.acceleration_limit, 1.0 - problem.margin[inner])
    ]
    if solution.jerk_limited:
        rows.append((JERK, problem.jerk_limit, 1.0))
    for k in range(axes):
        for limit, allowed, room in rows:
            worst = np.zeros(len(problem))
            for point, acc, d2, d3 in ends:
                at = RowPoint(problem.d1[point, k], d2[point, k], d3[point, k], x[point], acc, jerk)
                ratio = np.abs(limit.row(at)) / (allowed[point, k] * room)
                worst[inner] = np.maximum(worst[inner], ratio)
            yield first + ROWS.index(limit) * axes + k, worst


def active_names(problem: FeedrateProblem) -> tuple[str, ...]:
    """Names for the indices of `ratios_by_limit`."""
    return problem.bound_names + tuple(limit.called(axis) for limit in ROWS for axis in problem.axes)
