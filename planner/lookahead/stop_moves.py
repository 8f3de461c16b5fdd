"""What method `stop` does: every block from rest to rest, a spline segment by segment.

Lines and arcs are the closed form of rest_to_rest.py. The segments of a spline have limits of their own, so a spline is a chain of
legs between two full stops, passed from one to the next at the speed that both allow and without acceleration (look_ahead.py).
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.point_to_point import rest_to_rest_phases, rest_to_rest_times
from planner.corners.smooth import curvature_jumps
from planner.geometry.toolpath import Joint, Toolpath
from planner.lookahead.look_ahead import moves, swept
from planner.lookahead.passage import LegLimits, Passage
from planner.lookahead.ramps import JointKind
from planner.lookahead.rest_to_rest import block_limits
from planner.machine import Machine


def block_moves(toolpath: Toolpath) -> Array:
    """(N+1,) first segment of each move from rest to rest, and M: a block, or a part of a spline between kinks and jumps of its
    curvature, at which a motion cannot go on without a jump of its acceleration."""
    curve, joint = toolpath.curve >= 0, np.arange(len(toolpath) + 1)
    if not curve.any():
        return joint
    on = np.zeros(len(joint), bool)
    on[1:-1] = (
        curve[1:] & (toolpath.block[1:] == toolpath.block[:-1]) & (toolpath.joint[1:-1] == Joint.SMOOTH)
    )
    return np.flatnonzero(~on | curvature_jumps(toolpath, joint))


def stop_phases(
    toolpath: Toolpath, machine: Machine, length: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed (M,) at the start of each segment [mm/s], durations [s] and jerks [mm/s3] (M, F) of its phases.

    length : (M,) of the segments [mm]
    """
    v, a, j = block_limits(toolpath, machine)
    inside = np.ones(len(toolpath) + 1, bool)
    inside[block_moves(toolpath)] = False
    if not inside.any():
        return np.zeros(len(toolpath)), *rest_to_rest_phases(length, v, a, j)
    beside = np.minimum(np.append(v, np.inf), np.insert(v, 0, np.inf))
    none = np.zeros(len(inside))
    kind = np.where(inside, JointKind.PASS, JointKind.STOP)
    legs = LegLimits(length=length, v=v, a=a, j=j)
    passage = swept(legs, Passage(kind=kind, V=np.where(inside, beside, 0.0), p=none, q=none))
    return passage.V[:-1], *moves(passage, legs)


def stop_time(toolpath: Toolpath, machine: Machine) -> float:
    """Time of all moves, dwells included [s]."""
    if (toolpath.curve >= 0).any():
        times = stop_phases(toolpath, machine, toolpath.length)[1].sum(axis=1)
    else:
        times = rest_to_rest_times(toolpath.length, *block_limits(toolpath, machine))
    return float(times.sum() + np.sum(toolpath.dwell))
