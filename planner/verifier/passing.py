"""What is known of where a motion passes the vertices (switches.py), and which of its chords cannot be the place.

On its way along a leg a motion comes nearer and nearer to the vertex at the end: every chord is a better place than all before.
One of them need not be looked at if a later one is better for sure, as long as no other vertex is within reach and none is settled
meanwhile: when that is taken in, nothing remains of those before (`switches._look`). Over a period h the motion is, from either
end with the speed v, the acceleration a and the jerk j on, no farther than

    r  =  h (v + h/2 (a + h/3 j))

from that end, and on the chord no farther than its length; so it is at least the distance of the nearer end less r from the vertex.
Costs rise with the distance, of which the bow of the chord is taken off beyond the tolerance.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.kernel import kernel
from planner.verifier.pieces import PLACE_ROUNDING
from planner.verifier.worst import ROUNDING_ULPS

# cost: least sum of squared distances up to this vertex, from the first open one on, inf before it is looked
# at [mm2]; place: where it is passed along the chords from the start [mm]; begin, end: from where the block
# after it may have begun, and to where the one before it may last; group: number of vertices
# passed together; chord: on which, of those kept
SWITCH = np.dtype(
    [(name, "f8") for name in ("cost", "place", "begin", "end")] + [("group", "i8"), ("chord", "i8")]
)
# first, count, offset: the vertices that were looked at, and where the marks of those that came nearer begin;
# begin: place of the chord's start [mm]; step, h, cut, error: its length [mm], duration, end of the cubic that it begins with
# (NaN where it is not known) [s], rounding [mm]
CHORD = np.dtype(
    [(name, "i8") for name in ("first", "count", "offset")]
    + [(name, "f8") for name in ("begin", "step", "h", "cut", "error")]
)
# In `state`: the first vertex not settled; first and behind the last of the chords kept; marks used; the last vertex that is
# passed; how many chords there may be before it is tried again to settle those that are passed.
OPEN, HEAD, TAIL, USED, PASSED, PATIENCE = range(6)
SURE, TRAVELLED, JUDGED = range(3)  # in `along`: the open vertex is not passed, length run, judged to [mm]
# Price of a full stop passed where the motion does not rest [budgets]: more than of all vertices around.
RUN_THROUGH = 1e3
# How much more a square counts beyond the tolerance of its vertex [-]: what rounding adds there is below other distances.
OUTSIDE = 1e3


class Bounds(NamedTuple):
    """velocity (A,), digits (A+1,) as in limits.py; norm of the largest accelerations, inf if not judged."""

    velocity: FloatArray
    digits: FloatArray
    acceleration: float


class Chords(NamedTuple):
    """Samples whose feed is still to be judged, the first one as the beginning of a chord; (n,) each."""

    t: FloatArray  # [s]
    place: FloatArray  # length of chords from the start [mm]
    error: FloatArray  # largest rounding error [mm]
    speed: FloatArray  # as delivered [mm/s], NaN where it was not
    piece: Array  # where each is, to be told
    first: Array  # the pieces it can be on (matching.py), and the last of them
    last: Array
    cut: FloatArray  # as `Between.cut` [s], NaN where nothing is known between
    state: FloatArray  # (n, D, A) position, and derivatives where `cut` is known


class Passing(NamedTuple):
    """Where a motion passes the vertices, as far as its samples tell."""

    switch: Array  # (N+1,) `SWITCH`
    state: Array  # (6,) as named above
    along: FloatArray  # (3,) likewise; its last number is for who judges, and what is judged stays
    work: FloatArray  # (A,) a place that is worked with
    # chords since the last vertex that was settled: `CHORD` (C,), position and derivatives at their ends (C, 2, 4, A), marks
    chord: Array
    ends: FloatArray
    mark: Array


AHEAD = 64  # chords at most that are looked ahead
# [mm] more than cubics that agree (between.py) and rounding differ by, in up to nine axes
SAME_PLACE = 8.0 * PLACE_ROUNDING


@kernel(inline=True)
def rounding_of(new, k, begin, bounds):
    """Largest rounding error of sample k, whose chord begins at the place `begin` [mm]."""
    error_sq, axes = 0.0, new.state.shape[2]
    h = new.t[k] - new.t[k - 1] if k else 0.0
    push = bounds.acceleration * h if math.isfinite(bounds.acceleration) else 0.0
    for axis in range(axes):
        move = abs(new.state[k, 0, axis] - new.state[k - 1, 0, axis]) if k else 0.0
        error = (
            ROUNDING_ULPS * 2.0**-52 * (abs(new.state[k, 0, axis]) + begin + bounds.velocity[axis] * new.t[k])
        )
        digits = bounds.digits[axis]
        if k and bounds.digits[axes] > 0.0:  # most times have all digits, and a division takes long
            digits += bounds.digits[axes] * (move / h + push)
        error += digits
        error_sq += error * error
    return math.sqrt(error_sq)


@kernel(inline=True)
def _distance(vertex, new, k):
    square = 0.0
    for axis in range(len(vertex)):
        square += (new.state[k, 0, axis] - vertex[axis]) ** 2
    return math.sqrt(square)


@kernel(inline=True)
def nearer_soon(pieces, found, new, k, bounds):
    """The first chord from that to sample k on that is to be looked at, of those that have the one open vertex within reach: those
    before are farther from it than a later chord (module text). -> it, and the chord at which to ask again"""
    switch, i = found.switch, found.state[OPEN]
    top, most, end = len(switch) - 2, min(len(new.t), k + AHEAD), k
    while end + 1 < most and min(new.last[end + 1] + 1, top) == i and new.first[end + 1] < i:
        end += 1
    vertex, joint = pieces.vertex[i], pieces.joint[i]
    apart, begin = _distance(vertex, new, k - 1), found.along[TRAVELLED]
    near = _distance(vertex, new, end)
    if not near < _distance(vertex, new, end - 1):
        return k, end + 1
    near += SAME_PLACE
    cost = near * near + OUTSIDE * max(near * near - joint["budget"] ** 2, 0.0)
    if joint["stop"]:
        cost += (RUN_THROUGH * joint["budget"]) ** 2
    look = k
    while look < end and cost < switch[i]["cost"]:
        h, before, way, runs = new.t[look] - new.t[look - 1], apart, 0.0, 0.0
        apart = _distance(vertex, new, look)
        for axis in range(len(vertex)):
            way += abs(new.state[look, 0, axis] - new.state[look - 1, 0, axis])
        begin += way
        if new.cut[look] >= 0.0:
            for side in range(2):
                run = 0.0
                for axis in range(len(vertex)):
                    more = abs(new.state[look - side, 2, axis]) + h / 3.0 * abs(
                        new.state[look - side, 3, axis]
                    )
                    run += h * (abs(new.state[look - side, 1, axis]) + h / 2.0 * more)
                runs = max(runs, run)
        least = min(before, apart) - max(way, runs) - bounds.acceleration * h * h / 8.0
        if not least > near:
            break
        if joint["stop"] and not least > rounding_of(new, look, begin, bounds) + PLACE_ROUNDING:
            break
        look += 1
    # the leg goes on: what comes is nearer
    return look, look if look > k and end + 1 == k + AHEAD else end + 1
