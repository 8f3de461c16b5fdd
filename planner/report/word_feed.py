"""The feed that F words mean, for everything that is shown or written.

Inside, the feed is ds/dt of the path in all axes, an angle counting as a length at a radius
(docs/language.md). F is that of x, y, z together, which is that of the tool's tip where the tool centre point
is on; where they stand, that of u, v, w; where these stand too, that of the rotary axes in degrees. That is
what a picture, a table and a trajectory file have as feed, beside F itself.

F words that let an ordinary control keep to a planned motion, and the time of each block in it.

A control holds F in the middle of a block and puts its own ramps at the ends. Of the planned feed it is told
an upper envelope: runs of blocks, each with the highest planned feed in it. Three things follow.

* Planned again, the program takes the planned time: the planned motion keeps all its F words, and nothing
  faster than it was there.
* A control that can follow the plan is not slower than it; one without a jerk limit may be faster.
* Blocks of a run share one F word. Controls join short blocks into one move only where F does not change
  between them (LinuxCNC's naive CAM detector), and give every move a servo period at least.

A run ends where the next block's highest feed is off by more than `SPREAD`, but not before `RUN_PERIODS`
interpolation periods. The feed changes by little in less, and moves between two F words should last longer
than a control's period.

The motion passes a joint between two samples, k the last before it. Along the programmed path the joint
divides the distance between the two samples; with g = the share of it that lies before the joint, v0 and v1
the feeds at both samples and the acceleration constant between them, it is passed at the share tau of the
period that solves

    g (v0 + v1) / 2  =  v0 tau + (v1 - v0) tau^2 / 2.

A joint is missed by less than a period, most where the motion stops there, and what one block gains its
neighbour loses. Blocks that have no sample of their own are timed by the same formula.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import RAD_PER_DEG
from planner.geometry.build import feed_groups, path_per_length
from planner.geometry.toolpath import Toolpath
from planner.geometry.word_feed import ROTARY, goes_by
from planner.machine import Machine
from planner.motion.trajectory import Trajectory, joined

if TYPE_CHECKING:
    from planner.nc.program import Program


class WordFeed:
    """The feed of F words on a toolpath."""

    def __init__(self, toolpath: Toolpath):
        self._toolpath = toolpath
        self._groups = feed_groups(toolpath.axes)
        # whether the programs' feed is another one than that along the path in all axes
        self.mixed = bool((self._groups > 0).any())
        self._goes_by = goes_by(toolpath) if self.mixed else np.zeros(0, dtype=np.int64)
        turns = bool((self._goes_by == ROTARY).any())
        self.units = "mm/s, deg/s where rotary axes move alone" if turns else "mm/s"  # of it

    def of(self, trajectory: Trajectory) -> FloatArray:
        """(T,) feed of samples, by what F goes by in their blocks."""
        if not self.mixed:
            return trajectory.feed
        goes_by = self._goes_by[self._toolpath.segment_at(trajectory.block)]
        squares = trajectory.velocity**2
        feed = np.zeros(len(goes_by))
        for group in range(ROTARY + 1):
            here = goes_by == group
            feed[here] = np.sqrt(squares[here][:, self._groups == group].sum(axis=1))
        feed[goes_by == ROTARY] /= RAD_PER_DEG * self._toolpath.radius
        return feed

    def programmed(self, program: Program, block: Array) -> FloatArray:
        """(n,) F of the blocks `block` (n,) of a program [mm/s or deg/s]; inf for rapids."""
        feed: FloatArray = program.feed[block].copy()
        if self.mixed:
            feed[self._goes_by[self._toolpath.segment_at(block)] == ROTARY] /= RAD_PER_DEG
        return feed

    def of_segments(self, feed: FloatArray) -> FloatArray:
        """(M,) `feed` (M,) of the segments, along the path in all axes [mm/s], as F words mean it."""
        toolpath = self._toolpath
        if not self.mixed:
            return feed
        found: FloatArray = feed / path_per_length(toolpath.axes, toolpath.radius, toolpath)
        found[self._goes_by == ROTARY] /= RAD_PER_DEG
        return found


# A highest feed within this share of the programmed one is the programmed one [-]: solvers stay a little away
# from their limits.
SAME = 1e-3
# F words are this much above the planned feed [-]: they are written rounded down to four digits.
ABOVE = 1e-3
# The highest feeds of a run's blocks differ by at most this [-], ...
SPREAD = 0.5
# ... unless it lasts less than so many interpolation periods.
RUN_PERIODS = 20


@dataclass(frozen=True, eq=False)
class PlannedBlocks:
    """The planned times and feeds of the M segments of a path: (M,) time [s], dwells not included, and (M,)
    highest feed [mm/s]."""

    duration: FloatArray
    highest: FloatArray


def feeds_of(planned: PlannedBlocks, toolpath: Toolpath, machine: Machine, blocks: int) -> FloatArray:
    """(blocks,) F words for the blocks of a program [mm/s], an upper envelope of the planned feed (module text);
    NaN for rapids and for blocks that move nowhere."""
    cut = np.flatnonzero(~toolpath.rapid)
    run = runs_of_feed(planned.highest[cut], planned.duration[cut], RUN_PERIODS * machine.dt)
    cap = np.zeros(len(cut))  # of each run
    np.maximum.at(cap, run, planned.highest[cut])
    cap = cap[run]
    programmed = toolpath.feed[cut]
    feeds = np.full(blocks, np.nan)
    feeds[toolpath.block[cut]] = np.where(cap >= programmed * (1.0 - SAME), programmed, cap * (1.0 + ABOVE))
    return feeds


def runs_of_feed(highest: FloatArray, duration: FloatArray, least: float) -> Array:
    """(n,) the run of each block, from 0 (module text).

    highest  : (n,) highest feed of each block [mm/s]
    duration : (n,) how long each takes [s]
    least    : shortest time of a run [s]
    """
    run = np.empty(len(highest), np.int64)
    count, lasted = 0, 0.0
    low = high = highest[0] if len(highest) else 0.0
    for k, (feed, time) in enumerate(zip(highest.tolist(), duration.tolist(), strict=True)):
        low, high = min(low, feed), max(high, feed)
        if high > (1.0 + SPREAD) * low and lasted >= least:
            count, lasted = count + 1, 0.0
            low = high = feed
        run[k] = count
        lasted += time
    return run


def planned_blocks(trajectory: Trajectory, toolpath: Toolpath) -> PlannedBlocks:
    """Times and highest feeds of the blocks of a path, see `BlockWatch`."""
    watch = BlockWatch(toolpath)
    for chunk in trajectory.chunks():
        watch.take(chunk)
    return watch.planned(trajectory)


class BlockWatch:
    """Times and highest feeds of the blocks of a path, from a trajectory that comes chunk by chunk.

    The highest feed of a block is that at its samples, half-way between them, as far as feeds and
    accelerations at both tell, and at its joints. Its mean at least; twice that where both joints are passed
    at less than half of it, as between two full stops without a sample: from rest to rest no jerk-limited
    motion is faster. The segments of a spline share its time by their lengths, and have its highest feed.
    """

    def __init__(self, toolpath: Toolpath):
        self._count = np.diff(np.append(toolpath.block_first, len(toolpath)))  # segments of each block
        self._share = toolpath.length / np.repeat(
            np.add.reduceat(toolpath.length, toolpath.block_first), self._count
        )
        self._toolpath = toolpath = toolpath.block_ends()
        self._joint, self._passed = np.zeros(len(toolpath) + 1), np.zeros(len(toolpath) + 1)  # when, how fast
        self._highest = np.zeros(len(toolpath))
        self._along = np.concatenate([[0.0], np.cumsum(toolpath.length)])
        self._last: Trajectory | None = None

    def take(self, chunk: Trajectory) -> None:
        """The next samples."""
        part = chunk if self._last is None else joined([self._last, chunk])
        segment = np.searchsorted(self._toolpath.block, part.block)
        joints = np.arange(segment[0] + 1, segment[-1] + 1)
        self._joint[joints], self._passed[joints] = _passed(
            part, segment, joints, self._toolpath, self._along
        )
        _look_between(part, segment, self._highest, self._last is None)
        self._last = part.rows(np.array([len(part) - 1]))

    def planned(self, trajectory: Trajectory) -> PlannedBlocks:
        """The result, all samples of the trajectory taken."""
        toolpath, joint, passed, last = self._toolpath, self._joint, self._passed, self._last
        assert last is not None
        joint[-1], passed[-1] = last.t[-1], last.feed[-1]
        joint[0] = last.t[-1] - trajectory.cycle_time + toolpath.dwell[0]
        at = np.clip(trajectory.first_not_before(joint[:1])[0], 1, len(trajectory) - 1)
        beside = trajectory.rows(np.array([at - 1, at]))
        passed[0] = np.interp(joint[0], beside.t, beside.feed)
        duration = np.maximum(np.diff(joint) - toolpath.dwell[1:], 0.0)
        highest = np.maximum(self._highest, np.maximum(passed[:-1], passed[1:]))
        mean = np.divide(toolpath.length, duration, out=np.zeros(len(toolpath)), where=duration > 0)
        highest = np.maximum(highest, np.where(highest < 0.5 * mean, 2.0, 1.0) * mean)
        return PlannedBlocks(self._share * np.repeat(duration, self._count), np.repeat(highest, self._count))


def _look_between(part: Trajectory, segment: Array, highest: FloatArray, first: bool) -> None:
    """Take in the feeds of samples at segments (n,) and half-way between them; the first one is new if it is
    the `first` of all."""
    feed, push = part.feed, (part.velocity * part.acceleration).sum(axis=1)
    push = np.divide(push, feed, out=np.zeros_like(feed), where=feed > 0)
    np.maximum.at(highest, segment[not first :], feed[not first :])
    half_way = (feed[1:] + feed[:-1]) / 2 + np.diff(part.t) / 8 * (push[:-1] - push[1:])
    np.maximum.at(highest, segment[1:], half_way)
    np.maximum.at(highest, segment[:-1], half_way)


def _passed(
    part: Trajectory, segment: Array, joint: Array, toolpath: Toolpath, along: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """When the motion leaves each of n joints, dwell over (n,) [s], and how fast (n,) [mm/s].

    segment : (T,) of the samples; all of the joints lie between two of them
    along   : (M+1,) where the joints are along the path [mm]
    """
    t, feed = part.t, part.feed
    k = np.searchsorted(segment, joint) - 1  # the last sample before the joint
    here, there = segment[k], segment[k + 1]
    # Coordinates of the samples along the programmed path: reckoned back from the end of their segment, and
    # on from its start.
    before = along[here + 1] - np.linalg.norm(part.position[k] - toolpath.end[here], axis=1)
    after = along[there] + np.linalg.norm(part.position[k + 1] - toolpath.start[there], axis=1)
    distance = after - before
    share = np.divide(along[joint] - before, distance, out=np.zeros(len(joint)), where=distance > 0).clip(
        0.0, 1.0
    )
    v0, v1 = feed[k], feed[k + 1]
    root = v0 + np.sqrt(v0**2 + share * (v1**2 - v0**2))
    tau = np.divide(share * (v0 + v1), root, out=share.copy(), where=root > 0)
    when = t[k] + tau * (t[k + 1] - t[k])
    return when, np.interp(when, t, feed)
