"""The limits of the axis velocities:  |r'_k| feed <= v_k,  so x <= min_k (v_k / r'_k)^2.

Between the points r' turns; the share of the interval's `margin` (samples.py) makes that good.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limit import AxisLimit, Cap, by_axis
from planner.feedrate.constraints.on_grid import OnGrid


def feed_sq_max(d1: FloatArray, limits: FloatArray) -> tuple[FloatArray, Array]:
    """(P,) x <= min_k (v_k/|r'_k|)^2 [mm2/s2] for d1 (P, A), `limits` (A,); and the axis (P,)."""
    ratio = np.abs(d1) / limits
    axis = ratio.argmax(axis=1)
    return 1.0 / ratio[np.arange(len(d1)), axis] ** 2, axis


class AxisVelocity(AxisLimit):
    """|r'_k| feed <= v_k."""

    name, unit, order = "velocity", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        bound, axis = feed_sq_max(grid.samples.d1, self.of(grid.machine, grid.axes))
        margin = grid.samples.margin
        bound = bound * (1.0 - np.maximum(margin[grid.left], margin[grid.right]))
        yield from by_axis(self.name, grid.axes, bound, axis)

    def inside(self, grid: OnGrid) -> FloatArray:
        return feed_sq_max(grid.samples.d1, self.of(grid.machine, grid.axes))[0]
