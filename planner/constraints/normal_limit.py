"""The limit of the normal acceleration: kappa feed^2 <= A, in a path's corners and along its curves (paper 002, eq. (19)).

A is the machine's (`Machine.normal_acceleration`, inf if it names none), and never more than what its axes give in the direction n of
the path's normal: sum_k a_k |n_k|, the support function of the box of axis accelerations. Of it the error budget leaves, with eps_ap of
eps used by the rounding and c X by chords and filters (corners/allocation.py),

    X = min(A, (eps - eps_ap)/c)                                                                     eq. (18), (20)

What planners know of this limit is here; the judge has its own of it (verify/limits.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.limit import Cap, Limit, over
from planner.machine import Machine

if TYPE_CHECKING:
    from planner.constraints.on_grid import Side

NAME = "normal_acceleration"


def largest(machine: Machine) -> float:
    """A of the machine alone [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or np.inf


def feed_sq_within(kappa: FloatArray, limit: float) -> FloatArray:
    """(P,) limit / kappa, inf on straights [mm2/s2]."""
    return over(limit, kappa)


class NormalAcceleration(Limit):
    """kappa x <= A, on machines that name A."""

    name, unit, order = NAME, "mm/s2", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.normal_acceleration is not None:
            yield Cap(self.name, feed_sq_within(side.kappa, machine.normal_acceleration))


def of_axes(limits: FloatArray, u1: FloatArray, u2: FloatArray) -> FloatArray:
    """sum_k a_k |n_k| along the bisector n of corners with unit tangents u1, u2 (n, A) [mm/s2].

    Where the tangents agree (no bisector) the largest over all directions, the norm of the limits.
    """
    across = u2 - u1
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    normal = np.divide(across, size, out=np.zeros_like(across), where=size > 1e-6)
    return np.where(size[..., 0] > 1e-6, np.abs(normal) @ limits, np.linalg.norm(limits))


def at_corners(
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
    reachable = of_axes(limits, u1, u2)
    if curvature is not None:
        reachable = np.where(curvature > 0, np.linalg.norm(limits), reachable)
    return np.minimum(reachable, largest(machine))


def anywhere(machine: Machine, axes: tuple[str, ...]) -> float:
    """A in the direction in which the axes give most [mm/s2]."""
    return min(float(np.linalg.norm(machine.limits("acceleration", axes))), largest(machine))


def within_budget(tol: FloatArray, tol_ap: FloatArray, acceleration: FloatArray, rate: float) -> FloatArray:
    """(n,) X [mm/s2]: the largest kappa feed^2 that leaves eps_ap + c X within the budget, and at most A.

    tol, tol_ap  : (n,) budget eps and what the rounding uses of it, eps_ap [mm]
    acceleration : (n,) A [mm/s2]
    rate         : c, from `error_rate` [s2]
    """
    return np.minimum(acceleration, (tol - tol_ap) / rate)
