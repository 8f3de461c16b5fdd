"""The fewest straight moves and arcs, one after the other, that stay within a distance of a polyline.

Each move begins and ends at vertices of the polyline and is taken as long as it goes: its length is doubled
while it holds, then halved in. An arc is taken where it reaches further than a straight move. Both hold if they
and the part of the polyline that they replace can be run through side by side, never going back, and never
further apart than allowed.

A straight move: with t_k the range of places on it within the distance of vertex k, the places max(t_1, ..,
t_k) must be in t_k for all k, which is exact (Alt and Godau 1995).

An arc: its centre is on the bisector of its ends, where the squares of the errors at vertices and at midpoints
between them are least, and is rounded as it is written. Each vertex is compared with the point of the arc at
its own angle; the angles may not decrease. Between two of them, with errors e along the radius and w off the
plane, the chord is off by at most max(e) outwards, by the larger -e and the height of the arc over it inwards.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit

SWEEP_MAX = 1.5 * math.pi  # of an arc [rad]: the centre of a nearly full circle hangs on its short chord
STEP_MAX = 0.5 * math.pi  # of an arc between two vertices [rad]
RADIUS_MAX = 1e4  # [mm]: controls compare the radii at both ends, which rounding then changes
STRAIGHT = -1  # normal axis of a straight move
# (3, 3) the axes of the plane and its normal, by the normal: G19, G18, G17.
PLANES = np.array([[1, 2, 0], [2, 0, 1], [0, 1, 2]])


class Moves(NamedTuple):
    """M moves that replace a polyline."""

    end: Array  # (M,) the vertex where each ends, ascending
    normal: Array  # (M,) axis normal to the plane of an arc, `STRAIGHT` for straight moves
    center: FloatArray  # (M, 2) of arcs, from their start, in the axes of the plane [mm]
    sweep: FloatArray  # (M,) [rad], positive counter-clockwise


def fewest_moves(points: FloatArray, within: float, grid: float, *, arcs: bool) -> Moves:
    """Replace a polyline.

    points : (n+1, 3) its vertices, n > 0 [mm]
    within : how far the moves may be from it, and it from them [mm]
    grid   : the steps in which centres are written [mm]
    arcs   : whether arcs may be taken
    """
    moves = len(points) - 1
    end, normal = np.empty(moves, dtype=np.int64), np.empty(moves, dtype=np.int64)
    center, sweep = np.zeros((moves, 2)), np.zeros(moves)
    made = _fit(np.ascontiguousarray(points), within, grid, arcs, end, normal, center, sweep)
    return Moves(end[:made], normal[:made], center[:made], sweep[:made])


@njit(error_model="numpy")
def _fit(p, within, grid, arcs, end, normal, center, sweep):
    """Fill in the moves; returns how many there are."""
    made, at, last = 0, 0, len(p) - 1
    while at < last:
        reach, good, bad = at + 1, at + 1, last + 1
        step = 1
        while bad - good > 1:
            tried = min(good + step, last) if bad > last else (good + bad) // 2
            if _line_holds(p, at, tried, within):
                good, step = tried, 2 * step
            else:
                bad = tried
        reach = good
        end[made], normal[made] = reach, STRAIGHT
        for axis in range(3):
            if not arcs or reach >= last:
                break
            good, bad, step = reach, last + 1, 1
            while bad - good > 1:
                tried = min(good + step, last) if bad > last else (good + bad) // 2
                holds, u, v, turn = _arc_holds(p, at, tried, axis, within, grid)
                if not holds:
                    bad = tried
                    continue
                good, step = tried, 2 * step
                end[made], normal[made], reach = tried, axis, tried
                center[made, 0], center[made, 1], sweep[made] = u, v, turn
        at = reach
        made += 1
    return made


@njit(error_model="numpy")
def _line_holds(p, first, last, within):
    """Whether the straight move from vertex `first` to `last` holds."""
    dx, dy, dz = p[last, 0] - p[first, 0], p[last, 1] - p[first, 1], p[last, 2] - p[first, 2]
    size = dx * dx + dy * dy + dz * dz
    if size <= 0.0:
        return False
    place = 0.0
    for k in range(first + 1, last):
        x, y, z = p[k, 0] - p[first, 0], p[k, 1] - p[first, 1], p[k, 2] - p[first, 2]
        t = (x * dx + y * dy + z * dz) / size
        off = (x - t * dx) ** 2 + (y - t * dy) ** 2 + (z - t * dz) ** 2
        if off > within * within:
            return False
        half = math.sqrt((within * within - off) / size)
        place = max(place, t - half)
        if place > min(t + half, 1.0):
            return False
    return True


@njit(error_model="numpy")
def _arc_holds(p, first, last, axis, within, grid):
    """Whether an arc about an axis holds, its centre from its start, and how far it turns."""
    no = (False, 0.0, 0.0, 0.0)
    a, b, c = PLANES[axis, 0], PLANES[axis, 1], PLANES[axis, 2]
    u0, v0 = p[first, a], p[first, b]
    du, dv = p[last, a] - u0, p[last, b] - v0
    chord = math.sqrt(du * du + dv * dv)
    if chord <= within or last - first < 2:
        return no
    nu, nv = -dv / chord, du / chord
    top, bottom = 0.0, 0.0  # of the centre's place on the bisector
    for k in range(first, last):
        for half in range(2):
            u = (p[k, a] + half * 0.5 * (p[k + 1, a] - p[k, a])) - u0 - 0.5 * du
            v = (p[k, b] + half * 0.5 * (p[k + 1, b] - p[k, b])) - v0 - 0.5 * dv
            away = 2.0 * (u * nu + v * nv)
            top += away * (u * u + v * v - 0.25 * chord * chord)
            bottom += away * away
    if bottom <= 0.0:
        return no
    place = top / bottom
    cu = grid * np.round((0.5 * du + place * nu) / grid)
    cv = grid * np.round((0.5 * dv + place * nv) / grid)
    r0, r1 = math.hypot(cu, cv), math.hypot(du - cu, dv - cv)
    if max(r0, r1) > RADIUS_MAX or min(r0, r1) <= within:
        return no
    u, v = p[first + 1, a] - u0, p[first + 1, b] - v0
    side = 1.0 if -cu * (v - cv) + cv * (u - cu) > 0.0 else -1.0
    turn = _angle(cu, cv, du, dv, side)
    if turn > SWEEP_MAX or turn <= 0.0:
        return no
    before, e0, w0 = 0.0, 0.0, 0.0
    for k in range(first + 1, last + 1):
        u, v = p[k, a] - u0, p[k, b] - v0
        angle = turn if k == last else _angle(cu, cv, u, v, side)
        step = angle - before
        if step < 0.0 or step > STEP_MAX or angle > turn:
            return no
        share = angle / turn
        radius = r0 + (r1 - r0) * share
        e1 = 0.0 if k == last else math.hypot(u - cu, v - cv) - radius
        w1 = p[k, c] - p[first, c] - share * (p[last, c] - p[first, c])
        inwards = radius * (1.0 - math.cos(0.5 * step)) - min(e0, e1)
        off = max(max(e0, e1), inwards)
        across = max(abs(w0), abs(w1))
        if off * off + across * across > within * within:
            return no
        before, e0, w0 = angle, e1, w1
    return True, cu, cv, side * turn


@njit(error_model="numpy")
def _angle(cu, cv, u, v, side):
    """By how much the way from the start (0, 0) to a point turns about the centre, 0 to 2 pi, counter-clockwise
    for a `side` of 1."""
    su, sv, eu, ev = -cu, -cv, u - cu, v - cv
    angle = side * math.atan2(su * ev - sv * eu, su * eu + sv * ev)
    return angle if angle >= 0.0 else angle + 2.0 * math.pi
