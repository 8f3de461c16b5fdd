"""The profile of a whole problem while it is being solved, with its multipliers."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.feedrate.jerk.layout import Columns
from planner.feedrate.jerk.window import Window


@dataclass(frozen=True, eq=False, kw_only=True)
class Profile:
    """P points: x, u, jerk, duration (P,), and rows (P, A, 4), feed (P, 2), dynamics (P,) as in `Multipliers`."""

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

    def put(self, begin: int, found: Window, count: int) -> None:
        """Take over the first intervals of a window that begins at a point, and the state at their end."""
        for name in (field.name for field in fields(self)):
            beyond = count + 1 if name in ("x", "u") else count
            getattr(self, name)[begin : begin + beyond] = getattr(found, name)[:beyond]

    def put_backward(self, last: int, found: Profile, count: int) -> None:
        """Take over the first intervals of a profile of the way backward from point `last`, and the state at their end.

        Passed backward, accelerations change sign and so does r'; the rows of the acceleration keep theirs, those of the jerk change
        it, and so do the dynamics. What was at the start of an interval is at its end.
        """
        points, own = slice(last - count, last + 1), slice(count, None, -1)
        self.x[points], self.u[points] = found.x[own], -found.u[own]
        intervals, own = slice(last - count, last), slice(count - 1, None, -1)
        self.jerk[intervals], self.duration[intervals] = found.jerk[own], found.duration[own]
        self.dynamics[intervals] = -found.dynamics[own]
        self.rows[intervals] = found.rows[own][:, :, ::-1] * np.array([1.0, -1.0, -1.0, 1.0])
        self.feed[intervals, 1] = found.feed[own, 1]
        self.feed[intervals, 0] = found.feed[count:0:-1, 0]  # of the point where the interval starts


def backward(columns: Columns, first: int, last: int) -> Columns:
    """The points first..last as they are passed backward."""
    own = slice(first, last + 1)

    def turned(values: FloatArray, sign: float = 1.0) -> FloatArray:
        return np.ascontiguousarray(sign * values[own][::-1])

    return Columns(
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


@njit(cache=True, error_model="numpy", nogil=True)
def slower_by(columns, profile, first, last):
    """By what factor the points first..last have to be slower to keep every limit at the grid points; 1 if they do.

    profile : x, u, jerk (P,)
    """
    x, u, jerk = profile
    axes = columns.d1.shape[1]
    feed, acceleration, third = 1.0, 1.0, 1.0
    for i in range(first, last + 1):
        feed = max(feed, x[i] / columns.x_max[i])
        v = np.sqrt(x[i])
        for k in range(axes):
            d1, per_a, per_j = columns.d1[i, k], 1.0 / columns.acceleration[i, k], 1.0 / columns.jerk[i, k]
            if i > first:
                d2, d3 = columns.d2_left[i, k], columns.d3_left[i, k]
                acceleration = max(acceleration, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i - 1] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
            if i < last:
                d2, d3 = columns.d2_right[i, k], columns.d3_right[i, k]
                acceleration = max(acceleration, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
    return max(np.sqrt(max(feed, acceleration)), np.cbrt(third))
