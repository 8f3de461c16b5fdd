"""Packages that motions are compared with, and what a mode still rings. There are no wheels of the packages for some machines: tests
that need them are skipped there."""

from __future__ import annotations

import importlib.util
import platform

import numpy as np
import pytest

from planner.base.arrays import FloatArray
from planner.corners.kinematic import entry_acceleration


def _needs(package: str) -> pytest.MarkDecorator:
    missing = importlib.util.find_spec(package) is None
    return pytest.mark.skipif(
        missing, reason=f"{package} is not installed (there may be no wheel for {platform.machine()})"
    )


needs_ruckig, needs_toppra = _needs("ruckig"), _needs("toppra")


def entry_length(V: FloatArray, a: FloatArray, J: FloatArray) -> FloatArray:
    """(n,) tangent length d = Vc Tc / 3 [mm] of kinematic corners with speeds V (n,) [mm/s] at their ends, which take Tc = 2 Vc / Ac.

    a, J : (n,) limits of acceleration and jerk [mm/s2], [mm/s3]
    """
    return 2 * V**2 / (3 * entry_acceleration(V, a, J))


def residual_vibration(
    t: FloatArray, acceleration: FloatArray, frequency: float, damping: float
) -> FloatArray:
    """Amplitude (A,) [mm] at which a mode still rings when the motion is over.

    Each axis carries an oscillator x'' + 2 z w x' + w^2 x = -a(t), at rest before; a is straight between its samples. By Duhamel's
    integral the state at the end is that of the pole, and its envelope |pole integral| / w_d.

    t            : (T,) [s], ascending
    acceleration : (T, A) [mm/s2]
    frequency    : of the undamped mode [Hz]
    damping      : ratio z, 0 <= z < 1
    """
    w = 2.0 * np.pi * frequency
    damped = w * np.sqrt(1.0 - damping**2)
    pole = -damping * w + 1j * damped
    h = np.diff(t)[:, None]
    z = pole * h
    small = np.abs(z) < 1e-3
    safe = np.where(small, 1.0, z)
    grow = np.exp(z)
    # integrals of exp(z (1 - x)) and x exp(z (1 - x)) over [0, 1]
    phi1 = np.where(small, 1 + z / 2 + z**2 / 6 + z**3 / 24, (grow - 1) / safe)
    phi2 = np.where(small, 0.5 + z / 6 + z**2 / 24 + z**3 / 120, (grow - 1 - safe) / safe**2)
    rise = np.diff(acceleration, axis=0)
    terms = h * (acceleration[:-1] * phi1 + rise * phi2)
    after = np.exp(pole * (t[-1] - t[1:]))[:, None]
    return np.abs((after * terms).sum(axis=0)) / damped
