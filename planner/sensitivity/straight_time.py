"""The least time for a straight way: of one coordinate with limits on its velocity, acceleration and jerk, between
ends where it rests, or where only its speed is known not to be above something, at any acceleration.

It speeds up as fast as it can, with the full acceleration from an end that is free, holds its largest speed, and slows
down likewise: the time-optimal motion of a triple integrator. The acceleration is 0 at the largest speed, so a speed-up
by dv from a free end ends in a phase of falling acceleration, dv = a2/(2 J) with a = min(A, sqrt(2 J dv)).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit

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


@njit(cache=True, error_model="numpy")
def straight_time(way, begin, end, most):
    """(n,) the least time for ways (n,) [mm] from `begin` to `end` within limits, or a little less [s]."""
    found = np.empty(len(way))
    for n in range(len(way)):
        top, push = most.speed[n], most.acceleration[n]
        time, covered = _up_and_down(top, n, begin, end, most)
        if covered <= way[n]:
            found[n] = time + (way[n] - covered) / top
            continue
        low, high = _between(way[n], n, begin, end, most)
        time, covered = _up_and_down(low, n, begin, end, most)
        if covered <= way[n]:  # without a phase at the top
            found[n] = time + (way[n] - covered) / max(high, TINY)
        else:  # too short to get from one end's speed to the other's: as if only the slower end were known
            slow = min(begin.speed[n], end.speed[n])
            found[n] = (np.sqrt(slow * slow + 2.0 * push * way[n]) - slow) / push
        found[n] = max(found[n], way[n] / top)
    return found


@njit(cache=True, error_model="numpy")
def largest_speed(way, begin, end, most):
    """(n,) the largest speed on ways (n,) [mm] between ends with speeds (n,), or a little more [mm/s]."""
    found, free = np.empty(len(way)), np.zeros(len(way), dtype=np.bool_)
    for n in range(len(way)):
        found[n] = _between(way[n], n, End(begin, free), End(end, free), most)[1]
    return found


@njit(cache=True, error_model="numpy")
def _between(way, n, begin, end, most):
    """The largest speed on a way, between both ends' speeds and the top, from below and above."""
    high = most.speed[n]
    low = min(max(begin.speed[n], end.speed[n]), high)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        if _up_and_down(middle, n, begin, end, most)[1] <= way:
            low = middle
        else:
            high = middle
    return low, high


@njit(cache=True, error_model="numpy")
def _up_and_down(top, n, begin, end, most):
    """Time and distance of way n from one end to the speed `top` and from there to the other end."""
    time, way = _to_speed(top, n, begin, most)
    more_time, more_way = _to_speed(top, n, end, most)
    return time + more_time, way + more_way


@njit(cache=True, error_model="numpy")
def _to_speed(top, n, at, most):
    """Time and distance of way n from an end to the speed `top`, without acceleration there."""
    A, J = most.acceleration[n], most.jerk[n]
    if at.rests[n]:
        resting = 2.0 * np.sqrt(top / J) if top <= A * A / J else top / A + A / J
        return resting, resting * top / 2.0
    speed = min(at.speed[n], top)
    more = top - speed
    pushed = max(more - A * A / (2.0 * J), 0.0) / A  # time at the full acceleration
    falling = min(np.sqrt(2.0 * more / J), A / J)  # and of the falling one
    middle = speed + A * pushed
    way = speed * pushed + A * pushed**2 / 2.0 + middle * falling + J * falling**3 / 3.0
    return pushed + falling, way
