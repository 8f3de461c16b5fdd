"""A full stop as samples show it: whether the motion can rest at its vertex, and for how long.

A motion that rests at the vertex at some time within a period h has, with |acceleration| <= a, over the
period a chord of at most a h^2 / 2, and the nearer end of the period is at most a (h/2)^2 / 2 away; where
jerk is limited to j, at rest the acceleration is zero too, and it is j h^3 / 6 and j (h/2)^3 / 6. Per axis,
each.

Who is d away from where he rests left it, or has still to go, for

    tau(d) = the larger of  (6 d / j)^(1/3),  (2 d / a)^(1/2)

at least, the largest of the axes: of a period between samples d0 and d1 away he can rest h - tau(d0) -
tau(d1), and no longer. Of a motion that leaves with the whole jerk, that is how long it rests, wherever the
samples fall.
"""

import math
from typing import NamedTuple

from planner.base.arrays import FloatArray
from planner.verifier.pieces import PLACE_ROUNDING, kernel, reach_chord

STILL = 1e-9  # [mm] displacement over one period that is a standstill: rounding of coordinates up to 1e6 mm


class AtStop(NamedTuple):
    """How far and how fast a sample can be next to a stop: (A,) largest accelerations [mm/s2] and jerks
    [mm/s3], inf where they are not limited, and errors of positions by their digits [mm]."""

    acceleration_max: FloatArray
    jerk_max: FloatArray
    rounding: FloatArray


@kernel()
def watch_stop(pieces, passed, i, before, point, period, parts, at_stop):
    """The chord from `before` to `point` (A,), one of `parts` of a period [s], shows of the stop at vertex i,
    into `passed`."""
    acceleration_max, rounding = at_stop.acceleration_max, at_stop.rounding
    slow, away_sq = 0.0, 0.0
    for axis in range(len(point)):
        move = abs(point[axis] - before[axis])
        bow = acceleration_max[axis] * period * period / 8.0
        most = 4.0 * bow
        if math.isfinite(at_stop.jerk_max[axis]):
            bow = min(bow, at_stop.jerk_max[axis] * period**3 / 48.0)
            most = min(most, at_stop.jerk_max[axis] * period**3 / 6.0)
        slow = max(slow, max(move * parts - STILL - 2.0 * rounding[axis], 0.0) / most)
        away_sq += (bow + rounding[axis]) ** 2
    away = math.sqrt(away_sq) + PLACE_ROUNDING
    _, _, apart = reach_chord(before, point, pieces, i, 0.0)
    passed[i]["stop_ratio"] = min(passed[i]["stop_ratio"], max(slow, apart / away))


@kernel()
def longest_rest(pieces, i, before, point, period, at_stop):
    """How long a motion with samples `before` and `point` (A,), a period [s] apart, can rest at vertex i
    between them [s]."""
    early, late = 0.0, 0.0
    for axis in range(len(point)):
        rounding = PLACE_ROUNDING + at_stop.rounding[axis]
        a, j, there = at_stop.acceleration_max[axis], at_stop.jerk_max[axis], pieces.vertex[i, axis]
        was = max(abs(before[axis] - there) - rounding, 0.0)
        will = max(abs(point[axis] - there) - rounding, 0.0)
        early = max(early, (6.0 * was / j) ** (1.0 / 3.0), math.sqrt(2.0 * was / a))
        late = max(late, (6.0 * will / j) ** (1.0 / 3.0), math.sqrt(2.0 * will / a))
    return max(period - early - late, 0.0)
