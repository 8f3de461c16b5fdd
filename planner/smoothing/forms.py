"""Quadratic forms of the control points: third derivatives along the path, and what a motion along it does.

At the place u of the path, passed at u' = du/dt, the axes move with

    velocity      p_u u'
    acceleration  p_uu u'^2 + p_u u''
    jerk          p_uuu u'^3 + 3 p_uu u' u'' + p_u u'''

(p_u = dp/du), all linear in the control points as long as u(t) stays. From feed v, acceleration a and jerk j along the path, with
g = |p_u|:  u' = v/g,  u'' = (a - g_u u'^2)/g,  u''' = (j - g_uu u'^3 - 3 g_u u' u'')/g.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, ORDER, clamped, derivatives, span_basis

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, NODE_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0  # exact for squares of third derivatives


@njit(cache=True, error_model="numpy")
def third_derivative_forms(span_first, breaks, weights, H):
    """Add the integrals of the squared third derivatives times weights (A,) along all runs to the bands H (A, n, 6)."""
    rows = np.empty((4, ORDER))
    for q in range(len(span_first) - 1):
        cut = breaks[span_first[q] + q : span_first[q + 1] + q + 1]
        basis = span_basis(clamped(cut))
        begin = span_first[q] + DEGREE * q
        for i in range(len(cut) - 1):
            h = cut[i + 1] - cut[i]
            for node in range(len(NODES)):
                derivatives(basis[i], NODES[node], h, rows)
                for k in range(len(weights)):
                    add_square(H[k, begin:], i, rows[3], weights[k] * NODE_WEIGHTS[node] * h)


@njit(cache=True, error_model="numpy")
def third_derivative_energy(cut, basis, weights, c, first, last):
    """Integral of the squared third derivatives times weights (A,) over the spans first .. last - 1."""
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
def _add_prices(basis, control, cut, i, tau, v, a, jerk, weight, limits, own, H, Q):
    """Add what one end of a grid interval pays to H, and its own weight to Q (optimal/reshape.py).

    v, a, jerk : along the path; weight (A, 3) of squared velocity, acceleration and jerk over their `limits` (2, A); own: of Q [s]
    """
    axes = control.shape[1]
    rows = np.empty((4, ORDER))
    derivatives(basis[i], tau, cut[i + 1] - cut[i], rows)
    jet = np.zeros((3, axes))
    for k in range(axes):
        for m in range(3):
            for d in range(ORDER):
                jet[m, k] += rows[m + 1, d] * control[i + d, k]
    speed_sq, along2, along3, bend = 0.0, 0.0, 0.0, 0.0
    for k in range(axes):
        speed_sq += jet[0, k] * jet[0, k]
        along2 += jet[0, k] * jet[1, k]
        along3 += jet[0, k] * jet[2, k]
        bend += jet[1, k] * jet[1, k]
    speed = np.sqrt(speed_sq)
    grows = along2 / speed  # d|p'|/du, and then its derivative
    grows2 = along3 / speed + (bend - grows * grows) / speed
    du = v / speed
    ddu = (a - grows * du * du) / speed
    dddu = (jerk - grows2 * du * du * du - 3.0 * grows * du * ddu) / speed
    row_v, row_a, row_j = np.empty(ORDER), np.empty(ORDER), np.empty(ORDER)
    for d in range(ORDER):
        row_v[d] = rows[1, d] * du
        row_a[d] = rows[2, d] * du * du + rows[1, d] * ddu
        row_j[d] = rows[3, d] * du * du * du + 3.0 * rows[2, d] * du * ddu + rows[1, d] * dddu
    for k in range(axes):
        if weight[k, 0] > 0.0:
            add_square(H[k], i, row_v, weight[k, 0])
        if weight[k, 1] > 0.0:
            add_square(H[k], i, row_a, weight[k, 1] / limits[0, k] ** 2)
        share = 1.0 / limits[1, k] ** 2
        if weight[k, 2] > 0.0:
            add_square(H[k], i, row_j, weight[k, 2] * share)
        add_square(Q[k], i, row_j, own * share)


@njit(cache=True, error_model="numpy")
def motion_forms(
    span_first, breaks, control, fits, interval, of_span, tau, v, a, jerk, duration, price, limits, H, Q
):  # fmt: skip
    """Add what a motion along the splines pays to the bands H, and its squared jerks over their limits, times dt, to Q (A, n, 6).

    interval    : (Q+1,) the grid intervals of each run; of_span (I,) their span, counted within the run; tau (I, 2) its part
    v, a        : (I, 2) feed and acceleration along the path at both ends; jerk, duration (I,)
    price       : (I, 2, A, 3) weights of squared velocity, acceleration and jerk, the last two over their limits
    limits      : (2, A) of acceleration and jerk
    """
    for q in range(len(fits)):
        if not fits[q]:
            continue
        s0, s1 = span_first[q], span_first[q + 1]
        cut = breaks[s0 + q : s1 + q + 1]
        basis = span_basis(clamped(cut))
        c = control[s0 + DEGREE * q : s1 + DEGREE * (q + 1)]
        begin, end = s0 + DEGREE * q, s1 + DEGREE * (q + 1)
        for i in range(interval[q], interval[q + 1]):
            for e in range(2):
                _add_prices(
                    basis, c, cut, of_span[i], tau[i, e], v[i, e], a[i, e], jerk[i], price[i, e], limits, 0.5 * duration[i],
                    H[:, begin:end], Q[:, begin:end],
                )  # fmt: skip
