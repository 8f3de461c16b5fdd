"""The smooth path cut into rows of one element and one block each, which the grid then divides.

In the order of the path: the free part of a leg, then the corner behind it in two halves, or the run of spans
that begins there. Free parts and corners are cut at all ends of blocks, spans where the motion passes changes
of the feed. Where a piece ends there is a closing row.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.corners.blend import corner_point, shape_at
from planner.feedrate.sampling.feed_limited import SWITCHING_WAY, interval_ends
from planner.geometry.legs import leg_point

# Arcs start with intervals of at most this angle [rad], so that no full turn hides between two equal points.
ARC_STEP = np.pi / 8
# ... and with so many at least, so that a short arc between two stops can start and stop.
ARC_INTERVALS_MIN = 4
# Free parts of legs shorter than this fraction of the leg are rounding: others are at least CLOSE [-].
FREE_PART_MIN = 1e-9

# curve, w0, w1: element and its parameters; segment: of the toolpath; begin, end: place along the legs from
# the start of the job [mm]; last: a closing row
ROW = np.dtype(
    [
        ("curve", np.int64),
        ("segment", np.int64),
        ("w0", np.float64),
        ("w1", np.float64),
        ("begin", np.float64),
        ("end", np.float64),
        ("last", np.bool_),
    ]
)


class PathLimits(NamedTuple):
    """The bounds along the path: programmed feed of each segment, and limits of each axis; inf for none."""

    feed: FloatArray  # (M,) [mm/s]
    velocity: FloatArray  # (A,) [mm/s]
    acceleration: FloatArray  # (A,) [mm/s2]
    jerk: FloatArray  # (A,) [mm/s3]


class Joints(NamedTuple):
    """The path at its R+1 joints between legs, and where its M segments are."""

    first: Array  # (R+1,) the first segment of each leg, then M (geometry/legs.py)
    place: FloatArray  # (M+1,) where each segment starts, counted along the legs [mm]
    passed: FloatArray  # (M+1,) where the path passes that start; the same but on spans (geometry/spline_joints.py) [mm]
    d_in: FloatArray  # (R+1,) what its corner or run takes from the leg before [mm]
    d_out: FloatArray  # (R+1,) and from the leg after [mm]
    blended: Array  # (R+1,) True where there is a corner
    is_stop: Array  # (R+1,) True at full stops
    breaks: (
        FloatArray  # (R+1, B) parameters where a corner starts with a grid point, ascending, padded with 1
    )
    run: Array  # (R+1,) run of spans that begins before each joint, or -1
    run_first: Array  # (Q+1,) its first span


class Longest(NamedTuple):
    """How long the intervals on curves may be (feedrate/sampling/feed_limited.py)."""

    duration: float  # at the fastest feed [s]; inf for second-order solvers, where the rest is not looked at
    busy: FloatArray  # (B, 2) ranges of the path that are not feed-limited [mm]
    feed_sq: FloatArray  # (R+S,) bound of feed^2 by the curvature of each leg and span [mm2/s2]
    quiet: FloatArray  # (M,) `quiet_way` at each segment's feed [mm]


@njit(cache=True, error_model="numpy")
def grown(rows, needed):
    """`rows`, or a copy at least twice as long if there is no room in it for `needed` rows."""
    if needed <= len(rows):
        return rows
    out = np.empty(max(2 * len(rows), needed), rows.dtype)
    for i in range(len(rows)):  # a slice assignment costs 4 s of compilation for its error message
        out[i] = rows[i]
    return out


@njit(cache=True, error_model="numpy")
def set_row(row, curve, segment, w0, w1, begin, end, last):
    """Fill a record `ROW` in place."""
    row.curve, row.segment = curve, segment
    row.w0, row.w1, row.begin, row.end, row.last = w0, w1, begin, end, last


@njit(cache=True, error_model="numpy")
def _corner_parameter(corners, k, z):
    """w of corner k whose matched point lies z [mm] after the vertex, Y(w) - X(w) = z (corners/blend.py)."""
    wa, wb = 0.0, 1.0
    for _ in range(60):
        w = 0.5 * (wa + wb)
        X, Y = shape_at(corners[k], w, w)
        if Y[0] - X[0] < z:
            wa = w
        else:
            wb = w
    return 0.5 * (wa + wb)


@njit(cache=True, error_model="numpy")
def _corner_passes(legs, corners, k, leg, x, z, changes):
    """w of corner k where it passes the place x [mm] on a leg, z after the vertex: its matched point, or,
    where the feed changes there, the nearest one to rounding, from which on the next feed holds."""
    if not changes:
        return _corner_parameter(corners, k, z) if z != 0.0 else 0.5
    axes = len(legs[leg].start)
    place, out, one, other = (
        np.empty((4, axes)),
        np.empty((4, axes)),
        np.empty((4, axes)),
        np.empty((4, axes)),
    )
    leg_point(legs, leg, x, place)
    wa, wb = 0.0, 1.0
    for _ in range(60):
        w = 0.5 * (wa + wb)
        corner_point(legs, corners, k, w, w, one, other, out)
        away = 0.0
        for a in range(axes):
            away += (out[0, a] - place[0, a]) * out[1, a]
        if away < 0.0:
            wa = w
        else:
            wb = w
    return 0.5 * (wa + wb)


@njit(cache=True, error_model="numpy")
def _arc_feed(leg, feed, limits):
    """A bound of the feed on an arc: programmed, what all axes reach together, and what they can turn
    with."""
    v_sq, a_sq = 0.0, 0.0
    for k in range(len(limits.velocity)):
        v_sq += limits.velocity[k] * limits.velocity[k]
        a_sq += limits.acceleration[k] * limits.acceleration[k]
    return min(feed, np.sqrt(v_sq), np.sqrt(np.sqrt(a_sq) / (leg.radius * leg.rate * leg.rate)))


@njit(cache=True, error_model="numpy")
def _cut_leg(rows, n, leg, seg, start, ends):
    """Rows of the free part of a leg that starts at the place `start`, cut at `ends` on it; returns the rows
    and their number."""
    rows = grown(rows, n + len(ends) - 1)
    for i in range(len(ends) - 1):
        left, right = ends[i], ends[i + 1]
        set_row(rows[n], leg, seg, left, right, start + left, start + right, False)
        n += 1
    return rows, n


@njit(cache=True, error_model="numpy")
def _cut_corner(rows, n, corners, k, seg, between, vertex, breaks):
    """Rows of corner k, vertex at `vertex` [mm], between (wa, wb), cut at its breaks; returns the rows and
    their number."""
    wa, wb = between
    rows = grown(rows, n + len(breaks) + 1)
    cut = 0
    left = wa
    while left < wb:
        while cut < len(breaks) and breaks[cut] <= left:
            cut += 1
        right = min(wb, breaks[cut]) if cut < len(breaks) else wb
        X, Y = shape_at(corners[k], left, left)
        begin = vertex + Y[0] - X[0]
        X, Y = shape_at(corners[k], right, right)
        set_row(rows[n], ~k, seg, left, right, begin, vertex + Y[0] - X[0], False)
        n += 1
        left = right
    return rows, n


@njit(cache=True, error_model="numpy")
def _base(longest, feed, feed_sq, acceleration):
    """Longest interval on a curve [mm] that switches of the acceleration allow (feedrate/sampling/feed_limited.py):
    `longest` [s] at the fastest feed, or by the time to change the speed where feed^2 is at least `feed_sq`
    by its curvature."""
    return max(longest * feed, SWITCHING_WAY * min(feed * feed, feed_sq) / acceleration)


class _Pace(NamedTuple):
    """The limits as `_cut_span` needs them."""

    feed: FloatArray  # (M,) programmed [mm/s]
    changes: Array  # segments at whose start it changes, ascending
    speed: float  # of all axes together [mm/s]
    acceleration: float  # of all axes together [mm/s2]


@njit(cache=True, error_model="numpy")
def _pace(limits):
    """The limits that `_cut_span` needs."""
    speed_sq, acceleration_sq = 0.0, 0.0
    for k in range(len(limits.velocity)):
        speed_sq += limits.velocity[k] * limits.velocity[k]
        acceleration_sq += limits.acceleration[k] * limits.acceleration[k]
    changes = np.flatnonzero(limits.feed[1:] != limits.feed[:-1]) + 1
    return _Pace(limits.feed, changes, np.sqrt(speed_sq), np.sqrt(acceleration_sq))


@njit(cache=True, error_model="numpy")
def _cut_span(rows, n, span, curve, seg, passed, limits, longest):
    """Rows of the span that is element `curve` and begins in segment `seg`, cut where the feed changes; returns
    the rows, their number and the segment in which the span ends."""
    feed, changes = limits.feed, limits.changes
    begin, end = span.begin, span.begin + span.width
    least = FREE_PART_MIN * span.width
    c = last_not_after(changes, seg, 0, len(changes) - 1) if len(changes) else 0
    left = begin
    while left < end:
        while c < len(changes) and passed[changes[c]] <= left + least:
            c += 1
        right = passed[changes[c]] if c < len(changes) and passed[changes[c]] < end - least else end
        while seg + 1 < len(feed) and passed[seg + 1] <= 0.5 * (left + right):
            seg += 1
        fastest = min(feed[seg], limits.speed)
        base = _base(longest.duration, fastest, longest.feed_sq[curve], limits.acceleration)
        ends = interval_ends(0.0, left, right, base, np.inf, longest.quiet[seg], longest.busy)
        rows = grown(rows, n + len(ends) - 1)
        for i in range(len(ends) - 1):
            a, b = ends[i], ends[i + 1]
            w0 = 0.0 if a == begin else (a - begin) / span.width
            w1 = 1.0 if b == end else (b - begin) / span.width
            set_row(rows[n], curve, seg, w0, w1, a, b, False)
            n += 1
        left = right
    while seg + 1 < len(feed) and passed[seg + 1] <= end:
        seg += 1
    return rows, n, seg


@njit(cache=True, error_model="numpy")
def cut_path(table, joints, limits, longest):
    """Rows (n,) `ROW` of the whole path in order (module text).

    table, joints, limits, longest : `ElementTable` (corners/elements.py), `Joints`, `PathLimits`, `Longest`
    """
    legs, corners, spans = table
    rows = np.empty(8 * len(legs) + 4 * len(spans) + 64, ROW)
    n = 0
    first, place, feed, pace = joints.first, joints.place, limits.feed, _pace(limits)
    for leg in range(len(legs)):
        length = legs[leg].length
        start = place[first[leg]]
        k = leg + 1
        d_in, d_out = joints.d_in[k], joints.d_out[k]
        if length - joints.d_out[leg] - d_in > FREE_PART_MIN * length:
            for seg in range(first[leg], first[k]):
                end = place[seg + 1] - start if seg + 1 < first[k] else length
                wa, wb = max(place[seg] - start, joints.d_out[leg]), min(end, length - d_in)
                if wb - wa <= FREE_PART_MIN * length:
                    continue
                ends = np.array([wa, wb])
                if legs[leg].round:
                    fastest = _arc_feed(legs[leg], feed[seg], limits)
                    base = _base(longest.duration, fastest, longest.feed_sq[leg], pace.acceleration)
                    most = min(ARC_STEP / abs(legs[leg].rate), (wb - wa) / ARC_INTERVALS_MIN)
                    ends = interval_ends(start, wa, wb, base, most, longest.quiet[seg], longest.busy)
                rows, n = _cut_leg(rows, n, leg, seg, start, ends)
        run = joints.run[k]
        if run >= 0:
            seg = first[leg]
            for i in range(joints.run_first[run], joints.run_first[run + 1]):
                rows, n, seg = _cut_span(rows, n, spans[i], len(legs) + i, seg, joints.passed, pace, longest)
        elif joints.blended[k]:
            vertex, breaks, wa = start + length, joints.breaks[k], 0.0
            for seg in range(first[leg], first[k]):
                end = place[seg + 1] - start if seg + 1 < first[k] else length
                if end > length - d_in:
                    wb = _corner_passes(legs, corners, k, leg, end, end - length, feed[seg + 1] != feed[seg])
                    rows, n = _cut_corner(rows, n, corners, k, seg, (wa, wb), vertex, breaks)
                    wa = max(wa, wb)
            for seg in range(first[k], first[k + 1]):
                begin = place[seg] - place[first[k]]
                end = place[seg + 1] - place[first[k]] if seg + 1 < first[k + 1] else legs[k].length
                if begin >= d_out:
                    break
                wb = 1.0
                if end < d_out:
                    wb = _corner_passes(legs, corners, k, k, end, end, feed[seg + 1] != feed[seg])
                rows, n = _cut_corner(rows, n, corners, k, seg, (wa, wb), vertex, breaks)
                wa = max(wa, wb)
        if joints.is_stop[k]:
            rows = grown(rows, n + 1)
            before = rows[n - 1]
            end = place[first[k]]
            set_row(rows[n], before.curve, before.segment, before.w1, before.w1, end, end, True)
            n += 1
    return rows[:n].copy()
