"""The least time for a straight way: of one coordinate with limits on its velocity, acceleration and jerk, between
ends where it rests, or where only its speed is known not to be above something, at any acceleration.

It speeds up as fast as it can, with the full acceleration from an end that is free, holds its largest speed, and slows
down likewise: the time-optimal motion of a triple integrator. The acceleration is 0 at the largest speed, so a speed-up
by dv from a free end ends in a phase of falling acceleration, dv = a2/(2 J) with a = min(A, sqrt(2 J dv)).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray

UNLIMITED = 1e15  # instead of no limit [mm, s]
BISECTIONS = 50  # of the largest speed
TINY = 1e-30  # keeps quotients finite


class End(NamedTuple):
    """One end of n ways: speeds (n,) that are not exceeded there, and whether it rests (n,), without acceleration."""

    speed: FloatArray
    rests: Array


class Bounds(NamedTuple):
    """(n,) limits of the coordinate of each way [mm/s, mm/s2, mm/s3]."""

    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def straight_time(way: FloatArray, begin: End, end: End, most: Bounds) -> FloatArray:
    """(n,) the least time for ways, or a little less [s].

    way        : (n,) [mm]
    begin, end : of each
    most       : limits of each
    """
    top = most.speed
    low = np.minimum(np.maximum(begin.speed, end.speed), top)
    time, covered = _up_and_down(top, begin, end, most)
    found = np.where(covered <= way, time + (way - covered) / top, 0.0)
    # without a phase at the top: the largest speed between both ends' and the top, from below
    needs, fits = covered > way, _up_and_down(low, begin, end, most)[1] <= way
    high = top.copy()
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        short = _up_and_down(middle, begin, end, most)[1] <= way
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    time, covered = _up_and_down(low, begin, end, most)
    found = np.where(needs & fits, time + np.maximum(way - covered, 0.0) / np.maximum(high, TINY), found)
    # too short to get from one end's speed to the other's: as if only the slower end were known
    slow, push = np.minimum(begin.speed, end.speed), most.acceleration
    alone = (np.sqrt(slow**2 + 2.0 * push * way) - slow) / push
    return np.maximum(np.where(needs & ~fits, alone, found), way / top)


def _up_and_down(top: FloatArray, begin: End, end: End, most: Bounds) -> tuple[FloatArray, FloatArray]:
    """Time and distance from one end to the speed `top` and from there to the other end."""
    one, other = (_to_speed(top, at, most) for at in (begin, end))
    return one[0] + other[0], one[1] + other[1]


def _to_speed(top: FloatArray, at: End, most: Bounds) -> tuple[FloatArray, FloatArray]:
    """Time and distance from an end to the speed `top`, without acceleration there."""
    A, J = most.acceleration, most.jerk
    resting = np.where(top <= A**2 / J, 2.0 * np.sqrt(top / J), top / A + A / J)
    speed = np.minimum(at.speed, top)
    more = top - speed
    pushed = np.maximum(more - A**2 / (2.0 * J), 0.0) / A  # time at the full acceleration
    falling = np.minimum(np.sqrt(2.0 * more / J), A / J)  # and of the falling one
    middle = speed + A * pushed
    way = speed * pushed + A * pushed**2 / 2.0 + middle * falling + J * falling**3 / 3.0
    return np.where(at.rests, resting, pushed + falling), np.where(at.rests, resting * top / 2.0, way)


def largest_speed(way: FloatArray, begin: FloatArray, end: FloatArray, most: Bounds) -> FloatArray:
    """(n,) the largest speed on ways, or a little more [mm/s].

    way        : (n,) [mm]
    begin, end : (n,) speeds that are not exceeded at their ends [mm/s]
    most       : limits of each
    """
    low, high = np.minimum(np.maximum(begin, end), most.speed), most.speed.copy()
    free = np.zeros(len(way), dtype=bool)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        short = _up_and_down(middle, End(begin, free), End(end, free), most)[1] <= way
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return high
