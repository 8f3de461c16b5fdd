"""The profile of a whole problem while it is being solved, with its multipliers."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.window import Window
from planner.feedrate.solution import FeedrateSolution


@dataclass(frozen=True, eq=False, kw_only=True)
class Profile:
    """P points: x, u, jerk, duration (P,), and rows (P, A, 4), feed (P, 2), dynamics (P,) as in
    `Multipliers`."""

    x: FloatArray
    u: FloatArray
    jerk: FloatArray
    duration: FloatArray
    rows: FloatArray
    feed: FloatArray
    dynamics: FloatArray

    @classmethod
    def at_rest(cls, points: int, axes: int) -> Profile:
        """All zero."""
        x, u, jerk, duration, dynamics = np.zeros((5, points))
        rows, feed = np.zeros((points, axes, 4)), np.zeros((points, 2))
        return cls(x=x, u=u, jerk=jerk, duration=duration, rows=rows, feed=feed, dynamics=dynamics)

    @classmethod
    def of_solution(cls, solution: FeedrateSolution) -> Profile:
        """A copy of a solution that has multipliers."""
        found = solution.multipliers
        assert found is not None
        return cls(
            x=solution.feed_sq.copy(),
            u=solution.acc_s.copy(),
            jerk=solution.jerk_s.copy(),
            duration=solution.duration.copy(),
            rows=found.rows.copy(),
            feed=found.feed.copy(),
            dynamics=found.dynamics.copy(),
        )

    def forget(self, first: int, beyond: int) -> None:
        """Make the points first..beyond-1 zero, as `at_rest`."""
        for name in (field.name for field in fields(self)):
            getattr(self, name)[first:beyond] = 0.0

    def put(self, begin: int, found: Window, count: int) -> None:
        """Take over the first intervals of a window that begins at a point, and the state at their end."""
        for name in (field.name for field in fields(self)):
            beyond = count + 1 if name in ("x", "u") else count
            getattr(self, name)[begin : begin + beyond] = getattr(found, name)[:beyond]

    def put_backward(self, last: int, found: Profile, count: int) -> None:
        """Take over the first intervals of a profile of the way backward from point `last`, and the state at
        their end.

        Passed backward, accelerations change sign and so does r'; the rows of the acceleration keep theirs,
        those of the jerk change it, and so do the dynamics. What was at the start of an interval is at its
        end.
        """
        points, own = slice(last - count, last + 1), slice(count, None, -1)
        self.x[points], self.u[points] = found.x[own], -found.u[own]
        intervals, own = slice(last - count, last), slice(count - 1, None, -1)
        self.jerk[intervals], self.duration[intervals] = found.jerk[own], found.duration[own]
        self.dynamics[intervals] = -found.dynamics[own]
        self.rows[intervals] = found.rows[own][:, :, ::-1] * np.array([1.0, -1.0, -1.0, 1.0])
        self.feed[intervals, 1] = found.feed[own, 1]
        self.feed[intervals, 0] = found.feed[count:0:-1, 0]  # of the point where the interval starts


def backward(columns: ProblemColumns, first: int, last: int) -> ProblemColumns:
    """The points first..last as they are passed backward."""
    own = slice(first, last + 1)

    def turned(values: FloatArray, sign: float = 1.0) -> FloatArray:
        return np.ascontiguousarray(sign * values[own][::-1])

    return ProblemColumns(
        unit=columns.unit,
        s=columns.s[last] - turned(columns.s),
        x_max=turned(columns.x_max),
        d1=turned(columns.d1, -1.0),
        d2_left=turned(columns.d2_right),
        d2_right=turned(columns.d2_left),
        d3_left=turned(columns.d3_right, -1.0),
        d3_right=turned(columns.d3_left, -1.0),
        acceleration=turned(columns.acceleration),
        jerk=turned(columns.jerk),
    )
