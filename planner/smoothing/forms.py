"""Quadratic forms of the control points: third derivatives along the path, and what a motion along it does.

At the place u of the path, passed at u' = du/dt, the axes move with

    velocity      p_u u'
    acceleration  p_uu u'^2 + p_u u''
    jerk          p_uuu u'^3 + 3 p_uu u' u'' + p_u u'''

(p_u = dp/du), all linear in the control points as long as u(t) stays. From feed v, acceleration a and jerk j
along the path, with
g = |p_u|:  u' = v/g,  u'' = (a - g_u u'^2)/g,  u''' = (j - g_uu u'^3 - 3 g_u u' u'')/g.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import ORDER, derivatives
from planner.smoothing.sites import control_first, run_control, run_knots

# Gauss-Legendre rule of three points on [0, 1], exact for squares of third derivatives, which are of degree
# 4.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, NODE_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


class SplineMotion(NamedTuple):
    """A motion along the splines of Q runs: its grid intervals (I,) on them, run q holds interval[q] :
    interval[q+1], and what it pays for squared velocity, acceleration and jerk of each axis at the two ends
    of each."""

    interval: Array  # (Q+1,)
    span: Array  # (I,) counted within the run
    tau: FloatArray  # (I, 2) place on the span
    feed: FloatArray  # (I, 2) along the path [mm/s], like the next two
    acc: FloatArray  # (I, 2) [mm/s2]
    jerk: FloatArray  # (I,) [mm/s3]
    duration: FloatArray  # (I,) [s]
    price: FloatArray  # (I, 2, A, 3) weights, the last two over the squares of their limits


@njit(cache=True, error_model="numpy")
def third_derivative_bands(splines, weights):
    """(A, n, 6) bands of the integrals of the squared third derivatives times weights (A,) along all runs
    [1/mm5]: 1/2 c'Hc of the control points c [mm] is the integral [1/mm3]."""
    H = np.zeros((len(weights), len(splines.control), ORDER))
    for q in range(len(splines.fits)):
        knots, begin = run_knots(splines, q), control_first(splines, q)
        add_third_derivatives(knots, weights, H[:, begin:])
    return H


@njit(cache=True, error_model="numpy")
def add_third_derivatives(knots, weights, H):
    """Add the integral of the squared third derivatives times weights (A,) along one run to its bands H (A,
    n, 6)."""
    rows = np.empty((4, ORDER))
    for i in range(len(knots.breaks) - 1):
        h = knots.breaks[i + 1] - knots.breaks[i]
        for node in range(len(NODES)):
            derivatives(knots.basis[i], NODES[node], h, rows)
            for k in range(len(weights)):
                add_square(H[k], i, rows[3], weights[k] * NODE_WEIGHTS[node] * h)


@njit(cache=True, error_model="numpy")
def third_derivative_energy(knots, weights, c, first, last):
    """Integral of the squared third derivatives times weights (A,) over the spans first .. last - 1 [1/mm3],
    from the control points c (n, A) [mm] of the run."""
    cut, basis = knots
    total = 0.0
    rows = np.empty((4, ORDER))
    for i in range(first, last):
        h = cut[i + 1] - cut[i]
        for q in range(len(NODES)):
            derivatives(basis[i], NODES[q], h, rows)
            for k in range(c.shape[1]):
                value = 0.0
                for d in range(ORDER):
                    value += rows[3, d] * (c[i + d, k] - c[i, k])
                total += weights[k] * NODE_WEIGHTS[q] * h * value * value
    return total


@njit(cache=True, error_model="numpy")
def add_square(band, i, row, weight):
    """Add weight (row . c_i..i+5)^2 to a band (n, 6), so that it counts 1/2 c'Hc."""
    for b in range(ORDER):
        value = 2.0 * weight * row[b]
        for a in range(b + 1):
            band[i + b, ORDER - 1 - b + a] += value * row[a]


@njit(cache=True, error_model="numpy")
def time_derivatives(rows, tangent, feed, acc, jerk, out):
    """out (4, 6) = the basis functions and their time derivatives in a motion with feed, acc and jerk along
    the path, from the derivatives by the spline's parameter, `rows` (4, 6) of the basis functions and
    `tangent` (3, A) of the curve; returns
    |p_u|."""
    square, along2, along3, bend = 0.0, 0.0, 0.0, 0.0
    for k in range(tangent.shape[1]):
        square += tangent[0, k] * tangent[0, k]
        along2 += tangent[0, k] * tangent[1, k]
        along3 += tangent[0, k] * tangent[2, k]
        bend += tangent[1, k] * tangent[1, k]
    speed = np.sqrt(square)
    grows = along2 / speed  # d|p'|/du, and then its derivative
    grows2 = along3 / speed + (bend - grows * grows) / speed
    du = feed / speed
    ddu = (acc - grows * du * du) / speed
    dddu = (jerk - grows2 * du * du * du - 3.0 * grows * du * ddu) / speed
    for b in range(ORDER):
        out[0, b] = rows[0, b]
        out[1, b] = rows[1, b] * du
        out[2, b] = rows[2, b] * du * du + rows[1, b] * ddu
        out[3, b] = rows[3, b] * du * du * du + 3.0 * rows[2, b] * du * ddu + rows[1, b] * dddu
    return speed


@njit(cache=True, error_model="numpy")
def _add_prices(knots, control, motion, at, limits, H, Q):
    """Add what a motion pays at one end of a grid interval, at = (interval, end), to H, and its squared jerks
    to Q (`motion_bands`)."""
    interval, end = at
    i, weight = motion.span[interval], motion.price[interval, end]
    v, a, jerk = motion.feed[interval, end], motion.acc[interval, end], motion.jerk[interval]
    own = 0.5 * motion.duration[interval]
    axes = control.shape[1]
    rows = np.empty((4, ORDER))
    derivatives(knots.basis[i], motion.tau[interval, end], knots.breaks[i + 1] - knots.breaks[i], rows)
    jet = np.zeros((3, axes))
    for k in range(axes):
        for m in range(3):
            for d in range(ORDER):
                jet[m, k] += rows[m + 1, d] * control[i + d, k]
    in_time = np.empty((4, ORDER))
    time_derivatives(rows, jet, v, a, jerk, in_time)
    for k in range(axes):
        if weight[k, 0] > 0.0:
            add_square(H[k], i, in_time[1], weight[k, 0])
        if weight[k, 1] > 0.0:
            add_square(H[k], i, in_time[2], weight[k, 1] / limits[0, k] ** 2)
        share = 1.0 / limits[1, k] ** 2
        if weight[k, 2] > 0.0:
            add_square(H[k], i, in_time[3], weight[k, 2] * share)
        add_square(Q[k], i, in_time[3], own * share)


@njit(cache=True, error_model="numpy")
def motion_bands(splines, motion, limits):
    """Two bands (A, n, 6) over the control points of all runs that fit: of what the motion pays, and of its
    squared jerks over their limits, times dt (planning/optimal/reshape.py), both [s/mm2].

    limits : (2, A) of acceleration [mm/s2] and jerk [mm/s3]
    """
    axes, n = splines.control.shape[1], len(splines.control)
    H, Q = np.zeros((axes, n, ORDER)), np.zeros((axes, n, ORDER))
    add_motion_bands(splines, motion, limits, H, Q)
    return H, Q


@njit(cache=True, error_model="numpy", nogil=True)
def add_motion_bands(splines, motion, limits, H, Q):
    """Add the bands of a part of a motion, some of its intervals, to H and Q (`motion_bands`)."""
    for q in range(len(splines.fits)):
        if not splines.fits[q] or motion.interval[q] == motion.interval[q + 1]:
            continue
        knots, control = run_knots(splines, q), run_control(splines, q)
        begin, end = control_first(splines, q), control_first(splines, q + 1)
        for interval in range(motion.interval[q], motion.interval[q + 1]):
            for side in range(2):
                _add_prices(
                    knots, control, motion, (interval, side), limits, H[:, begin:end], Q[:, begin:end]
                )
