"""The candidates of the look-ahead: the ways to take every corner, each at its largest speed.

A corner may use what the interpolation leaves of the tolerance. Between samples dt apart the motion bows from
its chords by up to rate X, rate = dt^2/8 (plus sum T^2/24 where filters follow), with the largest
acceleration X in the corner:

    zero entry acceleration   X = 2 s min(alpha, (3 eps eta^2/s)^(1/3))       entry deceleration   X = Ac,
    miss of the vertex <= eps - rate X,       X <= eps / (2 rate)   as in eq. (20).

A limit A_n on the normal acceleration adds alpha <= A_n/(2s) and Ac <= A_n/s: at the apex, where it is
largest, the acceleration is normal, Vc 2s/T1 and Ac s.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.lookahead.corner_pieces import ARC_RAMP
from planner.baselines.lookahead.look_ahead import capped, needed
from planner.baselines.lookahead.ramps import LEG, WAY, JointKind, records
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.corners import kinematic as corner
from planner.corners.budget import error_rate, largest_normal
from planner.corners.sharing import share_legs
from planner.geometry.build import COLLINEAR_ANGLE
from planner.geometry.legs import Legs
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine

# Arcs run whole get this fraction of their limits [-]: cubic pieces exceed them a little (ARC_PIECE).
ARC_LIMITS = 1.0 - 3e-4

# Speed^2 per length [mm/s2] that a corner counts with at least when a leg is shared: no division by 0.
EASE_MIN = 1e-12


def leg_limits(path: Legs, toolpath: Toolpath, machine: Machine) -> np.recarray:
    """(n,) records `LEG` of a path of lines, and of arcs between full stops."""
    v, a, j = (np.minimum.reduceat(limit, path.first[:-1]) for limit in block_limits(toolpath, machine))
    share = np.where(toolpath.arc[path.first[:-1]] >= 0, ARC_LIMITS, 1.0)
    turning = np.abs(path.table["rate"])
    j = np.where(turning > 0.0, np.minimum(j, a / ARC_RAMP), j)
    return records(LEG, length=path.length, v=share * v, a=share * a, j=share * j, turning=turning)


def corner_passages(
    path: Legs, toolpath: Toolpath, legs: np.recarray, machine: Machine, start_stop: float
) -> list[np.recarray]:
    """Zero entry acceleration, entry deceleration, perhaps a step of velocity, (n+1,) records `WAY` each.

    Each is as fast as tolerance, limits and the feeds of both legs allow, whatever room it needs. Joints
    without a corner are passed straight on by every candidate.

    start_stop : step of velocity from standstill [mm/s]; 0 for none, then there are two candidates
    """
    at = path.first
    turns = (toolpath.joint[at] == Joint.CORNER) & (toolpath.theta[at] >= COLLINEAR_ANGLE)
    bare = np.where(turns | (toolpath.joint[at] == Joint.STOP), JointKind.STOP, JointKind.PASS)
    k = np.flatnonzero(turns)
    direction = path.vector("direction")
    u1, u2 = direction[k - 1], direction[k]
    feed = np.minimum(np.append(legs.v, np.inf), np.insert(legs.v, 0, np.inf))
    ways = [
        (JointKind.ZERO, *_zero_entry(u1, u2, toolpath.tolerance[at[k]], machine, toolpath.axes)),
        (JointKind.ENTRY, *_entry(u1, u2, toolpath.tolerance[at[k]], machine, toolpath.axes)),
    ]
    if start_stop > 0:
        ways.append(
            (JointKind.PASS, *_velocity_step(u1, u2, toolpath.tolerance[at[k]], machine.dt, start_stop))
        )
    return [_candidate(bare, feed, k, *way) for way in ways]


def fitted(passage: np.recarray, legs: np.recarray) -> np.recarray:
    """A candidate slowed down to what its n legs have room for, divided where corners would be as fast."""
    longest = np.minimum(np.append(legs.length, np.inf), np.insert(legs.length, 0, np.inf))
    wanted = np.minimum(needed(passage, legs), longest)
    ease = np.divide(passage.V**2, wanted, out=np.ones(len(wanted)), where=wanted > 0)
    return capped(passage, legs, share_legs(wanted, np.maximum(ease, EASE_MIN), legs.length))


def _candidate(
    bare: Array, feed: FloatArray, k: Array, kind: JointKind, V: FloatArray, p: FloatArray, q: FloatArray
) -> np.recarray:
    """One kind at the corners k with speeds V and parameters p, q."""
    kinds, speed = bare.copy(), np.where(bare == JointKind.PASS, feed, 0.0)
    first, second = np.zeros(len(bare)), np.zeros(len(bare))
    kinds[k], speed[k], first[k], second[k] = kind, np.minimum(V, feed[k]), p, q
    return records(WAY, kind=kinds, V=speed, p=first, q=second)


def _zero_entry(
    u1: FloatArray, u2: FloatArray, tol: FloatArray, machine: Machine, axes: tuple[str, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed, alpha and eta of the corners with zero entry acceleration."""
    across, rate = u2 - u1, error_rate(machine)
    twice = np.linalg.norm(across, axis=1)  # 2 s
    eta = corner.ratio_min(machine.limits("jerk", axes), across)
    alpha = corner.ratio_min(machine.limits("acceleration", axes), across)
    alpha = np.minimum(alpha, np.minimum(largest_normal(machine), tol / (2.0 * rate)) / twice)
    bow = rate * twice * np.minimum(alpha, np.cbrt(6.0 * tol * eta**2 / twice))
    return corner.speed_from_middle((tol - bow) / twice, alpha, eta), alpha, eta


def _velocity_step(
    u1: FloatArray, u2: FloatArray, tol: FloatArray, dt: float, start_stop: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed at the vertex with no axis stepping by more than `start_stop`; the chord between two samples cuts
    the vertex off by up to V dt s / 2. This kind has no parameters."""
    step = np.abs(u2 - u1).max(axis=1)
    sin_half = np.linalg.norm(u2 - u1, axis=1) / 2.0
    return np.minimum(start_stop / step, 2.0 * tol / (dt * sin_half)), np.ones(len(u1)), np.ones(len(u1))


def _entry(
    u1: FloatArray, u2: FloatArray, tol: FloatArray, machine: Machine, axes: tuple[str, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed, largest entry deceleration and largest jerk of the corners with entry deceleration."""
    rate = error_rate(machine)
    twice = np.linalg.norm(u2 - u1, axis=1)
    a, J = corner.entry_limits(u1, u2, machine.limits("acceleration", axes), machine.limits("jerk", axes))
    a = np.minimum(a, np.minimum(2.0 * largest_normal(machine) / twice, tol / (2.0 * rate)))
    return corner.entry_speed_from_middle((tol - rate * a) / twice, a, J), a, J
