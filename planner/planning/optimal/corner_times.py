"""The least time of a motion on single corners, in closed form: no grid, a few operations for each corner.

A corner between two straight legs begins and ends with their directions e1 and e2, without curvature. Let
theta be the angle between them, s = sin(theta/2), n = (e2 - e1)/(2 s), and T the time from its beginning to
its end, with the speeds v0 and v1 there. Across the corner, along n, the velocity goes from -v0 s to v1 s,
and the acceleration is -u0 s at the beginning and u1 s at the end, where u0 and u1 are accelerations along
straight legs: |u| <= U = min_k a_k/|e_k|. With A_n = sum_k a_k |n_k| and J_n = sum_k j_k |n_k|, the largest
acceleration and jerk along n,

    (v0 + v1) s <= integral min(U s + J_n t, U s + J_n (T - t), A_n) dt <= min(U s T + J_n T^2/4, A_n T).

The speed changes by |a| at most, the norm of all accelerations, so it is v0 + |a| t and v1 + |a| (T - t) at
most: the corner's length is l <= (v0 + v1) T/2 + |a| T^2/4, and both together

    l <= J_n T^3/(8 s) + (2 U + |a|) T^2/4,        l <= (A_n/(2 s) + |a|/4) T^2.

l is at least the distance of the corner's ends. Therefore T is at least the root of the first, that of the
second, and l over the largest speed, whatever the shape of the corner; straight parts take their length over
the largest speed, and no piece between two full stops of length L less than 2 sqrt(L/|a|). With chords of 0.1
to 0.3 mm, 100 mm/s and 2e5 mm/s3 that tells that splines are faster; with long legs and few corners it says
little.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath
from planner.geometry.toolpath import Joint
from planner.machine import Machine

# Points on a grid of the usual resolution, about: of a corner (98 on chords of 0.3 mm, 213 on chords of 20
# um, at a/j = 40 ms), and of the rest of a leg.
CORNER_POINTS, LEG_POINTS = 100.0, 10.0
NEWTON_STEPS = 30  # from above, for the root of a cubic that is convex and ascending: to the last digits
ROUNDING = 1e-9  # taken off a root [-]


class CornerBounds(NamedTuple):
    """Of a motion on corners between full stops: time (G,) that it takes at least [s], points (G,) of its
    grid, about."""

    time: FloatArray
    points: FloatArray


def corner_times(path: SmoothPath, machine: Machine, *, jerk_limited: bool = True) -> CornerBounds:
    """Bounds (module text) for the pieces between full stops of a path with rounded corners.

    Raises InputError if the machine lacks an axis of the path.
    """
    toolpath, legs, axes = path.toolpath, path.legs, path.toolpath.axes
    velocity, acceleration = machine.limits("velocity", axes), machine.limits("acceleration", axes)
    fastest, strongest = float(np.linalg.norm(velocity)), float(np.linalg.norm(acceleration))
    feed = np.maximum.reduceat(toolpath.feed, legs.first[:-1])
    line = ~legs.table["round"]
    direction = legs.vector("direction")
    along = np.abs(direction)
    speed = np.minimum(feed, np.where(line, _least_ratio(velocity, along), fastest))
    straight = np.maximum(legs.length - path.d_out[:-1] - path.d_in[1:], 0.0) / speed

    between_lines = np.concatenate([[False], line[:-1] & line[1:], [False]])
    corner = np.flatnonzero(
        between_lines & (path.d > 0.0)
    )  # the tangents of arcs are not those at the corner's ends
    before, after = corner - 1, corner
    d_in, d_out = path.d_in[corner], path.d_out[corner]
    theta = path.theta[corner]
    length = np.sqrt(np.maximum(d_in**2 + d_out**2 + 2.0 * d_in * d_out * np.cos(theta), 0.0))
    s = np.maximum(np.sin(theta / 2.0), 1e-9)  # with less there is no corner
    n = np.abs(direction[after] - direction[before]) / (2.0 * s[:, None])
    held = _least_ratio(acceleration, along)
    square = (2.0 * np.maximum(held[before], held[after]) + strongest) / 4.0
    took = length / np.minimum(np.maximum(feed[before], feed[after]), fastest)
    took = np.maximum(took, np.sqrt(length / (n @ acceleration / (2.0 * s) + strongest / 4.0)))
    if jerk_limited:
        cube = n @ machine.limits("jerk", axes) / (8.0 * s)
        took = np.maximum(took, (1.0 - ROUNDING) * _root(cube, square, length))

    stop = np.flatnonzero(path.joint == Joint.STOP)
    at_joint = np.zeros(len(path.joint))
    at_joint[corner] = took
    between = np.add.reduceat(straight + at_joint[:-1], stop[:-1])
    way = np.zeros(len(path.joint))
    way[corner] = length
    run = np.add.reduceat(straight * speed + way[:-1], stop[:-1])
    points = LEG_POINTS + CORNER_POINTS * (path.d[:-1] > 0.0)
    return CornerBounds(
        time=np.maximum(between, 2.0 * np.sqrt(run / strongest)), points=np.add.reduceat(points, stop[:-1])
    )


def _least_ratio(limit: FloatArray, along: FloatArray) -> FloatArray:
    """(n,) the smallest of limit_k over along_k, for |direction| `along` (n, A); inf where none is moved."""
    ratio = np.divide(limit, along, out=np.full(along.shape, np.inf), where=along > 0.0)
    return np.asarray(ratio.min(axis=1))


def _root(cube: FloatArray, square: FloatArray, whole: FloatArray) -> Array:
    """(n,) T > 0 with cube T^3 + square T^2 = whole, each (n,); 0 where `whole` is."""
    T = np.minimum(np.cbrt(whole / cube), np.sqrt(whole / square))
    for _ in range(NEWTON_STEPS):
        value, slope = T * T * (cube * T + square) - whole, T * (3.0 * cube * T + 2.0 * square)
        T = T - np.divide(value, slope, out=np.zeros(len(T)), where=slope > 0.0)
    return np.asarray(T)
