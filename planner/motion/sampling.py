"""The kernel behind motion/timing.py: a motion along a path at given times.

A time gives an arc length s by the time law; the place on the path is the parameter w of the grid interval there. On curves w(s) has
no closed form. Per interval, a quintic in the arc length that matches w and two derivatives at both ends comes first (`_invert`);
where it is not good enough, every sample takes a step on s(w) from there (`_refine`), s(w) by Gauss' rule (corners/elements.py).

Of a span, which most intervals of a long job lie on, the coefficients are copied once per interval, and lengths and points are
evaluated from the copy: the same operations in the same order as in geometry/spline.py, all nodes of Gauss' rule side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.corners.elements import (
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    element_length,
    element_point,
    is_straight,
    to_arc_length,
)
from planner.geometry.spline import DEGREE

# Arc length is inverted to this share of the interval [-]: 1e-14 mm on 0.1 mm, below the rounding of coordinates, so that
# accelerations by differences of nearby positions are as good as the columns.
LENGTH_ROUNDING = 1e-13
# Steps on s(w) at most; one is the rule where the interpolated inverse is not good enough by itself. Halves alone take 43 for
# `LENGTH_ROUNDING`.
REFINE_STEPS = 60
# A step leaves about the cube of the miss, so that below this share of the interval no further check is needed [-].
CUBE_ROOT_ROUNDING = 4e-5


class Law(NamedTuple):
    """The fields of `TimeLaw`."""

    t: FloatArray
    s: FloatArray
    feed: FloatArray
    acc_s: FloatArray
    jerk_s: FloatArray
    run: Array
    end: float


class Grid(NamedTuple):
    """The fields of `PathSamples` that say where its intervals are on the elements of the path; and where its joints are on the
    programmed one."""

    piece: Array
    s: FloatArray
    element: Array
    w0: FloatArray
    w1: FloatArray
    segment: Array
    passed: FloatArray


class _Interval(NamedTuple):
    """An interval of the grid: parameters w0 .. w1 of an element, over an arc length h [mm]."""

    element: int
    w0: float
    w1: float
    h: float
    span: bool


class _Room(NamedTuple):
    """What an interval is evaluated with: coef (6, A) of its span and slope (5, A) of its derivative; work (2, 4, A), speed (8,)."""

    coef: FloatArray
    slope: FloatArray
    work: FloatArray
    speed: FloatArray


@njit(cache=True, error_model="numpy")
def _copy_span(spans, i, coef, slope):
    """Coefficients of span i and of its derivative."""
    given = spans[i].coef
    for k in range(coef.shape[1]):
        coef[0, k] = given[0, k]
        for m in range(1, DEGREE + 1):
            coef[m, k] = given[m, k]
            slope[m - 1, k] = m * given[m, k]


@njit(cache=True, error_model="numpy")
def _length(table, on, room, w, out):
    """Arc length of the interval's element from its start to w [mm]; out (4, A) is scratch."""
    if not on.span:
        return element_length(table[0], table[1], table[2], on.element, on.w0, w, 0.5 * (on.w0 + on.w1), out)
    slope, speed, step = room.slope, room.speed, w - on.w0
    for g in range(len(GAUSS_NODES)):
        speed[g] = 0.0
    for k in range(slope.shape[1]):
        d0, d1, d2, d3, d4 = slope[0, k], slope[1, k], slope[2, k], slope[3, k], slope[4, k]
        for g in range(len(GAUSS_NODES)):
            tau = on.w0 + step * GAUSS_NODES[g]
            rate = (((d4 * tau + d3) * tau + d2) * tau + d1) * tau + d0
            speed[g] += rate * rate
    for g in range(len(GAUSS_NODES)):
        speed[g] = np.sqrt(speed[g])
    total = 0.0
    for g in range(len(GAUSS_NODES)):
        total += GAUSS_WEIGHTS[g] * speed[g]
    return total * step


@njit(cache=True, error_model="numpy")
def _point(table, on, room, w, out):
    """Point and three w-derivatives of the interval's element at w, into out (4, A)."""
    if not on.span:
        element_point(table[0], table[1], table[2], on.element, w, 0.5 * (on.w0 + on.w1), room.work, out)
        return
    coef = room.coef
    for k in range(out.shape[1]):
        value, first, second, third = 0.0, 0.0, 0.0, 0.0
        for m in range(DEGREE, -1, -1):
            third = third * w + 3.0 * second
            second = second * w + 2.0 * first
            first = first * w + value
            value = value * w + coef[m, k]
        out[0, k], out[1, k], out[2, k], out[3, k] = value, first, second, third


@njit(cache=True, error_model="numpy")
def _invert(table, on, room, out, c):
    """Quintic c (6,) with w = w0 + (w1 - w0) sum c_n q^n, q = ds/h, matching w(s) and two derivatives at both ends.

    Returns whether it is accurate to `LENGTH_ROUNDING` in the middle, where it is worst as a rule, and at its quarters.
    """
    w0, w1, h = on.w0, on.w1, on.h
    c[:] = 0.0
    c[1] = 1.0
    if is_straight(table[0], on.element):
        return True
    dw = w1 - w0
    slope, bend = np.empty(2), np.empty(2)  # dw/dq and d2w/dq2 over dw, at both ends
    for e in range(2):
        _point(table, on, room, w1 if e else w0, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        slope[e] = h / (np.sqrt(speed_sq) * dw)
        bend[e] = -along * h * h / (speed_sq * speed_sq * dw)
    c[1], c[2] = slope[0], 0.5 * bend[0]
    p, v, a = 1.0 - c[1] - c[2], slope[1] - c[1] - 2.0 * c[2], bend[1] - 2.0 * c[2]
    c[3], c[4], c[5] = 10.0 * p - 4.0 * v + 0.5 * a, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + 0.5 * a
    for q in (0.5, 0.25, 0.75):
        w = w0 + dw * _horner(c, q)
        if not w0 <= w <= w1:
            return False
        if abs(_length(table, on, room, w, out) / h - q) > LENGTH_ROUNDING:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _horner(c, q):
    return q * (c[1] + q * (c[2] + q * (c[3] + q * (c[4] + q * c[5]))))


@njit(cache=True, error_model="numpy")
def _refine(table, on, room, w, ds, out):
    """Solve for the arc length ds from w0, starting from w: the inverse function's series to second order, and halves of what encloses
    the solution where that leads outside it (where an interval is a whole span it may)."""
    w0, w1, h = on.w0, on.w1, on.h
    low, high = w0, w1
    w = min(max(w, w0), w1)
    for _ in range(REFINE_STEPS):
        miss = _length(table, on, room, w, out) - ds
        if abs(miss) <= LENGTH_ROUNDING * h:
            break
        if miss > 0.0:
            high = w
        else:
            low = w
        _point(table, on, room, w, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        step = miss / np.sqrt(speed_sq)
        w = w - step - 0.5 * along / speed_sq * step * step
        if not low <= w <= high:
            w = 0.5 * (low + high)
            continue
        if abs(miss) <= CUBE_ROOT_ROUNDING * h:
            break
    return w


@njit(cache=True, error_model="numpy")
def sample(table, law, grid, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times, and the toolpath segment (T,) that each lies at; an interval
    of a span may cover several."""
    legs, _, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, w0, w1, of_interval, passed = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed, segment = np.empty(count), np.empty(count), np.empty(count, np.int64)
    here = np.empty((4, axes))
    room = _Room(np.empty((DEGREE + 1, axes)), np.empty((DEGREE, axes)), np.empty((2, 4, axes)), np.empty(8))
    inverse, inverse_of, exact = np.zeros(6), -1, False
    on = _Interval(element[0], w0[0], w1[0], 0.0, False)
    begin, width = 0.0, 0.0  # of the span, along the programmed path
    m = last_not_after(t, times[0], 0, len(t) - 1)
    i, joint = -1, 0
    for n in range(count):
        while m + 1 < len(t) and t[m + 1] <= times[n]:
            m += 1
        tau = max(times[n] - t[m], 0.0)
        u, j = acc_s[m] + jerk_s[m] * tau, jerk_s[m]
        v = max(feed[m] + tau * (acc_s[m] + 0.5 * jerk_s[m] * tau), 0.0)
        s_here = s_law[m] + tau * (feed[m] + tau * (acc_s[m] / 2.0 + jerk_s[m] * tau / 6.0))
        if m + 1 < len(t):
            s_here = min(s_here, s_law[m + 1])
        if times[n] >= end:
            s_here, v, u, j = s[-1], 0.0, 0.0, 0.0
        elif times[n] < t[m]:  # a dwell before the first move
            v, u, j = 0.0, 0.0, 0.0
        first, last = piece[run[m]], piece[run[m] + 1] - 2  # the intervals of this run
        if i < first:
            i = last_not_after(s, s_here, first, last)
        while i < last and s[i + 1] <= s_here:
            i += 1
        h = s[i + 1] - s[i]
        ds = min(max(s_here - s[i], 0.0), h)
        if inverse_of != i:
            span = element[i] - len(legs)
            on = _Interval(element[i], w0[i], w1[i], h, span >= 0)
            if span >= 0:
                _copy_span(spans, span, room.coef, room.slope)
                begin, width = spans[span].begin, spans[span].width
            exact = _invert(table, on, room, here, inverse)
            inverse_of = i
        w = w0[i] + (w1[i] - w0[i]) * _horner(inverse, ds / h)
        if not exact:
            w = _refine(table, on, room, w, ds, here)
        segment[n] = of_interval[i]
        if on.span:
            place = begin + width * w
            if joint + 1 >= len(passed) or passed[joint + 1] <= place or passed[joint] > place:
                joint = last_not_after(passed, place, 0, len(passed) - 2)
            segment[n] = joint
        _point(table, on, room, w, here)
        to_arc_length(here)
        for k in range(axes):
            out_position[n, k] = here[0, k]
            out_velocity[n, k] = here[1, k] * v
            out_acceleration[n, k] = here[1, k] * u + here[2, k] * v * v
            out_jerk[n, k] = here[1, k] * j + 3.0 * here[2, k] * v * u + here[3, k] * v * v * v
        out_s[n], out_feed[n] = s[i] + ds, v
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, segment
