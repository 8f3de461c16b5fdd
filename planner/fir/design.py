"""The filters of each stretch, for a speed and a margin."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.fir import overlap_time
from planner.fir.course import StraightCourse
from planner.fir.filters import damped_period, lengths_from_limits, suppressing
from planner.fir.rules import schedule
from planner.fir.schedule import Schedule
from planner.machine import Machine

# In a corner the acceleration changes by 2 s V/T1 at most, and the chord over a period dt leaves the motion by dt^2/8 of it. T1 is at
# least so long that this is the given share of the tolerance [-]: what is left is for the filters.
CHORD_PART = 0.5
# Two filters suppress two modes, those of the lowest frequencies.
MODES = 2


def filters_for(
    course: StraightCourse, machine: Machine, speed: FloatArray, margin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """T1 and T2 (S,) [s]: the course's own, or the shortest for legs run at their feed and at most at `speed`.

    T1 = V/A, T2 = margin A/J with the acceleration A and the jerk J that the axes allow along the legs (or both equal where V does
    not reach A), lengthened to whole periods of the machine's vibration modes (eq. 10).

    speed  : (S,) [mm/s]
    margin : (S,) [-]
    """
    if course.own is not None:
        return course.given_filters()
    V = np.minimum(course.feed, speed[course.stretch])
    T1 = course.largest(V / course.a_max)
    product = margin * course.largest(V / course.j_max)
    sharpest = course.largest(V * course.sin_half[1:] / course.tol[1:])
    T1 = np.maximum(T1, sharpest * machine.dt**2 / (4 * CHORD_PART))
    T1 = np.maximum(T1, np.sqrt(product))
    T2 = product / T1
    modes = sorted(machine.modes, key=lambda mode: mode.frequency)[:MODES]
    return (
        suppressing(T1, T2, tuple(damped_period(m.frequency, m.damping) for m in modes))
        if modes
        else (T1, T2)
    )


def plan_for(course: StraightCourse, machine: Machine, speed: FloatArray, margin: FloatArray) -> Schedule:
    """The first schedule of a course run at `speed` (S,) [mm/s] at most, with the filters for it and the `margin` (S,)."""
    T1, T2 = filters_for(course, machine, speed, margin)
    return schedule(course, machine, np.minimum(course.feed, speed[course.stretch]), T1, T2)


def plain_plan(course: StraightCourse, machine: Machine) -> Schedule:
    """The paper's rules and nothing else: T1 = V/A, T2 = A/J, full speed, and eq. 15 at every corner."""
    a, j = (machine.limits(q, course.axes).min() for q in ("acceleration", "jerk"))
    V = course.largest(course.feed)
    T1, T2 = lengths_from_limits(V, a, j) if course.own is None else course.given_filters()
    before, after, at = course.feed[:-1], course.feed[1:], course.stretch[1:]
    overlap = np.zeros(len(course) + 1)
    overlap[1:-1] = overlap_time(
        course.tol[1:-1], np.sqrt(before * after), course.sin_half[1:-1], T1[at], T2[at]
    )
    return Schedule(
        course=course,
        T1=T1,
        T2=T2,
        speed=course.feed,
        passing=np.full(len(course) + 1, np.inf),
        overlap=np.where(course.inner, overlap, 0.0),
        holding=np.zeros(len(course), bool),
    )
