"""Runs of a motion between full stops: slowed down as a whole, or followed by a longer rest.

Slowing down by f divides speeds by f, accelerations by f^2 and jerks by f^3: every limit still holds, and the path is the same. A
longer rest changes nothing else. A motion can wait only where its velocity is zero, and its acceleration too if jerk is limited.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.motion.axis_motion import AxisMotion
from planner.motion.time_law import TimeLaw
from planner.motion.timing import Motion

# Velocities and accelerations below this fraction of the motion's largest are none [-]: rounding of long sums of pulses is 1e-12 of
# them.
STANDING = 1e-7

Timed = Motion | AxisMotion
TimedT = TypeVar("TimedT", Motion, AxisMotion)


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionRuns:
    """G runs of a motion.

    first : (G,) index of the first piece of the run
    last  : (G,) index of the first piece behind it: a standstill, the first piece of the next run, or the number of pieces
    begin : (G,) [s]
    end   : (G,) [s]
    """

    first: Array
    last: Array
    begin: FloatArray
    end: FloatArray

    def __len__(self) -> int:
        return len(self.first)


def runs_of(motion: Timed) -> MotionRuns:
    """The runs of a motion; none if the motion rests all the time."""
    edges = np.append(motion.t, motion.end)
    if isinstance(motion, Motion):
        run = motion.law.run
        first = np.searchsorted(run, np.arange(run[-1] + 1))
        last = np.append(first[1:], len(run)) - 1  # the last piece of a run is its standstill
    else:
        rest = np.append(_rests(motion), True)
        begins = np.flatnonzero(rest[:-1])
        ends = np.append(begins[1:], len(motion))
        moving = [
            motion.velocity[a:b].any() or motion.jerk[a:b].any() for a, b in zip(begins, ends, strict=True)
        ]
        first, last = begins[moving], ends[moving]
    return MotionRuns(first=first, last=last, begin=edges[first], end=edges[last])


def _rests(motion: AxisMotion) -> Array:
    """(L,) True where nothing moves at the start of a piece, nor begins to with a jump of the acceleration."""
    lasting = np.diff(np.append(motion.t, motion.end))[:, None]
    after = motion.acceleration + lasting * motion.jerk
    before = np.vstack([np.zeros_like(after[:1]), after[:-1]])
    still = np.abs(motion.velocity).max(axis=1) <= STANDING * np.abs(motion.velocity).max()
    for acceleration in (before, motion.acceleration):
        still &= np.abs(acceleration).max(axis=1) <= STANDING * np.abs(motion.acceleration).max()
    still[0] = True
    return still


def paced(motion: TimedT, runs: MotionRuns, factor: FloatArray, pause: FloatArray) -> TimedT:
    """The motion with every run slowed down and followed by more rest.

    factor : (G,) by which each run takes longer [-], >= 1
    pause  : (G,) rest added behind each run [s]; not used behind the last
    """
    pause = np.append(pause[:-1], 0.0)
    by = np.ones(len(motion.t))
    for g in np.flatnonzero(factor != 1.0):
        by[runs.first[g] : runs.last[g]] = factor[g]
    lasting = np.diff(np.append(motion.t, motion.end)) * by
    if isinstance(motion, Motion):
        law = motion.law
        lasting[runs.last] += pause
        t = law.t[0] + np.append(0.0, np.cumsum(lasting))
        return dataclasses.replace(
            motion,
            law=TimeLaw(
                t=t[:-1],
                s=law.s,
                feed=law.feed / by,
                acc_s=law.acc_s / by**2,
                jerk_s=law.jerk_s / by**3,
                run=law.run,
                end=float(t[-1]),
            ),
        )
    wait = np.flatnonzero(pause)
    at = runs.last[wait]
    t = np.append(0.0, np.cumsum(np.insert(lasting, at, pause[wait])))
    columns = {
        name: np.insert(getattr(motion, name) / by[:, None] ** power, at, 0.0, axis=0)
        for power, name in enumerate(("position", "velocity", "acceleration", "jerk"))
    }
    columns["position"] = np.insert(motion.position, at, motion.position[at], axis=0)
    return dataclasses.replace(
        motion,
        t=t[:-1],
        end=float(t[-1]),
        block=np.insert(motion.block, at, motion.block[at - 1]),
        line=np.insert(motion.line, at, motion.line[at - 1]),
        **columns,
    )
