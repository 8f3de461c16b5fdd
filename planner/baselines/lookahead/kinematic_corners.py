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

from planner.base.arrays import FloatArray
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
    """Zero entry acceleration, entry deceleration, and a step of velocity if `start_stop` [mm/s] is one, (n+1,) records
    `WAY` each: as fast as tolerance, limits and the feeds of both legs allow, whatever room it needs. Joints without a
    corner are passed straight on by all."""
    at = path.first
    turns = (toolpath.joint[at] == Joint.CORNER) & (toolpath.theta[at] >= COLLINEAR_ANGLE)
    bare = np.where(turns | (toolpath.joint[at] == Joint.STOP), JointKind.STOP, JointKind.PASS)
    k = np.flatnonzero(turns)
    direction = path.vector("direction")
    u1, u2 = direction[k - 1], direction[k]
    feed = np.minimum(np.append(legs.v, np.inf), np.insert(legs.v, 0, np.inf))
    tol = toolpath.tolerance[at[k]]
    limits = [machine.limits(quantity, toolpath.axes) for quantity in ("acceleration", "jerk")]
    ways = [
        (JointKind.ZERO, *_zero_entry(u1, u2, tol, machine, limits)),
        (JointKind.ENTRY, *_entry(u1, u2, tol, machine, limits)),
    ]
    if start_stop > 0:
        # no axis steps by more; the chord between two samples cuts the vertex off by up to V dt s / 2
        step, sin_half = np.abs(u2 - u1).max(axis=1), np.linalg.norm(u2 - u1, axis=1) / 2.0
        V = np.minimum(start_stop / step, 2.0 * tol / (machine.dt * sin_half))
        ways.append((JointKind.PASS, V, np.ones(len(k)), np.ones(len(k))))
    passages = []
    for kind, V, p, q in ways:
        kinds, parameters = bare.copy(), np.zeros((3, len(bare)))
        parameters[0] = np.where(bare == JointKind.PASS, feed, 0.0)
        kinds[k], parameters[:, k] = kind, (np.minimum(V, feed[k]), p, q)
        passages.append(records(WAY, kind=kinds, **dict(zip("Vpq", parameters, strict=True))))
    return passages


def fitted(passage: np.recarray, legs: np.recarray) -> np.recarray:
    """A candidate slowed down to what its n legs have room for, divided where corners would be as fast."""
    longest = np.minimum(np.append(legs.length, np.inf), np.insert(legs.length, 0, np.inf))
    wanted = np.minimum(needed(passage, legs), longest)
    ease = np.divide(passage.V**2, wanted, out=np.ones(len(wanted)), where=wanted > 0)
    return capped(passage, legs, share_legs(wanted, np.maximum(ease, EASE_MIN), legs.length))


def _zero_entry(
    u1: FloatArray, u2: FloatArray, tol: FloatArray, machine: Machine, limits: list[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed, alpha and eta of the corners with zero entry acceleration; limits: (A,) accelerations and (A,) jerks of the axes."""
    across, rate = u2 - u1, error_rate(machine)
    twice = np.linalg.norm(across, axis=1)  # 2 s
    alpha, eta = (corner.ratio_min(limit, across) for limit in limits)
    alpha = np.minimum(alpha, np.minimum(largest_normal(machine), tol / (2.0 * rate)) / twice)
    bow = rate * twice * np.minimum(alpha, np.cbrt(6.0 * tol * eta**2 / twice))
    return corner.speed_from_middle((tol - bow) / twice, alpha, eta), alpha, eta


def _entry(
    u1: FloatArray, u2: FloatArray, tol: FloatArray, machine: Machine, limits: list[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed, largest entry deceleration and largest jerk of the corners with entry deceleration."""
    rate, twice = error_rate(machine), np.linalg.norm(u2 - u1, axis=1)
    a, J = corner.entry_limits(u1, u2, *limits)
    a = np.minimum(a, np.minimum(2.0 * largest_normal(machine) / twice, tol / (2.0 * rate)))
    return corner.entry_speed_from_middle((tol - rate * a) / twice, a, J), a, J
