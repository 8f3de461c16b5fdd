"""The record of the programmed path: M segments (lines, arcs, helices, curves), M+1 joints.

Segment i runs from joint i to joint i+1. Every segment is a curve over its own parameter x in [0, length_i]:

    line   p(x) = start + x * u
    arc    p(x) = center + radius * (cos(rate x) e1 + sin(rate x) e2) + drift * x

`rate` [rad/mm] is signed; e1 points from the centre to the start, e2 is e1 turned by 90 degrees
counter-clockwise about the plane's normal; `drift` is the helix' rise per mm. Programs print arcs with
rounded numbers, so that start and end lie on circles of slightly different radius; the gap is spread over the
arc as a component of `drift` inside the plane, which makes the curve smooth and lets it end exactly on the
programmed point. x is the arc length but for that gap (relative error gap/length), so nothing downstream may
assume |dp/dx| = 1 on arcs. A curve of the program is several segments (geometry/curves.py); |dp/dx| is 1 at
their ends.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.geometry.curves import Curves
from planner.geometry.extrusion import Extrusion, extruding_part


def lesser_end(at_joints: FloatArray) -> FloatArray:
    """(M,) the smaller of the two values at the ends of each segment, of those `at_joints` (M+1,)."""
    lesser: FloatArray = np.minimum(at_joints[:-1], at_joints[1:])
    return lesser


class Joint(IntEnum):
    """How the motion passes the joint between two segments."""

    STOP = 0  # full stop, because the program needs rest: its ends, dwells, exact stop
    SMOOTH = 1  # the tangents agree: passed as it is, the curvature may jump
    CORNER = 2  # the tangents differ: to be passed within the joint's tolerance


# Turning angle above which the path turns right back [rad]: 175 degrees. The corner speed of paper 002 eq.
# (19), (20) is sqrt(1.5 X eps) cot(theta/2), 0.044 of sqrt(1.5 X eps) there.
REVERSAL_ANGLE = np.deg2rad(175.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Arcs:
    """The K arcs and helices of a toolpath, one row each (formula in the module text)."""

    center: FloatArray  # (K, A) [mm]
    e1: FloatArray  # (K, A) unit vector from the centre to the start
    e2: FloatArray  # (K, A) e1 turned counter-clockwise about the plane's normal
    drift: FloatArray  # (K, A) rise and closing gap per mm of x [-]
    radius: FloatArray  # (K,) [mm]
    rate: FloatArray  # (K,) signed turning [rad/mm]

    def __post_init__(self) -> None:
        arcs, axes = np.shape(self.center)
        freeze(self, "center e1 e2 drift", np.float64, (arcs, axes))
        freeze(self, "radius rate", np.float64, (arcs,))

    def __len__(self) -> int:
        return len(self.radius)


def _rows(table: Arcs | Curves, at: Array) -> Arcs | Curves:
    """Some rows of a table."""
    columns = {field.name: getattr(table, field.name)[at] for field in dataclasses.fields(table)}
    return dataclasses.replace(table, **columns)


@dataclass(frozen=True, eq=False, kw_only=True)
class Toolpath:
    """The programmed path: M segments over A axes, and M+1 joints.

    start, end      : (M, A) end points [mm]
    length          : (M,) range of the segment's parameter x [mm], > 0
    feed            : (M,) programmed feed [mm/s]; inf on rapids
    rapid           : (M,) True on G0 moves
    block           : (M,) index of the block of the program, non-decreasing
    line            : (M,) NC line of that block
    arc             : (M,) row in `arcs`, or -1
    curve           : (M,) row in `curves`, or -1; a segment that is neither arc nor curve is a line
    tangent_start   : (M, A) unit tangent at x = 0
    tangent_end     : (M, A) unit tangent at x = length
    curvature       : (M,) bound of the curvature and of |d2p/dx2| on the segment [1/mm], 0 on lines
    joint           : (M+1,) `Joint`; the first and the last are STOP
    theta           : (M+1,) turning angle at the joint [rad]; 0 at both ends
    tolerance       : (M+1,) contour tolerance eps at the joint [mm]
    dwell           : (M+1,) time to stand still at the joint [s], > 0 only where the joint is STOP
    held            : (M,) True where the feed is to be reached and held: threads (geometry/run_in.py)
    exact           : (M,) True where the path is followed exactly (G61, G61.1); no corner there is rounded
    radius          : rotary axes are in angles times this radius [mm], so that all axes are lengths
    extrusion       : what the extruder does along it; None without one
    speeds          : along the path at its first and its last joint [mm/s], with no acceleration: 0 for rest; the limits
                      of the axes and the feeds beside them allow them
    inside          : (M,) `along` over the smaller tolerance of the segment's ends [-], where joints were
                      given less of it (delivery/periods.py); None for 1
    """

    source: str
    axes: tuple[str, ...]
    start: FloatArray
    end: FloatArray
    length: FloatArray
    feed: FloatArray
    rapid: Array
    block: Array
    line: Array
    arc: Array
    arcs: Arcs
    curve: Array
    curves: Curves
    tangent_start: FloatArray
    tangent_end: FloatArray
    curvature: FloatArray
    joint: Array
    theta: FloatArray
    tolerance: FloatArray
    dwell: FloatArray
    held: Array
    exact: Array
    radius: float = 1.0
    extrusion: Extrusion | None = None
    speeds: tuple[float, float] = (0.0, 0.0)
    inside: FloatArray | None = None

    def __post_init__(self) -> None:
        segments, axes = len(self.length), len(self.axes)
        freeze(self, "start end tangent_start tangent_end", np.float64, (segments, axes))
        freeze(self, "length curvature", np.float64, (segments,))
        freeze(self, "feed", np.float64, (segments,), finite=False)
        freeze(self, "rapid held exact", np.bool_, (segments,))
        freeze(self, "block arc curve", np.int64, (segments,))
        freeze(self, "line", np.int32, (segments,))
        freeze(self, "joint", np.uint8, (segments + 1,))
        freeze(self, "theta tolerance dwell", np.float64, (segments + 1,))
        if self.inside is not None:
            freeze(self, "inside", np.float64, (segments,))
        if segments and (self.joint[0] != Joint.STOP or self.joint[-1] != Joint.STOP):
            raise ValueError("Toolpath.joint: the first and the last joint must be STOP")
        if not (self.length > 0).all():
            raise ValueError("Toolpath.length: every segment must have a length > 0 mm")

    def __len__(self) -> int:
        return len(self.length)

    @property
    def along(self) -> FloatArray:
        """(M,) contour tolerance along each segment, between its joints [mm]."""
        least = lesser_end(self.tolerance)
        return least if self.inside is None else least * self.inside

    @property
    def straight(self) -> Array:
        """(M,) True for lines."""
        return (self.arc < 0) & (self.curve < 0)

    @property
    def block_first(self) -> Array:
        """(N,) first segment of each block."""
        return np.flatnonzero(np.append(True, self.block[1:] != self.block[:-1]))

    def block_ends(self) -> Toolpath:
        """One line for each block, as long as the block: to time blocks, no path to be followed."""
        first = self.block_first
        if len(first) == len(self):
            return self
        last = np.append(first[1:], len(self)) - 1
        at = np.append(first, len(self))
        of_segment = ("start", "feed", "rapid", "held", "exact", "block", "line", "tangent_start")
        return dataclasses.replace(
            self,
            end=self.end[last],
            tangent_end=self.tangent_end[last],
            length=np.add.reduceat(self.length, first),
            curvature=np.maximum.reduceat(self.curvature, first),
            arc=np.full(len(first), -1),
            curve=np.full(len(first), -1),
            extrusion=None,
            inside=None,
            **{name: getattr(self, name)[first] for name in of_segment},
            **{name: getattr(self, name)[at] for name in ("joint", "theta", "tolerance", "dwell")},
        )

    def with_joints(self, at: Array | slice, how: Joint) -> Toolpath:
        """The same path with `how` for the joints `at` (indices, a mask or a slice)."""
        joint = self.joint.copy()
        joint[at] = how
        return dataclasses.replace(self, joint=joint)

    def resting(self) -> Toolpath:
        """The same path with full stops where it turns right back: a motion along a fixed path, whose rounded
        corner would be a cusp there, rests at the vertex. The program does not ask for it."""
        back = (self.joint == Joint.CORNER) & (self.theta > REVERSAL_ANGLE)
        return self.with_joints(back, Joint.STOP) if back.any() else self

    def segment_at(self, block: Array) -> Array:
        """(n,) the last segment of each block (n,); of blocks that are unknown or move nowhere one beside them."""
        return np.maximum(np.searchsorted(self.block, block, side="right") - 1, 0)

    @property
    def same_tolerance(self) -> float | None:
        """The contour tolerance if it is the same at every joint [mm]; None where the program changes it (G64 P)."""
        tolerance = self.tolerance
        return float(tolerance[0]) if (tolerance == tolerance[0]).all() else None

    @property
    def velocities(self) -> FloatArray:
        """(2, A) at the first and the last joint [mm/s]."""
        tangents = np.stack([self.tangent_start[0], self.tangent_end[-1]])
        return np.asarray(np.array(self.speeds)[:, None] * tangents)

    @property
    def rests(self) -> Array:
        """(M+1,) True at full stops: the ends are none where the path begins and ends in motion."""
        rests: Array = self.joint == Joint.STOP
        rests[[0, -1]] = np.equal(self.speeds, 0.0)
        return rests

    def with_leads(self, lengths: tuple[float, float]) -> Toolpath:
        """The path with a straight way before its begin and behind its end, from rest and to rest, which are run at no
        more than the speeds there. lengths : [mm]; 0 for none"""
        before, behind = (length > 0.0 for length in lengths)
        columns: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                sides = [(int(before), int(behind)), *[(0, 0)] * (value.ndim - 1)]
                columns[field.name] = np.pad(value, sides, mode="edge")
        for k, joint in [(0, 1)] * before + [(-1, -2)] * behind:
            columns["length"][k], columns["feed"][k] = lengths[k], self.speeds[k]
            columns["curvature"][k], columns["arc"][k], columns["curve"][k] = 0.0, -1, -1
            columns["tangent_start"][k] = columns["tangent_end"][k] = (
                self.tangent_start[0] if k == 0 else self.tangent_end[-1]
            )
            columns["joint"][joint] = Joint.SMOOTH
        if before:
            columns["start"][0] = self.start[0] - lengths[0] * self.tangent_start[0]
            columns["end"][0] = self.start[0]
        if behind:
            columns["start"][-1] = self.end[-1]
            columns["end"][-1] = self.end[-1] + lengths[1] * self.tangent_end[-1]
        return dataclasses.replace(self, speeds=(0.0, 0.0), **columns)

    def part(self, kept: Array) -> Toolpath:
        """The segments `kept` (M,) one after the other, all of what lies between two full stops or none of
        it: where some are left out, the path jumps at a full stop."""
        # with the joint behind each segment; the first is a full stop, like all that begin a part
        joints = np.append(True, kept)
        columns: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                columns[field.name] = value[kept if len(value) == len(self) else joints]
        # each segment has a row of its own in these, in order
        for row, table in (("arc", "arcs"), ("curve", "curves")):
            of_kept = columns[row] >= 0
            columns[table] = _rows(getattr(self, table), columns[row][of_kept])
            columns[row] = np.where(of_kept, np.cumsum(of_kept) - 1, -1)
        if self.extrusion is not None:
            columns["extrusion"] = extruding_part(self.extrusion, kept)
        return dataclasses.replace(self, **columns)
