"""How fast a motion is at corners at most, and what lines take between them at least (least_time.py)."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.sensitivity.straight_time import TINY, UNLIMITED, Bounds, End, straight_time
from planner.sensitivity.waypoints import Way


class Legs(NamedTuple):
    """(N,) the least way of each leg in a coordinate [mm], the least time for it [s], and the speeds at its ends."""

    way: FloatArray
    time: FloatArray
    begin: End
    end: End


def legs_between(way: Way, bounds: Bounds, length: FloatArray, known: Array) -> Legs:
    """Lines between corners and stops; `length` (N,) in the coordinate that bounds each, and whether it is its tangent, as
    otherwise its speed at corners is not known."""
    u, corner = way.tangent, way.vertex[1:-1] & way.line[:-1] & way.line[1:]
    least = np.maximum(length - way.tolerance[:-1] - way.tolerance[1:], 0.0)
    within = np.maximum(way.tolerance[:-1], way.tolerance[1:])
    lasting = least / bounds.speed
    cosine = np.clip((u[:-1] * u[1:]).sum(axis=1), -1.0, 1.0)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, TINY))
    of_before = confined(way, u[1:] - cosine[:, None] * u[:-1], within[:-1], lasting[:-1])
    of_after = confined(way, u[:-1] - cosine[:, None] * u[1:], within[1:], lasting[1:])
    before = (np.abs(cosine) * of_before + of_after) / sine
    after = (np.abs(cosine) * of_after + of_before) / sine
    back = np.where(cosine < 0.0, 4.0 * np.maximum(within[:-1], within[1:]), np.inf)
    before = np.minimum(before, np.sqrt(bounds.acceleration[:-1] * back))
    after = np.minimum(after, np.sqrt(bounds.acceleration[1:] * back))
    begin = np.append(np.inf, np.where(corner & known[1:], after, np.inf))
    end = np.append(np.where(corner & known[:-1], before, np.inf), np.inf)
    at_begin = End(np.where(way.stop[:-1], 0.0, np.minimum(begin, bounds.speed)), way.stop[:-1])
    at_end = End(np.where(way.stop[1:], 0.0, np.minimum(end, bounds.speed)), way.stop[1:])
    time = np.where(way.line, straight_time(least, at_begin, at_end, bounds), lasting)
    return Legs(least, time, at_begin, at_end)


def confined(way: Way, across: FloatArray, within: FloatArray, lasting: FloatArray) -> FloatArray:
    """(n,) the largest speed across a leg at its end [mm/s], UNLIMITED where the time is too short to tell:
    in directions `across` (n, A) of any length, `within` (n,) of the leg [mm], for `lasting` (n,) before at
    least [s]."""
    size = np.maximum(np.linalg.norm(across, axis=1), TINY)
    direction = np.abs(across) / size[:, None]
    push, jerk = (np.maximum(direction @ limit, TINY) for limit in way.limit[1:])
    by_push, by_jerk = np.sqrt(4.0 * push * within), np.cbrt(243.0 / 8.0 * within**2 * jerk)
    by_push = np.where(lasting * push >= by_push, by_push, UNLIMITED)
    return np.minimum(by_push, np.where(lasting >= 2.0 * np.cbrt(24.0 * within / jerk), by_jerk, UNLIMITED))
