"""How far linear and rotary axes are from the path, each by themselves.

The contour error is one of all axes in one norm, angles at a radius. Its vector, from the nearest point of the path to the motion, has
a part in the linear axes, the error of the tip where the kinematics carry it there, and one in the rotary axes, of which the tool's
direction turns by no more. Neither exceeds the whole, so that a motion within the tolerance keeps both tolerances.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import ROTARY_AXES
from planner.verifier.curves import curve_points
from planner.verifier.pieces import CENTER, DRIFT, E1, E2, RADIUS, RATE, ProgramPieces

STARTS = 17  # places on an arc or a curve from which the nearest one is looked for: they turn by no more than 22.5 degrees
STEPS = 6  # of Gauss and Newton from the nearest of them; what they gain falls by a tenth and more with each


def both_apart(
    pieces: ProgramPieces, piece: Array, position: FloatArray, axes: tuple[str, ...]
) -> FloatArray:
    """(2,) largest distance of the linear axes, and of the rotary ones, from the path [mm]; zeros without axes of both kinds.

    piece    : (n,) the piece that each sample lies on
    position : (n, A) of the samples [mm]
    """
    rotary = np.array([letter in ROTARY_AXES for letter in axes], dtype=bool)
    if not len(position) or not rotary.any() or rotary.all():
        return np.zeros(2)
    off = position - _feet(pieces, piece, position)
    return np.array([np.linalg.norm(off[:, part], axis=1).max() for part in (~rotary, rotary)])


def _feet(pieces: ProgramPieces, piece: Array, position: FloatArray) -> FloatArray:
    """(n, A) the nearest point of a piece to each sample."""
    begin, end = pieces.vertex[piece], pieces.vertex[piece + 1]
    along = np.einsum("na,na->n", position - begin, end - begin)
    length_sq = np.einsum("na,na->n", end - begin, end - begin)
    share = np.clip(np.divide(along, length_sq, out=np.zeros_like(along), where=length_sq > 0.0), 0.0, 1.0)
    feet = begin + share[:, None] * (end - begin)
    bent = np.flatnonzero(pieces.piece["arc"][piece] != -1)
    if len(bent):
        feet[bent] = _feet_on_bent(pieces, piece[bent], position[bent])
    return feet


def _feet_on_bent(pieces: ProgramPieces, piece: Array, position: FloatArray) -> FloatArray:
    x0, x1 = pieces.piece["x0"][piece], pieces.piece["x1"][piece]
    starts = [x0 + share * (x1 - x0) for share in np.linspace(0.0, 1.0, STARTS)]
    apart = [np.linalg.norm(_points(pieces, piece, x) - position, axis=1) for x in starts]
    x = np.take_along_axis(np.array(starts), np.argmin(apart, axis=0)[None], axis=0)[0]
    h = 1e-4 * (x1 - x0)
    for _ in range(STEPS):
        slope = (_points(pieces, piece, x + h) - _points(pieces, piece, x - h)) / (2.0 * h)[:, None]
        step = np.einsum("na,na->n", position - _points(pieces, piece, x), slope)
        x = np.clip(x + step / np.einsum("na,na->n", slope, slope), x0, x1)
    return _points(pieces, piece, x)


def _points(pieces: ProgramPieces, piece: Array, x: FloatArray) -> FloatArray:
    """(n, A) points of arcs and curves at their parameters x (n,)."""
    arc = pieces.piece["arc"][piece]
    found = np.empty((len(piece), pieces.vertex.shape[1]))
    on_arc, on_curve = np.flatnonzero(arc >= 0), np.flatnonzero(arc < -1)
    frame, turn = pieces.frame[arc[on_arc]], pieces.turn[arc[on_arc]]
    angle = turn[:, RATE] * x[on_arc]
    circle = np.cos(angle)[:, None] * frame[:, E1] + np.sin(angle)[:, None] * frame[:, E2]
    found[on_arc] = frame[:, CENTER] + turn[:, RADIUS, None] * circle + frame[:, DRIFT] * x[on_arc, None]
    row = -2 - arc[on_curve]
    if len(row):
        found[on_curve] = curve_points(pieces.frame[row], pieces.turn[row], x[on_curve])[0]
    return found
