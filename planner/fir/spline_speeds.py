"""Closed-form feed limits of paper 001 on a path of curvature kappa = 1/rho, behind two moving averages T1, T2.

    v_acc  = sqrt(a rho)                          normal acceleration                                        (par. 13)
    v_jerk = (j rho^2)^(1/3)                      jerk of a point on a circle                                (par. 17)
    v_eps  = sqrt(24 rho eps / (T1^2 + T2^2))     error of the filters to second order, eps = a_n var(h)/2   (par. 24)
    v_ph   = 2 rho phi / (T1 + T2)                phase lag phi behind the path                              (par. 26)
    v_sc   = min(v_p, v_acc, v_jerk, v_eps, v_ph)                                                            (par. 29)
    T1 = v_p / a,   T2 = a / j                                                                               (par. 19)

On a circle the filtered point runs on another one, exactly rho [1 - sinc(v T1/2rho) sinc(v T2/2rho)] further inside, sinc x =
sin x / x; the second order is larger than that, by 0.9 % at a phase lag of 30 degrees.

Where the curvature varies within the length that the filters cover, none of this is a bound (PAPERS, paper 001): the path's own
curvature may also overrate what the filters see of it. At the constant speed v they see the path's mean with their kernel as weight,
by a rule with two nodes that has the kernel's second and fourth moment mu2, mu4

    D = p(s - v x) + p(s + v x) - 2 p(s),   error w |D|,   acceleration D/x^2,      x^2 = mu4/mu2,   w = mu2^2/(2 mu4).
"""

from __future__ import annotations

import numpy as np

from planner.arrays import FloatArray
from planner.constraints.bounds import filter_error, phase_lag
from planner.fir.guide import Guide

# Bisections of the speed between nothing and what the other limits allow; 2^-12 of it is left.
BISECTIONS = 12


def circle_error(rho: FloatArray, v: FloatArray, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """How far inside a circle of radius rho [mm] the filtered point runs at the speed v [mm/s]: exact."""
    lag = v / (2.0 * np.pi * rho)  # np.sinc(x) is sin(pi x)/(pi x)
    return rho * (1.0 - np.sinc(lag * T1) * np.sinc(lag * T2))


def v_eps(kappa: FloatArray, tol: FloatArray, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """Speed at which the filters' error is `tol` [mm], to second order; inf where the path is straight."""
    return np.sqrt(filter_error(kappa, tol, (T1, T2)))


def v_ph(kappa: FloatArray, phi: float, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """Speed at which the filtered point lags by the angle phi [rad]; inf where the path is straight."""
    return np.sqrt(phase_lag(kappa, phi, (T1, T2)))


def v_sc(guide: Guide, T1: FloatArray, T2: FloatArray, phi: float) -> FloatArray:
    """The paper's speed on each chord (P,) for filters T1, T2 (G,) of the runs."""
    T1, T2 = T1[guide.run], T2[guide.run]
    limits = (guide.feed, guide.v_acc, guide.v_jerk, v_eps(guide.kappa, guide.tol, T1, T2), v_ph(guide.kappa, phi, T1, T2))
    return np.min(limits, axis=0)


def filter_lengths(
    guide: Guide, speed: FloatArray, acceleration: FloatArray, jerk: FloatArray, a_margin: FloatArray, j_margin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """T1 >= T2 (G,) [s] of the shortest filters for speeds (P,) on the chords: V/A and A/J, both longer by the margins (G,), or
    both the same where V is too small to reach A."""
    along = speed[:, None] * np.abs(guide.direction)
    along[guide.length == 0] = 0.0
    first = guide.first[:-1]
    by_a = np.maximum.reduceat((along / acceleration).max(axis=1), first) * a_margin
    by_j = np.maximum.reduceat((along / jerk).max(axis=1), first) * a_margin * j_margin
    T1 = np.maximum(by_a, np.sqrt(by_j))
    return T1, by_j / T1


def v_mean(guide: Guide, most: FloatArray, acceleration: FloatArray, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """Largest constant speeds (P,), up to `most` (P,), at which the mean of the path keeps error and acceleration (module text)."""
    T1, T2 = T1[guide.run], T2[guide.run]
    second, fourth = (T1**2 + T2**2) / 12.0, (T1**4 + T2**4) / 80.0 + T1**2 * T2**2 / 24.0
    x, w = np.sqrt(fourth / second), second**2 / (2.0 * fourth)
    low, high, v = np.zeros(len(guide)), most, most
    begin, end = guide.s[guide.first[:-1]][guide.run], guide.s[guide.first[1:] - 1][guide.run]
    here = guide.s + 0.5 * guide.length
    middle = guide.point + 0.5 * guide.length[:, None] * guide.direction
    for _ in range(BISECTIONS):
        reach = np.minimum(v * x, np.minimum(here - begin, end - here))  # before a run's ends the path is run through to them
        around = [_point(guide, here - reach), _point(guide, here + reach)]
        D = around[0] + around[1] - 2.0 * middle
        over = np.maximum(w * np.linalg.norm(D, axis=1) / guide.tol, (np.abs(D) / acceleration).max(axis=1) / x**2)
        fits = over <= 1.0
        low, high = np.where(fits, v, low), np.where(fits, high, v)
        v = np.where(fits & (v == most), most, 0.5 * (low + high))
    return np.maximum(low, 0.0)


def _point(guide: Guide, s: FloatArray) -> FloatArray:
    """Points (n, A) of the chords at lengths (n,)."""
    return np.stack([np.interp(s, guide.s, axis) for axis in guide.point.T], axis=1)
