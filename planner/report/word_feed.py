"""The feed that F words mean, for everything that is shown or written.

Inside, the feed is ds/dt of the path in all axes, an angle counting as a length at a radius (docs/language.md). F is that of x, y, z
together, which is that of the tool's tip where the tool centre point is on; where they stand, that of u, v, w; where these stand too,
that of the rotary axes in degrees. That is what a picture, a table and a trajectory file have as feed, beside F itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import RAD_PER_DEG
from planner.geometry.build import feed_groups, path_per_length
from planner.geometry.word_feed import ROTARY, goes_by

if TYPE_CHECKING:
    from planner.geometry.toolpath import Toolpath
    from planner.motion.trajectory import Trajectory
    from planner.nc.program import Program


class WordFeed:
    """The feed of F words on a toolpath.

    mixed : whether the programs' feed is another one than that along the path in all axes
    units : of it
    """

    def __init__(self, toolpath: Toolpath):
        self._toolpath = toolpath
        self._groups = feed_groups(toolpath.axes)
        self.mixed = bool((self._groups > 0).any())
        self._goes_by = goes_by(toolpath) if self.mixed else np.zeros(0, dtype=np.int64)
        turns = bool((self._goes_by == ROTARY).any())
        self.units = "mm/s, deg/s where rotary axes move alone" if turns else "mm/s"

    def of(self, trajectory: Trajectory) -> FloatArray:
        """(T,) feed of samples, by what F goes by in their blocks."""
        if not self.mixed:
            return trajectory.feed
        goes_by = self._goes_by[self._segment(trajectory.block)]
        squares = trajectory.velocity**2
        feed = np.zeros(len(goes_by))
        for group in range(ROTARY + 1):
            here = goes_by == group
            feed[here] = np.sqrt(squares[here][:, self._groups == group].sum(axis=1))
        feed[goes_by == ROTARY] *= self._degrees
        return feed

    def programmed(self, program: Program, block: Array) -> FloatArray:
        """(n,) F of the blocks `block` (n,) of a program [mm/s or deg/s]; inf for rapids."""
        feed: FloatArray = program.feed[block].copy()
        if self.mixed:
            feed[self._goes_by[self._segment(block)] == ROTARY] /= RAD_PER_DEG
        return feed

    def of_segments(self, feed: FloatArray) -> FloatArray:
        """(M,) `feed` (M,) of the segments, along the path in all axes [mm/s], as F words mean it."""
        toolpath = self._toolpath
        if not self.mixed:
            return feed
        found: FloatArray = feed / path_per_length(toolpath.axes, toolpath.radius, toolpath)
        found[self._goes_by == ROTARY] /= RAD_PER_DEG
        return found

    @property
    def _degrees(self) -> float:
        return 1.0 / (RAD_PER_DEG * self._toolpath.radius)

    def _segment(self, block: Array) -> Array:
        """The segment of each block; of blocks that are unknown or move nowhere one beside them."""
        last = np.searchsorted(self._toolpath.block, block, side="right") - 1
        found: Array = np.clip(last, 0, len(self._toolpath) - 1)
        return found
