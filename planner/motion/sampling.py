"""The kernels behind motion/timing.py: a motion along a path at given times.

A time gives an arc length s by the time law; the place on the path is the parameter w of the grid interval
there. On curves w(s) has no closed form. `inverses` makes one polynomial for each interval, once for all
looks at the motions on a grid. With q = (s - s0)/h and W = (w - w0)/(w1 - w0) it matches W and three
derivatives at both ends: with the speed S = |B'(w)| of the curve

    dw/ds = 1/S,     d2w/ds2 = -S'/S^3,     d3w/ds3 = (3 S'^2 - S S'')/S^5,
    S' = B'.B''/S,     S'' = (B''.B'' + B'.B''' - S'^2)/S.

How far its arc length is off is measured in the middle and at the quarters, by Gauss' rule. Where that is
more than `LENGTH_ROUNDING`, every sample takes a step from there by the slope of the polynomial, and where
that is not enough, steps by the curve itself (`_refine`).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.base.sizes import SIZES
from planner.base.threads import in_parts
from planner.corners.elements import (
    ElementTable,
    element_length,
    element_point,
    is_straight,
    to_arc_length,
)

# Arc length is inverted to this share of the interval [-]: 1e-14 mm on 0.1 mm, below rounding.
LENGTH_ROUNDING = 1e-13
# The polynomial's slope is off by at most 14 times what its values are off by [share of the interval], the
# shape of their error q^4 (1-q)^4; where they are off by less a step leaves less than `LENGTH_ROUNDING`.
ONE_STEP = 8e-8
S_ROUNDING = 2.0**-52  # of s itself [-], which is not an error of the polynomial
COEFFICIENTS = 8  # of an interval's polynomial, with how far it is off
POINTS_SHARED = SIZES.intervals_shared
# Steps by the curve at most; halves alone take 43 for `LENGTH_ROUNDING`.
REFINE_STEPS = 60
# A step leaves about the cube of the miss: below this share of the interval no check is needed [-].
CUBE_ROOT_ROUNDING = 4e-5


class Grid(NamedTuple):
    """The fields of `PathSamples` that say where its intervals are on the elements of the path; and where its
    joints are on the programmed one."""

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


@njit(cache=True, error_model="numpy", forceinline=True)
def interval_of(grid, i):
    """Interval i of the grid."""
    return _Interval(grid.element[i], grid.w0[i], grid.w1[i], grid.s[i + 1] - grid.s[i])


@njit(cache=True, error_model="numpy", forceinline=True)
def _length(table, on, w, out):
    """Arc length of the interval's element from its start to w [mm]; out (4, A) is scratch."""
    return element_length(table[0], table[1], table[2], on.element, on.w0, w, 0.5 * (on.w0 + on.w1), out)


@njit(cache=True, error_model="numpy", forceinline=True)
def _point(table, on, work, w, out):
    """Point and three w-derivatives of the interval's element at w, into out (4, A); work (2, 4, A) is
    scratch."""
    element_point(table[0], table[1], table[2], on.element, w, 0.5 * (on.w0 + on.w1), work, out)


@njit(cache=True, error_model="numpy", nogil=True)
def _inverses(table, grid, axes, first, beyond, found):
    """The rows first .. beyond - 1 of `inverses`, where they are all 0."""
    work, out = np.empty((2, 4, axes)), np.empty((4, axes))
    for g in range(len(grid.piece) - 1):
        for i in range(max(grid.piece[g], first), min(grid.piece[g + 1] - 1, beyond)):
            on = interval_of(grid, i)
            if is_straight(table[0], on.element):
                found[i, 1] = 1.0
            else:
                _invert(table, on, work, out, found[i])
                found[i, 0] = max(found[i, 0] - S_ROUNDING * grid.s[i + 1] / on.h, 0.0)


def inverses(table: ElementTable, grid: Grid, axes: int) -> FloatArray:
    """(P, C) for the interval to the right of each point: how far the polynomial is off [share of the
    interval], and c_1 .. c_7 of sum c_n q^n; zeros at the ends of pieces.

    grid : P points over so many axes; C = `COEFFICIENTS`
    """
    found = np.zeros((len(grid.s), COEFFICIENTS))

    def work(first: int, beyond: int) -> None:
        _inverses(table, grid, axes, first, beyond, found)

    in_parts(len(found), POINTS_SHARED, work)
    return found


@njit(cache=True, error_model="numpy")
def _invert(table, on, work, out, c):
    """The polynomial of an interval on a curve, into c (`COEFFICIENTS`,) as `inverses` has it."""
    w0, dw, h = on.w0, on.w1 - on.w0, on.h
    slope, bend, third = np.empty(2), np.empty(2), np.empty(2)  # derivatives of W by q at both ends
    for e in range(2):
        _point(table, on, work, on.w1 if e else w0, out)
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
    for quarter in range(1, 4):  # how far its arc length is off there; inf where it leaves the interval
        q, off = 0.25 * quarter, np.inf
        w = w0 + dw * _at(c, q)
        if w0 <= w <= on.w1:
            off = abs(_length(table, on, w, out) / h - q)
        c[0] = max(c[0], off)


@njit(cache=True, error_model="numpy", forceinline=True)
def _at(c, q):
    return q * (c[1] + q * (c[2] + q * (c[3] + q * (c[4] + q * (c[5] + q * (c[6] + q * c[7]))))))


@njit(cache=True, error_model="numpy", forceinline=True)
def _slope_at(c, q):
    high = 4.0 * c[4] + q * (5.0 * c[5] + q * (6.0 * c[6] + q * 7.0 * c[7]))
    return c[1] + q * (2.0 * c[2] + q * (3.0 * c[3] + q * high))


@njit(cache=True, error_model="numpy", forceinline=True)
def _parameter(table, on, work, c, ds, out):
    """The parameter w at the arc length ds into the interval, from its polynomial c."""
    dw, q = on.w1 - on.w0, ds / on.h
    w = on.w0 + dw * _at(c, q)
    if c[0] <= LENGTH_ROUNDING:
        return w
    if c[0] > ONE_STEP:
        return _refine(table, on, work, w, ds, out)
    miss = _length(table, on, w, out) / on.h - q
    return min(max(w - miss * dw * _slope_at(c, q), on.w0), on.w1)


@njit(cache=True, error_model="numpy")
def _refine(table, on, work, w, ds, out):
    """Solve for the arc length ds from w0, starting from w: the inverse function's series to second order,
    and halves of what encloses the solution where that leads outside it (where an interval is a whole span it
    may)."""
    low, high, h = on.w0, on.w1, on.h
    w = min(max(w, low), high)
    for _ in range(REFINE_STEPS):
        miss = _length(table, on, w, out) - ds
        if abs(miss) <= LENGTH_ROUNDING * h:
            break
        low, high = (low, w) if miss > 0.0 else (w, high)
        _point(table, on, work, w, out)
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


@njit(cache=True, error_model="numpy", nogil=True)
def place_of(table, on, work, c, ds, out):
    """Place and w-derivatives at the arc length ds into an interval, into out (4, A), from its polynomial c;
    returns the parameter w there."""
    w = _parameter(table, on, work, c, ds, out)
    _point(table, on, work, w, out)
    return w


@njit(cache=True, error_model="numpy", nogil=True)
def sample(table, law, grid, inverse, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times, and the toolpath segment (T,) that
    each lies at; an interval of a span may cover several.

    table, law, grid, inverse : `ElementTable`, `TimeLaw.columns`, `Grid`, and (P, `COEFFICIENTS`) from `inverses`
    """
    legs, _, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, _, _, of_interval, passed = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed, segment = np.empty(count), np.empty(count), np.empty(count, np.int64)
    work, here = np.empty((2, 4, axes)), np.empty((4, axes))
    m = last_not_after(t, times[0], 0, len(t) - 1) if count else 0
    i, at, joint = -1, 0, 0
    # known: the derivatives, which a straight leg has once
    on, known = interval_of(grid, at), False
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
        if i != at:
            on, at, known = interval_of(grid, i), i, False
        ds = min(max(s_here - s[i], 0.0), on.h)
        if known:
            w = on.w0 + (on.w1 - on.w0) * (ds / on.h)
            for k in range(axes):
                here[0, k] = legs[on.element].start[k] + w * legs[on.element].direction[k]
        else:
            w = place_of(table, on, work, inverse[i], ds, here)
            to_arc_length(here)
            known = is_straight(legs, on.element)
        out_s[n], out_feed[n] = s[i] + ds, v
        segment[n] = of_interval[i]
        if element[i] >= len(legs):
            span = element[i] - len(legs)
            place = spans[span].begin + spans[span].width * w
            if joint + 1 >= len(passed) or passed[joint + 1] <= place or passed[joint] > place:
                joint = last_not_after(passed, place, 0, len(passed) - 2)
            segment[n] = joint
        for k in range(axes):
            tangent, bend, twist = here[1, k], here[2, k], here[3, k]
            out_position[n, k], out_velocity[n, k] = here[0, k], tangent * v
            out_acceleration[n, k] = tangent * u + bend * (v * v)
            out_jerk[n, k] = tangent * j + 3.0 * bend * (v * u) + twist * (v * v * v)
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, segment
