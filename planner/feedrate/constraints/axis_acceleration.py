"""The limits of the axis accelerations, by differentiating r(s(t)) twice:

    | r'_k u + r''_k x | <= a_k                          rows, at both ends of every interval, each with the r'' of its side
    | r''_k(s+) - r''_k(s-) | x <= a_k                   a cap where r'' jumps, as where a line meets an arc

At a jump both rows of the point hold with the u of their intervals; the cap asks that the step in
acceleration itself be within the limit, too, so that setpoints across it show no more.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limit import Cap, RowLimit, RowPoint, by_axis, over
from planner.feedrate.constraints.on_grid import OnGrid

JUMP = "curvature_jump"  # the name of the cap, with the axis behind it


def feed_sq_at_jump(
    d2_left: FloatArray, d2_right: FloatArray, limits: FloatArray
) -> tuple[FloatArray, Array]:
    """(P,) |d2_right - d2_left| x <= limits for r'' (P, A) on both sides and every axis [mm2/s2]; also the
    index (P,) of the axis that limits."""
    ratio = np.abs(d2_right - d2_left) / limits
    axis = ratio.argmax(axis=1)
    return over(1.0, ratio[np.arange(len(ratio)), axis]), axis


class AxisAcceleration(RowLimit):
    """|r'_k u + r''_k x| <= a_k."""

    name, unit, order = "acceleration", "mm/s2", 2

    def at_jumps(self, grid: OnGrid) -> Iterator[Cap]:
        jump, axis = feed_sq_at_jump(*grid.jumps, self.of(grid.machine, grid.axes))
        yield from by_axis(JUMP, grid.axes, jump, axis)

    def row(self, at: RowPoint) -> FloatArray:
        return at.d1 * at.u + at.d2 * at.x

    @staticmethod
    def called_at_jump(axis: str) -> str:
        """The name of the cap with the axis: "curvature_jump.x"."""
        return f"{JUMP}.{axis}"
