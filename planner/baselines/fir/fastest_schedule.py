"""The fastest schedule: which speed, which filters, stops or none.

A high speed V needs a long filter, T1 = V/A, which every standstill and every curve pays for; a pulse of
length L is fastest from rest to rest at about V = sqrt(L A), well below the feed of many programs. So each
run between full stops is tried with several V, and with margins on T2 = A/J: 1 where nothing overlaps or all
flows, up to 2 where overlaps add jerks up. The time of a schedule is known without making its motion; the
most promising of every margin is slowed down for what it exceeds.

Where the command waits anyway a full stop costs little more, and what it parts has filters of its own.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.baselines.fir.guide import LegGuide
from planner.baselines.fir.rules import schedule
from planner.baselines.fir.schedule import Schedule
from planner.baselines.fir.slow_down import fastest_of
from planner.corners.fir import overlap_time
from planner.machine import Machine
from planner.motion.filters import damped_period, lengths_from_limits, suppressing

# Speeds that are tried, from the fastest leg's to what the shortest leg is best run at from rest to rest.
SPEEDS = 32
MARGINS = (1.0, 1.25, 1.5, 1.75, 2.0)
# In a corner the acceleration changes by 2 s V/T1 at most, and the chord over a period dt leaves the motion
# by dt^2/8 of it. T1 is at least so long that this is the given fraction of the tolerance [-]: what is left
# is for the filters.
CHORD_FRACTION = 0.5
# Two filters suppress two modes, those of the lowest frequencies.
MODES = 2


def fastest_schedule(guide: LegGuide, machine: Machine) -> Schedule:
    """The fastest of three schedules that keep tolerance and limits: of the guide, with full stops where that
    waits, and with full stops at all corners."""
    plan = _settled(guide, machine)
    for stops in (plan.gap() > 0, guide.inner & (guide.sin_half > 0)):
        if stops.any():
            stopping = _settled(guide.stopping(np.flatnonzero(stops)), machine)
            plan = min(plan, stopping, key=lambda one: one.time().sum())
    return plan


def _settled(guide: LegGuide, machine: Machine) -> Schedule:
    """The fastest schedule of every run, each margin with the speed that promises to be the fastest."""
    margins = MARGINS if guide.profile_filters is None else MARGINS[:1]
    return fastest_of((_promising(guide, machine, margin) for margin in margins), machine)


def _promising(guide: LegGuide, machine: Machine, margin: float) -> Schedule:
    high = guide.largest(guide.feed)
    low = -guide.largest(-np.minimum(np.cbrt(guide.j_max * guide.length**2 / 4), guide.feed))
    best, best_time = high, np.full(guide.runs, np.inf)
    for share in np.linspace(0.0, 1.0, SPEEDS):
        speed = high * (low / high) ** share
        time = plan_for(guide, machine, speed, margin).time()
        best, best_time = np.where(time < best_time, speed, best), np.minimum(time, best_time)
    return plan_for(guide, machine, best, margin)


def filters_for(
    guide: LegGuide, machine: Machine, speed: FloatArray, margin: float
) -> tuple[FloatArray, FloatArray]:
    """T1 and T2 (S,) [s]: the guide's own, or the shortest for legs run at their feed and at most at `speed`.

    T1 = V/A, T2 = margin A/J with the acceleration A and the jerk J that the axes allow along the legs (or
    both equal where V does not reach A), lengthened to whole periods of the machine's vibration modes (eq.
    10).

    speed : (S,) [mm/s]
    """
    if guide.profile_filters is not None:
        return guide.given_filters()
    V = np.minimum(guide.feed, speed[guide.run])
    T1 = guide.largest(V / guide.a_max)
    product = margin * guide.largest(V / guide.j_max)
    sharpest = guide.largest(V * guide.sin_half[1:] / guide.tol[1:])
    T1 = np.maximum(T1, sharpest * machine.dt**2 / (4 * CHORD_FRACTION))
    T1 = np.maximum(T1, np.sqrt(product))
    T2 = product / T1
    modes = sorted(machine.modes, key=lambda mode: mode.frequency)[:MODES]
    return (
        suppressing(T1, T2, tuple(damped_period(m.frequency, m.damping) for m in modes))
        if modes
        else (T1, T2)
    )


def plan_for(guide: LegGuide, machine: Machine, speed: FloatArray, margin: float) -> Schedule:
    """The first schedule with the filters for a `speed` (S,), the largest on each run [mm/s], not yet slowed
    down."""
    T1, T2 = filters_for(guide, machine, speed, margin)
    return schedule(guide, machine, np.minimum(guide.feed, speed[guide.run]), T1, T2)


def plain_plan(guide: LegGuide, machine: Machine) -> Schedule:
    """Paper 000's rules and nothing else: T1 = V/A, T2 = A/J, full speed, and eq. 15 at every corner."""
    a, j = (machine.limits(q, guide.axes).min() for q in ("acceleration", "jerk"))
    V = guide.largest(guide.feed)
    T1, T2 = lengths_from_limits(V, a, j) if guide.profile_filters is None else guide.given_filters()
    before, after, at = guide.feed[:-1], guide.feed[1:], guide.run[1:]
    overlap = np.zeros(len(guide) + 1)
    overlap[1:-1] = overlap_time(
        guide.tol[1:-1], np.sqrt(before * after), guide.sin_half[1:-1], T1[at], T2[at]
    )
    return Schedule(
        guide=guide,
        T1=T1,
        T2=T2,
        speed=guide.feed,
        passing=np.full(len(guide) + 1, np.inf),
        overlap=np.where(guide.inner, overlap, 0.0),
        holding=np.zeros(len(guide), bool),
    )
