"""The extruder beside a motion: place, velocity, acceleration and jerk, from what it does on the path.

Between two joints with programmed places E0 and E1 (geometry/extrusion.py), which the motion passes at the
lengths s0 and s1 of its own path, with r = (E1 - E0)/(s1 - s0)

    E = E0 + r (s - s0),      velocity r feed,      acceleration r u,      jerk r d u/dt

with u the acceleration along the path. While the motion rests at a full stop, the moves of the extruder alone
follow one another, each in seven phases of constant jerk (base/point_to_point.py).
"""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.point_to_point import PHASES, rest_to_rest_phases
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine.user_limit import along_path
from planner.motion.timing import CHUNK, MotionInTime, in_chunks
from planner.motion.trajectory import Trajectory
from planner.motion.vertex_times import passing_times_of

# A motion this near to the length at which it rests is at rest there [mm + share of the length].
AT_JOINT = 1e-9


class _Passed(NamedTuple):
    """The K joints of an extrusion."""

    s: FloatArray  # (K,) length that is run when the motion passes them [mm]
    arrival: FloatArray  # (K,) when it arrives there and leaves [s]
    departure: FloatArray


class _Alone(NamedTuple):
    """The P moves alone: begin and end (P,) [s], index of the joint (P,), and at the start of each phase its
    time (P, 7) [s], place, velocity and acceleration (P, 7, 3), and its jerk (P, 7)."""

    begin: FloatArray
    end: FloatArray
    joint: Array
    time: FloatArray
    state: FloatArray
    jerk: FloatArray


class Extruding:
    """A motion with its extruder: its trajectories have the columns `extruder`.

    dt : period at which joints are looked for [s]
    """

    def __init__(self, motion: MotionInTime, toolpath: Toolpath, dt: float):
        assert toolpath.extrusion is not None
        self.motion, self.toolpath, self.dt, self.extrusion = motion, toolpath, dt, toolpath.extrusion

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece [s]."""
        return self.motion.t

    @property
    def end(self) -> float:
        """End of the last piece [s]."""
        return self.motion.end

    def waiting(self, at: FloatArray, by: FloatArray) -> Extruding:
        """The motion standing longer by `by` (n,) [s] where it comes to rest, at the times `at` (n,) [s]."""
        return Extruding(self.motion.waiting(at, by), self.toolpath, self.dt)

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]; dt [s] is the trajectory's interpolation period."""
        seen = self.motion.at(times, dt)
        return dataclasses.replace(seen, extruder=self._columns(seen))

    @cached_property
    def _passed(self) -> _Passed:
        """Where and when the joints are passed."""
        edges = np.unique(np.append(self.motion.t, self.motion.end))
        s = self._way(edges)
        chunks = in_chunks(self.motion, self.dt, np.append(np.arange(0.0, self.motion.end, self.dt), edges))
        when = passing_times_of(chunks, self.toolpath)[self.extrusion.joint]
        times, place = np.unique(when, return_inverse=True)
        way = np.maximum.accumulate(self._way(times)[place])
        way[0], way[-1] = s[0], s[-1]
        near = AT_JOINT * (1.0 + way)
        arrival = edges[np.minimum(np.searchsorted(s, way - near), len(edges) - 1)]
        departure = edges[np.searchsorted(s, way + near, side="right") - 1]
        rests = self.toolpath.joint[self.extrusion.joint] == Joint.STOP
        arrival, departure = np.where(rests, arrival, when), np.where(rests, departure, when)
        return _Passed(way, arrival, np.maximum(departure, arrival))

    def _way(self, times: FloatArray) -> FloatArray:
        """(n,) the length run at ascending times (n,) [mm]."""
        parts = [times[first : first + CHUNK] for first in range(0, len(times), CHUNK)]
        return np.concatenate([self.motion.at(part, 1.0).s for part in parts])

    @cached_property
    def _alone(self) -> _Alone:
        """The moves of the extruder alone."""
        fed, passed = self.extrusion, self._passed
        joint = np.searchsorted(fed.joint, fed.at)
        a, j = np.outer(fed.limits[1:], np.ones(len(fed.at)))
        lasts, jerk = rest_to_rest_phases(np.abs(fed.amount), fed.speed, a, j)
        jerk = jerk * np.sign(fed.amount)[:, None]
        time = np.cumsum(lasts, axis=1) - lasts
        state = np.zeros((len(fed.at), PHASES, 3))
        for k in range(PHASES - 1):
            h, j = lasts[:, k], jerk[:, k]
            p, v, a = (state[:, k, m] for m in range(3))
            state[:, k + 1] = np.stack(
                [p + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j], axis=1
            )
        begin = passed.arrival[joint] + fed.delay
        return _Alone(begin, begin + lasts.sum(axis=1), joint, time, state, jerk)

    def _columns(self, seen: Trajectory) -> FloatArray:
        """(T, 4) place [mm], velocity, acceleration and jerk of the extruder at samples."""
        fed, passed = self.extrusion, self._passed
        k = np.clip(np.searchsorted(passed.departure, seen.t, side="right") - 1, -1, len(fed.joint) - 2)
        before = k < 0  # waiting for the first move
        k = np.maximum(k, 0)
        way = passed.s[k + 1] - passed.s[k]
        amount = fed.arrive[k + 1] - fed.leave[k]
        ratio = np.divide(amount, way, out=np.zeros(len(way)), where=way > 0.0)
        share = np.divide(seen.s - passed.s[k], way, out=np.ones(len(way)), where=way > 0.0)
        going = ~before & (share < 1.0)
        along, _ = along_path(seen.velocity, seen.acceleration, seen.jerk)
        columns = np.zeros((len(way), 4))
        columns[:, 0] = np.where(before, fed.arrive[0], fed.leave[k] + amount * np.clip(share, 0.0, 1.0))
        columns[:, 1:] = np.where(going, ratio * along, 0.0).T
        columns[:, 1] = np.where(going, ratio * seen.feed, 0.0)
        self._add_alone(seen.t, columns)
        return columns

    def _add_alone(self, t: FloatArray, columns: FloatArray) -> None:
        """Add the moves alone at the times (T,) to the columns (T, 4)."""
        if not len(self.extrusion.at):
            return
        alone, fed = self._alone, self.extrusion
        until = self._passed.departure[alone.joint]
        last = alone.joint == len(fed.joint) - 1
        first = np.searchsorted(t, alone.begin)
        end = np.where(last, len(t), np.searchsorted(t, until))
        for p in np.flatnonzero(end > first):
            part = slice(first[p], end[p])
            tau = t[part] - alone.begin[p]
            done = tau >= alone.end[p] - alone.begin[p]
            phase = np.searchsorted(alone.time[p], tau, side="right") - 1
            h, j = tau - alone.time[p, phase], alone.jerk[p, phase]
            q, v, a = (alone.state[p, phase, m] for m in range(3))
            columns[part, 0] += np.where(done, fed.amount[p], q + h * (v + h * (a / 2 + h * j / 6)))
            columns[part, 1] += np.where(done, 0.0, v + h * (a + h * j / 2))
            columns[part, 2] += np.where(done, 0.0, a + h * j)
            columns[part, 3] += np.where(done, 0.0, j)
