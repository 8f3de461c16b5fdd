"""The limit of the programmed feed, the F word or the machine's largest feed:  feed <= F,  so x <= F^2.

At a point between two blocks the smaller of both counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.limit import Cap, Limit

if TYPE_CHECKING:
    from planner.constraints.on_grid import OnGrid


def feed_sq_max(feed: FloatArray) -> FloatArray:
    """(P,) x <= F^2 [mm2/s2] for programmed feeds F = feed (P,) [mm/s], inf on rapids."""
    return feed**2


class ProgrammedFeed(Limit):
    """feed <= F."""

    name, unit, order = "feed", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        feed_sq = self.inside(grid)
        yield Cap(self.name, np.minimum(feed_sq[grid.left], feed_sq[grid.right]))

    def inside(self, grid: OnGrid) -> FloatArray:
        samples = grid.samples
        return feed_sq_max(samples.path.toolpath.feed[samples.segment])
