"""The limit of the programmed feed, the F word or the machine's largest feed:  feed <= F,  so x <= F^2.

At a point between two blocks the smaller of both counts. With rotary axes F is the speed of the linear ones
(geometry/word_feed.py): on a curve that rounds a corner or a spline their part of the path is another one
than on the block, and F holds there too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limit import Cap, Limit
from planner.feedrate.constraints.on_grid import OnGrid
from planner.machine import LINEAR_AXES


def feed_sq_max(feed: FloatArray) -> FloatArray:
    """(P,) x <= F^2 [mm2/s2] for programmed feeds F = feed (P,) [mm/s], inf on rapids."""
    return feed**2


class ProgrammedFeed(Limit):
    """feed <= F."""

    name, unit, order = "feed", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        feed_sq = self.inside(grid)
        cap = np.minimum(feed_sq[grid.left], feed_sq[grid.right])
        if set(grid.axes) - set(LINEAR_AXES):
            for side in (grid.left, grid.right):
                cap = np.minimum(cap, feed_sq_max(grid.feed_of_words(side)))
        yield Cap(self.name, cap)

    def inside(self, grid: OnGrid) -> FloatArray:
        samples = grid.samples
        return feed_sq_max(samples.path.toolpath.feed[samples.segment])
