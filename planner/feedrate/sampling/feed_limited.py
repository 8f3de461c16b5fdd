"""Where nothing happens along a path: a motion keeps the feed, or tracks what the curve allows.

A grid for jerk-limited motions needs intervals of a fraction of a/j where the acceleration switches; a
machine whose a/j is a thousandth of the time that its motions last would fill the memory with them. Two
bounds say where they are not needed:

* An acceleration that switches over an interval of h seconds instead of at once costs a h^2/(8 v) seconds.
  With h = 0.03 v/a that is 1e-4 of v/a, the time between two such switches.
* A curve is feed-limited where the programmed feed F is the smallest bound, and leaves half of the axes'
  accelerations and jerks free:

      F <= v_k,    |r''_k| F^2 <= a_k/2,    |r'''_k| F^3 <= j_k/2        for all axes k.

  A time-optimal motion runs there at F, but where it still comes from, or already prepares for, something
  else. Half of acceleration and jerk change the speed by F within 2 F/a + a/j [s], so within `quiet_way` of
  it; beyond, intervals grow with the distance.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.corners.elements import ElementTable, element_point, to_arc_length
from planner.corners.smooth import SmoothPath
from planner.geometry.toolpath import Joint

SWITCHING_WAY = 0.03  # h above [v/a]
FREE_FRACTION = 0.5  # of accelerations and jerks, on feed-limited curves [-]
# Of intervals by their distance from what is not feed-limited [-]: as on straight elements (grid.py).
GROWTH = 0.25
PLACES = 9  # on every curve, at which it is looked at


class FeedLimited(NamedTuple):
    """busy (B, 2) ascending ranges of the path that are not feed-limited, counted along the legs [mm]; feed_sq
    (R+S,) a lower bound of feed^2 that each leg's and span's curvature leaves, inf where it is straight."""

    busy: FloatArray
    feed_sq: FloatArray


def feed_limited(
    path: SmoothPath, table: ElementTable, limits: tuple[FloatArray, FloatArray, FloatArray]
) -> FeedLimited:
    """Where the path is feed-limited (module text).

    table  : of the path's elements
    limits : velocity [mm/s], acceleration [mm/s2] and jerk [mm/s3] of the axes, (A,) each
    """
    velocity, acceleration, jerk = limits
    legs, spans = path.legs, table.spans
    bend, twist = _turning(*table, acceleration, jerk)
    feed, place, passed = path.toolpath.feed, legs.place, path.passed
    of_leg = np.maximum.reduceat(feed, legs.first[:-1])
    ends = np.stack([spans["begin"], spans["begin"] + spans["width"]])
    of_span = feed[np.clip(np.searchsorted(passed, ends, side="right") - 1, 0, len(feed) - 1)].max(axis=0)
    F = np.concatenate([of_leg, of_span])
    with np.errstate(invalid="ignore"):  # rapids: inf times 0
        lively = (velocity.min() < F) | (bend * F**2 > FREE_FRACTION) | (twist * F**3 > FREE_FRACTION)
    with np.errstate(divide="ignore"):
        feed_sq = np.minimum(1.0 / bend, twist ** (-2.0 / 3.0))
    joint = place[legs.first]
    changes = passed[1:-1][feed[1:] != feed[:-1]]
    leg, span = lively[: len(legs)] & ~_replaced(path), spans[lively[len(legs) :]]
    alone = ~_inside(path)
    ranges = [
        np.stack([joint - path.d_in, joint + path.d_out], axis=1)[alone & (path.joint == Joint.CORNER)],
        np.stack([joint, joint], axis=1)[alone],
        np.stack([changes, changes], axis=1),
        np.stack([joint[:-1], joint[1:]], axis=1)[leg],
        np.stack([span["begin"], span["begin"] + span["width"]], axis=1),
    ]
    return FeedLimited(busy=_merged(np.concatenate(ranges)), feed_sq=feed_sq)


def quiet_way(feed: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> FloatArray:
    """(M,) how far from other ranges a motion at `feed` (M,) [mm/s] may change its speed [mm] (module text).

    acceleration, jerk : (A,) limits of the axes [mm/s2], [mm/s3]
    """
    slowest = float((1.0 / acceleration).max())
    return np.asarray(feed * (2.0 * feed * slowest + float((acceleration / jerk).max())))


@njit(cache=True, error_model="numpy", nogil=True)
def _turning(legs, corners, spans, acceleration, jerk):
    """max_k |r''_k|/a_k (R+S,) [s2/mm2] and max_k |r'''_k|/j_k [s3/mm3] of all legs and spans."""
    elements = len(legs) + len(spans)
    bend, twist = np.zeros(elements), np.zeros(elements)
    axes = len(acceleration)
    work, out = np.empty((2, 4, axes)), np.empty((4, axes))
    for e in range(elements):
        reach = legs[e].length if e < len(legs) else 1.0
        if e < len(legs) and not legs[e].round:
            continue
        for p in range(PLACES):
            element_point(legs, corners, spans, e, reach * p / (PLACES - 1.0), 0.5 * reach, work, out)
            to_arc_length(out)
            for k in range(axes):
                bend[e] = max(bend[e], abs(out[2, k]) / acceleration[k])
                twist[e] = max(twist[e], abs(out[3, k]) / jerk[k])
    return bend, twist


def _inside(path: SmoothPath) -> Array:
    """(R+1,) True for joints that a run of the spline replaces."""
    covered = np.zeros(len(path.d) + 1, dtype=np.int64)
    np.add.at(covered, path.spline.joint_first, 1)
    np.add.at(covered, path.spline.joint_last + 1, -1)
    return np.asarray(np.cumsum(covered)[:-1] > 0)


def _replaced(path: SmoothPath) -> Array:
    """(R,) True for legs of which a run leaves nothing."""
    return np.asarray(path.legs.length - path.d_out[:-1] - path.d_in[1:] <= 0.0)


def _merged(ranges: FloatArray) -> FloatArray:
    """Ascending ranges (B, 2) without overlaps."""
    order = ranges[np.argsort(ranges[:, 0], kind="stable")]
    end = np.maximum.accumulate(order[:, 1])
    fresh = np.concatenate([[True], order[1:, 0] > end[:-1]])
    last = np.append(np.flatnonzero(fresh)[1:] - 1, len(order) - 1)
    return np.stack([order[fresh, 0], end[last]], axis=1)


@njit(cache=True, error_model="numpy")
def interval_ends(start, left, right, base, most, quiet, busy):
    """Ends (n+1,) of the intervals of a row from `left` to `right`: of `base` at most, longer ones, up to
    `most`, where the path is feed-limited and `quiet` away from what is not.

    start                     : place that left and right are counted from [mm]
    left, right, base, most   : [mm]
    quiet                     : `quiet_way` [mm]
    busy                      : (B, 2) ranges that are not feed-limited [mm]
    """
    middle = start + 0.5 * (left + right)
    gap = np.searchsorted(busy[:, 0], middle, side="right") - 1
    since = busy[gap, 1] if gap >= 0 else -np.inf
    until = busy[gap + 1, 0] if gap + 1 < len(busy) else np.inf
    calm_here = since <= middle
    since, until = since - start, until - start
    if not calm_here or not GROWTH * (0.5 * (until - since) - quiet) > base:
        count = max(int(np.ceil(max((right - left) / min(base, most), 1.0))), 1)
        ends = np.empty(count + 1)
        for i in range(count):
            ends[i] = left + (right - left) * i / count
        ends[count] = right
        return ends
    ends = np.empty(0)
    for sweep in range(2):
        u, n = left, 0
        while u < right:
            away = min(GROWTH * (u - since - quiet), GROWTH / (1.0 + GROWTH) * (until - u - quiet))
            step = min(max(base, away), most)
            if sweep == 1:
                ends[n] = u
            n += 1
            u = right if right - u <= 1.5 * step else u + step
        if sweep == 0:
            ends = np.empty(n + 1)
    ends[-1] = right
    return ends
