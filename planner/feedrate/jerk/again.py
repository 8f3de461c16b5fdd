"""A problem whose limits became tighter in places is solved again around these places only; elsewhere the
known profile stays.

What a limit changes dies out within about a way to brake. So around every changed point a range of `REACH`
such ways to both sides, or more, is solved again, from the state that the known profile has at the range's
first point to the one that it has at its last point: a task of chain.py between two states. Ranges that
overlap are one.

An optimal profile is nearly always at some limit, and most of its states are at the edge of what can be
continued: while it brakes into a bend, or takes its acceleration back below the largest feed, with all its
jerk. A problem that begins there has no room, and no solution is found. So ranges end at rest, where the feed
is held without acceleration, and at dips of the feed, where feed^2 is below `DEEP` of that of the peaks on
both sides.

From such a state the range's solution is looked for beside the known profile slowed down to rest, x W over
the way s with

    W = (1 - q^2)^2,    q = s / way,    u = (x W)'/2 = u W - 2 q (1 - q^2) x / way,

which has the state at q = 0. A range that gets no solution is tried once more with `WIDER` ways to brake on
both sides. If that has none either, it keeps its profile, and its limits what they were.

Multipliers stay those of the solution before: between two states that are fixed they would price these
instead of the limits.
"""

from dataclasses import fields
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.chain import Chain, Task, reach_of_end, way_felt
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.window import Way
from planner.feedrate.solution import FeedrateSolution

MULTIPLIERS = ("rows", "feed", "dynamics")  # columns of a profile
REACH = 0.5  # to each side of a changed point [ways to brake]
# The same where that has no solution: 16 of 507 ranges of 20,000 blocks of stellabee1, all of which have one
# then.
WIDER = 3.0
DEEP = 0.9  # feed^2 at a dip, over that of the peaks beside it, at most [-]
EDGE = 8  # points at least on each side of a changed one: on coarse grids few points lie on a way to brake


class Range(NamedTuple):
    """The points first..last, inside one piece."""

    first: int
    last: int


def ranges_of(
    problem: FeedrateProblem, known: FeedrateSolution, changed: Array, reach: float = REACH
) -> list[Range]:
    """The ranges to solve again, ascending, for points (P,) that changed (module text); `known` has
    multipliers.

    reach : to each side of them at least [ways to brake]
    """
    at = np.flatnonzero(changed)
    if not len(at):
        return []
    assert known.multipliers is not None
    s, piece = problem.s, problem.piece
    way = way_felt(known.feed_sq, float(problem.acceleration_limit.min()), float(problem.jerk_limit.min()))
    of = np.searchsorted(piece, at, side="right") - 1
    begin, end = piece[of], piece[of + 1] - 1
    first = np.minimum(np.searchsorted(s, s[at] - reach * way[at]), at - EDGE)
    last = np.maximum(np.searchsorted(s, s[at] + reach * way[at], side="right"), at + EDGE)
    first, last = np.maximum(first, begin), np.minimum(last, end)
    ends = _open_points(problem, known)
    first = ends[np.searchsorted(ends, first, side="right") - 1]
    last = ends[np.searchsorted(ends, last)]
    return _merged(np.maximum(first, begin), np.minimum(last, end))


def _open_points(problem: FeedrateProblem, known: FeedrateSolution) -> Array:
    """(n,) points where ranges may end (module text), ascending: the first and the last of each piece, dips
    and held feeds."""
    x, u, jerk = known.feed_sq, known.acc_s, known.jerk_s
    dip = np.flatnonzero((x[1:-1] <= x[:-2]) & (x[1:-1] < x[2:])) + 1
    peak = np.maximum.reduceat(x, np.append(0, dip))
    dip = dip[x[dip] < DEEP * np.minimum(peak[:-1], peak[1:])]
    held = np.flatnonzero((u[1:] == 0.0) & (jerk[1:] == 0.0) & (jerk[:-1] == 0.0)) + 1
    return np.unique(np.concatenate([problem.piece[:-1], problem.piece[1:] - 1, dip, held]))


def _merged(first: Array, last: Array) -> list[Range]:
    """The union of the ranges first..last (n,), ascending; those that meet in a point stay apart."""
    order = np.argsort(first, kind="stable")
    first, last = first[order], last[order]
    reach = np.maximum.accumulate(last)  # pieces follow each other, so no range reaches into the next one
    begins = np.flatnonzero(np.append(True, first[1:] >= reach[:-1]))
    ends = np.append(begins[1:], len(first)) - 1
    return [Range(*own) for own in zip(first[begins].tolist(), reach[ends].tolist(), strict=True)]


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
        names = [column.name for column in fields(self.profile)]
        ends = {
            name: self.last + int(name in ("x", "u")) for name in names
        }  # the interval behind is not its own
        before = {name: getattr(self.profile, name)[self.first : ends[name]].copy() for name in names}
        self.chain.run(room, self.last)
        self.solved = not self.chain.failed and not self.chain.stops
        for name, old in before.items():
            values = getattr(self.profile, name)[self.first : ends[name]]
            if not self.solved or name in MULTIPLIERS:
                values[:] = old
            elif name in ("x", "u"):
                values[0], values[-1] = old[0], old[-1]  # but for rounding they are


def _slowed_to_rest(s: FloatArray, x: FloatArray, u: FloatArray, a: float, j: float) -> Way | None:
    """A way to rest (module text) from the first of some states x, u at the distances s (n,), as far as these
    points go; None from rest. The profile must not rest before that."""
    if x[0] == 0.0:
        return None
    reach = reach_of_end(float(x[0]), a, j)
    count = max(int(np.searchsorted(s, reach)), 1)
    q = s[:count] / reach
    slower = 1.0 - q * q
    return Way(x[:count] * slower**2, u[:count] * slower**2 - 2.0 * q * slower * x[:count] / reach)
