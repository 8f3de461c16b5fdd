"""Legs: the straight or circular stretches between which corners are rounded.

A leg is a maximal run of collinear lines, or one arc. Collinear lines are joined because where a CAM system cut a straight line
into blocks must not change the motion: a corner may reach back over several short blocks of the same line.

`CurveTable` is what the numba kernels see: plain arrays, one row per leg or arc.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from planner.arrays import Array, FloatArray, freeze
from planner.geometry.toolpath import Joint, Toolpath


@dataclass(frozen=True, eq=False, kw_only=True)
class Legs:
    """R legs of a toolpath and the R+1 joints between them.

    first  : (R+1,) leg r holds the segments first[r] : first[r+1]; also the toolpath's joint index at the leg's start
    offset : (M,) place of each segment's start on its leg [mm]
    length : (R,) range of the leg's parameter x [mm]
    table  : the same geometry for the kernels
    """

    first: Array
    offset: FloatArray
    length: FloatArray
    table: CurveTable

    def __post_init__(self) -> None:
        legs = len(self.length)
        freeze(self, "first", np.int64, (legs + 1,))
        freeze(self, "offset", np.float64, (None,))
        freeze(self, "length", np.float64, (legs,))

    def __len__(self) -> int:
        return len(self.length)


class CurveTable(NamedTuple):
    """Geometry of R legs over A axes; K arcs (formulas: geometry/toolpath.py)."""

    arc: Array  # (R,) row of the arc, or -1: a straight leg
    length: FloatArray  # (R,)
    start: FloatArray  # (R, A)
    direction: FloatArray  # (R, A) unit vector of straight legs
    center: FloatArray  # (K, A) ...
    e1: FloatArray
    e2: FloatArray
    drift: FloatArray
    radius: FloatArray  # (K,)
    rate: FloatArray


def legs_of(toolpath: Toolpath) -> Legs:
    """Join collinear lines; every other segment is a leg of its own."""
    straight = toolpath.arc < 0
    joined = (toolpath.joint[1:-1] == Joint.SMOOTH) & straight[:-1] & straight[1:]
    first = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(toolpath)]])
    leg_of_segment = np.repeat(np.arange(len(first) - 1), np.diff(first))
    along = np.concatenate([[0.0], np.cumsum(toolpath.length)])
    offset = along[:-1] - along[first[:-1]][leg_of_segment]
    start, end = toolpath.start[first[:-1]], toolpath.end[first[1:] - 1]
    arc = toolpath.arc[first[:-1]]
    chord = np.linalg.norm(end - start, axis=1)
    length = np.where(arc < 0, chord, toolpath.length[first[:-1]])
    direction = np.zeros_like(start)
    np.divide(end - start, chord[:, None], out=direction, where=(arc < 0)[:, None])
    arcs = toolpath.arcs
    table = CurveTable(
        arc, length, start, direction, arcs.center, arcs.e1, arcs.e2, arcs.drift, arcs.radius, arcs.rate
    )
    return Legs(first=first, offset=offset, length=length, table=table)


@njit(cache=True, error_model="numpy")
def leg_point(table, leg, x, out):
    """Point and first three x-derivatives of a leg at x, into out (4, A)."""
    axes = out.shape[1]
    row = table.arc[leg]
    if row < 0:
        for k in range(axes):
            out[0, k] = table.start[leg, k] + x * table.direction[leg, k]
            out[1, k] = table.direction[leg, k]
            out[2, k] = 0.0
            out[3, k] = 0.0
        return
    rate = table.rate[row]
    radius = table.radius[row]
    cos, sin = np.cos(rate * x), np.sin(rate * x)
    for k in range(axes):
        radial = radius * (cos * table.e1[row, k] + sin * table.e2[row, k])
        across = radius * (cos * table.e2[row, k] - sin * table.e1[row, k])
        out[0, k] = table.center[row, k] + radial + table.drift[row, k] * x
        out[1, k] = rate * across + table.drift[row, k]
        out[2, k] = -rate * rate * radial
        out[3, k] = -rate * rate * rate * across
