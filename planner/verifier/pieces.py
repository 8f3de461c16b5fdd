"""The programmed path, laid out for the matching: pieces between vertices.

A line is one piece. An arc or helix is cut into pieces of at most `PIECE_ANGLE`, and the points between them
are vertices like those of the program: the motion has to pass each of them in order, so that a full circle
cannot be left out although its ends coincide. A curve is cut likewise (bends.py).
"""

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import ROTARY_AXES
from planner.verifier.bends import apart_on_bend, arc_points, curve_counts, curve_points, reach_bend
from planner.verifier.kernel import kernel

PIECE_ANGLE = np.pi / 8  # largest turning of an arc piece [rad]: a point is passed every 22.5 degrees
# Relative allowance on every limit: values computed in float64, files written with 7 digits.
RATIO_ROUNDING = 1e-6
# [mm] allowance on distances: rounding of coordinates up to 1e3 mm after 1e6 mm of path is 1e-10.
CONTOUR_ROUNDING = 1e-8
# [mm] what "exactly at the point" means: the least digit that NC programs and trajectory files carry.
PLACE_ROUNDING = 1e-6
# [s] of a sample's time: the least digit that files print; float64 has it up to 1e6 s.
PERIOD_ROUNDING = 1e-9

STRAIGHT = -1  # row of the arc of a line
PIECE = np.dtype(
    [(name, "f8") for name in ("budget", "feed", "word", "x0", "x1")]
    + [(name, "i8") for name in ("by", "arc", "segment")]
)
JOINT = np.dtype([("budget", "f8"), ("stop", "i8"), ("real", "?")])


class ProgramPieces(NamedTuple):
    """N pieces over A axes, the N+1 vertices around them, the K arcs and curves; few arrays, as calls cost."""

    vertex: FloatArray  # (N+1, A) [mm]
    joint: Array  # (N+1,) `JOINT`: budget [mm]; stop (0 or 1); real: of the program
    # (N,) `PIECE`: budget [mm]; feed in all axes [mm/s]; word, that in the axes of group `by` alone; x0, x1 range of the arc's
    # parameter [mm], or of the curve's [-]; arc: row of an arc, -1 for a line, -2 - row of a curve; segment
    piece: Array
    frame: FloatArray  # (K, 4, A) center, e1, e2, drift of an arc; control points of a curve
    turn: FloatArray  # (K, 2) radius [mm], rate [rad/mm] of an arc; weights of the inner control points of a curve


def program_pieces(toolpath: Toolpath, halved: Array | None = None) -> ProgramPieces:
    """Cut the toolpath into pieces. A segment's budget is the larger of its two joints'.

    halved : (M,) segments that are cut into an even number of pieces; None for none

    Raises ValueError if the toolpath contradicts itself: segments that do not meet, arcs that do not end
    where they say.
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
    vertex[on_arc] = arc_points(frame[arc[on_arc]], turn[arc[on_arc]], x0[on_arc])
    on_curve = np.flatnonzero(arc < -1)
    at = -2 - arc[on_curve]
    vertex[on_curve] = curve_points(frame[at], turn[at], x0[on_curve])[0]
    ends = toolpath.end.copy()
    ends[is_arc] = arc_points(frame[row[is_arc]], turn[row[is_arc]], toolpath.length[is_arc])
    _check_consistent(toolpath, vertex[first], ends)
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
    joint["stop"][at] = toolpath.rests
    return ProgramPieces(vertex=vertex, joint=joint, piece=piece, frame=frame, turn=turn)


def axis_groups(axes: tuple[str, ...]) -> Array:
    """(A,) 0 for x, y, z, 1 for u, v, w, 2 for rotary axes: F is the speed in the first group that moves."""
    return np.array(["xyzuvwabc".index(letter) // 3 for letter in axes])


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


def _check_consistent(toolpath: Toolpath, computed_start: FloatArray, computed_end: FloatArray) -> None:
    for what, gap in (
        ("does not start where its arc does", computed_start - toolpath.start),
        ("does not end where its arc does", computed_end - toolpath.end),
        ("does not start where the one before ends", toolpath.start[1:] - toolpath.end[:-1]),
    ):
        distance = np.linalg.norm(gap, axis=1)
        bad = np.flatnonzero(distance > PLACE_ROUNDING)
        if len(bad):
            k = int(bad[0]) + len(toolpath) - len(distance)
            where = f"Toolpath: segment {k} (line {toolpath.line[k]})"
            raise ValueError(f"{where} {what}: {distance[bad[0]]:.3g} mm apart")


@kernel(inline=True)
def reach_piece(pieces, i, q, radius):
    """Which part of piece i lies within `radius` of the point q (A,).

    -> (a, b, distance): the part as fractions of the piece, empty if a > b; the distance of q from the piece
    [mm]. Exact on lines; on arcs and curves the distance is, and a and b are to second order about the
    nearest point.
    """
    if pieces.piece[i]["arc"] != STRAIGHT:
        return reach_bend(pieces, i, q, radius)
    return _reach_line(pieces.vertex[i], pieces.vertex[i + 1], q, radius)


@kernel(inline=True)
def reach_chord(begin, end, pieces, i, radius):
    """Which part of the chord from `begin` to `end` (A,), which may be a point, lies within `radius` of
    vertex i; as `reach_piece`."""
    return _reach_line(begin, end, pieces.vertex[i], radius)


@kernel(inline=True)
def _reach_line(begin, end, q, radius):
    """Which part of the line from `begin` to `end` (A,) lies within `radius` of q (A,), as `reach_piece`."""
    along, length_sq, off_sq = 0.0, 0.0, 0.0
    for n in range(len(q)):
        u, w = end[n] - begin[n], q[n] - begin[n]
        along += w * u
        length_sq += u * u
    x = along / length_sq if length_sq > 0.0 else 0.0
    for n in range(len(q)):
        off_sq += (q[n] - begin[n] - x * (end[n] - begin[n])) ** 2
    nearest = min(max(x, 0.0), 1.0)
    distance = math.sqrt(off_sq + (x - nearest) ** 2 * length_sq)
    if distance > radius:
        return 1.0, 0.0, distance
    if length_sq == 0.0:
        return 0.0, 1.0, distance
    half = math.sqrt(max(radius * radius - off_sq, 0.0) / length_sq)
    # the nearest point belongs to the part whatever the rounding of `half`
    return min(max(x - half, 0.0), nearest), max(min(x + half, 1.0), nearest), distance


@kernel(inline=True)
def out_of_reach(pieces, first, last, ends):
    """Whether the chord between `ends` (2, A) is out of reach of one of the vertices from `first` to `last`."""
    over = 0.0
    for i in range(first, last + 1):
        over = max(over, reach_chord(ends[0], ends[1], pieces, i, 0.0)[2] - pieces.joint[i]["budget"])
    return over > 0.0


def both_apart(
    pieces: ProgramPieces, piece: Array, position: FloatArray, axes: tuple[str, ...]
) -> FloatArray:
    """(2,) largest distance of linear, and of rotary axes from the path [mm]; zeros without both kinds.

    The vector from the nearest point of the path to the motion has a part in the linear axes, the error of the tip where
    the kinematics carry it there, and one in the rotary axes, of which the tool's direction turns by no more. Neither
    exceeds the contour error, the norm of both.

    piece    : (n,) the piece that each sample lies on
    position : (n, A) of the samples [mm]
    """
    rotary = np.array([letter in ROTARY_AXES for letter in axes], dtype=bool)
    if not len(position) or not rotary.any() or rotary.all():
        return np.zeros(2)
    counted = [part.astype(np.float64) for part in (~rotary, rotary)]
    return np.sqrt([_largest_apart(pieces, piece, position, counts) for counts in counted])


@kernel()
def _largest_apart(pieces, piece, position, counts):
    """Largest square of the distance of samples from their nearest points, in the axes that count (A,)."""
    largest, vertex = 0.0, pieces.vertex
    for k in range(len(piece)):
        i, q = piece[k], position[k]
        if pieces.piece[i]["arc"] != STRAIGHT:
            largest = max(largest, apart_on_bend(pieces, i, q, counts))
            continue
        along, length_sq, apart_sq = 0.0, 0.0, 0.0
        for n in range(len(q)):
            u = vertex[i + 1, n] - vertex[i, n]
            along += (q[n] - vertex[i, n]) * u
            length_sq += u * u
        share = min(max(along / length_sq, 0.0), 1.0) if length_sq > 0.0 else 0.0
        for n in range(len(q)):
            at = vertex[i, n] + share * (vertex[i + 1, n] - vertex[i, n])
            apart_sq += counts[n] * (q[n] - at) ** 2
        largest = max(largest, apart_sq)
    return largest
