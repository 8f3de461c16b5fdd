"""How far points are from the segments of the programmed path near the ones that they are at."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.chords import arc_point
from planner.geometry.toolpath import Toolpath

NEIGHBOURS = 3  # segments on both sides of a point's own that are looked at: between short blocks a motion is nearest to a later one
_TURNS_MAX = 1000  # of a helix that are looked at


def distance_near(toolpath: Toolpath, point: FloatArray, segment: Array) -> FloatArray:
    """(n,) distance of points from the nearest of their segments and `NEIGHBOURS` on both sides [mm].

    point   : (n, A) [mm]
    segment : (n,) the segment that each of them is at
    """
    nearest = np.full(len(point), np.inf)
    for step in range(-NEIGHBOURS, NEIGHBOURS + 1):
        other = segment + step
        at = np.flatnonzero((other >= 0) & (other < len(toolpath)))
        straight = toolpath.arc[other[at]] < 0
        for rows, distance in ((at[straight], _from_lines), (at[~straight], _from_arcs)):
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
    """(n,) distance of points (n, A) from arcs (n,): from the point at the same angle, in each of the turns, and from both ends."""
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
