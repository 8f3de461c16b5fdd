"""A planned motion measured exactly, and what has to become slower for it.

The filtered position is the mean of the commanded one over the last Td with the kernel as weight, and so is
the filtered length along the guide, sigma(t). With the corners c of the guide, at s_c, that turn by Du_c, the
motion q differs from the point of the polyline at sigma by

    q(t) - p(sigma(t)) = sum_c Du_c B_c(t),    B_c = mean of (s - s_c)_+ where sigma < s_c, of (s_c - s)_+ where it is not,

whatever the speeds, gaps and lengths. sigma never goes back, so the largest of these distances bounds the
deviation of motion and path from each other both ways and in order (their Frechet distance): no corner is
left out, the tolerance is two-sided. For one corner between long legs it is eq. 14, for a chain without gaps
V |sum Du_c psi(t - t_c)| (docs/papers.md A8). B_c grows until sigma passes s_c and falls from there on, so
that the peaks are looked for at the corners, at the ends of the pieces and in their middle. Samples at dt
leave the motion by up to |normal acceleration| dt^2/8 more, which is added.

Acceleration is linear and jerk constant on every piece: their peaks are exact.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.fir.guide import Guide
from planner.baselines.fir.superpose import Filtered
from planner.corners.budget import chord_rate, largest_normal
from planner.machine import LINEAR_AXES, Machine

# Normal acceleration is looked at so often on half a piece, and may use this fraction of its limit [-].
NORMAL_STEPS, NORMAL_SPARE = 16, 0.98
# Bisections for the time at which the motion passes a joint: to 1e-9 of the piece.
BISECTIONS = 30
FEED_AT_REST = 1e-9  # [mm/s] below this the direction of the velocity is rounding


class Measured(NamedTuple):
    """Measured at n times: start and middle of all pieces, and when joints without a stop are passed."""

    t: FloatArray  # (n,) ascending [s]
    error: FloatArray  # (n,) deviation from the guide with the chord error, over the tolerance there [-]
    normal: FloatArray  # (n,) normal acceleration of the linear axes over its limit [-]
    acceleration: FloatArray  # (n,) largest over the axes, over the limit [-]
    jerk: FloatArray  # (n,) largest over the axes just after t, over the limit [-]

    @property
    def worst(self) -> FloatArray:
        """(n,) the largest of the ratios [-]."""
        return np.max(self[1:], axis=0)


class _Limits(NamedTuple):
    """Acceleration and jerk of the axes; normal acceleration, its axes, and the chord error over it [s2]."""

    acceleration: FloatArray
    jerk: FloatArray
    normal: float
    linear: Array
    bow: float


def measure(guide: Guide, motion: Filtered, machine: Machine) -> Measured:
    """Measure a filtered motion along a guide (module text)."""
    seen = np.empty((5, 2 * len(motion.t) + len(guide)))
    limits = _Limits(
        machine.limits("acceleration", guide.axes),
        machine.limits("jerk", guide.axes),
        largest_normal(machine) * NORMAL_SPARE,
        np.array([axis in LINEAR_AXES for axis in guide.axes]),
        chord_rate(machine),
    )
    count = _measure(motion, guide.line, limits, seen)
    return Measured(*seen[:, :count])


@njit(cache=True, error_model="numpy")
def _measure(motion, line, limits, seen):
    """Write time and ratios into seen (5, .); returns how many there are."""
    n, leg, last = 0, 0, motion.state.shape[2] - 1
    for m in range(len(motion.t)):
        half, begun = 0.5 * (motion.ends[m] - motion.t[m]), 0
        p, v = motion.state[0, m, last], motion.state[1, m, last]
        a, j = motion.state[2, m, last], motion.state[3, m, last]
        arrival = p + 2.0 * half * (v + half * (a + 2.0 * half * j / 3.0))
        while True:
            joint, tau = leg + 1 < len(line.direction) and line.s[leg + 1] <= arrival, np.inf
            if joint:
                tau = _reaching((p, v, a, j), line.s[leg + 1], 2.0 * half)
            while begun < 2 and begun * half <= tau:
                _record(motion, m, begun * half, line, leg, limits, seen[:, n])
                if limits.normal < np.inf:
                    peak = _normal_peak(motion, m, begun * half, half, limits.linear)
                    seen[2, n] = max(seen[2, n], peak / limits.normal)
                n, begun = n + 1, begun + 1
            if not joint:
                break
            leg += 1
            if line.inner[leg]:
                _record(motion, m, tau, line, leg, limits, seen[:, n])
                n += 1
    return n


@njit(cache=True, error_model="numpy")
def _normal_peak(motion, m, begin, lasting, linear):
    """Largest normal acceleration [mm/s2] on piece m from `begin` for `lasting` [s]."""
    peak_sq = 0.0
    for k in range(NORMAL_STEPS + 1):
        tau, feed_sq, bend_sq, both = begin + lasting * k / NORMAL_STEPS, 0.0, 0.0, 0.0
        for c in range(len(linear)):
            if linear[c]:
                v, a, j = motion.state[1, m, c], motion.state[2, m, c], motion.state[3, m, c]
                velocity, acceleration = v + tau * (a + tau * j / 2.0), a + tau * j
                feed_sq += velocity * velocity
                bend_sq += acceleration * acceleration
                both += velocity * acceleration
        if feed_sq > FEED_AT_REST * FEED_AT_REST:
            peak_sq = max(peak_sq, bend_sq - both * both / feed_sq)
    return np.sqrt(peak_sq)


@njit(cache=True, error_model="numpy")
def _reaching(state, s, duration):
    """tau in [0, duration] at which p + v tau + a tau^2/2 + j tau^3/6, which never falls, reaches s; state: p, v, a, j."""
    p, v, a, j = state
    low, high = 0.0, duration
    for _ in range(BISECTIONS):
        tau = 0.5 * (low + high)
        low, high = (tau, high) if p + tau * (v + tau * (a / 2.0 + tau * j / 6.0)) < s else (low, tau)
    return 0.5 * (low + high)


@njit(cache=True, error_model="numpy")
def _record(motion, m, tau, line, leg, limits, out):
    """Measure piece m at tau, where the motion is on `leg`: out (5,)."""
    state, axes = motion.state, len(limits.acceleration)
    p, v, a, j = state[0, m, axes], state[1, m, axes], state[2, m, axes], state[3, m, axes]
    along = p + tau * (v + tau * (a / 2.0 + tau * j / 6.0)) - line.s[leg]
    off_sq, feed_sq, bend_sq, both, over_a, over_j = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(axes):
        p, v, a, j = state[0, m, c], state[1, m, c], state[2, m, c], state[3, m, c]
        acceleration = a + tau * j
        velocity = v + tau * (a + tau * j / 2.0)
        position = p + tau * (v + tau * (a / 2.0 + tau * j / 6.0))
        off_sq += (position - line.point[leg, c] - along * line.direction[leg, c]) ** 2
        feed_sq += velocity * velocity
        bend_sq += acceleration * acceleration
        both += velocity * acceleration
        over_a = max(over_a, abs(acceleration) / limits.acceleration[c])
        over_j = max(over_j, abs(j) / limits.jerk[c])
    if feed_sq > FEED_AT_REST * FEED_AT_REST:
        bend_sq = max(bend_sq - both * both / feed_sq, 0.0)
    half = 1 if along > 0.5 * (line.s[leg + 1] - line.s[leg]) else 0
    out[0] = motion.t[m] + tau
    out[1] = (np.sqrt(off_sq) + limits.bow * np.sqrt(bend_sq)) / line.budget[leg, half]
    out[2], out[3], out[4] = 0.0, over_a, over_j


def slowest(t: FloatArray, factor: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """(n,) smallest `factor` (T,) [-] of the ascending times t (T,) within begin <= t <= end, both (n,), ascending [s]; 1
    where there is none."""
    return _window_min(factor, np.searchsorted(t, begin), np.searchsorted(t, end, side="right"))


@njit(cache=True, error_model="numpy")
def _window_min(value, first, last):
    """min(value[first[n] : last[n]]) for windows that never go back, by a queue of the candidates for later
    windows."""
    out = np.ones(len(first))
    queue = np.empty(len(value), np.int64)
    head, tail, taken = 0, 0, 0
    for n in range(len(first)):
        while taken < last[n]:
            while tail > head and value[queue[tail - 1]] >= value[taken]:
                tail -= 1
            queue[tail] = taken
            tail, taken = tail + 1, taken + 1
        while head < tail and queue[head] < first[n]:
            head += 1
        if head < tail and queue[head] < last[n]:
            out[n] = value[queue[head]]
    return out
