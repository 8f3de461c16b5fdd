"""A problem whose limits became tighter in places is solved again around these places only; elsewhere the known profile stays.

What a limit changes dies out within about a way to brake. So around every changed point a range of `REACH` such ways to both sides is
solved again, from the state that the known profile has at the range's first point to the one that it has at its last point: a task of
chain.py between two states. Ranges that meet are one. Both ends are moved out by up to as much again, to the points where more speed
would help most, seen from within the range: there a problem that begins in that state has most room (chain.py).

From such a state the range's solution is looked for beside the known profile slowed down to rest, x W over the way s with

    W = (1 - q^2)^2,    q = s / way,    u = (x W)'/2 = u W - 2 q (1 - q^2) x / way,

which has the state at q = 0. A range that gets no solution keeps its profile, and its limits what they were.
"""

from __future__ import annotations

from dataclasses import fields
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.chain import INTERVALS_MIN, Chain, Task, reach_of_end, way_felt
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.window import Way
from planner.feedrate.solution import FeedrateSolution

# To each side of a changed point, and by which ends may be moved out [ways to brake].
REACH, MOVED = 1.0, 0.5
EDGE = 8  # points at least on each side of a changed one: on coarse grids few points lie on a way to brake


class Range(NamedTuple):
    """The points first..last, inside one piece."""

    first: int
    last: int


def ranges_of(problem: FeedrateProblem, known: FeedrateSolution, changed: Array) -> list[Range]:
    """The ranges to solve again, ascending, for points (P,) that changed (module text); `known` has multipliers."""
    at = np.flatnonzero(changed)
    if not len(at):
        return []
    assert known.multipliers is not None
    s, piece, last_point = problem.s, problem.piece, len(problem) - 1
    way = way_felt(known.feed_sq, float(problem.acceleration_limit.min()), float(problem.jerk_limit.min()))
    of = np.searchsorted(piece, at, side="right") - 1
    begin, end = piece[of], piece[of + 1] - 1
    first = np.clip(np.minimum(np.searchsorted(s, s[at] - REACH * way[at]), at - EDGE), begin, end)
    last = np.clip(
        np.maximum(np.searchsorted(s, s[at] + REACH * way[at], side="right"), at + EDGE), begin, end
    )
    wanted = known.multipliers.dynamics * known.feed_sq  # the less, the more would more speed help behind it
    found: list[Range] = []
    for g, lo, hi in _merged(of, first, last):
        begin, end = int(piece[g]), int(piece[g + 1]) - 1
        outer = max(int(np.searchsorted(s, s[lo] - MOVED * way[lo])), begin)
        lo = begin if outer <= begin + INTERVALS_MIN else outer + int(np.argmin(wanted[outer : lo + 1]))
        outer = min(int(np.searchsorted(s, s[hi] + MOVED * way[hi], side="right")), end, last_point)
        hi = end if outer >= end - INTERVALS_MIN else hi + int(np.argmax(wanted[hi : outer + 1]))
        if found and begin <= found[-1].first and lo <= found[-1].last + INTERVALS_MIN:
            found[-1] = Range(found[-1].first, max(hi, found[-1].last))
        else:
            found.append(Range(lo, hi))
    return found


def _merged(of: Array, first: Array, last: Array) -> list[tuple[int, int, int]]:
    """Pieces and ends of what the ranges first..last (n,) of the pieces `of` (n,) cover together, ascending."""
    order = np.lexsort((first, of))
    of, first, last = of[order], first[order], last[order]
    reach = np.maximum.accumulate(last)  # pieces follow each other, so no range reaches into the next one
    begins = np.flatnonzero(np.append(True, first[1:] > reach[:-1]))
    ends = np.append(begins[1:], len(of)) - 1
    return list(zip(of[begins].tolist(), first[begins].tolist(), reach[ends].tolist(), strict=True))


class RangeAgain:
    """A range of a profile, solved again in place.

    solved : whether it was; if not, the profile is as before
    """

    def __init__(self, task: Task):
        """The points first..last of the task's profile, from the state at the one to that at the other."""
        self.first, self.last, self.profile = task.first, task.last, task.profile
        self.solved = False
        own = slice(task.first, task.last + 1)
        a, j = task.columns.acceleration[own].min(), task.columns.jerk[own].min()
        s, x, u = task.columns.s[own], task.profile.x[own], task.profile.u[own]
        self.chain = Chain(
            task,
            ahead=_slowed_to_rest(s - s[0], x, u, a, j),
            back=_slowed_to_rest(s[-1] - s[::-1], x[::-1], -u[::-1], a, j),
        )

    def __call__(self, room: Room) -> None:
        """Solve it."""
        own = slice(self.first, self.last + 1)
        columns = [getattr(self.profile, column.name) for column in fields(self.profile)]
        before = [values[own].copy() for values in columns]
        self.chain.run(room, self.last)
        self.solved = not self.chain.failed and not self.chain.stops
        for values, old in zip(columns, before, strict=True):
            if not self.solved:
                values[own] = old
        for values, old in zip((self.profile.x, self.profile.u), before, strict=False):
            values[self.first], values[self.last] = old[0], old[-1]  # but for rounding they are


def _slowed_to_rest(s: FloatArray, x: FloatArray, u: FloatArray, a: float, j: float) -> Way | None:
    """A way to rest (module text) from the first of some states x, u at the distances s (n,), as far as these points go; None from
    rest. The profile must not rest before that."""
    if x[0] == 0.0:
        return None
    reach = reach_of_end(float(x[0]), a, j)
    count = max(int(np.searchsorted(s, reach)), 1)
    q = s[:count] / reach
    slower = 1.0 - q * q
    return Way(x[:count] * slower**2, u[:count] * slower**2 - 2.0 * q * slower * x[:count] / reach)
