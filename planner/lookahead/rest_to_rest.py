"""From rest to rest along one block: the point-to-point reference of the papers.

Along a block of length L with limits v, a, j on speed, acceleration and jerk along the path, the fastest move is symmetric:

    peak speed p = min(v, p_L),   p_L from   p^2/a + p a/j = L   (a is reached),   or   (j L^2 / 4)^(1/3)   (it is not: p_L < a^2/j)
    T = L/p + p/a + a/j   for p >= a^2/j,      L/p + 2 sqrt(p/j)   below:

jerk j for A/j, none for p/A - A/j and -j for A/j with the largest acceleration A = min(a, sqrt(p j)), the cruise, and the same
backwards. The tests compare it with ruckig.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints import normal_limit
from planner.corners.allocation import error_rate
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine

AT_REST = 1e-12  # an axis with a smaller component of the direction does not limit; below the rounding of unit vectors [-]
PHASES = 7  # a jerk-limited move from rest to rest


def rest_to_rest_times(length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
    """(n,) shortest times from rest to rest [s] (module text).

    length  : (n,) [mm]
    v, a, j : (n,) limits of speed, acceleration and jerk along the block [mm/s], [mm/s2], [mm/s3]
    """
    peak = _peak(length, v, a, j)
    return length / peak + np.where(peak < a**2 / j, 2 * np.sqrt(peak / j), peak / a + a / j)


def rest_to_rest_phases(
    length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Durations [s] and jerks along the block [mm/s3], each (n, 7), of the moves of `rest_to_rest_times`.

    length  : (n,) [mm]
    v, a, j : (n,) limits as there
    """
    peak = _peak(length, v, a, j)
    largest = np.minimum(a, np.sqrt(peak * j))
    rise = largest / j
    held = np.maximum(peak / largest - rise, 0.0)
    cruise = np.where(peak < v, 0.0, np.maximum(length / peak - 2 * rise - held, 0.0))
    duration = np.stack([rise, held, rise, cruise, rise, held, rise], axis=1)
    return duration, j[:, None] * np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


def _peak(length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
    """Largest speed (n,) [mm/s] of the moves."""
    threshold = a**2 / j  # the speed at which a trapezoid of acceleration becomes a triangle
    without = np.cbrt(j * length**2 / 4)
    with_plateau = (np.sqrt(threshold**2 + 4 * a * length) - threshold) / 2
    return np.minimum(v, np.where(without < threshold, without, with_plateau))


def block_limits(toolpath: Toolpath, machine: Machine) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Limits v, a, j (M,) [mm/s], [mm/s2], [mm/s3] along each segment such that every axis keeps its own, wherever on the segment.

    On a line the tightest axis decides: min_k limit_k / |u_k|. On an arc the direction turns, so the smallest axis limit must hold
    for the vector: with kappa v^2 <= a/sqrt2 and an acceleration of a/sqrt2 along the path the norm stays below a, and with
    kappa^2 v^3 <= j/(2 sqrt2), 3 kappa v a/sqrt2 <= j/sqrt2 and j/(2 sqrt2) along the path the norm of the jerk stays below j
    (jerk = (j_s - kappa^2 v^3) T + 3 kappa v a_s N). Normal acceleration, chord and filter error bound kappa v^2 as well. On a curve
    kappa changes, and a bound of |r'''| takes the place of kappa^2.
    """
    axes = toolpath.axes
    direction = np.abs(toolpath.tangent_start)
    v, a, j = (
        (machine.limits(q, axes) / np.maximum(direction, AT_REST)).min(axis=1)
        for q in ("velocity", "acceleration", "jerk")
    )
    curved = ~toolpath.straight
    kappa = toolpath.curvature[curved]
    twist, on_curve = kappa**2, toolpath.curve[curved] >= 0
    twist[on_curve] = np.maximum(twist[on_curve], toolpath.curves.twist[toolpath.curve[curved][on_curve]])
    v_all, a_all, j_all = (machine.limits(q, axes).min() for q in ("velocity", "acceleration", "jerk"))
    half = np.sqrt(0.5)
    budget = np.minimum(toolpath.tolerance[:-1], toolpath.tolerance[1:])[curved] / error_rate(machine)
    across = np.minimum(half * a_all, np.minimum(budget, normal_limit.largest(machine)))
    v[curved] = np.min(
        [
            np.full(len(kappa), v_all),
            np.sqrt(across / kappa),
            np.cbrt(half * j_all / (2 * twist)),
            j_all / (3 * kappa * a_all),
        ],
        axis=0,
    )
    a[curved], j[curved] = half * a_all, half * j_all / 2
    return np.minimum(v, toolpath.feed), a, j
