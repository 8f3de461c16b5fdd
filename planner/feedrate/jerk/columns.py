"""The rows of a third-order problem as the solver (layout.py) and its Lagrangian take them."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem


class ProblemColumns(NamedTuple):
    """A problem of P points and A axes, in its own units."""

    unit: float  # of accelerations
    s: FloatArray  # (P,)
    x_max: FloatArray  # (P,)
    d1: FloatArray  # (P, A), like the rest
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def with_rows(problem: FeedrateProblem) -> Array | slice:
    """(A,) which axes have rows, or all: not a limit of one's own that bounds the velocity alone."""
    if problem.own_least is None:
        return slice(None)
    bounded = np.isfinite(problem.own_least[1:]).any(axis=0)
    return np.append(np.ones(problem.machine_axes, dtype=bool), bounded)


def columns_of(problem: FeedrateProblem, of: Array | slice = slice(None)) -> ProblemColumns:
    """The columns of a problem for the kernel; `of` (A,): its axes."""
    return ProblemColumns(
        unit=float(problem.acceleration[: problem.machine_axes].max()),
        s=problem.s,
        x_max=problem.feed_sq_limit,
        d1=problem.d1[:, of],
        d2_left=problem.d2_left[:, of],
        d2_right=problem.d2_right[:, of],
        d3_left=problem.d3_left[:, of],
        d3_right=problem.d3_right[:, of],
        acceleration=acceleration_limits(problem)[:, of],
        jerk=problem.jerk_limit[:, of],
    )


def acceleration_limits(problem: FeedrateProblem) -> FloatArray:
    """(P, A) axis accelerations less the larger margin of the intervals beside each point [mm/s2]."""
    margin = problem.margin.copy()
    margin[problem.piece[1:] - 1] = 0.0
    before = np.concatenate([[0.0], margin[:-1]])
    return problem.acceleration_limit * (1.0 - np.maximum(margin, before))[:, None]
