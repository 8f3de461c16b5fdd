"""From a first schedule to a motion that keeps tolerance and limits: measure, slow down where something is exceeded, repeat.

What is exceeded at time t comes from what was commanded within [t - Td, t]: legs that are short there get slower, joints that flow
are passed more slowly, joints that wait wait longer. Everything falls with that: the error of a flow joint with V to V^2, that of a
waiting one with Tk^3, accelerations with V to V^2, jerks with V to V^3. If it ever did not come to an end, every leg of the stretch
would run from rest to rest at half speed, which keeps any limit (a single pulse exceeds V/(T1 T2) by 2 at most) without an error.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.fir.audit import Audit, audit, slowest
from planner.fir.command import Cells, Command, command_of
from planner.fir.course import Course
from planner.fir.schedule import Schedule, cells_of
from planner.fir.superpose import Pieces, superpose
from planner.machine import Machine

ROUNDS = 40
# What rounding may add to a ratio [-]; the verifier allows twice as much.
RATIO_ROUNDING = 5e-7
# One round slows down by the root of what is exceeded and a little more, but not to less than half; and each by so much more than
# the round before at least, for what hardly falls with the speed [-].
BEYOND, SLOWEST, HASTE = 0.995, 0.5, 0.02
# An overlap shorter than this share of T2 is none.
LEAST_OVERLAP = 0.1


@dataclass(frozen=True, eq=False, kw_only=True)
class Made:
    """A motion with what made it."""

    plan: Schedule
    cells: Cells
    command: Command
    pieces: Pieces
    seen: Audit


def make(course: Course, machine: Machine, plan: Schedule) -> Made:
    """The motion of a schedule, measured."""
    cells = cells_of(course, plan)
    command = command_of(course, cells, plan.gap(course), plan.T1, plan.T2)
    pieces = superpose(command)
    return Made(plan=plan, cells=cells, command=command, pieces=pieces, seen=audit(course, pieces, machine))


def settle(course: Course, machine: Machine, plan: Schedule) -> Schedule:
    """Slow a schedule down until it keeps tolerance and limits."""
    chosen = np.ones(course.stretches, bool)
    for n in range(ROUNDS):
        part, now = course.pick(chosen), plan.pick(course, chosen)
        made = make(part, machine, now)
        factor = _factor(made.seen, max(SLOWEST, 1.0 - HASTE * n))
        wrong = _exceeding(made, factor)
        if not wrong.any():
            return plan
        last = n == ROUNDS - 1
        slower = _stopping(part, now, wrong) if last else _slower(part, made, factor)
        plan = plan.put(course, chosen, slower)
        chosen[chosen] = wrong
    return plan


def _factor(seen: Audit, most: float) -> FloatArray:
    """By how much to slow down at each measured time [-]; 1 where nothing is exceeded, `most` at most elsewhere."""
    worst = np.maximum(np.maximum(seen.error, seen.acceleration), seen.jerk)
    slower = np.clip(BEYOND / np.sqrt(np.maximum(worst, 1.0)), SLOWEST, most)
    return np.where(worst > 1 + RATIO_ROUNDING, slower, 1.0)


def _exceeding(made: Made, factor: FloatArray) -> Array:
    """(S,) True for the stretches that exceed something."""
    pieces = made.pieces
    return slowest(made.seen.t, factor, pieces.t[pieces.first[:-1]], pieces.end) < 1


def _slower(course: Course, made: Made, factor: FloatArray) -> Schedule:
    plan, command, cells = made.plan, made.command, made.cells
    first = np.searchsorted(cells.leg, np.arange(len(course)))
    last = np.append(first[1:], len(cells.leg)) - 1
    duration = cells.length / cells.speed
    begin, end = _leg_times(course, command)
    delay = (plan.T1 + plan.T2)[course.stretch]

    fastest = np.maximum.reduceat(cells.speed, first)
    at_fastest = np.add.reduceat(np.where(cells.speed == fastest[cells.leg], duration, 0.0), first)
    by_leg = slowest(made.seen.t, factor, begin, end + delay)
    lower = (by_leg < 1) & (at_fastest < delay)
    speed = np.where(lower, np.minimum(plan.speed, fastest * by_leg), plan.speed)

    inner = np.flatnonzero(course.inner)
    by_joint = slowest(made.seen.t, factor, end[inner - 1], begin[inner] + delay[inner])
    overlap, passing = plan.overlap.copy(), plan.passing.copy()
    flows = overlap[inner] >= delay[inner]
    flow, wait = inner[flows & (by_joint < 1)], inner[~flows]
    actual = np.minimum(cells.speed[last[flow - 1]], cells.speed[first[flow]])
    passing[flow] = np.minimum(passing[flow], actual * by_joint[flows & (by_joint < 1)])
    overlap[wait] *= by_joint[~flows]
    overlap[wait[overlap[wait] < LEAST_OVERLAP * plan.T2[course.stretch[wait]]]] = 0.0
    return dataclasses.replace(plan, speed=speed, passing=passing, overlap=overlap)


def _leg_times(course: Course, command: Command) -> tuple[FloatArray, FloatArray]:
    """When the command begins and ends each leg (R,) [s]."""
    first = np.searchsorted(command.leg, np.arange(len(course)))
    last = np.append(first[1:], len(command.leg)) - 1
    t = command.t + np.repeat(command.begin, np.diff(command.first))
    standing = command.velocity[last, -1] == 0
    return t[first], np.where(standing, t[last], np.append(t[first[1:]], t[-1]))


def _stopping(course: Course, plan: Schedule, wrong: Array) -> Schedule:
    """The stretches that exceed something with full stops and half speed."""
    leg: Array = wrong[course.stretch]
    joint = np.append(leg, False) & course.inner
    return dataclasses.replace(
        plan,
        speed=np.where(leg, plan.speed / 2, plan.speed),
        passing=np.where(joint, np.inf, plan.passing),
        overlap=np.where(joint, 0.0, plan.overlap),
    )
