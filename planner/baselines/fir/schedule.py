"""Paper 000's command: a speed on every leg, a wait or largest speed at joints; how it gets slower.

What is exceeded at time t comes from what was commanded within [t - Td, t]: legs that are short there get
slower, joints that flow are passed more slowly, joints that wait wait longer. Everything falls with that: the
error of a flow joint with V to V^2, that of a waiting one with Tk^3, accelerations with V to V^2, jerks with
V to V^3. If it ever did not come to an end, every leg of the run would run from rest to rest at half speed,
which keeps any limit (a single pulse exceeds V/(T1 T2) by 2 at most) without an error.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.fir.command import Command, VelocityPulses, command_of, lower_between
from planner.baselines.fir.guide import LegGuide, per
from planner.baselines.fir.measure import slowest
from planner.baselines.fir.slow_down import SLOWEST, Made, SpeedPlan, slowing
from planner.machine import Machine

# Legs are cut where a speed limit ends on them only if they take longer than this fraction of Td [-].
CUT_LEGS = 0.25
# After so many rounds what still exceeds something stops at every joint.
ROUNDS = 40
# Each round slows down by so much more at least [-], for what hardly falls with the speed.
HASTE = 0.02


@dataclass(frozen=True, eq=False, kw_only=True)
class Schedule(SpeedPlan):
    """Speeds and overlaps of a guide of R legs."""

    guide: LegGuide
    speed: FloatArray = per("leg")  # (R,) largest speed on each leg [mm/s]
    # (R+1,) largest speed at a flow joint, inf where there is no such limit [mm/s]
    passing: FloatArray = per("joint", finite=False)
    # (R+1,) Tk [s]: Td at flow joints, less where the command waits, 0 at full stops
    overlap: FloatArray = per("joint")
    holding: Array = per("leg", np.bool_)  # (R,) True for legs whose feed holds on V Td/2 beyond their ends

    def at_joints(self) -> tuple[FloatArray, FloatArray]:
        """T1 and T2 (R+1,) of the run that each joint lies in (the last joint: of the last one)."""
        run = np.append(self.guide.run, self.guide.runs - 1)
        return self.T1[run], self.T2[run]

    def gap(self) -> FloatArray:
        """(R+1,) standstill of the command at each joint [s]; full stops not counted."""
        T1, T2 = self.at_joints()
        return np.where(self.guide.inner, np.maximum(T1 + T2 - self.overlap, 0.0), 0.0)

    def time(self) -> FloatArray:
        """(S,) durations of the runs [s], dwells not counted."""
        pulses = velocity_pulses(self)
        running = np.bincount(pulses.leg, pulses.length / pulses.speed, len(self.guide))
        return self.guide.total(running + self.gap()[1:]) + self.T1 + self.T2

    def command(self) -> Command:
        """The velocity pulses and the waits between them."""
        return command_of(self.guide, velocity_pulses(self), self.gap(), self.T1, self.T2)

    def slower(self, made: Made, machine: Machine, n: int) -> Schedule:
        """Slower legs and joints, longer waits for what the motion exceeds; after `ROUNDS` half the speed and full stops
        at all joints (module text)."""
        if n < ROUNDS - 1:
            return _slower(self, made, slowing(made.seen.worst, max(SLOWEST, 1.0 - HASTE * n)))
        passing, overlap = np.where(self.guide.inner, [[np.inf], [0.0]], [self.passing, self.overlap])
        return dataclasses.replace(self, speed=self.speed / 2, passing=passing, overlap=overlap)


def velocity_pulses(plan: Schedule) -> VelocityPulses:
    """The pulses of a schedule: legs at their speeds, cut where a slower joint or block reaches into one."""
    guide, (T1, T2) = plan.guide, plan.at_joints()
    delay, run = T1 + T2, np.append(guide.run, guide.runs - 1)
    low, high = guide.s[guide.first[:-1]], guide.s[guide.first[1:]]
    slow, legs = np.flatnonzero(plan.passing < np.inf), np.flatnonzero(plan.holding)
    value = np.concatenate([plan.passing[slow], guide.feed[legs]])
    where = np.concatenate([run[slow], run[legs]])
    reach = value * delay[np.concatenate([slow, legs])] / 2
    begin = np.maximum(np.concatenate([guide.s[slow], guide.s[legs]]) - reach, low[where])
    end = np.minimum(np.concatenate([guide.s[slow], guide.s[legs + 1]]) + reach, high[where])

    cuts = np.concatenate([begin, end])
    leg = np.clip(np.searchsorted(guide.s, cuts, side="right") - 1, 0, len(guide) - 1)
    worth = guide.length[leg] > CUT_LEGS * delay[leg] * plan.speed[leg]
    edge = np.unique(np.concatenate([guide.s, cuts[worth]]))
    first = np.searchsorted(edge, begin, side="right") - 1
    last = np.searchsorted(edge, end, side="left")
    leg = np.searchsorted(guide.s, edge[:-1], side="right") - 1
    speed = plan.speed[leg].copy()
    lower_between(np.argsort(value), value, first, last, speed)

    # neighbours of one speed are one pulse
    keep = np.insert((np.diff(leg) > 0) | (np.diff(speed) != 0), 0, True)
    at = np.append(edge[:-1][keep], edge[-1])
    return VelocityPulses(leg=leg[keep], length=np.diff(at), speed=speed[keep])


def _slower(plan: Schedule, made: Made, factor: FloatArray) -> Schedule:
    """Slower legs, joints and longer waits by a factor per measured time."""
    guide, pulses = plan.guide, velocity_pulses(plan)
    first = np.searchsorted(pulses.leg, np.arange(len(guide)))
    last = np.append(first[1:], len(pulses.leg)) - 1
    duration = pulses.length / pulses.speed
    command, delay = made.command, (plan.T1 + plan.T2)[guide.run]
    # when the command begins and ends each leg
    begins, ends = (np.searchsorted(command.leg, np.arange(len(guide)) + side) for side in (0, 1))
    t = command.t + np.repeat(command.begin, np.diff(command.first))
    standing = command.velocity[ends - 1, -1] == 0
    begin, end = t[begins], np.where(standing, t[ends - 1], np.append(t[begins[1:]], t[-1]))

    fastest = np.maximum.reduceat(pulses.speed, first)
    at_fastest = np.add.reduceat(np.where(pulses.speed == fastest[pulses.leg], duration, 0.0), first)
    by_leg = slowest(made.seen.t, factor, begin, end + delay)
    lower = (by_leg < 1) & (at_fastest < delay)
    speed = np.where(lower, np.minimum(plan.speed, fastest * by_leg), plan.speed)

    inner = np.flatnonzero(guide.inner)
    by_joint = slowest(made.seen.t, factor, end[inner - 1], begin[inner] + delay[inner])
    overlap, passing = plan.overlap.copy(), plan.passing.copy()
    flows = overlap[inner] >= delay[inner]
    flow, wait = inner[flows & (by_joint < 1)], inner[~flows]
    actual = np.minimum(pulses.speed[last[flow - 1]], pulses.speed[first[flow]])
    passing[flow] = np.minimum(passing[flow], actual * by_joint[flows & (by_joint < 1)])
    overlap[wait] *= by_joint[~flows]
    return dataclasses.replace(plan, speed=speed, passing=passing, overlap=overlap)
