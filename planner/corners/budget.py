"""The error budget of a corner: what the path may use of it, and the speed then (002, eq. 18-20).

The budget is shared by the rounding, the chord error of the interpolation period and, where FIR filters
follow, their error; with X = kappa feed^2 the normal acceleration at the apex (docs/papers.md D, three
sources):

    eps_ap + c X <= eps,     c = dt^2/8 + sum_i T_i^2/24,     X <= A.

A is the machine's normal acceleration (`Machine.normal_acceleration`, inf if it names none), and never more
than what its axes give in the direction n of the path's normal: sum_k a_k |n_k|, the support function of the
box of axis accelerations. With it the closed-form speed is a true upper bound: no motion within the axis
limits passes the apex faster, whatever it does along the path.

The corner speed sqrt(X eps_ap / K), K = eps_ap kappa_max, grows with X and with eps_ap, so the constraint is
tight; X (eps - c X) is a parabola with its top at eps/(2c), hence

    X* = min(A, eps / (2c)),   eps_ap = eps - c X*                                   (eq. (20); independent of the angle)

and where a short leg keeps the corner from using eps_ap, X = min(A, (eps - eps_ap)/c).
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine

# Of the tolerance: what filters take at most for the joint search to be enough [-]. Longer ones, which move the motion by more
# than the search lets a node be from its leg, may leave the motion on the path faster
# (`python -m benchmarks.net.ablation ROWS --net NET --without "share of tolerance"`).
SEARCHED = 1.0
NORMAL = "normal_acceleration"  # key of the machine file, and name of the limit


def allocate(tol: FloatArray, acceleration: FloatArray, rate: float) -> FloatArray:
    """How much of the tolerance the rounding may use, eq. (20).

    tol          : (n,) tolerance eps [mm]
    acceleration : (n,) largest normal acceleration A [mm/s2]
    rate         : c, from `error_rate` [s2]

    Returns eps_ap (n,) [mm].
    """
    return tol - rate * np.minimum(acceleration, tol / (2.0 * rate))


def chord_rate(machine: Machine) -> float:
    """dt^2/8 [s2], or dt^2/32 with cubics: chord error per unit of normal acceleration."""
    return machine.dt**2 / (32.0 if machine.interpolation == "cubic" else 8.0)


def filter_rate(machine: Machine) -> float:
    """sum T^2/24 [s2]: filter error per unit of acceleration; 0 without filters."""
    return sum(T * T for T in machine.fir.time_constants) / 24.0 if machine.fir else 0.0


def filters_count(machine: Machine, toolpath: Toolpath) -> bool:
    """Whether filters may take more than `SEARCHED` of the tolerance."""
    return filter_rate(machine) * normal_anywhere(machine, toolpath.axes) > SEARCHED * float(
        toolpath.tolerance.min()
    )


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

    curvature : (n,) of their legs; between arcs the largest of all directions bounds the apex's normal.
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
