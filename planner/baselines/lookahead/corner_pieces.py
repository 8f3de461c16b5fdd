"""From a look-ahead to a motion: pieces of constant jerk of every axis.

Every piece is anchored at a joint k between the legs k-1 and k with the directions u1 and u2; its position is

    P_k + c1(t) u1 + c2(t) u2,      c1, c2 cubics in t: position, velocity, acceleration, jerk at the piece's start.

On leg k only c2 moves, in seven phases. In the corner at joint k (corners/kinematic.py)

    zero entry acceleration    c1'' = -V h(t),  c2'' = V h(t),   h = the trapezoid of T1, T2 (docs/papers.md 0);
    entry deceleration         c1''' = c2''' = A/Tc,

and c1 + c2 is the distance from the vertex along the program at which the corner is matched with it
(corners/blend.py): pieces are cut where that passes the end of a block, in a corner's middle and inside long
legs.

Arcs from rest to rest are the twice continuously differentiable cubic spline in time. A move s(t) along an
arc is cut into pieces that turn little; the spline through their ends p_i, at rest at both ends of the arc,
has the accelerations M_i that solve (h_i the pieces' durations, d_i = (p_{i+1} - p_i)/h_i)

    h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}),
    2 h_0 M_0 + h_0 M_1 = 6 d_0,        h_{n-1} M_{n-1} + 2 h_{n-1} M_n = -6 d_{n-1}      at the two ends,

and on piece i starts with the velocity d_i - h_i (2 M_i + M_{i+1})/6 and has the jerk (M_{i+1} - M_i)/h_i.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.lookahead.ramps import (
    ENTRY,
    PHASES,
    ZERO,
    corner_at,
    leg_end,
    leg_phases,
    phase_times_of,
)
from planner.geometry.chords import arc_point
from planner.geometry.legs import Legs
from planner.geometry.toolpath import Toolpath

# A piece on an arc turns by at most so much [rad]: the spline misses it by (5/384) 0.01^4 = 1e-10 of the
# radius; by less where that is more than ARC_MISS [mm], a tenth of a program's least digit.
ARC_PIECE, ARC_MISS = 0.01, 1e-7
# Each of the seven phases on an arc has at least so many pieces, and so many more that the spline's
# acceleration is good to this fraction of the limit, kappa v^2 for the largest speed v: its error is h^2/12
# times 4 kappa v J where the jerk J along the arc sets in, and 2 kappa a^2 where the acceleration is
# constant.
ARC_PIECES_MIN, ARC_ACCURACY = 16, 1e-4
# Shortest piece of all [s]: at 1000 mm/s it is 1e-13 mm long.
SHORTEST = 1e-16
# Shortest piece on an arc [s]: the rounding of a radius of 10 mm, over its third power, is 1 mm/s3 of jerk.
ARC_SHORTEST = 2e-5
# Shortest time in which acceleration on an arc comes to its limit, in such pieces: a step leaves the arc.
ARC_RAMP = 5 * ARC_SHORTEST
BISECTIONS = 50  # of a piece's duration, for where it passes the end of a block


class CornerPieces(NamedTuple):
    """L pieces of constant jerk."""

    joint: Array  # (L,) the joint k that the piece is anchored at
    leg: Array  # (L,) the leg it belongs to
    duration: FloatArray  # (L,) [s], > 0
    before: FloatArray  # (L, 4) c1 and its derivatives at the start
    after: FloatArray  # (L, 4) c2
    segment: Array  # (L,) segment of the toolpath that it belongs to


def corner_pieces(ways: np.recarray, limits: np.recarray, path: Legs, dwell: FloatArray) -> CornerPieces:
    """The motion of a look-ahead over n legs, in pieces (module text).

    ways   : (n+1,) records `WAY`, what was chosen at the joints
    limits : (n,) records `LEG`
    path   : the same legs with their segments
    dwell  : (n+1,) standstill at each joint [s]
    """
    rows = _empty(_emit(ways, limits, dwell, _empty(0)))
    _emit(ways, limits, dwell, rows)
    cut = _empty(len(rows.leg) + len(path.offset))
    count = _cut(rows, limits.length, path.first, path.offset, cut)
    return CornerPieces(*(column[:count] for column in cut))


def along_axes(pieces: CornerPieces, path: Legs, toolpath: Toolpath) -> list[FloatArray]:
    """Position, velocity, acceleration and jerk (L, A) of the axes at the start of every piece."""
    vertex = np.vstack([path.vector("start"), toolpath.end[-1:]])
    direction = path.vector("direction")
    joint, before, after = pieces.joint, pieces.before, pieces.after
    u1, u2 = direction[np.maximum(joint - 1, 0)], direction[np.minimum(joint, len(path) - 1)]
    columns = [before[:, c, None] * u1 + after[:, c, None] * u2 for c in range(4)]
    columns[0] += vertex[joint]
    arc = (toolpath.arc[pieces.segment] >= 0) & (after[:, 1:] != 0.0).any(axis=1)  # not at standstill
    if arc.any():
        for values, along in zip(columns, _along_arcs(pieces, np.flatnonzero(arc), toolpath), strict=True):
            values[arc] = along
    return columns


def _along_arcs(pieces: CornerPieces, move: Array, toolpath: Toolpath) -> tuple[FloatArray, ...]:
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
    return position, *_spline_at_rest(pieces.duration[move], points, last)


def _spline_at_rest(
    duration: FloatArray, position: FloatArray, last: Array
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Velocity, acceleration and jerk (n, A) at the starts of n pieces, of durations (n,) [s], on moves that begin and end at
    rest, through points `position` (n + moves, A) [mm], of which some are the `last` (n + moves,) of their move."""
    from scipy.linalg import solve_banded  # 0.2 s

    start = np.flatnonzero(~last)  # the points that a piece starts at
    h = np.zeros(len(position))
    h[start] = duration
    slope = np.zeros_like(position)
    slope[start] = (position[start + 1] - position[start]) / duration[:, None]
    before, slope_before = np.insert(h[:-1], 0, 0.0), np.insert(slope[:-1], 0, 0.0, axis=0)
    bands = np.zeros((3, len(position)))
    bands[1] = 2.0 * (before + h)
    bands[0, 1:] = bands[2, :-1] = h[:-1]  # 0 between moves, whose ends thus know nothing of each other
    M = solve_banded((1, 1), bands, 6.0 * (slope - slope_before))
    velocity = slope[start] - duration[:, None] * (2.0 * M[start] + M[start + 1]) / 6.0
    return velocity, M[start], (M[start + 1] - M[start]) / duration[:, None]


def _empty(count: int) -> CornerPieces:
    """Room for so many pieces."""
    joint, leg, segment = (np.zeros(count, np.int64) for _ in range(3))
    return CornerPieces(joint, leg, np.zeros(count), np.zeros((count, 4)), np.zeros((count, 4)), segment)


@njit(cache=True, error_model="numpy")
def _advance(state, t):
    """Move cubics (., 4) on by t, in place; their jerks stay."""
    for m in range(len(state)):
        state[m, 0] += t * (state[m, 1] + t * (0.5 * state[m, 2] + t * state[m, 3] / 6.0))
        state[m, 1] += t * (state[m, 2] + 0.5 * t * state[m, 3])
        state[m, 2] += t * state[m, 3]


@njit(cache=True, error_model="numpy")
def _put(n, t, k, leg, state, rows):
    """Write a piece unless it is shorter than `SHORTEST`, advance its cubics c1, c2 (2, 4), return the next
    row."""
    if t > SHORTEST and n < len(rows.duration):
        rows.joint[n], rows.leg[n], rows.duration[n] = k, leg, t
        for c in range(4):
            rows.before[n, c], rows.after[n, c] = state[0, c], state[1, c]
    _advance(state, t)
    return n + (t > SHORTEST)


@njit(cache=True, error_model="numpy")
def _emit(ways, legs, dwell, rows):
    """Write all pieces into the rows, as far as they have room; returns how many there are."""
    n, count = 0, len(legs)
    state, phases = np.zeros((2, 4)), np.zeros((2, PHASES))
    for k in range(count + 1):
        way = ways[k]
        A, reach, lasting = corner_at(way, way.V, True)
        state[:] = 0.0
        if lasting > 0.0 and way.kind == ZERO:
            T1, T2 = phase_times_of(way.V, way.p, way.q)
            state[0, 0], state[0, 1] = -reach, way.V
            bend = way.V / (T1 * T2)
            for phase in range(4):  # jerk +, half of the plateau; half of the plateau, jerk -
                state[1, 3] = bend if phase == 0 else (-bend if phase == 3 else 0.0)
                state[0, 3] = -state[1, 3]
                n = _put(n, T2 if phase in (0, 3) else 0.5 * (T1 - T2), k, k - 1 + phase // 2, state, rows)
        elif lasting > 0.0 and way.kind == ENTRY:
            state[0, 0], state[0, 1], state[0, 2] = -reach, way.V, -A
            state[0, 3] = state[1, 3] = A / lasting
            for half in range(2):
                n = _put(n, 0.5 * lasting, k, k - 1 + half, state, rows)
        state[:] = 0.0
        n = _put(n, dwell[k], k, max(k - 1, 0), state, rows)
        if k == count:
            break
        other = leg_end(ways[k + 1], ways[k + 1].V, legs[k].j, False)
        leg_phases(leg_end(way, way.V, legs[k].j, True), other, legs[k], phases)
        state[1, 0], state[1, 1], state[1, 2] = reach, way.V, A
        if legs[k].turning > 0.0:
            n = _emit_arc(n, k, legs[k], phases, state, rows)
        else:
            for f in range(PHASES):
                state[1, 3] = phases[1, f]
                n = _put(n, phases[0, f], k, k, state, rows)
    return n


@njit(cache=True, error_model="numpy")
def _emit_arc(n, k, leg, phases, state, rows):
    """The phases on an arc in pieces that turn little; phases shorter than `ARC_SHORTEST` join their
    neighbour."""
    two = state[1]
    pending, began = 0.0, two[0]
    turn = min(ARC_PIECE, (ARC_MISS * leg.turning * 384.0 / 5.0) ** 0.25)
    for f in range(PHASES):
        phase, jerk = phases[0, f], phases[1, f]
        two[3] = jerk
        if phase < ARC_SHORTEST:
            _advance(state, phase)
            pending += phase
            continue
        fastest = max(two[1], two[1] + phase * (two[2] + 0.5 * phase * jerk))
        accuracy = max(np.sqrt(abs(jerk) / (3.0 * leg.v)), abs(two[2]) / (2.45 * leg.v))
        accuracy /= np.sqrt(ARC_ACCURACY)
        pieces = max(ARC_PIECES_MIN, 1 + int(phase * max(leg.turning * fastest / turn, accuracy)))
        pieces = min(pieces, int(phase / ARC_SHORTEST))
        for _ in range(pieces):
            n = _put(n, phase / pieces, k, k, state, rows)
            if pending > 0.0 and n <= len(rows.duration):
                rows.duration[n - 1] += pending
                rows.after[n - 1, 0] = began
            pending = 0.0
        began = two[0]
    if n <= len(rows.duration):
        rows.duration[n - 1] += pending
    return n


@njit(cache=True, error_model="numpy")
def _cut(rows, length, first, offset, out):
    """Cut pieces where they pass the end of a segment inside their leg; returns the number of pieces."""
    n, m = 0, 0
    state = np.zeros((2, 4))
    for i in range(len(rows.duration)):
        leg, left = rows.leg[i], rows.duration[i]
        origin = length[leg] if rows.joint[i] == leg + 1 else 0.0
        for c in range(4):
            state[0, c], state[1, c] = rows.before[i, c], rows.after[i, c]
        m = max(m, first[leg])
        while m + 1 < first[leg + 1]:
            border = offset[m + 1] - origin
            if _along(state, left) <= border:
                break
            low, high = 0.0, left
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if _along(state, middle) <= border else (low, middle)
            if _along(state, 0.0) <= border:
                count = n
                n = _put(n, low, rows.joint[i], leg, state, out)
                if n > count:
                    out.segment[count] = m
                    left -= low
            m += 1
        count = n
        n = _put(n, left, rows.joint[i], leg, state, out)
        if n > count:
            out.segment[count] = m
    return n


@njit(cache=True, error_model="numpy")
def _along(state, t):
    """c1 + c2 after t: the distance from the joint along the program."""
    x, v = state[0, 0] + state[1, 0], state[0, 1] + state[1, 1]
    a, j = state[0, 2] + state[1, 2], state[0, 3] + state[1, 3]
    return x + t * (v + t * (0.5 * a + t * j / 6.0))
