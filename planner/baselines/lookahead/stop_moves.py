"""What method `stop` does: every block from rest to rest, a spline segment by segment.

Lines and arcs are the closed form of rest_to_rest.py. The segments of a spline have limits of their own, so a spline is a chain of
legs between two full stops, passed from one to the next at the speed that both allow and without acceleration (look_ahead.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.point_to_point import rest_to_rest_phases, rest_to_rest_times
from planner.baselines.lookahead.look_ahead import moves, swept
from planner.baselines.lookahead.passage import LegLimits, Passage
from planner.baselines.lookahead.ramps import JointKind
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.corners.smooth import curvature_jumps
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine


class Parts(NamedTuple):
    """P parts of a path, each passed with limits of its own, in moves from rest to rest."""

    first: Array  # (P+1,) first segment of each part, and M: one segment, or collinear lines of the same feed
    still: Array  # (P+1,) whether the motion stands still there


def parts_of(toolpath: Toolpath, join_lines: bool = False) -> Parts:
    """The parts of a path of M segments. A move is a block, or a part of a spline between kinks and jumps of its curvature, at which a
    motion cannot go on without a jump of its acceleration.

    join_lines : lines that go straight on are one move, so that it does not matter where a straight line is cut into blocks
    """
    first = np.arange(len(toolpath) + 1)
    curve, on = toolpath.curve >= 0, np.zeros(len(first), bool)
    if curve.any():
        same = curve[1:] & (toolpath.block[1:] == toolpath.block[:-1])
        on[1:-1] = same & (toolpath.joint[1:-1] == Joint.SMOOTH)
        on &= ~curvature_jumps(toolpath, first)
    if not join_lines:
        return Parts(first, ~on)
    begins = np.isin(first, legs_of(toolpath).first)
    begins[1:-1] |= toolpath.feed[1:] != toolpath.feed[:-1]
    return Parts(first[begins], ~on[begins])


def stop_phases(
    toolpath: Toolpath, machine: Machine, parts: Parts, length: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed (P,) at the start of each part [mm/s], durations [s] and jerks [mm/s3] (P, F) of its phases.

    length : (P,) of the parts [mm]
    """
    v, a, j = _limits(toolpath, machine, parts)
    if parts.still.all():
        return np.zeros(len(length)), *rest_to_rest_phases(length, v, a, j)
    beside = np.minimum(np.append(v, np.inf), np.insert(v, 0, np.inf))
    none = np.zeros(len(beside))
    kind = np.where(parts.still, JointKind.STOP, JointKind.PASS)
    legs = LegLimits(length=length, v=v, a=a, j=j)
    passage = swept(legs, Passage(kind=kind, V=np.where(parts.still, 0.0, beside), p=none, q=none))
    return passage.V[:-1], *moves(passage, legs)


def stop_time(toolpath: Toolpath, machine: Machine, join_lines: bool = False) -> float:
    """Time of all moves (`parts_of`), dwells included [s]."""
    parts = parts_of(toolpath, join_lines)
    length = np.add.reduceat(toolpath.length, parts.first[:-1])
    if parts.still.all():
        times = rest_to_rest_times(length, *_limits(toolpath, machine, parts))
    else:
        times = stop_phases(toolpath, machine, parts, length)[1]
    return float(times.sum() + np.sum(toolpath.dwell))


def _limits(toolpath: Toolpath, machine: Machine, parts: Parts) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed, acceleration and jerk (P,) that all segments of a part allow."""
    v, a, j = (np.minimum.reduceat(limit, parts.first[:-1]) for limit in block_limits(toolpath, machine))
    return v, a, j
