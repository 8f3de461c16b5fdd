"""Choosing the filters of each stretch, and with them how fast its fastest leg is run.

A high speed V needs a long filter, T1 = V/A, which every standstill and every curve pays for; a pulse of length L is fastest from
rest to rest at about V = sqrt(L A), well below the feed of many programs. So V is searched for, over decades, and with it the
factor on T2 = A/J (1 where nothing overlaps or all flows, up to 2 where overlaps add jerks up). The time of a schedule is known
without making its motion; what overlaps that it cannot see cost shows when the motions of the most promising are settled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.arrays import FloatArray
from planner.corners.fir import overlap_time
from planner.filters import damped_period, lengths_from_limits, suppressing
from planner.fir.course import Course
from planner.fir.schedule import Schedule, plan_time, schedule
from planner.fir.settle import settle
from planner.machine import Machine

# Speeds that are tried at first, from the fastest leg's to what the shortest leg is best run at from rest to rest; then others
# between them, to this natural logarithm of their ratio.
SPEEDS = 10
FINEST = 0.03
# Factors on T2 that are tried.
MARGINS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
# A choice is tried if it promises to save this share of the time, although it will lose as much in being settled as the one before
# did, which is at most by this factor [-].
WORTH, LOSS = 2e-3, 1.03
# At the speed V, acceleration jumps in direction by 2 V/T1 at most; the chord over a period dt leaves the motion by dt^2/8 of that.
# T1 is at least so long that this is half of the tolerance.
CHORD_PART = 0.5


@dataclass(frozen=True, eq=False, kw_only=True)
class Design:
    """Filters and largest speed of each stretch: T1, T2 (S,) [s], speed (S,) [mm/s]."""

    T1: FloatArray
    T2: FloatArray
    speed: FloatArray


def design(course: Course, machine: Machine, speed: FloatArray, margin: float) -> Design:
    """The shortest filters for legs that are run at `speed` (S,) [mm/s] or their own feed, if that is lower."""
    if machine.fir is not None:
        T1, T2 = _own(course, machine)
        return Design(T1=T1, T2=T2, speed=speed)
    V = np.minimum(course.feed, speed[course.stretch])
    T1 = course.largest(V / course.a_max)
    product = margin * course.largest(V / course.j_max)
    sharpest = course.largest(V * course.sin_half[1:] / course.tol[1:])
    T1 = np.maximum(T1, sharpest * machine.dt**2 / (4 * CHORD_PART))
    T1 = np.maximum(T1, np.sqrt(product))
    T2 = product / T1
    periods = tuple(damped_period(mode.frequency, mode.damping) for mode in machine.modes[:2])
    if periods:
        T1, T2 = suppressing(T1, T2, periods)
    return Design(T1=T1, T2=T2, speed=speed)


def first_plan(course: Course, machine: Machine, choice: Design) -> Schedule:
    """The schedule for a choice of filters."""
    return schedule(
        course, machine, np.minimum(course.feed, choice.speed[course.stretch]), choice.T1, choice.T2
    )


def fastest(course: Course, machine: Machine) -> Schedule:
    """The fastest schedule found that keeps tolerance and limits."""
    margins = MARGINS if machine.fir is None else MARGINS[:1]
    choices = _search(course, machine, margins)
    times = np.array([plan_time(course, first_plan(course, machine, choice)) for choice in choices])
    best, best_time = first_plan(course, machine, choices[0]), np.full(course.stretches, np.inf)
    for rank in np.argsort(times, axis=0):  # for every stretch its most promising choice first
        promised = np.take_along_axis(times, rank[None], axis=0)[0]
        chosen = promised * np.minimum(best_time / times.min(axis=0), LOSS) < best_time * (1 - WORTH)
        if not chosen.any():
            break
        part = course.pick(chosen)
        choice = Design(
            **{
                name: np.choose(rank, [getattr(c, name) for c in choices])[chosen]
                for name in ("T1", "T2", "speed")
            }
        )
        plan = settle(part, machine, first_plan(part, machine, choice))
        time = plan_time(part, plan)
        better = time < best_time[chosen]
        taken = chosen.copy()
        taken[chosen] = better
        if better.any():
            best = best.put(course, taken, plan.pick(part, better))
            best_time[taken] = time[better]
    return best


def plain_plan(course: Course, machine: Machine) -> Schedule:
    """The paper's rules and nothing else: T1 = V/A, T2 = A/J, full speed, and eq. 15 at every corner."""
    a, j = (machine.limits(q, course.lines.axes).min() for q in ("acceleration", "jerk"))
    V = course.largest(course.feed)
    T1, T2 = lengths_from_limits(V, a, j) if machine.fir is None else _own(course, machine)
    before, after = course.feed[:-1], course.feed[1:]
    overlap = np.zeros(len(course) + 1)
    at = course.stretch[1:]
    overlap[1:-1] = overlap_time(
        course.tol[1:-1], np.sqrt(before * after), course.sin_half[1:-1], T1[at], T2[at]
    )
    return Schedule(
        T1=T1,
        T2=T2,
        speed=course.feed,
        passing=np.full(len(course) + 1, np.inf),
        overlap=np.where(course.inner, overlap, 0.0),
    )


def _own(course: Course, machine: Machine) -> tuple[FloatArray, FloatArray]:
    """The machine's own filters for every stretch."""
    assert machine.fir is not None
    T2, T1 = sorted(machine.fir.time_constants)
    return np.full(course.stretches, T1), np.full(course.stretches, T2)


def _search(course: Course, machine: Machine, margins: tuple[float, ...]) -> list[Design]:
    """The best speed of each stretch for each factor on T2, by the times of schedules."""
    high = course.largest(course.feed)
    low = -course.largest(-np.minimum(np.cbrt(course.j_max * course.length**2 / 4), course.feed))
    step = np.log(high / low) / (SPEEDS - 1)
    choices = []
    for margin in margins:
        best, best_time, fine = high, np.full(course.stretches, np.inf), step
        tries = [np.exp(-k * step) * high for k in range(SPEEDS)]
        while tries:
            for speed in tries:
                plan = first_plan(course, machine, design(course, machine, speed, margin))
                time = plan_time(course, plan)
                better = time < best_time
                best, best_time = np.where(better, speed, best), np.where(better, time, best_time)
            fine = fine / 2
            signs = (-1, 1) if (fine > FINEST).any() else ()
            tries = [np.minimum(best * np.exp(sign * fine), high) for sign in signs]
        choices.append(design(course, machine, best, margin))
    return choices
