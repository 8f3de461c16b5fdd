"""The error budget of a corner: what chords and filters cost of the tolerance, and what normal acceleration is left (eq. 18 to 20).

A is the machine's normal acceleration (`Machine.normal_acceleration`, inf if it names none), and never more than what its axes give in
the direction n of the path's normal: sum_k a_k |n_k|, the support function of the box of axis accelerations. With eps_ap of eps used by
the rounding, and c X by chords and filters (docs/papers.md D),

    c = dt^2/8 + sum_i T_i^2/24,     X = min(A, (eps - eps_ap)/c)                                    eq. (18), (20)
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import Machine

NORMAL = "normal_acceleration"  # key of the machine file, and name of the limit


def chord_rate(machine: Machine) -> float:
    """dt^2/8 [s2], or dt^2/32 with cubics: chord error per unit of normal acceleration."""
    return machine.dt**2 / (32.0 if machine.interpolation == "cubic" else 8.0)


def filter_rate(machine: Machine) -> float:
    """sum T^2/24 [s2]: filter error per unit of acceleration; 0 without filters."""
    return sum(T * T for T in machine.fir.time_constants) / 24.0 if machine.fir else 0.0


def error_rate(machine: Machine) -> float:
    """c = dt^2/8 + sum T^2/24 [s2]: chord and filter error per unit of normal acceleration."""
    return chord_rate(machine) + filter_rate(machine)


def largest_normal(machine: Machine) -> float:
    """A of the machine alone [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or np.inf


def with_less_normal(machine: Machine, most: float) -> Machine:
    """The machine with A of at most that [mm/s2]: what is behind the setpoints cuts curves off by no more."""
    return machine.model_copy(update={NORMAL: min(most, largest_normal(machine))})


def normal_of_axes(limits: FloatArray, u1: FloatArray, u2: FloatArray) -> FloatArray:
    """sum_k a_k |n_k| along the bisector n of corners with unit tangents u1, u2 (n, A) [mm/s2].

    Where the tangents agree (no bisector) the largest over all directions, the norm of the limits.
    """
    across = u2 - u1
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    normal = np.divide(across, size, out=np.zeros_like(across), where=size > 1e-6)
    return np.where(size[..., 0] > 1e-6, np.abs(normal) @ limits, np.linalg.norm(limits))


def normal_at_corners(
    machine: Machine,
    axes: tuple[str, ...],
    u1: FloatArray,
    u2: FloatArray,
    curvature: FloatArray | None = None,
) -> FloatArray:
    """(n,) A at corners with unit tangents u1, u2 (n, A) [mm/s2].

    curvature : (n,) of their legs. Between arcs the normal at the apex is not the bisector at the vertex: the largest over all
                directions bounds it.
    """
    limits = machine.limits("acceleration", axes)
    reachable = normal_of_axes(limits, u1, u2)
    if curvature is not None:
        reachable = np.where(curvature > 0, np.linalg.norm(limits), reachable)
    return np.minimum(reachable, largest_normal(machine))


def normal_anywhere(machine: Machine, axes: tuple[str, ...]) -> float:
    """A in the direction in which the axes give most [mm/s2]."""
    return min(float(np.linalg.norm(machine.limits("acceleration", axes))), largest_normal(machine))


def normal_within_budget(
    tol: FloatArray, tol_ap: FloatArray, acceleration: FloatArray, rate: float
) -> FloatArray:
    """(n,) X [mm/s2]: the largest kappa feed^2 that leaves eps_ap + c X within the budget, and at most A.

    tol, tol_ap  : (n,) budget eps and what the rounding uses of it, eps_ap [mm]
    acceleration : (n,) A [mm/s2]
    rate         : c, from `error_rate` [s2]
    """
    return np.minimum(acceleration, (tol - tol_ap) / rate)
