"""Blocks under G61 and G61.1: the delivered samples run along the path itself, in its order.

They are matched with the path once more (matching.py), with the budgets that G61 means. With a motion x(t) on
the path, |x''| <= a, and samples at most h apart:

    sample   on the path, to `PLACE_ROUNDING` and the digits of the positions
    vertex   passed between two samples at a time u; the chord is at most a h^2 / 8 from x(u) there, and that is what it may miss the
             vertex by, with the same rounding; at most the tolerance, which counts between samples
             (contour.py), and that where the acceleration is not judged

A motion on the path always fits: its own course is a way through the free space of the matching, since chord
and motion are compared at the same time. One that leaves the path, or runs it in another order, leaves a
block out or is not at its end, is lost. What stays within a h^2 / 8 of one place could be run between two
samples; that it is left out is not seen.

The tolerance stays the budget of blocks under G64, and of the half of a block that is beside one without a
full stop between: the corner there may be rounded. How far a motion that is lost was off is measured within it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Joint, Toolpath
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, Kind
from planner.verifier.findings import line_of
from planner.verifier.matching import HELD, LAST, LOST_AFTER, Located
from planner.verifier.pieces import (
    CONTOUR_ROUNDING,
    PLACE_ROUNDING,
    RATIO_ROUNDING,
    ProgramPieces,
    program_pieces,
    widened,
)
from planner.verifier.stream import BLOCK_SAMPLES, Observed, follow
from planner.verifier.worst import Limits


def exact_faults(
    trajectory: Trajectory, readings: list[Observed], toolpath: Toolpath, limits: Limits
) -> list[Fault]:
    """The faults of a motion where the path is to be followed exactly; empty if nothing is."""
    if not toolpath.exact.any():
        return []
    digits = float(np.linalg.norm(limits.rounding))
    bow = float(np.linalg.norm(limits.acceleration_at_stop)) * readings[0].gap_max ** 2 / 8.0
    pieces = program_pieces(toolpath, halved=np.logical_or(*_beside(toolpath)))
    exact = _exact_pieces(toolpath, pieces)
    tight = widened(_tightened(pieces, exact, bow), more=digits)
    reading = follow(_positions(trajectory), tight, search=False)
    lost_at = _lost_at(reading, tight)
    if lost_at is None:
        return []
    worst = _Worst(widened(pieces, more=digits), exact)
    wide = follow(_positions(trajectory), worst.pieces, each=worst.take, search=False)
    line, time = line_of(toolpath, pieces, lost_at), None
    where = f"followed in its order only as far as line {line}"
    if worst.apart > PLACE_ROUNDING + digits and not wide.match.tally[HELD]:
        line, time = line_of(toolpath, pieces, worst.piece), worst.time
        where = f"{worst.apart:.6g} mm off at t = {time:.6g} s, line {line}"
    found = f"{where}: G61 asks for the path itself"
    return [Fault(Kind.EXACT, "exact path", found, time=time, line=line)]


@dataclass
class _Worst:
    """The sample that is farthest from the exact ones of some pieces: its distance [mm], time [s] and piece."""

    pieces: ProgramPieces
    exact: Array  # (N,) True for pieces that count
    apart: float = 0.0
    time: float = 0.0
    piece: int = 0

    def take(self, t: FloatArray, ratio: FloatArray, place: Located) -> None:
        """The next samples, as `follow` tells of them."""
        piece = place.piece
        apart = np.where(self.exact[piece], ratio * self.pieces.piece["budget"][piece], 0.0)
        k = int(apart.argmax())
        if apart[k] > self.apart:
            self.apart, self.time, self.piece = float(apart[k]), float(t[k]), int(piece[k])


def _positions(trajectory: Trajectory) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times and positions of the samples, some at a time."""
    for chunk in trajectory.chunks():
        for low in range(0, len(chunk), BLOCK_SAMPLES):
            yield chunk.t[low : low + BLOCK_SAMPLES], chunk.position[low : low + BLOCK_SAMPLES]


def _beside(toolpath: Toolpath) -> Array:
    """(2, M) True for exact segments that are entered, and left, without a full stop beside one not exact."""
    free, moving = np.pad(~toolpath.exact, 1), toolpath.joint != Joint.STOP
    return toolpath.exact & np.array([free[:-2] & moving[:-1], free[2:] & moving[1:]])


def _exact_pieces(toolpath: Toolpath, pieces: ProgramPieces) -> Array:
    """(N,) True for pieces of exact segments, but for those of a half where a corner may be rounded."""
    segment = pieces.piece["segment"]
    chord = np.linalg.norm(np.diff(pieces.vertex, axis=0), axis=1)
    run = np.append(0.0, np.cumsum(chord))
    first = np.searchsorted(segment, np.arange(len(toolpath) + 1))
    begin, whole = run[first[:-1]][segment], np.diff(run[first])[segment]
    low, high = (run[:-1] - begin) / whole, (run[1:] - begin) / whole  # shares of the segment
    at_start, at_end = _beside(toolpath)[:, segment]
    of_a_corner = (at_start & (low < 0.5 - RATIO_ROUNDING)) | (at_end & (high > 0.5 + RATIO_ROUNDING))
    exact: Array = toolpath.exact[segment] & ~of_a_corner
    return exact


def _tightened(pieces: ProgramPieces, exact: Array, bow: float) -> ProgramPieces:
    """The pieces with the budgets of the module's text on `exact` (N,) ones, and at their end vertices; bow: largest
    distance of a motion from its chord [mm], inf or NaN where acceleration is not judged."""
    piece, joint = pieces.piece.copy(), pieces.joint.copy()
    piece["budget"][exact] = PLACE_ROUNDING
    at_end = np.append(exact, False) | np.append(False, exact)
    joint["budget"][at_end] = np.fmin(joint["budget"][at_end], bow + PLACE_ROUNDING)
    return pieces._replace(piece=piece, joint=joint)


def _lost_at(reading: Observed, pieces: ProgramPieces) -> int | None:
    """The first piece that a motion is not seen to run along to its end; None if it runs along all."""
    match = reading.match
    allowed = pieces.joint["budget"] * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING
    missed = np.flatnonzero(match.passed["near"] > allowed)
    found = [max(int(i) - 1, 0) for i in missed[:1]]
    if match.tally[HELD]:
        found.append(int(match.tally[LOST_AFTER]))
    if match.tally[LAST] < len(pieces.piece) - 1:
        found.append(int(match.tally[LAST]))
    _, distance, budget, _, piece, _ = match.worst
    if distance > budget * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING:
        found.append(int(piece))
    return min(found, default=None)
