"""Bounds on x = feed^2 at a point of the path, one function per limit, each with its closed form.

    programmed feed       x <= F^2
    axis velocity         |r'_k| feed <= v_k                     x <= min_k (v_k / r'_k)^2
    normal acceleration   kappa x <= A                           eq. (19), constraints/normal_limit.py
    chord error           kappa x dt^2 / 8 <= eps_ch             eq. (19), approximate form: rigorous, because the interpolator
                                                                 advances the arc length feed*dt per period (docs/papers.md D)
    filter error          kappa x sum_i T_i^2 / 24 <= eps_fir    papers 000/001 (par. 21)
    phase lag             feed kappa (sum_i T_i)/2 <= phi        paper 001 (par. 26)
    curvature jump        |r''_k(s+) - r''_k(s-)| x <= a_k       where a line meets an arc: the acceleration steps

All take arrays over points and return (P,) bounds, inf where the path does not limit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.base.arrays import Array, FloatArray


def programmed_feed(feed: FloatArray) -> FloatArray:
    """x <= F^2; `feed` (P,) [mm/s], inf on rapids."""
    return feed**2


def axis_velocity(d1: FloatArray, limits: FloatArray) -> tuple[FloatArray, Array]:
    """x <= min_k (v_k/|r'_k|)^2 for tangents d1 (P, A); also the index (P,) of the axis that limits."""
    ratio = np.abs(d1) / limits
    axis = ratio.argmax(axis=1)
    return 1.0 / ratio[np.arange(len(d1)), axis] ** 2, axis


def chord_error(kappa: FloatArray, tol: FloatArray, dt: float) -> FloatArray:
    """(P,) kappa x dt^2/8 <= tol for kappa (P,) [1/mm], tol (P,) [mm] and the interpolation period dt [s]."""
    return _over(tol, kappa * dt**2 / 8.0)


def filter_error(
    kappa: FloatArray, tol: FloatArray, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) kappa x sum T^2/24 <= tol for kappa (P,) [1/mm], tol (P,) [mm] and averages of lengths T = time_constants [s]."""
    return _over(tol, kappa * sum(T * T for T in time_constants) / 24.0)


def phase_lag(kappa: FloatArray, angle: float, time_constants: Sequence[FloatArray | float]) -> FloatArray:
    """(P,) feed kappa sum T/2 <= angle [rad] for kappa (P,) [1/mm] and T = time_constants [s]: on a circle the filtered point lags by
    feed kappa times the filters' delay."""
    return _over(angle, kappa * sum(time_constants) / 2.0) ** 2


def curvature_jump(d2_left: FloatArray, d2_right: FloatArray, limits: FloatArray) -> tuple[FloatArray, Array]:
    """|d2_right - d2_left| x <= limits for r'' (P, A) on both sides and every axis; also the index (P,) of the axis that limits."""
    ratio = np.abs(d2_right - d2_left) / limits
    axis = ratio.argmax(axis=1)
    return _over(1.0, ratio[np.arange(len(ratio)), axis]), axis


def _over(value: FloatArray | float, by: FloatArray) -> FloatArray:
    """value/by, inf where by is 0."""
    return np.divide(value, by, out=np.full(by.shape, np.inf), where=by > 0)
