"""One leg of a look-ahead between two corners: how much speed it can gain, and how fast it is run.

On a leg with the limits a, j along it the motion runs from (V1, A1) to (V2, -A2). A ramp from (V, A) to a
speed W with zero acceleration is the end of one that began with zero acceleration at V' = V - A^2/(2j), `pre`
= V' A/j + A^3/(6 j^2) before:

    length  U = (V' + W)/2 T - pre,    time T - A/j,    T = 2 sqrt(x/j)  for x = W - V' <= a^2/j,    x/a + a/j beyond,
    dU/dW = W/p + p/(2j) with the largest acceleration p = min(a, sqrt(j x)).

From V' over D (measured from where the ramp would have begun) a motion reaches at most

    V' + x = [-a^2/j + sqrt((a^2/j - 2V')^2 + 8aD)]/2           for D >= (2V' + a^2/j) a/j
             V' + j y^2,  y > 0 from  j y^3 + 2V' y - D = 0     below   (Cardano; V' may be negative).
"""

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from planner.base.kernels import njit
from planner.base.point_to_point import PHASES
from planner.corners.kinematic import entry_acceleration, phase_times

ROUNDING = 1e-15  # of a leg's length [-]
# What is left of a leg between two ramps is run at constant speed if it is at most this fraction of it [-].
SMALL_REST = 1e-6
NEWTON_STEPS = 100  # safeguarded by bisection: never reached, as a bisection to the last digit takes 60


class JointKind(IntEnum):
    """How a joint is passed; p, q and r are the parameters of the kind."""

    STOP = 0  # a full stop
    PASS = 1  # the vertex itself is passed at a speed: straight on, or with a step of velocity
    ZERO = 2  # corner with zero entry acceleration: p = alpha, q = eta (corners/kinematic.py)
    ENTRY = 3  # corner with entry deceleration: p = a, q = J (corners/kinematic.py)
    CONSTANT = (
        4  # corner at constant speed, r [mm] long, that takes p and q [mm] of the legs before and behind
    )


STOP, PASS, ZERO, ENTRY, CONSTANT = (int(kind) for kind in JointKind)  # numba reads plain integers

# A leg: length from joint to joint, with what corners take of it, > 0 [mm]; largest speed, acceleration and
# jerk along it; of one that is run as an arc from rest to rest the turning [rad/mm], 0 on others.
LEG = np.dtype([(name, np.float64) for name in ("length", "v", "a", "j", "turning")])
# A way to pass a joint: its `JointKind`, the speed [mm/s], 0 at stops, and parameters of the kind.
WAY = np.dtype([("kind", np.int64), *((name, np.float64) for name in ("V", "p", "q", "r"))])


def records(dtype: np.dtype, **columns: Any) -> np.recarray:
    """(n,) records `LEG` or `WAY` with these columns (n,), 0 in others; n + 1 joints, stops at both ends."""
    table = np.zeros(len(next(iter(columns.values()))), dtype).view(np.recarray)
    for name, column in columns.items():
        table[name] = column
    return table


class End(NamedTuple):
    """One end of a leg, where the corner at it is over (module text)."""

    corner: float  # length that the corner takes of the leg [mm]
    A: float  # acceleration away from the corner [mm/s2]
    start: float  # V', speed at which a ramp would have begun without acceleration [mm/s]
    pre: float  # length of that ramp before this end [mm]
    top: float  # W = V + A^2/(2j), the lowest speed without acceleration [mm/s]
    ramp: float  # length of the ramp up to it [mm]


phase_times_of = njit(cache=True, error_model="numpy")(phase_times)
entry_acceleration_of = njit(cache=True, error_model="numpy")(entry_acceleration)


@njit(cache=True, error_model="numpy")
def gain_max(start, distance, a, j):
    """By how much the speed can grow at most [mm/s] over a distance [mm] from `start` [mm/s], with zero
    acceleration at both ends.

    a, j : limits of acceleration and jerk along the leg [mm/s2], [mm/s3]
    """
    if distance >= (2.0 * start + a * a / j) * a / j:
        mean = start + 0.5 * a * a / j  # x^2/2 + mean x = a distance - start a^2/j
        right = 2.0 * (a * distance - start * a * a / j)
        return right / (mean + np.sqrt(mean * mean + right))
    third, half = 2.0 * start / (3.0 * j), distance / (2.0 * j)  # y^3 + 3 third y - 2 half = 0
    discriminant = half * half + third * third * third
    if discriminant >= 0.0:
        w = np.cbrt(half + np.sqrt(discriminant))
        y = 2.0 * half / (w * w + third + (third / w) ** 2)  # = w - third/w without cancellation
    else:
        root = np.sqrt(-third)
        y = 2.0 * root * np.cos(np.arccos(min(half / root**3, 1.0)) / 3.0)
    return j * y * y


@njit(cache=True, error_model="numpy")
def ramp(start, gain, a, j):
    """Length U [mm] and time [s] from the speed `start` to W = start + gain [mm/s] with zero acceleration at
    both ends, and dU/dW [s].

    a, j : limits of acceleration and jerk along the leg [mm/s2], [mm/s3]
    """
    if gain <= a * a / j:
        time, peak = 2.0 * np.sqrt(gain / j), np.sqrt(j * gain)
    else:
        time, peak = gain / a + a / j, a
    return (start + 0.5 * gain) * time, time, (start + gain) / max(peak, 1e-300) + 0.5 * peak / j


@njit(cache=True, error_model="numpy")
def corner_at(way, V, behind):
    """A corner (record `WAY`) passed at V [mm/s]: start deceleration A [mm/s2], length [mm] that it takes of the leg
    `behind` it or of the one before, duration [s]."""
    if V <= 0.0 or way.kind in (STOP, PASS):
        return 0.0, 0.0, 0.0
    if way.kind == CONSTANT:
        return 0.0, way.q if behind else way.p, way.r / V
    if way.kind == ZERO:
        T1, T2 = phase_times_of(V, way.p, way.q)
        return 0.0, 0.5 * V * (T1 + T2), T1 + T2
    A = entry_acceleration_of(V, way.p, way.q)
    return A, 2.0 * V * V / (3.0 * A), 2.0 * V / A


@njit(cache=True, error_model="numpy")
def leg_end(way, V, j, behind):
    """The `End` of the leg `behind` a joint (record `WAY`) passed at V [mm/s], or of the one before, with jerk j [mm/s3]."""
    A, length, _ = corner_at(way, V, behind)
    lost, time = 0.5 * A * A / j, A / j
    pre = time * (V - lost) + A * time * time / 6.0
    return End(length, A, V - lost, pre, V + lost, time * V + A * time * time / 3.0)


@njit(cache=True, error_model="numpy")
def leg_top(one, other, leg):
    """Highest speed W on a leg (record `LEG`) between its ends (`End`) [mm/s], how far it is above each end's V' [mm/s],
    and the length that is left to be run at it [mm].

    The unknown is how far the speed is above the higher end, not the speed itself: a gain of 1e-10 mm/s is
    lost in the rounding of 100 mm/s, but takes 2e-8 s at 1e6 mm/s3.
    """
    a, j = leg.a, leg.j
    D = max(leg.length - one.corner - other.corner, 0.0) + one.pre + other.pre
    floor = max(one.top, other.top)
    first, second = max(floor - one.start, 0.0), max(floor - other.start, 0.0)
    high = max(leg.v - floor, 0.0)
    rest = D - ramp(one.start, first + high, a, j)[0] - ramp(other.start, second + high, a, j)[0]
    if rest >= 0.0:
        return leg.v, first + high, second + high, rest
    rest = D - ramp(one.start, first, a, j)[0] - ramp(other.start, second, a, j)[0]
    if rest <= SMALL_REST * leg.length:
        return floor, first, second, max(rest, 0.0)
    low, gain = 0.0, 0.5 * high
    for _ in range(NEWTON_STEPS):
        ramp1, ramp2 = ramp(one.start, first + gain, a, j), ramp(other.start, second + gain, a, j)
        miss = ramp1[0] + ramp2[0] - D
        low, high = (low, gain) if miss > 0.0 else (gain, high)
        if abs(miss) <= ROUNDING * D:
            break
        gain -= miss / (ramp1[2] + ramp2[2])
        if not low < gain < high:
            gain = 0.5 * (low + high)
            if not low < gain < high:
                break
    return floor + gain, first + gain, second + gain, 0.0


@njit(cache=True, error_model="numpy")
def leg_time(one, other, leg):
    """Shortest time [s] of a leg (record `LEG`) between its ends (`End`)."""
    W, first, second, rest = leg_top(one, other, leg)
    time = ramp(one.start, first, leg.a, leg.j)[1] + ramp(other.start, second, leg.a, leg.j)[1]
    return time - (one.A + other.A) / leg.j + (rest / W if rest > 0.0 else 0.0)


@njit(cache=True, error_model="numpy")
def leg_phases(one, other, leg, out):
    """Durations [s] and jerks [mm/s3] of the seven phases of a leg (record `LEG`) between its ends (`End`),
    into out (2, 7)."""
    W, first, second, rest = leg_top(one, other, leg)
    a, j = leg.a, leg.j
    for side in range(2):
        x, A = (first, one.A) if side == 0 else (second, other.A)
        peak = min(a, np.sqrt(j * x))
        held = x / a - a / j if x > a * a / j else 0.0
        for phase in range(3):
            f = phase if side == 0 else PHASES - 1 - phase
            out[0, f] = ((peak - A) / j, held, peak / j)[phase]
            out[1, f] = (j, 0.0, -j)[phase]
    out[0, 3], out[1, 3] = (rest / W if rest > 0.0 else 0.0), 0.0
