"""From another transcription's profile to one of constant jerk on every interval, within all limits.

1. The nearest profile with constant jerk on every interval and exact kinematics, by least squares over time
(`ScaledWindow.near`). 2. Every piece is slowed down until all limits hold at its grid points. Slower by lam
is a speed over lam, an acceleration over lam^2 and a jerk over lam^3, so the largest ratio to a limit says by
how much. The multipliers stay those of the other profile.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.columns import columns_of
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.window import ScaledWindow
from planner.feedrate.solution import FeedrateSolution, ratios_by_limit


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
