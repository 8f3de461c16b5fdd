"""The limits of speeds, caps of x = feed^2:

    feed <= F               programmed feed: the F word or the machine's largest feed
    |r'_k| feed <= v_k      axis velocities, so x <= min_k (v_k / r'_k)^2

At a point between two blocks the smaller F counts. With rotary axes F is the speed of the linear ones
(geometry/word_feed.py): on a curve that rounds a corner or a spline their part of the path is another one
than on the block, and F holds there too. Between the points r' turns; the share of the interval's `margin`
(samples.py) makes that good.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limit import AxisLimit, Cap, Limit, by_axis
from planner.feedrate.constraints.on_grid import OnGrid
from planner.machine import LINEAR_AXES


class ProgrammedFeed(Limit):
    """feed <= F."""

    name, unit, order = "feed", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        feed_sq = self.inside(grid)
        cap = np.minimum(feed_sq[grid.left], feed_sq[grid.right])
        if set(grid.axes) - set(LINEAR_AXES):
            for side in (grid.left, grid.right):
                cap = np.minimum(cap, grid.feed_of_words(side) ** 2)
        yield Cap(self.name, cap)

    def inside(self, grid: OnGrid) -> FloatArray:
        return grid.samples.path.toolpath.feed[grid.samples.segment] ** 2


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
