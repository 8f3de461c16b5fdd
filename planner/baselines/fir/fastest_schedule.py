"""The fastest schedule: which speed, which filters, which full stops.

A high speed V needs a long filter, T1 = V/A, which every standstill and every curve pays for; a pulse of
length L is fastest from rest to rest at about V = sqrt(L A), well below the feed of many programs. So V is
searched for, over decades, and with it the margin on T2 = A/J: 1 where nothing overlaps or all flows, up to 2
where overlaps add jerks up. The time of a schedule is known without making its motion; what it cannot see
costs when the most promising are settled.

Where the command waits anyway a full stop costs little more, and what it parts may have filters of its own.
"""

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.point_to_point import rest_to_rest_times
from planner.baselines.fir.guide import LegGuide
from planner.baselines.fir.rules import schedule
from planner.baselines.fir.schedule import Schedule
from planner.baselines.fir.slow_down import WORTH, settled_fastest
from planner.corners.fir import overlap_time
from planner.machine import Machine
from planner.motion.filters import damped_period, lengths_from_limits, suppressing

# Margins that are tried, each with speeds that are powers of a ratio [-], from the fastest leg's down to what
# is best for the shortest from rest to rest; the most promising ones are made into motions.
MARGINS = (1.0, 1.2, 1.4, 1.6, 2.0)
RATIO, SETTLED = 1.1, 3
BESIDE = RATIO ** np.array([0.0, -0.5, 0.5])
# Full stops are tried where the command waits for this fraction of the filters' delay or longer [-].
STOPS = (1.0, 0.0)
WAIT_ROUNDING = 1e-9  # of that fraction
# The chord over a period dt leaves a corner, whose acceleration changes by 2 s V/T1, by dt^2/8 of that: T1 is
# so long that this is at most the given fraction of the tolerance [-].
CHORD_FRACTION = 0.5
# Two filters suppress two modes, those of the lowest frequencies.
MODES = 2


def fastest_schedule(guide: LegGuide, machine: Machine) -> Schedule:
    """The fastest schedule found that keeps tolerance and limits; its guide may have more full stops."""
    plan = _settled(guide, machine)
    for fraction in STOPS:
        gap, (T1, T2) = plan.gap(), plan.at_joints()
        waits = (gap > 0) & (gap >= fraction * (T1 + T2) * (1 - WAIT_ROUNDING))
        plan = _stopping(plan, machine, waits)
    return _stopping(plan, machine, plan.guide.inner & (plan.guide.sin_half > 0))


def _stopping(plan: Schedule, machine: Machine, stops: Array) -> Schedule:
    """Full stops at the joints `stops` (R+1,), in the runs that gain by it."""
    guide, time = plan.guide, plan.time()
    tried = np.logical_or.reduceat(stops[:-1], guide.first[:-1])
    tried &= _least_time(guide, stops) < time * (1 - WORTH)
    if not tried.any():
        return plan
    legs = np.flatnonzero(tried[guide.run])
    stopping = guide.pick(tried).stopping(np.flatnonzero(stops[legs]))
    other = _settled(stopping, machine)
    home = guide.run[legs[stopping.first[:-1]]]  # the run that each of these was cut from
    new_time = np.bincount(home, other.time(), guide.runs)
    better = tried & (new_time < time * (1 - WORTH))
    if not better.any():
        return plan
    cut = guide.stopping(np.flatnonzero(stops & np.append(better[guide.run], False)))
    home_of_cut = guide.run[cut.first[:-1]]
    kept = dataclasses.replace(plan, guide=cut, T1=plan.T1[home_of_cut], T2=plan.T2[home_of_cut])
    return kept.put(better[home_of_cut], other.pick(better[home]))


def _least_time(guide: LegGuide, stops: Array) -> FloatArray:
    """A time (S,) [s] that no run beats with full stops at the joints `stops` (R+1,): straight moves."""
    stopping = guide.stopping(np.flatnonzero(stops))
    limits = (stopping.largest(value) for value in (stopping.feed, stopping.a_max, stopping.j_max))
    times = rest_to_rest_times(stopping.total(stopping.length), *limits)
    return np.asarray(np.bincount(guide.run[stopping.first[:-1]], times, guide.runs), dtype=np.float64)


def _settled(guide: LegGuide, machine: Machine) -> Schedule:
    """The fastest of the settled schedules, each run with the choices that are most promising for it."""
    margins = MARGINS if guide.profile_filters is None else MARGINS[:1]
    high = guide.largest(guide.feed)
    from_rest = np.minimum(np.cbrt(guide.j_max * guide.length**2 / 4), np.sqrt(guide.a_max * guide.length))
    low = -guide.largest(-np.minimum(from_rest, guide.feed))
    below = np.floor(np.log(high) / np.log(RATIO))
    count = int(np.ceil(np.log(high / low).max() / np.log(RATIO))) + 1
    tries = np.array([high, *(RATIO ** (below - k) for k in range(count))])
    plans, times, runs = [], [], np.arange(guide.runs)
    for margin in margins:
        of = np.full(guide.runs, margin)
        promised = np.array([plan_for(guide, machine, speed, of).time() for speed in tries])
        for best in np.argsort(promised, axis=0, kind="stable")[:SETTLED]:
            near = np.minimum(tries[best, runs] * BESIDE[:, None], high)
            fastest = np.argmin([plan_for(guide, machine, speed, of).time() for speed in near], axis=0)
            plans.append(plan_for(guide, machine, near[fastest, runs], of))
            times.append(plans[-1].time())
    return settled_fastest(plans, np.array(times), machine)


def plan_for(guide: LegGuide, machine: Machine, speed: FloatArray, margin: FloatArray) -> Schedule:
    """The first schedule for a speed, not yet slowed down, with the guide's own filters or the shortest: T1 = V/A, T2 =
    margin A/J with the acceleration A and the jerk J that the axes allow along the legs (or both equal where V does not
    reach A), lengthened to whole periods of the machine's vibration modes (eq. 10).

    speed  : (S,) largest speed on each run [mm/s]
    margin : (S,) on T2 = A/J [-]
    """
    V = np.minimum(guide.feed, speed[guide.run])
    if guide.profile_filters is not None:
        return schedule(guide, machine, V, *guide.given_filters())
    T1, product = guide.largest(V / guide.a_max), margin * guide.largest(V / guide.j_max)
    sharpest = guide.largest(V * guide.sin_half[1:] / guide.tol[1:])
    T1 = np.maximum(T1, sharpest * machine.dt**2 / (4 * CHORD_FRACTION))
    T1 = np.maximum(T1, np.sqrt(product))
    T2 = product / T1
    modes = sorted(machine.modes, key=lambda mode: mode.frequency)[:MODES]
    if modes:
        T1, T2 = suppressing(T1, T2, tuple(damped_period(m.frequency, m.damping) for m in modes))
    return schedule(guide, machine, V, T1, T2)


def plain_plan(guide: LegGuide, machine: Machine) -> Schedule:
    """Paper 000's rules and nothing else: T1 = V/A, T2 = A/J, full speed, and eq. 15 at every corner."""
    a, j = (machine.limits(q, guide.axes).min() for q in ("acceleration", "jerk"))
    V = guide.largest(guide.feed)
    T1, T2 = lengths_from_limits(V, a, j) if guide.profile_filters is None else guide.given_filters()
    before, after, at = guide.feed[:-1], guide.feed[1:], guide.run[1:]
    overlap, V = np.zeros(len(guide) + 1), np.sqrt(before * after)
    overlap[1:-1] = overlap_time(guide.tol[1:-1], V, guide.sin_half[1:-1], T1[at], T2[at])
    return Schedule(
        guide=guide,
        T1=T1,
        T2=T2,
        speed=guide.feed,
        passing=np.full(len(guide) + 1, np.inf),
        overlap=np.where(guide.inner, overlap, 0.0),
        holding=np.zeros(len(guide), bool),
    )
