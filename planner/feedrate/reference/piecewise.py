"""Common to the reference solvers: the problem falls into pieces between prescribed speeds, and what they find
in another transcription becomes a motion of constant jerk on every interval, within all limits: the nearest one
with exact kinematics, by least squares over time (`ScaledWindow.near`), every piece slowed down until all limits
hold at its grid points. The multipliers stay those of the other profile.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.layout import Room, columns_of
from planner.feedrate.jerk.window import ScaledWindow
from planner.feedrate.solution import FeedrateSolution, Multipliers, Status, ratios_by_limit

# Fewer intervals cannot go from rest to rest: the jerk must be positive, negative and positive again.
INTERVALS_MIN = 3


@dataclass(frozen=True, eq=False, kw_only=True)
class Found:
    """The n points of a piece, or of all pieces; `iterations`: the most of any piece.

    columns : (n, 7 + 4 A) feed_sq, acc_s, jerk_s and duration, then the multipliers: feed (2), dynamics (1)
              and rows (A x 4) of `Multipliers`; None on failure
    """

    status: Status
    sentence: str
    iterations: int
    columns: FloatArray | None = None


def too_few(intervals: int) -> Found:
    """The failure of a piece from rest to rest with less than `INTERVALS_MIN` intervals."""
    return Found(
        status=Status.INFEASIBLE,
        sentence=f"from rest to rest takes {INTERVALS_MIN} intervals, there are {intervals}; refine the grid",
        iterations=0,
    )


def too_large(problem: FeedrateProblem, most: int, name: str, solver: str) -> FeedrateSolution:
    """The failure of a problem that the solver of that name is not tried on."""
    sentence = (
        f"{len(problem):,} grid points are too many for solver {name}, which takes milliseconds for each and is tried on {most:,} "
        "at most; use solver own, or a shorter program"
    )
    return FeedrateSolution.failed(problem, Status.TOO_LARGE, sentence, solver, 0.0)


def solve_pieces(
    problem: FeedrateProblem,
    solve_piece: Callable[[int], Found],
    progress: Callable[[float], None] | None = None,
) -> Found:
    """All pieces by their numbers; the first failure, and else the worse status, stands for the whole."""
    columns = []
    whole: Found | None = None
    iterations = 0
    for g in range(len(problem.piece) - 1):
        found = solve_piece(g)
        iterations = max(iterations, found.iterations)
        if found.columns is None:
            where = f"piece {g} (from s = {problem.s[problem.piece[g]]:.6g} mm): {found.sentence}"
            return replace(found, sentence=where, iterations=iterations)
        if whole is None or found.status is Status.ACCEPTABLE:
            whole = found
        columns.append(found.columns)
        if progress is not None:
            progress(float(problem.piece[g + 1] / len(problem)))
    assert whole is not None, "a problem has a piece"
    return replace(whole, iterations=iterations, columns=np.concatenate(columns))


def solution_of(problem: FeedrateProblem, found: Found, solver: str, began: float) -> FeedrateSolution:
    """The values found, as a solution."""
    took = time.perf_counter() - began
    if found.columns is None:
        return FeedrateSolution.failed(problem, found.status, found.sentence, solver, took, found.iterations)
    feed_sq, acc, jerk, duration, at_point, between, dynamics = found.columns[:, :7].T
    return FeedrateSolution(
        status=found.status,
        sentence=found.sentence,
        solver=solver,
        feed_sq=feed_sq,
        acc_s=acc,
        jerk_s=jerk,
        duration=duration,
        solve_time=took,
        iterations=found.iterations,
        jerk_limited=True,
        multipliers=Multipliers(
            rows=found.columns[:, 7:].reshape(len(problem), -1, 4),
            feed=np.column_stack([at_point, between]),
            dynamics=dynamics,
        ),
    )


def polished(problem: FeedrateProblem, solution: FeedrateSolution) -> FeedrateSolution:
    """A profile whose kinematics hold to a solver's tolerance, made exact, and slower by what limits it then
    exceeds; as it is where there is no such profile near.

    ipopt leaves 2e-7 mm/s between the speeds at a point. On the intervals of a um beside a jump of a limit of
    one's own, differences of the positions then show 8 % more jerk than there is; this costs 1e-8 of the
    time.
    """
    exact = with_exact_kinematics(problem, solution)
    return solution if exact is None else slowed_to_limits(problem, exact)


def with_exact_kinematics(problem: FeedrateProblem, solution: FeedrateSolution) -> FeedrateSolution | None:
    """The profile nearest to a solution whose jerk is constant on every interval; None if there is none."""
    limits, room = columns_of(problem), Room()
    columns: list[FloatArray] = []
    for first, beyond in zip(problem.piece[:-1], problem.piece[1:], strict=True):
        own = slice(first, beyond)
        near = ScaledWindow.of(limits, int(first), int(beyond) - 1, room).near(
            solution.feed_sq[own], solution.acc_s[own]
        )
        if near is None:
            return None
        columns.append(
            np.column_stack([near.x, near.u, np.append(near.jerk, 0.0), np.append(near.duration, 0.0)])
        )
    feed_sq, acc, jerk, duration = np.concatenate(columns).T
    return replace(solution, feed_sq=feed_sq, acc_s=acc, jerk_s=jerk, duration=duration)


def slowed_to_limits(problem: FeedrateProblem, solution: FeedrateSolution) -> FeedrateSolution:
    """Every piece slower by the smallest factor with which all limits hold at its grid points."""
    factor = np.ones(len(problem))
    bounds = len(problem.bound_names)
    for limit, ratio in ratios_by_limit(problem, solution):
        jerk = limit >= bounds + len(problem.axes)
        factor = np.maximum(factor, np.cbrt(ratio) if jerk else np.sqrt(ratio))
    by = np.repeat(np.maximum.reduceat(factor, problem.piece[:-1]), np.diff(problem.piece))
    return replace(
        solution,
        feed_sq=solution.feed_sq / by**2,
        acc_s=solution.acc_s / by**2,
        jerk_s=solution.jerk_s / by**3,
        duration=solution.duration * by,
    )
