"""The profile of a whole problem while it is being solved, with its multipliers."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.jerk.window import Window


@dataclass(frozen=True, eq=False, kw_only=True)
class Profile:
    """P points: x, u, jerk, duration (P,); rows (P, A, 4), feed (P, 2), dynamics (P,) as in `Multipliers`."""

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
