"""Runs: the parts of the path that are replaced by one curve each.

A run reaches from full stop to full stop, or from and to the middle of long straight legs, which stay as they
are. A corner influences the motion only within one braking distance, plus the knots of a smooth end.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.smoothing.basis import DEGREE

BRAKING_WAYS = 1.5  # of a straight leg that belong to the run beside it ...
END_SPANS = 6.0  # ... and so many of the longest spans, five of which end on the straight line
MIDDLE = 0.5  # of that at least is left of a leg in the middle, or the runs on both sides are one [-]
LONGEST_DELAY = 1.0  # a span lasts at most so many times a/j ...
LONGEST_WAY = 0.2  # ... or takes this share of feed^2/a, if that is more ...
LONGEST_TOLERANCE = 4.0  # ... or so many tolerances [-]


class SplineRuns(NamedTuple):
    """Q runs in order. Run q begins on the leg before its first joint and ends on the leg after its last."""

    joint_first: Array  # (Q,) joints between legs that it replaces
    joint_last: Array  # (Q,)
    x_first: FloatArray  # (Q,) where it begins on its first leg [mm]
    x_last: FloatArray  # (Q,) where it ends on its last leg [mm]
    fixed_first: Array  # (Q,) control points that stay at its start: 1 at a full stop, 5 on a straight leg
    fixed_last: Array  # (Q,) and at its end


def longest_span(path: SmoothPath, machine: Machine, tol: FloatArray) -> FloatArray:
    """(R,) the longest that a span may be on each leg [mm]: short enough for the profile to build up its
    acceleration within a few spans, and no shorter than the tolerance asks for. tol : (R,) tolerance of each
    leg [mm]"""
    feed, a, j = _motion(path, machine)
    return np.maximum(
        np.maximum(LONGEST_DELAY * feed * a / j, LONGEST_WAY * feed**2 / a), LONGEST_TOLERANCE * tol
    )


def find_runs(path: SmoothPath, machine: Machine, longest: FloatArray) -> SplineRuns:
    """The runs of a path over R legs (module text), but for those on legs that are to be followed exactly.

    longest : (R,) longest span on each leg [mm], from `longest_span`
    """
    legs, cut = path.legs, path.joint == Joint.STOP
    feed, a, j = _motion(path, machine)
    reach = BRAKING_WAYS * (feed**2 / (2.0 * a) + feed * a / (2.0 * j)) + END_SPANS * longest
    inside = ~cut
    ends = cut[:-1].astype(int) + cut[1:]  # of each leg that are no joints of runs
    split = ~legs.table["round"] & (legs.length > (2.0 - ends + MIDDLE) * reach)
    before = np.concatenate([[True], split])  # the leg before each joint is split
    after = np.concatenate([split, [True]])
    first = np.flatnonzero(inside & (before | np.concatenate([[True], cut[:-1]])))
    last = np.flatnonzero(inside & (after | np.concatenate([cut[1:], [True]])))
    exact = np.append(0, np.cumsum(np.logical_or.reduceat(path.toolpath.exact, legs.first[:-1])))
    free = exact[last + 1] == exact[first - 1]
    first, last = first[free], last[free]
    return SplineRuns(
        joint_first=first,
        joint_last=last,
        x_first=np.where(split[first - 1], legs.length[first - 1] - reach[first - 1], 0.0),
        x_last=np.where(split[last], reach[last], legs.length[last]),
        fixed_first=np.where(split[first - 1], DEGREE, 1),
        fixed_last=np.where(split[last], DEGREE, 1),
    )


def _motion(path: SmoothPath, machine: Machine) -> tuple[FloatArray, float, float]:
    """Feed (R,) of the fastest block of each leg, finite; acceleration and jerk of the slowest axis."""
    toolpath = path.toolpath
    fastest = np.linalg.norm(machine.limits("velocity", toolpath.axes))
    feed = np.maximum.reduceat(np.minimum(toolpath.feed, fastest), path.legs.first[:-1])
    return (
        feed,
        float(machine.limits("acceleration", toolpath.axes).min()),
        float(machine.limits("jerk", toolpath.axes).min()),
    )
