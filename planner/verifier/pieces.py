"""The programmed path, laid out for the matching: pieces between vertices.

A line is one piece. An arc or helix p(x) = center + radius (cos(rate x) e1 + sin(rate x) e2) + drift x is cut into pieces of at
most `PIECE_ANGLE`, and the points between them are vertices like those of the program: the motion has to pass each of them
in order, so that a full circle cannot be left out although its ends coincide.

A curve is cut likewise (verifier/curves.py).

The nearest point of an arc piece solves g(x) = (p(x) - q) . p'(x) = 0. Without drift it lies at the polar angle of q; with
drift Newton's method starts there. With E1 = e1.drift, E2 = e2.drift, DD = drift.drift, w = q - center, c = cos, s = sin:

    g  = R r (s w1 - c w2) - w.drift + R (c E1 + s E2) + x (R r (c E2 - s E1) + DD)
    g' = R r^2 (c w1 + s w2) + 2 R r (c E2 - s E1) + DD - x R r^2 (c E1 + s E2)

The distance itself is taken from the vector p(x) - q, never from the expanded square, which loses half the digits; at the
nearest point an error of x enters it only squared.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Joint, Toolpath
from planner.verifier.curves import curve_counts, curve_points, reach_curve
from planner.verifier.kernel import kernel

PIECE_ANGLE = (
    np.pi / 8
)  # largest turning of an arc piece [rad]: one of its points is passed every 22.5 degrees
RATIO_ROUNDING = (
    1e-6  # relative allowance on every limit: values computed in float64, files written with 7 digits
)
CONTOUR_ROUNDING = (
    1e-8  # [mm] allowance on distances: rounding of coordinates up to 1e3 mm after 1e6 mm of path is 1e-10
)
PLACE_ROUNDING = 1e-6  # [mm] what "exactly at the point" means: the least digit that NC programs and trajectory files carry
PERIOD_ROUNDING = 1e-9  # [s] of a sample's time: the least digit that files print; float64 has it up to 1e6 s
NEWTON_STEPS = 8  # quadratic from the polar angle; four suffice for a helix whose pitch equals its radius


PIECE = np.dtype(
    [
        ("budget", "f8"),
        ("feed", "f8"),
        ("word", "f8"),
        ("by", "i8"),
        ("x0", "f8"),
        ("x1", "f8"),
        ("arc", "i8"),
        ("segment", "i8"),
    ]
)
JOINT = np.dtype([("budget", "f8"), ("stop", "i8"), ("real", "?")])


class ProgramPieces(NamedTuple):
    """N pieces over A axes, the N+1 vertices around them, and the K arcs and curves. Few arrays, since each costs at every call.

    vertex : (N+1, A) [mm]
    joint  : (N+1,) `JOINT`, what holds at a vertex: budget [mm]; stop (0 or 1); real, if it is a joint of the program
    piece  : (N,) `PIECE`: budget [mm]; feed in all axes [mm/s]; word, that in the axes of group `by` alone; x0, x1 range of the
             arc's parameter [mm], or of the curve's [-]; arc: row of an arc, -1 for a line, -2 - row of a curve; segment
    frame  : (K, 4, A) center, e1, e2, drift of an arc; control points of a curve
    turn   : (K, 2) radius [mm], rate [rad/mm] of an arc; weights of the inner control points of a curve
    """

    vertex: FloatArray
    joint: Array
    piece: Array
    frame: FloatArray
    turn: FloatArray


CENTER, E1, E2, DRIFT = range(4)  # in `frame`
RADIUS, RATE = range(2)  # in `turn`


def program_pieces(toolpath: Toolpath, halved: Array | None = None) -> ProgramPieces:
    """Cut the toolpath into pieces. A segment's budget is the larger of its two joints'.

    halved : (M,) segments that are cut into an even number of pieces; None for none

    Raises ValueError if the toolpath contradicts itself: segments that do not meet, arcs that do not end where they say.
    """
    arcs, is_arc, curves, is_curve = toolpath.arcs, toolpath.arc >= 0, toolpath.curves, toolpath.curve >= 0
    count = np.ones(len(toolpath), dtype=np.int64)
    angle = np.abs(arcs.rate[toolpath.arc[is_arc]]) * toolpath.length[is_arc]
    count[is_arc] = np.maximum(1, np.ceil(angle / PIECE_ANGLE - RATIO_ROUNDING)).astype(np.int64)
    count[is_curve] = curve_counts(curves.points, curves.weight, PIECE_ANGLE)[toolpath.curve[is_curve]]
    if halved is not None:
        count += halved & (count % 2 == 1)
    segment = np.repeat(np.arange(len(toolpath)), count)
    first = np.cumsum(count) - count  # first piece of each segment
    part = np.arange(len(segment)) - first[segment]
    step = np.where(is_curve, 1.0, toolpath.length) / count
    x0, x1 = part * step[segment], (part + 1) * step[segment]
    row = np.where(is_curve, len(arcs) + toolpath.curve, toolpath.arc)  # in frame and turn
    arc = np.where(is_curve, -2 - row, row)[segment]
    frame = np.concatenate([np.stack([arcs.center, arcs.e1, arcs.e2, arcs.drift], axis=1), curves.points])
    turn = np.concatenate([np.stack([arcs.radius, arcs.rate], axis=1), curves.weight])

    share = (part / count[segment])[:, None]
    chord = toolpath.end[segment] - toolpath.start[segment]
    vertex = np.vstack([toolpath.start[segment] + share * chord, toolpath.end[-1:]])
    on_arc = np.flatnonzero(arc >= 0)
    vertex[on_arc] = _arc_points(toolpath, arc[on_arc], x0[on_arc])
    on_curve = np.flatnonzero(arc < -1)
    at = -2 - arc[on_curve]
    vertex[on_curve] = curve_points(frame[at], turn[at], x0[on_curve])[0]
    _check_consistent(toolpath, vertex[first])
    vertex[first] = toolpath.start
    at = np.append(first, len(segment))  # the vertices that are joints of the program
    piece = np.zeros(len(segment), dtype=PIECE)
    piece["budget"] = np.maximum(toolpath.tolerance[:-1], toolpath.tolerance[1:])[segment]
    piece["feed"] = toolpath.feed[segment]
    by, part = counted_axes(toolpath)
    piece["by"], piece["word"] = by[segment], (part * toolpath.feed)[segment]
    piece["x0"], piece["x1"] = x0, x1
    piece["arc"], piece["segment"] = arc, segment
    joint = np.zeros(len(vertex), dtype=JOINT)
    joint["budget"][:-1] = piece["budget"]
    joint["budget"][at] = toolpath.tolerance
    joint["real"][at] = True
    joint["stop"][at] = toolpath.joint == Joint.STOP
    return ProgramPieces(vertex=vertex, joint=joint, piece=piece, frame=frame, turn=turn)


def axis_groups(axes: tuple[str, ...]) -> Array:
    """(A,) 0 for x, y, z, 1 for u, v, w, 2 for rotary axes: F is the speed in the axes of the first group that moves."""
    return np.array(
        [("xyz", "uvw", "abc").index(next(g for g in ("xyz", "uvw", "abc") if a in g)) for a in axes]
    )


def counted_axes(toolpath: Toolpath) -> tuple[Array, FloatArray]:
    """(M,) the group that F counts on each segment, and (M,) its share of the length in all axes [-]."""
    groups, change = axis_groups(toolpath.axes), toolpath.end - toolpath.start
    turned = (toolpath.arc >= 0) | (toolpath.curve >= 0)
    squares = np.stack([(change[:, groups == k] ** 2).sum(axis=1) for k in range(3)])
    squares[0, turned] = toolpath.length[turned] ** 2 - squares[1:, turned].sum(axis=0)
    by: Array = np.argmax(squares > PLACE_ROUNDING**2, axis=0)
    share: FloatArray = np.sqrt(np.maximum(squares[by, np.arange(len(by))], 0.0)) / toolpath.length
    return by, share


def widened(pieces: ProgramPieces, factor: float = 1.0, more: float = 0.0) -> ProgramPieces:
    """The same pieces and vertices with `factor` times their budgets and `more` [mm]."""
    piece, joint = pieces.piece.copy(), pieces.joint.copy()
    for table in (piece, joint):
        table["budget"] = factor * table["budget"] + more
    return pieces._replace(piece=piece, joint=joint)


def _arc_points(toolpath: Toolpath, row: Array, x: FloatArray) -> FloatArray:
    arcs = toolpath.arcs
    angle = arcs.rate[row] * x
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    circle = arcs.radius[row][:, None] * (cos * arcs.e1[row] + sin * arcs.e2[row])
    return arcs.center[row] + circle + arcs.drift[row] * x[:, None]


def _check_consistent(toolpath: Toolpath, computed_start: FloatArray) -> None:
    rows = np.flatnonzero(toolpath.arc >= 0)
    computed_end = toolpath.end.copy()
    computed_end[rows] = _arc_points(toolpath, toolpath.arc[rows], toolpath.length[rows])
    for what, gap in (
        ("does not start where its arc does", computed_start - toolpath.start),
        ("does not end where its arc does", computed_end - toolpath.end),
        ("does not start where the one before ends", toolpath.start[1:] - toolpath.end[:-1]),
    ):
        distance = np.linalg.norm(gap, axis=1)
        bad = np.flatnonzero(distance > PLACE_ROUNDING)
        if len(bad):
            k = int(bad[0]) + len(toolpath) - len(distance)
            raise ValueError(
                f"Toolpath: segment {k} (line {toolpath.line[k]}) {what}: {distance[bad[0]]:.3g} mm apart"
            )


@kernel(inline=True)
def reach_piece(pieces: ProgramPieces, i: int, q: FloatArray, radius: float) -> tuple[float, float, float]:
    """Which part of piece i lies within `radius` of the point q (A,).

    -> (a, b, distance): the part as fractions of the piece, empty if a > b; the distance of q from the piece [mm].
    Exact on lines; on arcs and curves the distance is, and a and b are to second order about the nearest point.
    """
    if pieces.piece[i]["arc"] >= 0:
        return _reach_arc(pieces, i, q, radius)
    if pieces.piece[i]["arc"] < -1:
        return reach_curve(pieces, i, q, radius)
    vertex = pieces.vertex
    along, length_sq = 0.0, 0.0
    for n in range(len(q)):
        u, w = vertex[i + 1, n] - vertex[i, n], q[n] - vertex[i, n]
        along += w * u
        length_sq += u * u
    x = along / length_sq if length_sq > 0.0 else 0.0
    off_sq = 0.0
    for n in range(len(q)):
        off_sq += (q[n] - vertex[i, n] - x * (vertex[i + 1, n] - vertex[i, n])) ** 2
    return _within(x, off_sq, length_sq, radius)


@kernel(inline=True)
def reach_chord(
    begin: FloatArray, end: FloatArray, pieces: ProgramPieces, i: int, radius: float
) -> tuple[float, float, float]:
    """Which part of the chord from `begin` to `end` (A,), which may be a point, lies within `radius` of vertex i; as `reach_piece`."""
    vertex = pieces.vertex
    along, length_sq = 0.0, 0.0
    for n in range(len(begin)):
        u, w = end[n] - begin[n], vertex[i, n] - begin[n]
        along += w * u
        length_sq += u * u
    x = along / length_sq if length_sq > 0.0 else 0.0
    off_sq = 0.0
    for n in range(len(begin)):
        off_sq += (vertex[i, n] - begin[n] - x * (end[n] - begin[n])) ** 2
    return _within(x, off_sq, length_sq, radius)


@kernel(inline=True)
def _within(x: float, off_sq: float, length_sq: float, radius: float) -> tuple[float, float, float]:
    """The part of a segment within `radius` of a point whose foot on its line is at the fraction x, off_sq away (squared)."""
    nearest = min(max(x, 0.0), 1.0)
    distance = math.sqrt(off_sq + (x - nearest) ** 2 * length_sq)
    if distance > radius:
        return 1.0, 0.0, distance
    if length_sq == 0.0:
        return 0.0, 1.0, distance
    half = math.sqrt(max(radius * radius - off_sq, 0.0) / length_sq)
    # the nearest point belongs to the part whatever the rounding of `half`
    return min(max(x - half, 0.0), nearest), max(min(x + half, 1.0), nearest), distance


@kernel()
def _reach_arc(pieces: ProgramPieces, i: int, q: FloatArray, radius: float) -> tuple[float, float, float]:
    k, x0, x1 = pieces.piece[i]["arc"], pieces.piece[i]["x0"], pieces.piece[i]["x1"]
    big, rate, frame = pieces.turn[k, RADIUS], pieces.turn[k, RATE], pieces.frame
    w1, w2, wd, d1, d2, dd = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(len(q)):
        w, e1, e2, drift = q[n] - frame[k, CENTER, n], frame[k, E1, n], frame[k, E2, n], frame[k, DRIFT, n]
        w1 += w * e1
        w2 += w * e2
        wd += w * drift
        d1 += e1 * drift
        d2 += e2 * drift
        dd += drift * drift

    middle = 0.5 * (x0 + x1)
    angle = math.atan2(w2 - d2 * middle, w1 - d1 * middle) - rate * middle
    angle -= 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    x = min(max(middle + angle / rate, x0), x1)
    for _ in range(NEWTON_STEPS):
        c, s = math.cos(rate * x), math.sin(rate * x)
        turn = big * rate * (c * d2 - s * d1)
        pull = big * (c * d1 + s * d2)
        g = big * rate * (s * w1 - c * w2) - wd + pull + x * (turn + dd)
        slope = big * rate * rate * (c * w1 + s * w2) + 2.0 * turn + dd - x * rate * rate * pull
        if (
            slope <= 0.0
        ):  # q is beyond the centre: the nearest point of the piece is one of its ends, which x already is
            break
        better = min(max(x - g / slope, x0), x1)
        moved = abs(better - x)
        x = better
        if moved <= 1e-13 * (x1 - x0):
            break
    c, s = math.cos(rate * x), math.sin(rate * x)
    distance_sq, g, slope = 0.0, 0.0, 0.0
    for n in range(len(q)):
        e1, e2, drift = frame[k, E1, n], frame[k, E2, n], frame[k, DRIFT, n]
        off = frame[k, CENTER, n] + big * (c * e1 + s * e2) + drift * x - q[n]
        d = big * rate * (c * e2 - s * e1) + drift
        distance_sq += off * off
        g += off * d
        slope += d * d - off * big * rate * rate * (c * e1 + s * e2)
    distance = math.sqrt(distance_sq)
    if distance > radius:
        return 1.0, 0.0, distance
    if slope <= 0.0:
        return 0.0, 1.0, distance
    # distance^2 + 2 g D + slope D^2 = radius^2 about the nearest point
    root = math.sqrt(g * g + slope * (radius * radius - distance_sq))
    low, high = x + (-g - root) / slope, x + (-g + root) / slope
    span = x1 - x0
    return max(low - x0, 0.0) / span, min(high - x0, span) / span, distance
