"""Runs of a motion between full stops: slowed down as a whole, or followed by a longer standstill.

Slowing down by f divides speeds by f, accelerations by f^2 and jerks by f^3: every limit still holds, and the
path is the same. A longer standstill changes nothing else. A motion can stand only where its velocity is
zero, and its acceleration too if jerk is limited.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.motion.axis_motion import LEVELS, AxisMotion
from planner.motion.timing import Motion

# Velocities and accelerations below this fraction of the largest are none [-]: rounding of sums.
STANDING = 1e-7

Timed = Motion | AxisMotion
TimedT = TypeVar("TimedT", Motion, AxisMotion)


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionRuns:
    """G runs of a motion between its standstills."""

    first: Array  # (G,) index of the first piece of the run
    # (G,) index of the first piece behind it: a standstill, the next run, or the number of pieces
    last: Array
    begin: FloatArray  # (G,) [s]
    end: FloatArray  # (G,) [s]

    def __len__(self) -> int:
        return len(self.first)

    def of(self, motion: Timed) -> MotionRuns:
        """The same runs of a motion with the same pieces and other times."""
        edges = np.append(motion.t, motion.end)
        return dataclasses.replace(self, begin=edges[self.first], end=edges[self.last])

    def behind(self, by: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(G,) begins and ends of the runs [s], each but the last followed by `by` (G,) [s] more."""
        later = np.append(0.0, np.cumsum(by[:-1]))
        return self.begin + later, self.end + later


def runs_of(motion: Timed) -> MotionRuns:
    """The runs of a motion; none if it stands still all the time."""
    edges = np.append(motion.t, motion.end)
    if isinstance(motion, Motion):
        run = motion.law.run
        first = np.searchsorted(run, np.arange(run[-1] + 1))
        last = np.append(first[1:], len(run)) - 1  # the last piece of a run is its standstill
    else:
        begins = np.flatnonzero(_rests(motion))
        moves = motion.velocity.any(axis=1) | motion.jerk.any(axis=1)
        moving = np.logical_or.reduceat(moves, begins)
        first, last = begins[moving], np.append(begins[1:], len(motion))[moving]
    return MotionRuns(first=first, last=last, begin=edges[first], end=edges[last])


def _rests(motion: AxisMotion) -> Array:
    """(L,) True where nothing moves at the start of a piece, nor begins to with an acceleration."""
    lasting = np.diff(np.append(motion.t, motion.end))[:, None]
    after = motion.acceleration + lasting * motion.jerk
    before = np.vstack([np.zeros_like(after[:1]), after[:-1]])
    still = np.abs(motion.velocity).max(axis=1) <= STANDING * np.abs(motion.velocity).max()
    for acceleration in (before, motion.acceleration):
        still &= np.abs(acceleration).max(axis=1) <= STANDING * np.abs(motion.acceleration).max()
    still[0] = True
    return still


def slower_runs(motion: TimedT, runs: MotionRuns, factor: FloatArray) -> TimedT:
    """The motion with every run slowed down; its pieces stay the same, and so do its standstills.

    factor : (G,) by which each run takes longer [-], >= 1
    """
    by = np.ones(len(motion.t))
    for g in np.flatnonzero(factor != 1.0):
        by[runs.first[g] : runs.last[g]] = factor[g]
    lasting = np.diff(np.append(motion.t, motion.end)) * by
    if isinstance(motion, Motion):
        law = motion.law
        t = law.t[0] + np.append(0.0, np.cumsum(lasting))
        rates = {"feed": law.feed / by, "acc_s": law.acc_s / by**2, "jerk_s": law.jerk_s / by**3}
        slower = dataclasses.replace(law, t=t[:-1], end=float(t[-1]), **rates)
        return dataclasses.replace(motion, law=slower)
    t = np.append(0.0, np.cumsum(lasting))
    rates = {
        name: getattr(motion, name) / by[:, None] ** power for power, name in enumerate(LEVELS[1:], start=1)
    }
    return dataclasses.replace(motion, t=t[:-1], end=float(t[-1]), **rates)


def standing_longer(motion: TimedT, runs: MotionRuns, by: FloatArray) -> TimedT:
    """The motion with longer standstills behind its runs: `waiting` at their ends.

    by : (G,) standstill added behind each run [s], >= 0; not used behind the last
    """
    edges = np.append(motion.t, motion.end)
    behind = np.flatnonzero(by[:-1])
    return motion.waiting(edges[runs.last[behind]], by[behind]) if len(behind) else motion
