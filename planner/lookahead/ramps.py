"""One leg of a look-ahead between two corners: how much speed it can gain, and how fast it is run.

On a leg with the limits a, j along it the motion runs from (V1, A1) to (V2, -A2). A ramp from (V, A) to a speed W with zero
acceleration is the end of one that began with zero acceleration at V' = V - A^2/(2j), `pre` = V' A/j + A^3/(6 j^2) before:

    length  U = (V' + W)/2 T - pre,    time T - A/j,    T = 2 sqrt(x/j)  for x = W - V' <= a^2/j,    x/a + a/j beyond,
    dU/dW = W/p + p/(2j) with the largest acceleration p = min(a, sqrt(j x)).

From V' over D (measured from where the ramp would have begun) a motion reaches at most

    V' + x = [-a^2/j + sqrt((a^2/j - 2V')^2 + 8aD)]/2           for D >= (2V' + a^2/j) a/j
             V' + j y^2,  y > 0 from  j y^3 + 2V' y - D = 0     below   (Cardano; V' may be negative).
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from planner.base.kernels import njit
from planner.corners.kinematic import entry_acceleration, phase_times

ROUNDING = 1e-15  # of a leg's length [-]
# What is left of a leg between two ramps is run at constant speed if it is at most this share of the leg [-]: faster still would save
# less than this share of the leg's time, for four pieces of microseconds.
SMALL_REST = 1e-6
NEWTON_STEPS = 100  # safeguarded by bisection


class Kind(IntEnum):
    """What happens at a joint; p and q are the parameters of the kind (corners/kinematic.py)."""

    STOP = 0  # a full stop
    PASS = 1  # the vertex itself is passed at a speed: straight on, or with a step of velocity
    ZERO = 2  # corner with zero entry acceleration: p = alpha, q = eta
    ENTRY = 3  # corner with entry deceleration: p = a, q = J


STOP, PASS, ZERO, ENTRY = (int(kind) for kind in Kind)  # numba reads plain integers

phase_times_of = njit(cache=True, error_model="numpy")(phase_times)
entry_acceleration_of = njit(cache=True, error_model="numpy")(entry_acceleration)


@njit(cache=True, error_model="numpy")
def reach(start, distance, a, j):
    """By how much the speed can grow at most [mm/s] over a distance [mm] from `start`, with zero acceleration at both ends."""
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
    """Length [mm] and time [s] from the speed `start` to W = start + gain with zero acceleration at both ends, and dU/dW."""
    if gain <= a * a / j:
        time, peak = 2.0 * np.sqrt(gain / j), np.sqrt(j * gain)
    else:
        time, peak = gain / a + a / j, a
    return (start + 0.5 * gain) * time, time, (start + gain) / max(peak, 1e-300) + 0.5 * peak / j


@njit(cache=True, error_model="numpy")
def corner_at(kind, V, p, q):
    """Start deceleration A [mm/s2], length l [mm] and duration [s] of a corner at the speed V."""
    if V <= 0.0 or kind in (STOP, PASS):
        return 0.0, 0.0, 0.0
    if kind == ZERO:
        T1, T2 = phase_times_of(V, p, q)
        return 0.0, 0.5 * V * (T1 + T2), T1 + T2
    A = entry_acceleration_of(V, p, q)
    return A, 2.0 * V * V / (3.0 * A), 2.0 * V / A


@njit(cache=True, error_model="numpy")
def leg_end(kind, V, p, q, j):
    """One end of a leg with jerk j: corner length l, V' and `pre`, the speed W = V + A^2/(2j) and the length of the ramp up to it."""
    A, length, _ = corner_at(kind, V, p, q)
    lost, time = 0.5 * A * A / j, A / j
    pre = time * (V - lost) + A * time * time / 6.0
    return length, V - lost, pre, V + lost, time * V + A * time * time / 3.0


@njit(cache=True, error_model="numpy")
def leg_top(one, other, length, v, a, j):
    """Highest speed on a leg, how far it is above each end's V', and the length that is left to be run at it [mm].

    The ends are as of `leg_end`. The unknown is how far the speed is above the higher end, not the speed itself: a gain of 1e-10 mm/s
    is lost in the rounding of 100 mm/s, but takes 2e-8 s at 1e6 mm/s3.
    """
    D = max(length - one[0] - other[0], 0.0) + one[2] + other[2]
    floor = max(one[3], other[3])
    first, second = max(floor - one[1], 0.0), max(floor - other[1], 0.0)
    high = max(v - floor, 0.0)
    rest = D - ramp(one[1], first + high, a, j)[0] - ramp(other[1], second + high, a, j)[0]
    if rest >= 0.0:
        return v, first + high, second + high, rest
    rest = D - ramp(one[1], first, a, j)[0] - ramp(other[1], second, a, j)[0]
    if rest <= SMALL_REST * length:
        return floor, first, second, max(rest, 0.0)
    low, gain = 0.0, 0.5 * high
    for _ in range(NEWTON_STEPS):
        ramp1, ramp2 = ramp(one[1], first + gain, a, j), ramp(other[1], second + gain, a, j)
        miss = ramp1[0] + ramp2[0] - D
        if miss > 0.0:
            high = gain
        else:
            low = gain
        if abs(miss) <= ROUNDING * D:
            break
        gain -= miss / (ramp1[2] + ramp2[2])
        if not low < gain < high:
            gain = 0.5 * (low + high)
            if not low < gain < high:
                break
    return floor + gain, first + gain, second + gain, 0.0


@njit(cache=True, error_model="numpy")
def leg_time(one, other, A1, A2, length, v, a, j):
    W, first, second, rest = leg_top(one, other, length, v, a, j)
    time = ramp(one[1], first, a, j)[1] + ramp(other[1], second, a, j)[1] - (A1 + A2) / j
    return time + (rest / W if W > 0.0 else 0.0)
