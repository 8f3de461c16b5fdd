"""The kernels behind motion/timing.py: a motion along a path at given times.

A time gives an arc length s by the time law; the place on the path is the parameter w of the grid interval there. On curves w(s) has
no closed form. `inverses` makes one polynomial for each interval, once for all looks at the motions on a grid. With
q = (s - s0)/h and W = (w - w0)/(w1 - w0) it matches W and three derivatives at both ends: with the speed S = |B'(w)| of the curve

    dw/ds = 1/S,     d2w/ds2 = -S'/S^3,     d3w/ds3 = (3 S'^2 - S S'')/S^5,
    S' = B'.B''/S,     S'' = (B''.B'' + B'.B''' - S'^2)/S.

How far its arc length is off is measured in the middle and at the quarters, by Gauss' rule. Where that is more than
`LENGTH_ROUNDING`, every sample takes a step from there by the slope of the polynomial, and where that is not enough, steps by the
curve itself (`_refine`).

Of a span, which most intervals of a long job lie on, the coefficients are copied once per interval, and all nodes of Gauss' rule are
evaluated side by side.
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
# The polynomial's slope is off by at most 4 times what its values are off by [share of the interval]: 256 q^4 (1-q)^4, the shape of
# their error, is nowhere steeper. Where they are off by less than this, a step by its slope leaves less than `LENGTH_ROUNDING`.
ONE_STEP = 1e-7
# Steps by the curve at most; halves alone take 43 for `LENGTH_ROUNDING`.
REFINE_STEPS = 60
# A step leaves about the cube of the miss, so that below this share of the interval no further check is needed [-].
CUBE_ROOT_ROUNDING = 4e-5


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
    """What an interval is evaluated with: coefficients of its span (6, A) and of the derivatives (5, A), (4, A), (3, A) of that;
    work (2, 4, A), speed (8,)."""

    coef: FloatArray
    first: FloatArray
    second: FloatArray
    third: FloatArray
    work: FloatArray
    speed: FloatArray


@njit(cache=True, error_model="numpy")
def _room(axes):
    return _Room(
        np.empty((DEGREE + 1, axes)),
        np.empty((DEGREE, axes)),
        np.empty((DEGREE - 1, axes)),
        np.empty((DEGREE - 2, axes)),
        np.empty((2, 4, axes)),
        np.empty(len(GAUSS_NODES)),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _interval(table, grid, i, room):
    """Interval i of the grid, with the coefficients of its span in `room`."""
    legs, _, spans = table
    span = grid.element[i] - len(legs)
    if span >= 0:
        given, p, d, b, t = spans[span].coef, room.coef, room.first, room.second, room.third
        for k in range(p.shape[1]):
            c1, c2, c3, c4, c5 = given[1, k], given[2, k], given[3, k], given[4, k], given[5, k]
            p[0, k], p[1, k], p[2, k], p[3, k], p[4, k], p[5, k] = given[0, k], c1, c2, c3, c4, c5
            d[0, k], d[1, k], d[2, k], d[3, k], d[4, k] = c1, 2.0 * c2, 3.0 * c3, 4.0 * c4, 5.0 * c5
            b[0, k], b[1, k], b[2, k], b[3, k] = 2.0 * c2, 6.0 * c3, 12.0 * c4, 20.0 * c5
            t[0, k], t[1, k], t[2, k] = 6.0 * c3, 24.0 * c4, 60.0 * c5
    return _Interval(grid.element[i], grid.w0[i], grid.w1[i], grid.s[i + 1] - grid.s[i], span >= 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _length(table, on, room, w, out):
    """Arc length of the interval's element from its start to w [mm]; out (4, A) is scratch."""
    if not on.span:
        return element_length(table[0], table[1], table[2], on.element, on.w0, w, 0.5 * (on.w0 + on.w1), out)
    first, speed, step = room.first, room.speed, w - on.w0
    for g in range(len(GAUSS_NODES)):
        speed[g] = 0.0
    for k in range(first.shape[1]):
        d0, d1, d2, d3, d4 = first[0, k], first[1, k], first[2, k], first[3, k], first[4, k]
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


@njit(cache=True, error_model="numpy", forceinline=True)
def _point(table, on, room, w, out):
    """Point and three w-derivatives of the interval's element at w, into out (4, A)."""
    if not on.span:
        element_point(table[0], table[1], table[2], on.element, w, 0.5 * (on.w0 + on.w1), room.work, out)
        return
    p, d, b, t = room.coef, room.first, room.second, room.third
    for k in range(out.shape[1]):
        out[0, k] = ((((p[5, k] * w + p[4, k]) * w + p[3, k]) * w + p[2, k]) * w + p[1, k]) * w + p[0, k]
        out[1, k] = (((d[4, k] * w + d[3, k]) * w + d[2, k]) * w + d[1, k]) * w + d[0, k]
        out[2, k] = ((b[3, k] * w + b[2, k]) * w + b[1, k]) * w + b[0, k]
        out[3, k] = (t[2, k] * w + t[1, k]) * w + t[0, k]


@njit(cache=True, error_model="numpy")
def inverses(table, grid, axes):
    """(P, 8) for the interval to the right of each point: how far the polynomial is off [share of the interval], c_1 .. c_7 of
    W = sum c_n q^n; zeros at the ends of pieces."""
    found = np.zeros((len(grid.s), 8))
    room, out = _room(axes), np.empty((4, axes))
    for g in range(len(grid.piece) - 1):
        for i in range(grid.piece[g], grid.piece[g + 1] - 1):
            on = _interval(table, grid, i, room)
            if is_straight(table[0], on.element):
                found[i, 1] = 1.0
            else:
                _invert(table, on, room, out, found[i])
    return found


@njit(cache=True, error_model="numpy")
def _invert(table, on, room, out, c):
    """The polynomial of an interval on a curve, into c (8,) as `inverses` has it."""
    w0, dw, h = on.w0, on.w1 - on.w0, on.h
    slope, bend, third = np.empty(2), np.empty(2), np.empty(2)  # derivatives of W by q at both ends
    for e in range(2):
        _point(table, on, room, on.w1 if e else w0, out)
        speed_sq, along, bend_sq, along3 = 0.0, 0.0, 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
            bend_sq += out[2, k] * out[2, k]
            along3 += out[1, k] * out[3, k]
        speed = np.sqrt(speed_sq)
        rate = along / speed
        slope[e] = h / (speed * dw)
        bend[e] = -h * h * rate / (speed * speed_sq * dw)
        third[e] = h**3 * (4.0 * rate * rate - bend_sq - along3) / (speed * speed_sq * speed_sq * dw)
    c[1], c[2], c[3] = slope[0], 0.5 * bend[0], third[0] / 6.0
    p, v = 1.0 - c[1] - c[2] - c[3], slope[1] - c[1] - 2.0 * c[2] - 3.0 * c[3]
    a, j = bend[1] - 2.0 * c[2] - 6.0 * c[3], third[1] - 6.0 * c[3]
    c[4], c[5] = 35.0 * p - 15.0 * v + 2.5 * a - j / 6.0, -84.0 * p + 39.0 * v - 7.0 * a + 0.5 * j
    c[6], c[7] = 70.0 * p - 34.0 * v + 6.5 * a - 0.5 * j, -20.0 * p + 10.0 * v - 2.0 * a + j / 6.0
    c[0] = 0.0
    for q in (0.5, 0.25, 0.75):
        w = w0 + dw * _at(c, q)
        if not w0 <= w <= on.w1:
            c[0] = np.inf
            return
        c[0] = max(c[0], abs(_length(table, on, room, w, out) / h - q))


@njit(cache=True, error_model="numpy", forceinline=True)
def _at(c, q):
    return q * (c[1] + q * (c[2] + q * (c[3] + q * (c[4] + q * (c[5] + q * (c[6] + q * c[7]))))))


@njit(cache=True, error_model="numpy", forceinline=True)
def _slope_at(c, q):
    high = 4.0 * c[4] + q * (5.0 * c[5] + q * (6.0 * c[6] + q * 7.0 * c[7]))
    return c[1] + q * (2.0 * c[2] + q * (3.0 * c[3] + q * high))


@njit(cache=True, error_model="numpy", forceinline=True)
def _parameter(table, on, room, c, ds, out):
    """The parameter w at the arc length ds into the interval, from its polynomial c (8,)."""
    dw, q = on.w1 - on.w0, ds / on.h
    w = on.w0 + dw * _at(c, q)
    if c[0] <= LENGTH_ROUNDING:
        return w
    if c[0] > ONE_STEP:
        return _refine(table, on, room, w, ds, out)
    miss = _length(table, on, room, w, out) / on.h - q
    return min(max(w - miss * dw * _slope_at(c, q), on.w0), on.w1)


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
def sample(table, law, grid, inverse, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times, and the toolpath segment (T,) that each lies at; an interval
    of a span may cover several.

    law     : `TimeLaw.columns`
    inverse : (P, 8), from `inverses`
    """
    legs, _, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, w0, w1, of_interval, passed = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed, segment = np.empty(count), np.empty(count), np.empty(count, np.int64)
    here, room = np.empty((4, axes)), _room(axes)
    on, on_of = _Interval(element[0], w0[0], w1[0], 0.0, False), -1
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
        if on_of != i:
            on, on_of = _interval(table, grid, i, room), i
            if on.span:
                begin, width = spans[element[i] - len(legs)].begin, spans[element[i] - len(legs)].width
        ds = min(max(s_here - s[i], 0.0), on.h)
        w = _parameter(table, on, room, inverse[i], ds, here)
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
