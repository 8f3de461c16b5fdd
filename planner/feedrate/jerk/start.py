"""Profiles to start the jerk-limited solver from.

`envelope` is what the solver starts from, turned into a motion where that is found (window.py):

1. Caps: feed^2 may not exceed a share of what axis accelerations and jerks allow at constant speed,
   |r''_k| x <= a_k and |r'''_k| x^(3/2) <= j_k.
2. The fastest profile under these caps that leaves every dip, and brakes into it, like a motion with a share
   of the jerk, up to a share of the acceleration. Near rest that is s = j t^3/6.

`plain_start` is far from it and always works: from rest with constant jerk on the first interval, with that
acceleration for about a quarter of the way, constant speed after one interval of transition, and the same
backwards. Its kinematics are exact, and slowed down enough it keeps any limits.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit

# Fractions of the limits, so that a start lies inside them and yet is fast [-]: half or nearly twice of any
# of these five changes the iterations by no more than 4 % (settings.py: on which problems).
ACCELERATION_SHARE = 0.4  # of the axis accelerations, for speeding up and braking
NORMAL_SHARE = 0.7  # of the axis accelerations, for the caps
JERK_SHARE = 0.5  # of the axis jerks, for the caps and the first motion from rest
CAP_SHARE = 0.8  # of all other bounds on feed^2
PLAIN_SHARE = 0.25  # of the length, on which the plain start accelerates, and again brakes
NEWTON_STEPS = (
    4  # for the time on an interval; from the bound they start at, one in a thousand is left at worst
)
FEED_SQ_MIN = 1e-12  # of the largest feed^2: the start stays above it between the ends [-]


@njit(cache=True, error_model="numpy", nogil=True)
def envelope(columns, begin, end):
    """(n + 1,) feed^2 [mm2/s2] at the points begin..end, from rest to rest."""
    n = end - begin
    caps, rate, jerk = np.zeros(n + 1), np.empty(n + 1), np.empty(n + 1)
    for i in range(n + 1):
        a = begin + i
        by_acceleration, by_jerk, slowest, slowest_jerk = 0.0, 0.0, 0.0, 0.0
        for k in range(columns.d1.shape[1]):
            bend = max(abs(columns.d2_left[a, k]), abs(columns.d2_right[a, k]))
            twist = max(abs(columns.d3_left[a, k]), abs(columns.d3_right[a, k]))
            by_acceleration = max(by_acceleration, bend / columns.acceleration[a, k])
            by_jerk = max(by_jerk, twist / columns.jerk[a, k])
            slowest = max(slowest, abs(columns.d1[a, k]) / columns.acceleration[a, k])
            slowest_jerk = max(slowest_jerk, abs(columns.d1[a, k]) / columns.jerk[a, k])
        rate[i], jerk[i] = ACCELERATION_SHARE / slowest, JERK_SHARE / slowest_jerk
        if 0 < i < n:
            cap = min(CAP_SHARE * columns.x_max[a], NORMAL_SHARE / by_acceleration)
            caps[i] = min(cap, np.cbrt(JERK_SHARE / by_jerk) ** 2)
    s = columns.s[begin : end + 1]
    x = _growing(_growing(caps, rate, jerk, s, 1), rate, jerk, s, -1)
    least = FEED_SQ_MIN * x.max()
    for i in range(1, n):
        x[i] = max(x[i], least)
    return x


@njit(cache=True, error_model="numpy", nogil=True)
def envelope_profile(x, s):
    """Feed^2 and acceleration (n + 1,) of a motion close to the envelope x over the points s of n >= 4
    intervals, in any units: harmonic means of the accelerations on both sides, none where they differ in sign
    (central differences overshoot where intervals grow), and constant jerk on the first and the last
    interval, with no more of it than the next interval can take back."""
    n = len(x) - 1
    x, u = x.copy(), np.zeros(n + 1)
    first, last = s[1] - s[0], s[n] - s[n - 1]
    x[1] = min(x[1], x[2] * 1.5 * first / (1.5 * first + s[2] - s[1]))
    x[n - 1] = min(x[n - 1], x[n - 2] * 1.5 * last / (1.5 * last + s[n - 1] - s[n - 2]))
    before = 0.0
    for i in range(n):
        after = (x[i + 1] - x[i]) / (2.0 * (s[i + 1] - s[i]))
        if before * after > 0.0:
            u[i] = 2.0 * before * after / (before + after)
        before = after
    u[1], u[n - 1] = x[1] / (1.5 * first), -x[n - 1] / (1.5 * last)
    return x, u


def plain_start(s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Feed^2 and acceleration (n + 1,) over the points s of n >= 4 intervals, fastest speed 1."""
    n = len(s) - 1
    x, u = np.zeros(n + 1), np.zeros(n + 1)
    tops = []
    for ds, last in ((np.diff(s), n // 2), (np.diff(s)[::-1], n - n // 2)):
        quarter = int(np.searchsorted(np.cumsum(ds), PLAIN_SHARE * (s[-1] - s[0])))
        i = min(max(quarter, 1), last - 1)  # transition on the interval after point i
        # x at points 1..i of unit acceleration
        rising = 1.5 * ds[0] + 2.0 * np.concatenate([[0.0], np.cumsum(ds[1:i])])
        v = np.sqrt(rising[-1])
        # with jerk -1/h for the time h of that interval
        top = (v + 0.75 * (np.sqrt(v * v + 4.0 * ds[i] / 3.0) - v)) ** 2
        tops.append((i, rising / top, top))
    (i, rising, top), (k, falling, end_top) = tops
    x[1:-1] = 1.0
    x[1 : i + 1], u[1 : i + 1] = rising, 1.0 / top
    x[n - k : n], u[n - k : n] = falling[::-1], -1.0 / end_top
    return x, u


@njit(cache=True, error_model="numpy")
def _growing(caps, rate, jerk, s, way):
    """The largest x (N+1,) below the caps that grows, forward (way 1) or backward (-1), with no more than a
    jerk from u = 0 up to an acceleration: from every dip like a motion that starts there."""
    n = len(s) - 1
    x = caps.copy()
    i, u = (0, 0.0) if way > 0 else (n, 0.0)
    for _ in range(n):
        step = abs(s[i + way] - s[i])
        j, a = min(jerk[i], jerk[i + way]), min(rate[i], rate[i + way])
        v = np.sqrt(x[i])
        # v h + u h^2/2 + j h^3/6 = step; each term alone bounds h, Newton's steps go down from there
        h = np.cbrt(6.0 * step / j)
        if v * h > step:
            h = step / v
        for _newton in range(NEWTON_STEPS):
            h -= (h * (v + h * (u / 2.0 + h * j / 6.0)) - step) / (v + h * (u + h * j / 2.0))
        grown = min((v + h * (u + h * j / 2.0)) ** 2, x[i] + 2.0 * a * step)
        if grown < x[i + way]:
            x[i + way] = grown
            u = min(u + j * h, a)
        else:
            u = min(max((x[i + way] - x[i]) / (2.0 * step), 0.0), u + j * h, a)
        i += way
    return x
