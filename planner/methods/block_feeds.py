"""The feed of each block of a program in a planned motion: what an F word per block can say of it.

A block's feed is its programmed length over its planned time, so that

    sum over the feed blocks of length / feed  +  time of rapids and dwells  =  cycle time,

exactly, but for blocks whose quotient is above the programmed feed (the motion cuts corners, its path is shorter).

Why the mean and not the highest feed in the block: run by LinuxCNC 2.9 (axes at 100 mm/s and 2000 mm/s2, 0.05 mm), jerk-limited
plans with mean feeds take 0.7 % more (circle of chords), 0.4 % less (spiral) and 4 % less (dense relief) than planned, with the
highest feeds 0.3 % more, 3 % less and 44 % less: such a control has no jerk limit of its own, and the F words are what keeps it
near the plan. On few long blocks, where the control's own ramps come on top, the mean costs 18 % (polygon, zig-zag), the highest
feed 5 %.

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
from planner.geometry.toolpath import Toolpath
from planner.trajectory import Trajectory


def block_feeds(trajectory: Trajectory, toolpath: Toolpath, blocks: int) -> FloatArray:
    """(blocks,) planned mean feed of each block [mm/s]; NaN for rapids and for blocks that move nowhere; inf where a block
    takes no measurable time.

    blocks : number of blocks of the program
    """
    duration = block_times(trajectory, toolpath)
    mean = np.full(len(toolpath), np.inf)
    np.divide(toolpath.length, duration, out=mean, where=duration > 0)
    feeds = np.full(blocks, np.nan)
    feeds[toolpath.block[~toolpath.rapid]] = mean[~toolpath.rapid]
    return feeds


def block_times(trajectory: Trajectory, toolpath: Toolpath) -> FloatArray:
    """(M,) planned time of each segment [s], dwells not included; with the dwells they add up to the cycle time."""
    return np.maximum(np.diff(_joint_times(trajectory, toolpath)) - toolpath.dwell[1:], 0.0)


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
