"""From a look-ahead to a motion: pieces of constant jerk of every axis.

Every piece is anchored at a joint k between the legs k-1 and k with the directions u1 and u2; its position is

    P_k + c1(t) u1 + c2(t) u2,      c1, c2 cubics in t: position, velocity, acceleration, jerk at the piece's start.

On leg k only c2 moves, in the seven phases of two ramps and the cruise between them. In the corner at joint k (corners/kinematic.py)

    zero entry acceleration    c1'' = -V h(t),  c2'' = V h(t),   h = the trapezoid of T1, T2 (docs/papers.md 0);
    entry deceleration         c1''' = c2''' = A/Tc,

and c1 + c2 is the distance from the vertex along the program at which the corner is matched with it (corners/blend.py): pieces are
cut where that passes the end of a block, in a corner's middle and inside long legs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.geometry.chords import arc_point
from planner.geometry.legs import Legs as PathLegs
from planner.geometry.toolpath import Toolpath
from planner.lookahead.arc_pieces import spline_at_rest
from planner.lookahead.look_ahead import Legs, Passage
from planner.lookahead.ramps import ENTRY, ZERO, corner_at, leg_end, leg_top, phase_times_of

# A piece on an arc turns by at most so much [rad]: the spline then misses the arc by (5/384) 0.01^4 = 1e-10 of the radius.
ARC_PIECE = 0.01
# Each of the seven phases on an arc has at least so many pieces, and so many more that the spline's acceleration is good to this share
# of the limit, kappa v^2 for the largest speed v: its error is h^2/12 times 4 kappa v J where the jerk J along the arc sets in, and
# 2 kappa a^2 where the acceleration is constant.
ARC_PARTS, ARC_ACCURACY = 16, 1e-4
# Shortest piece of all [s]: at 1000 mm/s it is 1e-13 mm long.
SHORTEST = 1e-16
# Shortest piece on an arc [s]: the rounding of a radius of 10 mm, over its third power, is 1 mm/s3 of jerk.
ARC_SHORTEST = 2e-5
BISECTIONS = 50  # of a piece's duration, for where it passes the end of a block


class Pieces(NamedTuple):
    """L pieces of constant jerk.

    joint    : (L,) the joint k that the piece is anchored at
    leg      : (L,) the leg it belongs to
    segment  : (L,) the toolpath's segment
    duration : (L,) [s], > 0
    before   : (L, 4) c1 and its derivatives at the start
    after    : (L, 4) c2
    """

    joint: Array
    leg: Array
    segment: Array
    duration: FloatArray
    before: FloatArray
    after: FloatArray


def pieces_of(passage: Passage, legs: Legs, path: PathLegs, dwell: FloatArray, turning: FloatArray) -> Pieces:
    """The motion of a look-ahead.

    path    : the same legs with their segments
    dwell   : (n+1,) standstill at each joint [s]
    turning : (n,) turning of legs that are arcs [rad/mm], 0 on straight ones
    """
    chosen = (passage.kind, passage.V, passage.p, passage.q)
    limits = (legs.length, legs.v, legs.a, legs.j)
    rows = _empty(0)
    rows = _empty(_emit(*chosen, *limits, dwell, turning, *rows))
    _emit(*chosen, *limits, dwell, turning, *rows)
    cut = _empty(len(rows[0]) + len(path.offset))
    segment = np.zeros(len(cut[0]), np.int64)
    count = _cut(*rows, legs.length, path.first, path.offset, *cut, segment)
    joint, leg, duration, before, after = (column[:count] for column in cut)
    return Pieces(joint, leg, segment[:count], duration, before, after)


def along_axes(
    pieces: Pieces, path: PathLegs, toolpath: Toolpath
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration and jerk (L, A) of the axes at the start of every piece."""
    vertex = np.vstack([path.table["start"], toolpath.end[-1:]])
    direction = path.table["direction"]
    u1, u2 = direction[np.maximum(pieces.joint - 1, 0)], direction[np.minimum(pieces.joint, len(path) - 1)]
    position, velocity, acceleration, jerk = (
        pieces.before[:, c, None] * u1 + pieces.after[:, c, None] * u2 for c in range(4)
    )
    position += vertex[pieces.joint]
    arc = (toolpath.arc[pieces.segment] >= 0) & (pieces.after[:, 1:] != 0.0).any(axis=1)  # not at standstill
    for values, along in zip(
        (position, velocity, acceleration, jerk),
        _along_arcs(pieces, np.flatnonzero(arc), toolpath),
        strict=True,
    ):
        values[arc] = along
    return position, velocity, acceleration, jerk


def _along_arcs(pieces: Pieces, move: Array, toolpath: Toolpath) -> tuple[FloatArray, ...]:
    """The same of the pieces `move`, which lie on arcs from rest to rest."""
    leg, segment = pieces.leg[move], pieces.segment[move]
    ends = np.append(leg[1:] != leg[:-1], True)[: len(move)]
    at = np.arange(len(move)) + np.cumsum(ends) - ends  # with room for the end point of every arc
    # relative to the arc's centre, so that the rounding is that of the radius and not of the coordinates
    points = np.empty((len(move) + int(ends.sum()), len(toolpath.axes)))
    points[at] = arc_point(toolpath, segment, pieces.after[move, 0])
    points[at[ends] + 1] = arc_point(toolpath, segment[ends], toolpath.length[segment[ends]])
    last = np.ones(len(points), bool)
    last[at] = False
    position = points[at] + toolpath.arcs.center[toolpath.arc[segment]]
    return position, *spline_at_rest(pieces.duration[move], points, last)


def _empty(rows: int) -> tuple[Array, Array, FloatArray, FloatArray, FloatArray]:
    return (
        np.zeros(rows, np.int64),
        np.zeros(rows, np.int64),
        np.zeros(rows),
        np.zeros((rows, 4)),
        np.zeros((rows, 4)),
    )


@njit(cache=True, error_model="numpy")
def _advance(state, t):
    """Move a cubic (4,) on by t, in place; its jerk stays."""
    state[0] += t * (state[1] + t * (0.5 * state[2] + t * state[3] / 6.0))
    state[1] += t * (state[2] + 0.5 * t * state[3])
    state[2] += t * state[3]


@njit(cache=True, error_model="numpy")
def _clear(one, two):
    for c in range(4):
        one[c] = two[c] = 0.0


@njit(cache=True, error_model="numpy")
def _put(n, t, k, leg, one, two, joint, legs, duration, before, after):
    """Write a piece unless it is shorter than `SHORTEST`, advance its cubics, return the next row."""
    if t > SHORTEST and n < len(duration):
        joint[n], legs[n], duration[n] = k, leg, t
        for c in range(4):
            before[n, c], after[n, c] = one[c], two[c]
    _advance(one, t)
    _advance(two, t)
    return n + (t > SHORTEST)


@njit(cache=True, error_model="numpy")
def _emit(kind, V, p, q, length, v, a, j, dwell, turning, joint, legs, duration, before, after):
    """Write all pieces into the columns, as far as they have room; returns how many there are."""
    n, count = 0, len(length)
    one, two = np.zeros(4), np.zeros(4)
    phase, jerk = np.zeros(7), np.zeros(7)
    for k in range(count + 1):
        A, reach, lasting = corner_at(kind[k], V[k], p[k], q[k])
        _clear(one, two)
        if lasting > 0.0 and kind[k] == ZERO:
            T1, T2 = phase_times_of(V[k], p[k], q[k])
            one[0], one[1] = -reach, V[k]
            bend = V[k] / (T1 * T2)
            for part in range(4):  # jerk +, half of the plateau; half of the plateau, jerk -
                two[3] = bend if part == 0 else (-bend if part == 3 else 0.0)
                one[3] = -two[3]
                time = T2 if part in (0, 3) else 0.5 * (T1 - T2)
                n = _put(n, time, k, k - 1 + part // 2, one, two, joint, legs, duration, before, after)
        elif lasting > 0.0 and kind[k] == ENTRY:
            one[0], one[1], one[2], one[3], two[3] = -reach, V[k], -A, A / lasting, A / lasting
            for half in range(2):
                n = _put(n, 0.5 * lasting, k, k - 1 + half, one, two, joint, legs, duration, before, after)
        _clear(one, two)
        n = _put(n, dwell[k], k, max(k - 1, 0), one, two, joint, legs, duration, before, after)
        if k == count:
            break
        _phases(kind, V, p, q, k, length[k], v[k], a[k], j[k], phase, jerk)
        two[0], two[1], two[2] = reach, V[k], A
        if turning[k] > 0.0:
            n = _emit_arc(n, k, turning[k], v[k], phase, jerk, one, two, joint, legs, duration, before, after)
        else:
            for f in range(7):
                two[3] = jerk[f]
                n = _put(n, phase[f], k, k, one, two, joint, legs, duration, before, after)
    return n


@njit(cache=True, error_model="numpy")
def _emit_arc(n, k, turning, v, phase, jerk, one, two, joint, legs, duration, before, after):
    """The phases on an arc in pieces that turn little; phases shorter than `ARC_SHORTEST` join their neighbour."""
    pending, began = 0.0, two[0]
    for f in range(7):
        two[3] = jerk[f]
        if phase[f] < ARC_SHORTEST:
            _advance(two, phase[f])
            pending += phase[f]
            continue
        moved = phase[f] * (two[1] + phase[f] * (0.5 * two[2] + phase[f] * two[3] / 6.0))
        accuracy = max(np.sqrt(abs(jerk[f]) / (3.0 * v)), abs(two[2]) / (2.45 * v)) / np.sqrt(ARC_ACCURACY)
        parts = max(ARC_PARTS, 1 + int(max(turning * moved / ARC_PIECE, phase[f] * accuracy)))
        parts = min(parts, int(phase[f] / ARC_SHORTEST))
        for _ in range(parts):
            n = _put(n, phase[f] / parts, k, k, one, two, joint, legs, duration, before, after)
            if pending > 0.0 and n <= len(duration):
                duration[n - 1] += pending
                after[n - 1, 0] = began
            pending = 0.0
        began = two[0]
    if n <= len(duration):
        duration[n - 1] += pending
    return n


@njit(cache=True, error_model="numpy")
def _phases(kind, V, p, q, k, length, v, a, j, phase, jerk):
    """Durations and jerks (7,) on leg k: two ramps with the cruise between them."""
    one, other = leg_end(kind[k], V[k], p[k], q[k], j), leg_end(kind[k + 1], V[k + 1], p[k + 1], q[k + 1], j)
    A1, A2 = corner_at(kind[k], V[k], p[k], q[k])[0], corner_at(kind[k + 1], V[k + 1], p[k + 1], q[k + 1])[0]
    W, first, second, rest = leg_top(one, other, length, v, a, j)
    for side in range(2):
        x = first if side == 0 else second
        A = A1 if side == 0 else A2
        peak = min(a, np.sqrt(j * x))
        held = x / a - a / j if x > a * a / j else 0.0
        for part in range(3):
            f = part if side == 0 else 6 - part
            phase[f] = ((peak - A) / j, held, peak / j)[part]
            jerk[f] = (j, 0.0, -j)[part]
    phase[3], jerk[3] = (rest / W if rest > 0.0 else 0.0), 0.0


@njit(cache=True, error_model="numpy")
def _cut(
    joint, legs, duration, before, after, length, first, offset,
    out_joint, out_legs, out_duration, out_before, out_after, segment,
):  # fmt: skip
    """Cut pieces where they pass the end of a segment inside their leg; returns the number of pieces."""
    n, m = 0, 0
    one, two = np.zeros(4), np.zeros(4)
    for i in range(len(duration)):
        leg, left = legs[i], duration[i]
        origin = length[leg] if joint[i] == leg + 1 else 0.0
        for c in range(4):
            one[c], two[c] = before[i, c], after[i, c]
        m = max(m, first[leg])
        while m + 1 < first[leg + 1]:
            border = offset[m + 1] - origin
            if _along(one, two, left) <= border:
                break
            low, high = 0.0, left
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                if _along(one, two, middle) <= border:
                    low = middle
                else:
                    high = middle
            if _along(one, two, 0.0) <= border:
                rows = n
                n = _put(
                    n, low, joint[i], leg, one, two, out_joint, out_legs, out_duration, out_before, out_after
                )
                if n > rows:
                    segment[rows] = m
                    left -= low
            m += 1
        rows = n
        n = _put(n, left, joint[i], leg, one, two, out_joint, out_legs, out_duration, out_before, out_after)
        if n > rows:
            segment[rows] = m
    return n


@njit(cache=True, error_model="numpy")
def _along(one, two, t):
    """c1 + c2 after t: the distance from the joint along the program."""
    x, v = one[0] + two[0], one[1] + two[1]
    a, j = one[2] + two[2], one[3] + two[3]
    return x + t * (v + t * (0.5 * a + t * j / 6.0))
