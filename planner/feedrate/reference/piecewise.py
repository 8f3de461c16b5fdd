"""What the reference solvers share: the jerk-limited problem falls into pieces between prescribed speeds, solved one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import Status

# Fewer intervals cannot go from rest to rest: the jerk must be positive, negative and positive again.
INTERVALS_MIN = 3


@dataclass(frozen=True, eq=False, kw_only=True)
class Found:
    """Columns (n, C) over the n points of a piece, or of all pieces; None on failure. `iterations`: the most of any piece."""

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


def solve_pieces(problem: FeedrateProblem, solve_piece: Callable[[int], Found]) -> Found:
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
    assert whole is not None, "a problem has a piece"
    return replace(whole, iterations=iterations, columns=np.concatenate(columns))
