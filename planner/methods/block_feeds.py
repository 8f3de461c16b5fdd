"""The feed of each block of a program in a planned motion: what an F word per block can say of it.

An ordinary control holds F in the middle of a block and puts its own ramps at the ends of it. What that asks of F depends on whether
it has room for them. With v the highest planned feed in the block, and a what the axes' accelerations leave along it, a block is

* long, if the way from rest to v and to rest again fits in:  v^2/a <= length. Its F is v: the ramps are the control's.
* dense, otherwise. Its F is the mean, its programmed length over its planned time: the feed changes from block to block, and the
  F words are what keeps the control near the plan. Over dense blocks

      sum of length / feed  =  their planned time

  exactly, but for blocks whose quotient is above the programmed feed (the motion cuts corners, its path is shorter).

Run by LinuxCNC 2.9 (axes at 100 mm/s and 2000 mm/s2, no jerk limit of its own, G64 P0.05 Q0) at the feeds of jerk-limited plans
(2e5 mm/s3), the programs took so much longer than planned:

    feeds                        pentagon   zig-zag   circle of chords   spiral of chords   relief
    means                        19.4 %     18.1 %    0.7 %              -0.3 %              2.7 %
    highest                       5.1 %      6.1 %    0.4 %              -3.2 %             -8.3 %
    highest if long, else mean    5.1 %      6.1 %    0.7 %              -0.9 %             -1.4 %

What remains on the long blocks is how that control rounds corners. Beside full stops the plan is so slow that short blocks are long
too; there a control without a jerk limit gets ahead by some milliseconds. A feed for which trapezoids between the planned feeds at the
joints take the planned time was tried too: 8.0, 11.7, 0.7, -0.6, -2.3 %.

The motion passes a joint between two samples, k the last before it. Along the programmed path the joint divides the
distance between the two samples; with g = the share of it that lies before the joint, v0 and v1 the feeds at both samples
and the acceleration constant between them, it is passed at the share tau of the period that solves

    g (v0 + v1) / 2  =  v0 tau + (v1 - v0) tau^2 / 2.

A joint is missed by less than a period, most where the motion stops there, and what one block gains its neighbour
loses. Blocks that have no sample of their own are timed by the same formula.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import FloatArray
from planner.feedrate.rest_to_rest import block_limits
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.trajectory import Trajectory

# A highest feed within this share of the programmed one is the programmed one [-]: solvers stay a little away from their limits.
SAME = 1e-3


def block_feeds(trajectory: Trajectory, toolpath: Toolpath, machine: Machine, blocks: int) -> FloatArray:
    """(blocks,) feed of each block [mm/s]; NaN for rapids and for blocks that move nowhere; inf where a dense block takes no
    measurable time.

    blocks : number of blocks of the program
    """
    joint = _joint_times(trajectory, toolpath)
    duration = _block_times(joint, toolpath)
    mean = np.full(len(toolpath), np.inf)
    np.divide(toolpath.length, duration, out=mean, where=duration > 0)
    highest = _highest_feeds(trajectory, toolpath, joint)
    _, acceleration, _ = block_limits(toolpath, machine)
    long = highest**2 <= acceleration * toolpath.length
    full = highest >= toolpath.feed * (1.0 - SAME)
    feed = np.where(long, np.where(full, toolpath.feed, highest), mean)
    feeds = np.full(blocks, np.nan)
    feeds[toolpath.block[~toolpath.rapid]] = feed[~toolpath.rapid]
    return feeds


def block_times(trajectory: Trajectory, toolpath: Toolpath) -> FloatArray:
    """(M,) planned time of each segment [s], dwells not included; with the dwells they add up to the cycle time."""
    return _block_times(_joint_times(trajectory, toolpath), toolpath)


def _block_times(joint: FloatArray, toolpath: Toolpath) -> FloatArray:
    return np.maximum(np.diff(joint) - toolpath.dwell[1:], 0.0)


def _highest_feeds(trajectory: Trajectory, toolpath: Toolpath, joint: FloatArray) -> FloatArray:
    """(M,) highest planned feed on each segment, at its samples and, for segments between two samples, at its joints [mm/s]."""
    passed = np.interp(joint, trajectory.t, trajectory.feed)
    highest = np.maximum(passed[:-1], passed[1:])
    np.maximum.at(highest, np.searchsorted(toolpath.block, trajectory.block), trajectory.feed)
    return highest


def _joint_times(trajectory: Trajectory, toolpath: Toolpath) -> FloatArray:
    """(M+1,) when the motion leaves each joint, dwell over [s]; the last: when it ends."""
    t, feed = trajectory.t, trajectory.feed
    segment = np.searchsorted(toolpath.block, trajectory.block)
    along = np.concatenate([[0.0], np.cumsum(toolpath.length)])
    # Coordinates of the samples along the programmed path: reckoned back from the end of their segment, and on from its start.
    before = along[segment + 1] - np.linalg.norm(trajectory.position - toolpath.end[segment], axis=1)
    after = along[segment] + np.linalg.norm(trajectory.position - toolpath.start[segment], axis=1)

    joint = np.arange(1, len(toolpath))
    k = np.searchsorted(segment, joint) - 1  # the last sample before the joint
    distance = after[k + 1] - before[k]
    share = np.divide(along[joint] - before[k], distance, out=np.zeros(len(joint)), where=distance > 0).clip(
        0.0, 1.0
    )
    v0, v1 = feed[k], feed[k + 1]
    root = v0 + np.sqrt(v0**2 + share * (v1**2 - v0**2))
    tau = np.divide(share * (v0 + v1), root, out=share.copy(), where=root > 0)
    inner = t[k] + tau * (t[k + 1] - t[k])
    return np.concatenate([[t[0] + toolpath.dwell[0]], inner, [t[-1]]])
