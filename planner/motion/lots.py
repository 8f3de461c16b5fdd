"""A motion along a path at given times, in lots of `LANES` samples.

What is done for every sample is the same: the time law gives the arc length s, the polynomial of the grid
interval there (sampling.py) the parameter w, and the polynomials of the span the place and its derivatives.
So the samples of a lot lie side by side, quantity Q of sample o at Q + o, and several are done in one
instruction; each has its own copy of the coefficients, so that it does not matter how many samples an
interval has. Straight legs are spans of degree one. Samples on arcs and corners, and those whose polynomial
is too far off for one step, are evaluated one by one (`place_of`). A sample's value does not depend on the
others of its lot.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.corners.elements import GAUSS_NODES, GAUSS_WEIGHTS, is_straight
from planner.geometry.spline import DEGREE
from planner.motion.sampling import COEFFICIENTS, LENGTH_ROUNDING, ONE_STEP, interval_of, place_of, room_for

LANES = 16  # samples of a lot: a multiple of the 4 or 8 doubles that one instruction takes

# Of each sample: share q of its interval; w0, w1 - w0 and length of the interval; parameter; speed,
# acceleration and jerk along the path; sums over the nodes of Gauss' rule and over the axes. And the
# polynomial of its interval, as `inverses` has it.
Q, W0, DW, LENGTH, W, SPEED, ALONG, JERK, TOTAL, SQUARE, SECOND, THIRD, TAU, PER = (
    k * LANES for k in range(14)
)
LANE = 14 * LANES
INVERSE = COEFFICIENTS * LANES
# Of each sample and axis: coefficients of the span; place and derivatives, which become velocity,
# acceleration and jerk.
GIVEN = (DEGREE + 1) * LANES
PLACE, FIRST, BEND, TWIST = (k * LANES for k in range(4))
MADE = 4 * LANES


class _Lot(NamedTuple):
    """Room for a lot: lane (LANE,), inverse (INVERSE,), given (A, GIVEN), made (A, MADE)."""

    lane: FloatArray
    inverse: FloatArray
    given: FloatArray
    made: FloatArray


@njit(cache=True, error_model="numpy", nogil=True)
def _coefficients(table, element, given, o):
    """The coefficients of a span or a straight leg, into lane o of given (A, GIVEN); False for other
    elements."""
    legs, _, spans = table
    if element >= len(legs):
        c = spans[element - len(legs)].coef
        for k in range(given.shape[0]):
            for d in range(DEGREE + 1):
                given[k, d * LANES + o] = c[d, k]
        return True
    if not is_straight(legs, element):
        return False
    for k in range(given.shape[0]):
        given[k, o], given[k, LANES + o] = legs[element].start[k], legs[element].direction[k]
        for d in range(2, DEGREE + 1):
            given[k, d * LANES + o] = 0.0
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def _parameters(lot):
    """The parameter w of each sample by the polynomial of its interval, and where that is off a step by its
    slope."""
    lane, c = lot.lane, lot.inverse
    for o in range(LANES):
        q = lane[Q + o]
        high = c[4 * LANES + o] + q * (c[5 * LANES + o] + q * (c[6 * LANES + o] + q * c[7 * LANES + o]))
        share = c[LANES + o] + q * (c[2 * LANES + o] + q * (c[3 * LANES + o] + q * high))
        p, d = q * (1.0 - q), q - 0.5
        more = (p * p) * (p * p) * (c[8 * LANES + o] + d * (c[9 * LANES + o] + d * c[10 * LANES + o]))
        lane[W + o] = lane[W0 + o] + lane[DW + o] * (q * share + more)
    off = 0.0
    for o in range(LANES):
        off = max(off, c[o])
    if off <= LENGTH_ROUNDING:
        return
    _lengths(lot)
    for o in range(LANES):
        q, w, w0, dw = lane[Q + o], lane[W + o], lane[W0 + o], lane[DW + o]
        high = 5.0 * c[5 * LANES + o] + q * (6.0 * c[6 * LANES + o] + q * (7.0 * c[7 * LANES + o]))
        high = 3.0 * c[3 * LANES + o] + q * (4.0 * c[4 * LANES + o] + q * high)
        p, d = q * (1.0 - q), q - 0.5
        more = c[8 * LANES + o] + d * (c[9 * LANES + o] + d * c[10 * LANES + o])
        more = p * p * p * (p * (c[9 * LANES + o] + 2.0 * d * c[10 * LANES + o]) - 8.0 * d * more)
        slope = c[LANES + o] + q * (2.0 * c[2 * LANES + o] + q * high) + more
        miss = lane[TOTAL + o] * (w - w0) / lane[LENGTH + o] - q
        stepped = min(max(w - miss * dw * slope, w0), w0 + dw)
        lane[W + o] = stepped if c[o] > LENGTH_ROUNDING else w


@njit(cache=True, error_model="numpy", nogil=True)
def _lengths(lot):
    """Mean speed |B'| of each sample's curve from the start of its interval to w, by Gauss' rule, into
    `TOTAL`."""
    lane, given = lot.lane, lot.given
    for o in range(LANES):
        lane[TOTAL + o] = 0.0
    for g in range(len(GAUSS_NODES)):
        node, weight = GAUSS_NODES[g], GAUSS_WEIGHTS[g]
        for o in range(LANES):
            lane[TAU + o] = lane[W0 + o] + (lane[W + o] - lane[W0 + o]) * node
            lane[SQUARE + o] = 0.0
        for k in range(given.shape[0]):
            c = given[k]
            for o in range(LANES):
                tau = lane[TAU + o]
                high = 4.0 * c[4 * LANES + o] + tau * (5.0 * c[5 * LANES + o])
                high = 3.0 * c[3 * LANES + o] + tau * high
                rate = c[LANES + o] + tau * (2.0 * c[2 * LANES + o] + tau * high)
                lane[SQUARE + o] += rate * rate
        for o in range(LANES):
            lane[TOTAL + o] += weight * np.sqrt(lane[SQUARE + o])


@njit(cache=True, error_model="numpy", nogil=True)
def _places(lot):
    """Place and w-derivatives of each sample on its polynomial."""
    lane, _, given, made = lot
    for k in range(given.shape[0]):
        for o in range(LANES):
            w = lane[W + o]
            c0, c1, c2 = given[k, o], given[k, LANES + o], given[k, 2 * LANES + o]
            c3, c4, c5 = given[k, 3 * LANES + o], given[k, 4 * LANES + o], given[k, 5 * LANES + o]
            made[k, PLACE + o] = ((((c5 * w + c4) * w + c3) * w + c2) * w + c1) * w + c0
            made[k, FIRST + o] = (((5.0 * c5 * w + 4.0 * c4) * w + 3.0 * c3) * w + 2.0 * c2) * w + c1
            made[k, BEND + o] = ((20.0 * c5 * w + 12.0 * c4) * w + 6.0 * c3) * w + 2.0 * c2
            made[k, TWIST + o] = (60.0 * c5 * w + 24.0 * c4) * w + 6.0 * c3


@njit(cache=True, error_model="numpy", nogil=True)
def _in_time(lot):
    """From w-derivatives to derivatives by arc length (corners/elements.py), and to those in time
    (timing.py)."""
    lane, axes = lot.lane, lot.made.shape[0]
    for o in range(LANES):
        lane[SQUARE + o] = 0.0
    for k in range(axes):
        m = lot.made[k]
        for o in range(LANES):
            lane[SQUARE + o] += m[FIRST + o] * m[FIRST + o]
    for o in range(LANES):
        lane[PER + o] = 1.0 / np.sqrt(lane[SQUARE + o])  # one over |B'|
        lane[SECOND + o] = 0.0  # T . B''
        lane[THIRD + o] = 0.0  # T . B'''
        lane[TOTAL + o] = 0.0  # r'' . B''
    for k in range(axes):
        m = lot.made[k]
        for o in range(LANES):
            first = m[FIRST + o] * lane[PER + o]
            lane[SECOND + o] += first * m[BEND + o]
            lane[THIRD + o] += first * m[TWIST + o]
            m[FIRST + o] = first
    for k in range(axes):
        m = lot.made[k]
        for o in range(LANES):
            per, bend = lane[PER + o], m[BEND + o]
            second = (bend - m[FIRST + o] * lane[SECOND + o]) * (per * per)
            lane[TOTAL + o] += second * bend
            along = 3.0 * lane[SECOND + o] * second
            twist = (m[TWIST + o] - m[FIRST + o] * lane[THIRD + o]) * (per * per * per)
            m[TWIST + o] = twist - along * (per * per)
            m[BEND + o] = second
    for k in range(axes):
        m = lot.made[k]
        for o in range(LANES):
            per, v, u = lane[PER + o], lane[SPEED + o], lane[ALONG + o]
            first, second = m[FIRST + o], m[BEND + o]
            third = m[TWIST + o] - first * (lane[TOTAL + o] * per * per)
            m[FIRST + o] = first * v
            m[BEND + o] = first * u + second * (v * v)
            m[TWIST + o] = first * lane[JERK + o] + 3.0 * second * (v * u) + third * (v * v * v)


@njit(cache=True, error_model="numpy", nogil=True)
def sample(table, law, grid, inverse, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times, and the toolpath segment (T,) that
    each lies at; an interval of a span may cover several.

    table, grid : `ElementTable` (corners/elements.py), `Grid` (sampling.py)
    law         : `TimeLaw.columns`
    inverse     : (P, `COEFFICIENTS`), from `inverses` (sampling.py)
    """
    legs, _, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, w0, w1, of_interval, passed = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed, segment = np.empty(count), np.empty(count), np.empty(count, np.int64)
    lot = _Lot(np.ones(LANE), np.zeros(INVERSE), np.ones((axes, GIVEN)), np.ones((axes, MADE)))
    lane, polynomial, given, made = lot
    room, here = room_for(axes), np.empty((4, axes))
    interval, alone = np.zeros(LANES, np.int64), np.zeros(LANES, np.bool_)
    m = last_not_after(t, times[0], 0, len(t) - 1) if count else 0
    i, joint = -1, 0
    for begin in range(0, count, LANES):
        used = min(LANES, count - begin)
        any_alone = False
        for o in range(used):
            n = begin + o
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
            interval[o] = i
            lane[Q + o], lane[LENGTH + o] = ds / h, h
            lane[W0 + o], lane[DW + o] = w0[i], w1[i] - w0[i]
            lane[SPEED + o], lane[ALONG + o], lane[JERK + o] = v, u, j
            for d in range(COEFFICIENTS):
                polynomial[d * LANES + o] = inverse[i, d]
            alone[o] = not _coefficients(table, element[i], given, o) or inverse[i, 0] > ONE_STEP
            any_alone |= alone[o]
            out_s[n], out_feed[n] = s[i] + ds, v
        _parameters(lot)
        _places(lot)
        if any_alone:
            for o in range(used):
                if alone[o]:
                    on = interval_of(table, grid, interval[o], room)
                    lane[W + o] = place_of(table, on, room, inverse[interval[o]], lane[Q + o] * on.h, here)
                    for k in range(axes):
                        made[k, PLACE + o], made[k, FIRST + o] = here[0, k], here[1, k]
                        made[k, BEND + o], made[k, TWIST + o] = here[2, k], here[3, k]
        _in_time(lot)
        for o in range(used):
            n, at = begin + o, interval[o]
            segment[n] = of_interval[at]
            if element[at] >= len(legs):
                span = element[at] - len(legs)
                place = spans[span].begin + spans[span].width * lane[W + o]
                if joint + 1 >= len(passed) or passed[joint + 1] <= place or passed[joint] > place:
                    joint = last_not_after(passed, place, 0, len(passed) - 2)
                segment[n] = joint
            for k in range(axes):
                out_position[n, k], out_velocity[n, k] = made[k, PLACE + o], made[k, FIRST + o]
                out_acceleration[n, k], out_jerk[n, k] = made[k, BEND + o], made[k, TWIST + o]
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, segment
