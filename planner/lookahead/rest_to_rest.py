"""Limits along a block from those of the axes: the point-to-point reference of the papers (base/point_to_point.py has its moves)."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints import normal_limit
from planner.corners.allocation import error_rate
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine

AT_REST = 1e-12  # an axis with a smaller component of the direction does not limit; below the rounding of unit vectors [-]


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
