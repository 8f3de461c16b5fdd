"""One corner between two filtered pulses, in closed form (paper 000, eq. 10-15, as corrected in docs/papers.md A.14).

Pulse 2 starts the gap g = Td - Tk after pulse 1 has ended; Tk is the overlap time, 0 for a full stop and Td without any gap. With
tau = time since the start of pulse 2, w1 = V1 u1, w2 = V2 u2 and the ramp response R,

    p - P = -R(Tk - tau) w1 + R(tau) w2,     0 <= tau <= Tk.

For V1 = V2 = V the vertex P is missed by (s = sin(theta/2), theta the turning angle: with the interior angle it would be cos)

    eps = 2 V s R(Tk/2) = Tk^3 V s / (24 T1 T2)                         Tk <= 2 T2                     (eq. 14)
                          (4 T2^2 - 6 T2 Tk + 3 Tk^2) V s / (12 T1)     beyond

and eq. 15 is its inverse. For V1 != V2 the same with V = sqrt(V1 V2) is never too small: the exact value in the cubic zone is
V1 V2/(V1^(1/3) + V2^(1/3))^3 <= sqrt(V1 V2)/8, with equality at V1 = V2 only; min(V1, V2) would be too small.

Neighbours on a leg that is run through in Tv do not disturb each other's error if Tk_i + Tk_{i+1} <= Tv + Td.

Peaks of the axes within an isolated corner (Tv >= Td), with eta = (Tk - T2)/T2 clipped to [0, 1]:

    acceleration  max(|w1 - eta w2|, |w2 - eta w1|) / T1
    jerk          max(|w1|, |w2|;  |w1 + w2| if 0 < Tk < 2 T2;  |w2 - w1| if Tk > T1) / (T1 T2)
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.fir import overlap_time

# Pulses that were made to reach their limits exactly may exceed them by rounding [-].
LIMIT_ROUNDING = 1e-9


def corner_error(
    overlap: FloatArray, V: FloatArray, sin_half: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """(n,) by how much the vertex is missed [mm] (eq. 14).

    overlap  : (n,) Tk [s], 0 <= Tk <= Td
    V        : (n,) speed of the pulses, the geometric mean of two [mm/s]
    sin_half : (n,) sine of half the turning angle [-]
    T1, T2   : (n,) filters [s]
    """
    cubic = overlap**3 / (24 * T1 * T2)
    square = (4 * T2**2 - 6 * T2 * overlap + 3 * overlap**2) / (12 * T1)
    return np.where(overlap <= 2 * T2, cubic, square) * V * sin_half


def overlap_within(
    tol: FloatArray, V: FloatArray, sin_half: FloatArray, T1: FloatArray, T2: FloatArray, dt: float
) -> FloatArray:
    """(n,) overlap Tk [s] whose corner error, together with the chord error of samples at dt [s], stays within `tol` (n,) [mm].

    At the middle the acceleration is 2 V h(Tk/2) s, the chord over a period leaves the motion by dt^2/8 of it. What is left for
    the corner is reckoned with the overlap that the whole tolerance would allow, the longer one, and is half of it at least.

    V, sin_half, T1, T2 : (n,) as of `corner_error`
    """
    whole = overlap_time(tol, V, sin_half, T1, T2)
    bend = 2 * V * sin_half * np.minimum(whole / 2 / T2, 1.0) / T1
    return overlap_time(np.maximum(tol - bend * dt**2 / 8, tol / 2), V, sin_half, T1, T2)


def overlap_beside(
    overlap: FloatArray, neighbour: FloatArray, duration: FloatArray, delay: FloatArray
) -> FloatArray:
    """(n,) the overlap shortened until Tk_i + Tk_{i+1} <= Tv + Td [s]; both ends get the same unless one needs less.

    overlap, neighbour : (n,) Tk at this end of the leg and at the other [s]
    duration, delay    : (n,) Tv of the leg and Td of the filters [s]
    """
    room = duration + delay
    return np.minimum(overlap, np.maximum(room / 2, room - neighbour))


def overlap_within_limits(
    overlap: FloatArray,
    w1: FloatArray,
    w2: FloatArray,
    T1: FloatArray,
    T2: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> FloatArray:
    """The longest overlap (n,), at most `overlap`, at which an isolated corner keeps the axes' limits.

    w1, w2             : (n, A) velocities of the pulses [mm/s], each within the limits by itself
    T1, T2             : (n,) filters [s]
    acceleration, jerk : (A,) limits of the axes [mm/s2], [mm/s3]
    """
    delay = T1 + T2
    a_room = acceleration * T1[:, None] * (1 + LIMIT_ROUNDING)
    j_room = jerk * (T1 * T2)[:, None] * (1 + LIMIT_ROUNDING)
    eta = np.ones(len(overlap))  # the largest that is allowed
    for one, other in ((w1, w2), (w2, w1)):
        opposed = one * other < 0
        room = np.divide(a_room - np.abs(one), np.abs(other), out=np.ones_like(one), where=opposed)
        eta = np.minimum(eta, np.clip(room.min(axis=1), 0.0, 1.0))
    overlap = np.where(eta < 1, np.minimum(overlap, T2 * (1 + eta)), overlap)
    apart = (np.abs(w2 - w1) > j_room).any(axis=1)
    overlap = np.where(apart, np.minimum(overlap, T1), overlap)
    along = (np.abs(w1 + w2) > j_room).any(axis=1)
    partial = (overlap < 2 * T2) & (overlap < delay)
    return np.where(along & partial, 0.0, overlap)
