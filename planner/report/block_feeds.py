"""F words that let an ordinary control keep to a planned motion, and the time of each block in it.

A control holds F in the middle of a block and puts its own ramps at the ends. Of the planned feed it is told an upper envelope: runs
of blocks, each with the highest planned feed in it. Three things follow.

* Planned again, the program takes the planned time: the planned motion keeps all its F words, and nothing faster than it was there.
* A control that can follow the plan is not slower than it; one without a jerk limit may be faster.
* Blocks of a run share one F word. Controls join short blocks into one move only where F does not change between them (LinuxCNC's
  naive CAM detector), and give every move a servo period at least.

A run ends where the next block's highest feed is off by more than `SPREAD`, but not before `RUN_PERIODS` interpolation periods. The
feed changes by little in less, and moves between two F words should last longer than a control's period.

The motion passes a joint between two samples, k the last before it. Along the programmed path the joint divides the
distance between the two samples; with g = the share of it that lies before the joint, v0 and v1 the feeds at both samples
and the acceleration constant between them, it is passed at the share tau of the period that solves

    g (v0 + v1) / 2  =  v0 tau + (v1 - v0) tau^2 / 2.

A joint is missed by less than a period, most where the motion stops there, and what one block gains its neighbour
loses. Blocks that have no sample of their own are timed by the same formula.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory

# A highest feed within this share of the programmed one is the programmed one [-]: solvers stay a little away from their limits.
SAME = 1e-3
# F words are this much above the planned feed [-]: they are written rounded down to four digits.
ABOVE = 1e-3
# The highest feeds of a run's blocks differ by at most this [-], ...
SPREAD = 0.5
# ... unless it lasts less than so many interpolation periods.
RUN_PERIODS = 20


def block_feeds(trajectory: Trajectory, toolpath: Toolpath, machine: Machine, blocks: int) -> FloatArray:
    """F words for the blocks of a program: an upper envelope of the planned feed (module text).

    blocks : number of blocks of the program

    Returns the feed of each block (blocks,) [mm/s]; NaN for rapids and for blocks that move nowhere.
    """
    joint = _joint_times(trajectory, toolpath)
    duration = _block_times(joint, toolpath)
    highest = _highest_feeds(trajectory, toolpath, joint, duration)
    cut = np.flatnonzero(~toolpath.rapid)
    run = runs_of_feed(highest[cut], duration[cut], RUN_PERIODS * machine.dt)
    cap = np.zeros(len(cut))  # of each run
    np.maximum.at(cap, run, highest[cut])
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


def block_times(trajectory: Trajectory, toolpath: Toolpath) -> FloatArray:
    """(M,) planned time on each segment [s], dwells not included. With the dwells they add up to the cycle time."""
    return _block_times(_joint_times(trajectory, toolpath), toolpath)


def _block_times(joint: FloatArray, toolpath: Toolpath) -> FloatArray:
    return np.maximum(np.diff(joint) - toolpath.dwell[1:], 0.0)


def _highest_feeds(
    trajectory: Trajectory, toolpath: Toolpath, joint: FloatArray, duration: FloatArray
) -> FloatArray:
    """(M,) highest planned feed on each segment [mm/s]: at its samples, half-way between them, as far as feeds and accelerations at
    both tell, and at its joints. Its mean at least; twice that where both joints are passed at less than half of it, as between two
    full stops without a sample: from rest to rest no jerk-limited motion is faster."""
    t, feed = trajectory.t, trajectory.feed
    passed = np.interp(joint, t, feed)
    highest = np.maximum(passed[:-1], passed[1:])
    segment = np.searchsorted(toolpath.block, trajectory.block)
    np.maximum.at(highest, segment, feed)
    push = (trajectory.velocity * trajectory.acceleration).sum(axis=1)
    push = np.divide(push, feed, out=np.zeros_like(feed), where=feed > 0)
    half_way = (feed[1:] + feed[:-1]) / 2 + np.diff(t) / 8 * (push[:-1] - push[1:])
    np.maximum.at(highest, segment[1:], half_way)
    np.maximum.at(highest, segment[:-1], half_way)
    mean = np.divide(toolpath.length, duration, out=np.zeros(len(toolpath)), where=duration > 0)
    return np.maximum(highest, np.where(highest < 0.5 * mean, 2.0, 1.0) * mean)


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
