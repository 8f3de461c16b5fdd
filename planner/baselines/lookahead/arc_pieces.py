"""Arcs from rest to rest as pieces of constant jerk of every axis: the twice continuously differentiable cubic spline in time.

A move s(t) along an arc is cut into pieces that turn little; the spline through their ends p_i, at rest at both ends of the arc, has
the accelerations M_i that solve (h_i the pieces' durations, d_i = (p_{i+1} - p_i)/h_i)

    h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}),
    2 h_0 M_0 + h_0 M_1 = 6 d_0,        h_{n-1} M_{n-1} + 2 h_{n-1} M_n = -6 d_{n-1}      at the two ends,

and on piece i starts with the velocity d_i - h_i (2 M_i + M_{i+1})/6 and has the jerk (M_{i+1} - M_i)/h_i.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray


def spline_at_rest(
    duration: FloatArray, position: FloatArray, last: Array
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Velocity, acceleration and jerk (n, A) at the starts of n pieces on moves that begin and end at rest.

    duration : (n,) [s]
    position : (n + moves, A) points before and after every piece, move after move [mm]
    last     : (n + moves,) True at the last point of each move
    """
    if not len(duration):
        empty = np.empty((0, position.shape[1]))
        return empty, empty, empty
    from scipy.linalg import solve_banded  # 0.2 s

    start = np.flatnonzero(~last)  # the points that a piece starts at
    h = np.zeros(len(position))
    h[start] = duration
    slope = np.zeros_like(position)
    slope[start] = (position[start + 1] - position[start]) / duration[:, None]
    before, slope_before = np.insert(h[:-1], 0, 0.0), np.insert(slope[:-1], 0, 0.0, axis=0)
    bands = np.zeros((3, len(position)))
    bands[1] = 2.0 * (before + h)
    bands[0, 1:], bands[2, :-1] = (
        h[:-1],
        h[:-1],
    )  # 0 between moves, whose ends thus know nothing of each other
    M = solve_banded((1, 1), bands, 6.0 * (slope - slope_before))
    velocity = slope[start] - duration[:, None] * (2.0 * M[start] + M[start + 1]) / 6.0
    return velocity, M[start], (M[start + 1] - M[start]) / duration[:, None]
