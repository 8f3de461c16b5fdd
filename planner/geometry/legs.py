"""Legs: the straight lines, arcs and curves between which corners are rounded.

A leg is one arc, one segment of a curve, or all collinear lines that follow one another. Collinear lines are
joined because where a CAM system cut a straight line into blocks must not change the motion: a corner may
reach back over several short blocks of the same line.

The kernels see one numpy record per leg (`leg_dtype`): arrays would cost reference counts.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze, room
from planner.base.kernels import njit
from planner.geometry.curves import curve_point, curve_tangent
from planner.geometry.toolpath import Joint, Toolpath

# Joined lines may turn by this much in all [rad]: a leg of a metre is within 1e-4 mm / 8 of its blocks.
JOINED_ANGLE = 1e-7


@dataclass(frozen=True, eq=False, kw_only=True)
class Legs:
    """R legs of a toolpath and the R+1 joints between them."""

    # (R+1,) leg r holds the segments first[r] : first[r+1]; also the joint at the leg's start
    first: Array
    offset: FloatArray  # (M,) place of each segment's start on its leg [mm]
    length: FloatArray  # (R,) range of the leg's parameter x [mm]
    table: Array  # (R,) records of `leg_dtype`, the same geometry for the kernels
    axes: int

    def __post_init__(self) -> None:
        legs = len(self.length)
        freeze(self, "first", np.int64, (legs + 1,))
        freeze(self, "offset", np.float64, (None,))
        freeze(self, "length", np.float64, (legs,))

    def __len__(self) -> int:
        return len(self.length)

    def vector(self, name: str) -> FloatArray:
        """(R, A) a field of the records, "start", "direction" or another vector, of the legs' axes alone."""
        return np.asarray(self.table[name][:, : self.axes])

    @property
    def place(self) -> FloatArray:
        """(M+1,) where each segment starts along the legs, from the start of the job [mm]; last, its end."""
        start = np.concatenate([[0.0], np.cumsum(self.length)])
        return np.append(np.repeat(start[:-1], np.diff(self.first)) + self.offset, start[-1])


def leg_dtype(axes: int) -> np.dtype:
    """Record of a leg over `axes` axes, with `room` for more; its fields: geometry/toolpath.py.

    On a curve, which is `round` as well, start, direction, center and e1 are its control points, the first
    numbers of e2 and drift the weights of the inner two, and radius and rate those of an arc that turns as
    fast as the curve anywhere.
    """
    vectors = ("start", "direction", "center", "e1", "e2", "drift")
    flags = [("round", np.bool_), ("curve", np.bool_)]
    scalars = [*flags, ("length", np.float64), ("radius", np.float64), ("rate", np.float64)]
    return np.dtype([*scalars, *((name, np.float64, (room(axes),)) for name in vectors)])


def legs_of(toolpath: Toolpath) -> Legs:
    """The legs of a toolpath: collinear lines joined, every other segment a leg of its own."""
    line = toolpath.straight
    joined = (toolpath.joint[1:-1] == Joint.SMOOTH) & line[:-1] & line[1:]
    turned = np.cumsum(np.where(joined, toolpath.theta[1:-1], 0.0))
    joined[1:] &= np.diff(np.floor(turned / JOINED_ANGLE)) == 0
    first = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(toolpath)]])
    leg_of_segment = np.repeat(np.arange(len(first) - 1), np.diff(first))
    along = np.concatenate([[0.0], np.cumsum(toolpath.length)])
    offset = along[:-1] - along[first[:-1]][leg_of_segment]
    start, end = toolpath.start[first[:-1]], toolpath.end[first[1:] - 1]
    arc, straight = toolpath.arc[first[:-1]], line[first[:-1]]
    chord = np.linalg.norm(end - start, axis=1)
    length = np.where(straight, chord, toolpath.length[first[:-1]])
    axes = len(toolpath.axes)
    table = np.zeros(len(length), leg_dtype(axes))
    table["length"], table["round"] = length, ~straight
    table["start"][:, :axes] = start
    table["direction"][straight, :axes] = (end - start)[straight] / chord[straight, None]
    for name in ("center", "e1", "e2", "drift"):
        table[name][arc >= 0, :axes] = getattr(toolpath.arcs, name)[arc[arc >= 0]]
    for name in ("radius", "rate"):
        table[name][arc >= 0] = getattr(toolpath.arcs, name)[arc[arc >= 0]]
    _set_curves(table, toolpath, first[:-1])
    return Legs(first=first, offset=offset, length=length, table=table, axes=axes)


def _set_curves(table: Array, toolpath: Toolpath, segment: Array) -> None:
    """Write the curves among legs (R,) from the segments `segment` (R,) into their records, in place."""
    leg = np.flatnonzero(toolpath.curve[segment] >= 0)
    row, bend = toolpath.curve[segment[leg]], toolpath.curvature[segment[leg]]
    for k, name in enumerate(("start", "direction", "center", "e1")):
        table[name][leg, : len(toolpath.axes)] = toolpath.curves.points[row, k]
    table["curve"][leg] = True
    table["e2"][leg, 0], table["drift"][leg, 0] = toolpath.curves.weight[row].T
    table["radius"][leg], table["rate"][leg] = 1.0 / bend, bend


@njit(cache=True, error_model="numpy")
def leg_point(legs, leg, x, out):
    """Point [mm] and first three x-derivatives of a leg at x [mm], into out (4, A); legs: records of
    `leg_dtype`."""
    data = legs[leg]
    axes = out.shape[1]
    if not data.round:
        for k in range(axes):
            out[0, k] = data.start[k] + x * data.direction[k]
            out[1, k] = data.direction[k]
            out[2, k] = 0.0
            out[3, k] = 0.0
        return
    if data.curve:
        p0, p1, p2, p3 = data.start, data.direction, data.center, data.e1
        curve_point((p0, p1, p2, p3), (data.e2[0], data.drift[0]), data.length, x, out)
        return
    rate, radius = data.rate, data.radius
    cos, sin = np.cos(rate * x), np.sin(rate * x)
    for k in range(axes):
        radial = radius * (cos * data.e1[k] + sin * data.e2[k])
        across = radius * (cos * data.e2[k] - sin * data.e1[k])
        out[0, k] = data.center[k] + radial + data.drift[k] * x
        out[1, k] = rate * across + data.drift[k]
        out[2, k] = -rate * rate * radial
        out[3, k] = -rate * rate * rate * across


@njit(cache=True, error_model="numpy")
def leg_tangent(legs, leg, x, out):
    """First x-derivative of a leg at x [mm], into out (A,); legs: records of `leg_dtype`."""
    data = legs[leg]
    if not data.round:
        for k in range(len(out)):
            out[k] = data.direction[k]
        return
    if data.curve:
        p0, p1, p2, p3 = data.start, data.direction, data.center, data.e1
        curve_tangent((p0, p1, p2, p3), (data.e2[0], data.drift[0]), data.length, x, out)
        return
    across = data.radius * data.rate
    cos, sin = across * np.cos(data.rate * x), across * np.sin(data.rate * x)
    for k in range(len(out)):
        out[k] = cos * data.e2[k] - sin * data.e1[k] + data.drift[k]
