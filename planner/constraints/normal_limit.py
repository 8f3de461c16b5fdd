"""The limit of the normal acceleration: kappa feed^2 <= A, in a path's corners and along its curves (paper 002, eq. (19)).

A is the machine's (`Machine.normal_acceleration`, inf if it names none), and never more than what its axes give in the direction n of
the path's normal: sum_k a_k |n_k|, the support function of the box of axis accelerations. Of it the error budget leaves, with eps_ap of
eps used by the rounding and c X by chords and filters (corners/allocation.py),

    X = min(A, (eps - eps_ap)/c)                                                                     eq. (18), (20)

Between grid points a motion may exceed it by as little as any limit; `ratios` says where (optimal/tighten.py). What planners know of
this limit is here; the judge has its own of it (verify/limits.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.limit import Cap, Limit, over
from planner.machine import LINEAR_AXES, Machine

if TYPE_CHECKING:
    from planner.constraints.on_grid import Side
    from planner.motion.trajectory import Trajectory

NAME = "normal_acceleration"
ORDER = 2  # slower by lam, it is less by lam^2
REST = 1e-6  # [mm/s] below this, the direction of a velocity is rounding


def largest(machine: Machine) -> float:
    """A of the machine alone [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or np.inf


def with_less(machine: Machine, most: float) -> Machine:
    """The machine with A of at most that [mm/s2]: what is behind the setpoints cuts curves off by no more."""
    return machine.model_copy(update={NAME: min(most, largest(machine))})


def feed_sq_within(kappa: FloatArray, limit: float) -> FloatArray:
    """(P,) limit / kappa, inf on straights [mm2/s2]."""
    return over(limit, kappa)


class NormalAcceleration(Limit):
    """kappa x <= A, on machines that name A."""

    name, unit, order = NAME, "mm/s2", ORDER

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.normal_acceleration is not None:
            yield Cap(self.name, feed_sq_within(side.kappa, machine.normal_acceleration))


def ratios(machine: Machine, motion: Trajectory) -> Iterator[tuple[int, FloatArray]]:
    """The limit's order and the motion's ratio to it at its T samples (T,), 0 at rest; nothing on machines that name none."""
    if machine.normal_acceleration is None:
        return
    v, a = _linear(motion)
    square, along = np.sum(v * v, axis=1), np.sum(v * a, axis=1)
    moving = square > REST**2
    share = np.divide(along, square, out=np.zeros(len(v)), where=moving)
    across = np.where(moving, np.linalg.norm(a - share[:, None] * v, axis=1), 0.0)
    yield ORDER, across / machine.normal_acceleration


def slowest(motion: Trajectory) -> FloatArray:
    """(n,) times between samples at which the motion is slowest, as far as its acceleration is constant [s]: there it turns most
    quickly, and its normal acceleration can have peaks that are over before the next sample."""
    v, a = _linear(motion)
    square = np.sum(a * a, axis=1)
    step = np.divide(-np.sum(v * a, axis=1), square, out=np.full(len(v), np.inf), where=square > 0.0)
    before, after = np.diff(motion.t, prepend=motion.t[0]), np.diff(motion.t, append=motion.t[-1])
    inside = (step > -before) & (step < after) & (step != 0.0)
    return motion.t[inside] + step[inside]


def _linear(motion: Trajectory) -> tuple[FloatArray, FloatArray]:
    """(T, n) velocities and accelerations of the linear axes x, y and z."""
    of = np.isin(motion.axes, LINEAR_AXES)
    return motion.velocity[:, of], motion.acceleration[:, of]


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
