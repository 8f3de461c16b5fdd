"""What a planned motion really does, measured exactly, and what has to become slower for it.

The filtered position is the mean of the commanded one over the last Td with the kernel as weight, and so is the filtered length
along the course, sigma(t). With the corners c of the course, at s_c, that turn by Du_c, the motion q differs from the point of the
polyline at sigma by

    q(t) - p(sigma(t)) = sum_c Du_c B_c(t),    B_c = mean of (s - s_c)_+ where sigma < s_c, of (s_c - s)_+ where it is not,

whatever the speeds, gaps and lengths. sigma never goes back, so the largest of these distances bounds the deviation of motion
and path from each other both ways and in order (their Frechet distance): no corner is left out, the tolerance is two-sided. For one
corner between long legs it is eq. 14, for a chain without gaps V |sum Du_c psi(t - t_c)| (docs/papers.md A8). B_c grows until sigma
passes s_c and falls from there on, so that the peaks are looked for at the corners, at the ends of the pieces and in their middle.
Samples at dt leave the motion by up to |normal acceleration| dt^2/8 more, which is added.

Acceleration is linear and jerk constant on every piece: their peaks are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.base.kernels import njit
from planner.fir.course import Course
from planner.fir.superpose import Pieces
from planner.machine import Machine

# Normal acceleration, which is not linear on a piece, is looked at this many times on either half of it, and may use this share of
# its limit [-].
NORMAL_STEPS, NORMAL_SPARE = 16, 0.98
# Bisections for the time at which the motion passes a joint: to 1e-9 of the piece.
BISECTIONS = 30
FEED_AT_REST = 1e-9  # [mm/s] below this the direction of the velocity is rounding


@dataclass(frozen=True, eq=False, kw_only=True)
class Audit:
    """What was measured at start and middle of all pieces, and when the joints that are no full stops are passed.

    t            : ascending [s]
    error        : deviation from the course with the chord error, over the tolerance of the nearest joint [-]
    acceleration : largest over the axes, over the limit, or the normal one over its own [-]
    jerk         : largest over the axes just after t, over the limit [-]
    """

    t: FloatArray
    error: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def __post_init__(self) -> None:
        for name in ("t", "error", "acceleration", "jerk"):
            freeze(self, name, np.float64, (len(self.t),))


def audit(course: Course, pieces: Pieces, machine: Machine) -> Audit:
    """Measure a motion."""
    seen = np.empty((4, 2 * len(pieces) + len(course)))
    count = _measure(
        pieces.t,
        pieces.position,
        pieces.velocity,
        pieces.acceleration,
        pieces.jerk,
        np.append(pieces.t[1:], pieces.end[-1]),
        course.s,
        course.point,
        course.direction,
        course.tol,
        course.inner,
        machine.limits("acceleration", course.lines.axes),
        machine.limits("jerk", course.lines.axes),
        machine.normal_acceleration * NORMAL_SPARE if machine.normal_acceleration else np.inf,
        machine.dt**2 / 8,
        seen,
    )
    return Audit(t=seen[0, :count], error=seen[1, :count], acceleration=seen[2, :count], jerk=seen[3, :count])


@njit(cache=True, error_model="numpy")
def _measure(t, p, v, a, j, end, s, point, direction, tol, inner, a_max, j_max, n_max, bow, seen):
    """Write time and ratios into seen (4, .); returns how many there are. bow: chord error over normal acceleration [s2]."""
    n, leg, last = 0, 0, p.shape[1] - 1
    for m in range(len(t)):
        half, begun = 0.5 * (end[m] - t[m]), 0
        arrival = p[m, last] + 2.0 * half * (v[m, last] + half * (a[m, last] + 2.0 * half * j[m, last] / 3.0))
        while True:
            joint, tau = leg + 1 < len(direction) and s[leg + 1] <= arrival, np.inf
            if joint:
                tau = _passing(p[m, last], v[m, last], a[m, last], j[m, last], s[leg + 1], 2.0 * half)
            while begun < 2 and begun * half <= tau:
                at = begun * half
                _record(m, at, leg, t, p, v, a, j, s, point, direction, tol, a_max, j_max, bow, seen[:, n])
                if n_max < np.inf:
                    seen[2, n] = max(seen[2, n], _normal_peak(v[m], a[m], j[m], at, half) / n_max)
                n, begun = n + 1, begun + 1
            if not joint:
                break
            leg += 1
            if inner[leg]:
                _record(m, tau, leg, t, p, v, a, j, s, point, direction, tol, a_max, j_max, bow, seen[:, n])
                n += 1
    return n


@njit(cache=True, error_model="numpy")
def _normal_peak(v, a, j, begin, lasting):
    """Largest normal acceleration on a part of a piece."""
    peak_sq = 0.0
    for k in range(NORMAL_STEPS + 1):
        tau, feed_sq, bend_sq, both = begin + lasting * k / NORMAL_STEPS, 0.0, 0.0, 0.0
        for c in range(len(v) - 1):
            velocity, acceleration = v[c] + tau * (a[c] + tau * j[c] / 2.0), a[c] + tau * j[c]
            feed_sq += velocity * velocity
            bend_sq += acceleration * acceleration
            both += velocity * acceleration
        if feed_sq > FEED_AT_REST * FEED_AT_REST:
            peak_sq = max(peak_sq, bend_sq - both * both / feed_sq)
    return np.sqrt(peak_sq)


@njit(cache=True, error_model="numpy")
def _passing(p, v, a, j, s, duration):
    """tau in [0, duration] at which p + v tau + a tau^2/2 + j tau^3/6, which never falls, reaches s."""
    low, high = 0.0, duration
    for _ in range(BISECTIONS):
        tau = 0.5 * (low + high)
        if p + tau * (v + tau * (a / 2.0 + tau * j / 6.0)) < s:
            low = tau
        else:
            high = tau
    return 0.5 * (low + high)


@njit(cache=True, error_model="numpy")
def _record(m, tau, leg, t, p, v, a, j, s, point, direction, tol, a_max, j_max, bow, out):
    """Measure piece m at tau, where the motion is on `leg`: out (4,)."""
    axes = p.shape[1] - 1
    along = p[m, axes] + tau * (v[m, axes] + tau * (a[m, axes] / 2.0 + tau * j[m, axes] / 6.0)) - s[leg]
    off_sq, feed_sq, bend_sq, both, over_a, over_j = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(axes):
        acceleration = a[m, c] + tau * j[m, c]
        velocity = v[m, c] + tau * (a[m, c] + tau * j[m, c] / 2.0)
        position = p[m, c] + tau * (v[m, c] + tau * (a[m, c] / 2.0 + tau * j[m, c] / 6.0))
        off_sq += (position - point[leg, c] - along * direction[leg, c]) ** 2
        feed_sq += velocity * velocity
        bend_sq += acceleration * acceleration
        both += velocity * acceleration
        over_a = max(over_a, abs(acceleration) / a_max[c])
        over_j = max(over_j, abs(j[m, c]) / j_max[c])
    if feed_sq > FEED_AT_REST * FEED_AT_REST:
        bend_sq = max(bend_sq - both * both / feed_sq, 0.0)
    near = leg + 1 if along > 0.5 * (s[leg + 1] - s[leg]) else leg
    out[0] = t[m] + tau
    out[1] = (np.sqrt(off_sq) + bow * np.sqrt(bend_sq)) / tol[near]
    out[2], out[3] = over_a, over_j


def slowest(t: FloatArray, factor: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Smallest factor (n,) among the times t in each window [begin, end]; both ascend. 1 where there is none."""
    first, last = np.searchsorted(t, begin, side="left"), np.searchsorted(t, end, side="right")
    return _window_min(factor, first, last)


@njit(cache=True, error_model="numpy")
def _window_min(value, first, last):
    """min(value[first[n] : last[n]]) for windows that never go back, by a queue of the candidates for later windows."""
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
