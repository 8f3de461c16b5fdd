"""How far points are from the segments of the programmed path near the ones that they are at."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.chords import arc_point
from planner.geometry.toolpath import Toolpath

NEIGHBOURS = 3  # segments on both sides of a point's own that are looked at: between short blocks a motion is nearest to a later one
_TURNS_MAX = 1000  # of a helix that are looked at
_PLACES = 17  # on a curve, between which the nearest point is looked for
_THIRDS = 45  # times that a third of the range between two of them is left out


def distance_near(toolpath: Toolpath, point: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points from the nearest of their segments and `NEIGHBOURS` on both sides [mm].

    point   : (n, A) [mm]
    segment : (n,) the segment that each of them is at
    """
    nearest = np.full(len(point), np.inf)
    for step in range(-NEIGHBOURS, NEIGHBOURS + 1):
        other = segment + step
        at = np.flatnonzero((other >= 0) & (other < len(toolpath)))
        segments = other[at]
        kinds = (
            (toolpath.straight[segments], _from_lines),
            (toolpath.arc[segments] >= 0, _from_arcs),
            (toolpath.curve[segments] >= 0, _from_curves),
        )
        for kind, distance in kinds:
            rows = at[kind]
            if len(rows):
                nearest[rows] = np.minimum(nearest[rows], distance(toolpath, point[rows], other[rows]))
    return nearest


def _from_lines(toolpath: Toolpath, point: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points (n, A) from straight segments (n,)."""
    start, along = toolpath.start[segment], toolpath.end[segment] - toolpath.start[segment]
    share = ((point - start) * along).sum(axis=1) / (along * along).sum(axis=1)
    distance: FloatArray = np.linalg.norm(point - start - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
    return distance


def _from_arcs(toolpath: Toolpath, point: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points (n, A) from arcs (n,): at the same angle in each turn, and from both ends."""
    arcs, row, length = toolpath.arcs, toolpath.arc[segment], toolpath.length[segment]
    out = point - arcs.center[row]
    angle = np.arctan2((out * arcs.e2[row]).sum(axis=1), (out * arcs.e1[row]).sum(axis=1))
    rate = arcs.rate[row]
    first = np.mod(angle * np.sign(rate), 2.0 * np.pi) / np.abs(rate)
    turn = 2.0 * np.pi / np.abs(rate)
    places = [np.zeros_like(length), length]
    turns = int(min(np.max(length / turn), _TURNS_MAX))
    places += [np.minimum(first + k * turn, length) for k in range(turns + 1)]
    nearest = np.full(len(point), np.inf)
    for x in places:
        nearest = np.minimum(nearest, np.linalg.norm(out - arc_point(toolpath, segment, x), axis=1))
    return nearest


def _from_curves(toolpath: Toolpath, point: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points (n, A) from curves (n,): from some places, then between these by thirds."""
    row, length = toolpath.curve[segment], toolpath.length[segment]

    def off(share: FloatArray) -> FloatArray:
        distance: FloatArray = np.linalg.norm(
            toolpath.curves.at(row, length, share * length)[:, 0] - point, axis=1
        )
        return distance

    shares = np.linspace(0.0, 1.0, _PLACES)
    nearest = np.argmin([off(np.full(len(point), share)) for share in shares], axis=0)
    low, high = shares[np.maximum(nearest - 1, 0)], shares[np.minimum(nearest + 1, _PLACES - 1)]
    for _ in range(_THIRDS):
        third = (high - low) / 3.0
        left = off(low + third) < off(high - third)
        low, high = np.where(left, low, low + third), np.where(left, high - third, high)
    return off(0.5 * (low + high))
