"""Blocks from rest to rest, the papers' reference: limits along a block, and the moves.

Lines and arcs are the closed form of base/point_to_point.py. The segments of a spline have limits of their
own, so a spline is a chain of legs between two full stops, passed from one to the next at the speed that both
allow and without acceleration (look_ahead.py).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.point_to_point import rest_to_rest_phases, rest_to_rest_times
from planner.baselines.lookahead.look_ahead import moves, swept
from planner.baselines.lookahead.ramps import LEG, WAY, JointKind, records
from planner.corners.budget import error_rate
from planner.corners.smooth import curvature_jumps
from planner.feedrate.constraints.limits import Limits
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import LINEAR_AXES, Machine

GOLDEN = float((np.sqrt(5.0) - 1.0) / 2.0)
GOLDEN_STEPS = 26  # which leave 4e-6 of the range of log v
AT_REST = 1e-12  # an axis with a smaller component of a unit vector does not limit; below the rounding of unit vectors [-]


def block_limits(toolpath: Toolpath, machine: Machine) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Limits v, a, j (M,) [mm/s], [mm/s2], [mm/s3] along each segment so that every axis keeps its own.

    On a line the tightest axis decides: min_k limit_k / |u_k|. On an arc the direction turns, so the smallest
    limit of the axes that move, each over the largest component that a unit vector has there (`_components`),
    must hold for the vector: with kappa v^2 <= a/sqrt2 and an acceleration of a/sqrt2 along the path the norm
    stays below a, and with kappa^2 v^3 <= j/(2 sqrt2), 3 kappa v a_s <= j/sqrt2 and j/(2 sqrt2) along the
    path the norm of the jerk stays below j (jerk = (j_s - kappa^2 v^3) T + 3 kappa v a_s N). The tangential
    acceleration and jerk are bounded by the share of the path that is in x, y and z, on curves as if all of it were.
    Normal acceleration, chord and filter error bound kappa v^2 as well. On a curve kappa changes, and a bound
    of |r'''| takes the place of kappa^2. Where the bound of v a_s holds, v is the one with which the segment
    takes least time from rest to rest: none of these limits makes it longer when it gets larger.
    """
    axes = toolpath.axes
    direction = np.abs(toolpath.tangent_start)
    limits = Limits.of(machine, axes)
    v, a, j = ((limit / np.maximum(direction, AT_REST)).min(axis=1) for limit in limits.of_axes)
    linear = np.linalg.norm(direction[:, np.isin(axes, LINEAR_AXES)], axis=1)
    a = np.minimum(a, limits.tangential / np.maximum(linear, AT_REST))
    j = np.minimum(j, limits.tangential_jerk / np.maximum(linear, AT_REST))
    curved = ~toolpath.straight
    kappa = toolpath.curvature[curved]
    twist, on_curve = kappa**2, toolpath.curve[curved] >= 0
    twist[on_curve] = np.maximum(twist[on_curve], toolpath.curves.twist[toolpath.curve[curved][on_curve]])
    component = np.maximum(_components(toolpath, curved), AT_REST)
    v_all, a_all, j_all = ((limit / component).min(axis=1) for limit in limits.of_axes)
    half = np.sqrt(0.5)
    budget = toolpath.along[curved] / error_rate(machine)
    across = np.minimum(half * a_all, np.minimum(budget, limits.normal))
    v[curved] = np.min(
        [v_all, np.sqrt(across / kappa), np.cbrt(half * j_all / (2 * twist)), toolpath.feed[curved]], axis=0
    )
    a[curved] = np.minimum(half * a_all, limits.tangential)
    j[curved] = np.minimum(half * j_all / 2, limits.tangential_jerk)
    product = np.full(len(v), np.inf)  # bound of v a_s [mm2/s3]
    product[curved] = half * j_all / (3 * kappa)
    bound = np.flatnonzero(v * a > product)
    v[bound], a[bound] = _fastest(toolpath.length[bound], v[bound], a[bound], j[bound], product[bound])
    return np.minimum(v, toolpath.feed), a, j


def _components(toolpath: Toolpath, curved: Array) -> FloatArray:
    """(n, A) the largest component along each axis that a unit vector along or across the path can have, on
    the segments `curved` (M,): on an arc its drift's and that of its plane, on a curve 1 for the axes in
    which its control points differ."""
    arc, curve = toolpath.arc[curved], toolpath.curve[curved]
    found = np.empty((len(arc), len(toolpath.axes)))
    row = arc[arc >= 0]
    in_plane = np.hypot(toolpath.arcs.e1[row], toolpath.arcs.e2[row])
    found[arc >= 0] = np.minimum(in_plane + np.abs(toolpath.arcs.drift[row]), 1.0)
    found[curve >= 0] = np.ptp(toolpath.curves.points[curve[curve >= 0]], axis=1) > 0.0
    return found


def _fastest(
    length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray, product: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """v and a (n,) of the shortest moves from rest to rest with v a <= product, below the given v and a; by
    golden sections of log v, from the v that leaves a as it is to the one that is given. Where v is reached,
    a move takes L/v + v^2/P + P/(v j) with P the product: a sum of exponentials of log v, which is convex.
    Where it is not, it takes the longer the lower a is: the higher v."""
    low, high = np.log(product / a), np.log(v)

    def time(at: FloatArray) -> FloatArray:
        speed = np.exp(at)
        return rest_to_rest_times(length, speed, product / speed, j)

    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    times = [time(at) for at in inner]
    for _ in range(GOLDEN_STEPS):
        left = times[0] < times[1]
        low, high = np.where(left, low, inner[0]), np.where(left, inner[1], high)
        new = np.where(left, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        for two, there in ((inner, new), (times, time(new))):
            two[:] = np.where(left, there, two[1]), np.where(left, two[0], there)
    speed = np.exp(np.where(times[0] < times[1], inner[0], inner[1]))
    return speed, product / speed


class Parts(NamedTuple):
    """P parts of a path, each passed with limits of its own, in moves from rest to rest."""

    first: Array  # (P+1,) first segment of each part, and M: one segment, or collinear lines of the same feed
    still: Array  # (P+1,) whether the motion stands still there


def parts_of(toolpath: Toolpath, join_lines: bool = False) -> Parts:
    """The parts of a path of M segments. A move is a block, or a part of a spline between kinks and jumps of its curvature,
    at which a motion's acceleration would jump; with `join_lines` lines that go straight on are one, too."""
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
    """Speed (P,) at the start of each part of a `length` (P,) [mm], [mm/s]; durations [s], jerks [mm/s3] (P, F) of its phases."""
    v, a, j = _limits(toolpath, machine, parts)
    if parts.still.all():
        return np.zeros(len(length)), *rest_to_rest_phases(length, v, a, j)
    beside = np.minimum(np.append(v, np.inf), np.insert(v, 0, np.inf))
    kind = np.where(parts.still, JointKind.STOP, JointKind.PASS)
    legs = records(LEG, length=length, v=v, a=a, j=j)
    ways = swept(legs, records(WAY, kind=kind, V=np.where(parts.still, 0.0, beside)))
    return ways.V[:-1], *moves(ways, legs)


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
