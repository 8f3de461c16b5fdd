"""Limits of the search beside those of its axes and its feed: laws, the rows of a step that each has, and their
derivatives by p, v, a, j and h.

    SPEED         |v| <= V              of some axes: the feed in the axes that F goes by, the user's limits
    PUSH          |a.t| <= A_t          t = v/|v|
    JOLT          |d3s/dt3| <= J_t      d3s/dt3 = j.t + |a - (a.t) t|^2/|v|, the change of a.t
    POWER         |v_k a_k| <= P        of one axis
    JOINT_SPEED, JOINT_PUSH, JOINT_JOLT     the same three of a function q of the position
    PIN           n.(p - P) <= 0        a node stays on its side of where a bound jumps (own_laws.py)

On a step a is linear and v a parabola, with the Bezier ordinates b0, b1 and w0, w1, w2. Rows are those of
ordinates where there are any, so that they hold on the whole step: rows at places instead are made use of
between them, by a motion that weaves inside the tolerance.

SPEED has w0.w0 where a leg begins, w0.w1, (2 w1.w1 + w0.w2)/3, w1.w2 and w2.w2, over the ordinates of V^2.

PUSH: with the directions e0, e1 of the velocity at the ends e(q) = (1-q) e0 + q e1 is no longer than 1, so
that a.v <= A_t v.e(q) is enough. Both sides are cubics with the ordinates

    a.v     b0.w0,   (b1.w0 + 2 b0.w1)/3,   (2 b1.w1 + b0.w2)/3,   b1.w2
    v.e     w0.e0,   (w0.e1 + 2 w1.e0)/3,   (2 w1.e1 + w2.e0)/3,   w2.e1

exact at the nodes, and less by the cosine of half the turn between them. A row is (a.v - A_t v.e)/(A_t d),
with v.e kept in d: the share of the limit, less 1. From rest and to rest they are 0 for every motion, and are
no rows. POWER has those of a.v alone. The last ordinate is the first one of the next step.

JOLT has rows at both ends of a step and at its thirds, JOINT_JOLT at both ends; JOINT_SPEED the ordinate in the middle instead of the
second end, JOINT_PUSH the middle. About a place P that the node had before, with d = p - P, g = q',
H = q'' there and the third derivative T along the motion,

    q' = (g + H d).v,     q'' = (g + H d).a + v.H v,     q''' = (g + H d).j + 3 v.H a + T v^3.

Bounds V, A, J are those at both ends of a step, each times 1 + tilt.d there. Where the motion slides away
from P they are not the user's any more: what is found is looked at exactly, and searched once more about its own places.

Of the curvature the model has what is positive of that of SPEED, of the products a.v, of |a - (a.t) t|^2/|v|
and of v.H v: without it windows take many more iterations, or do not converge.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import CONTRACT, njit

SPEED, PUSH, JOLT, POWER, JOINT_SPEED, JOINT_PUSH, JOINT_JOLT, PIN = range(8)
ROWS_OF = (5, 6, 8, 6, 4, 4, 4, 1)  # upper before lower, where there are both
REST = 1e-3  # of a step's pace: below that the direction of a velocity counts less and less [-]
TILTED_LEAST = 0.1  # what 1 + tilt.d is at least [-]
# Bezier ordinates of w.w, and of b.w or e.w: row, ordinates of both factors, share.
SQUARE = np.array(
    [(0, 0, 0, 1), (1, 0, 1, 1), (2, 1, 1, 2 / 3), (2, 0, 2, 1 / 3), (3, 1, 2, 1), (4, 2, 2, 1)]
)
PRODUCT = np.array([(0, 0, 0, 1), (1, 1, 0, 1 / 3), (1, 0, 1, 2 / 3), (2, 1, 1, 2 / 3), (2, 0, 2, 1 / 3)])
# Of degree 4 of a square of what is linear: shares of that of its beginning (of its end the other way round)
# and of beginning times end.
FIRST, BOTH = (1.0, 0.5, 1.0 / 6.0, 0.0, 0.0), (0.0, 0.5, 4.0 / 6.0, 0.5, 0.0)


class LawRows(NamedTuple):
    """M laws of N steps, in the units of the problem; Q functions of the position."""

    kind: Array  # (M,)
    first: Array  # (M+1,) of their rows
    counts: FloatArray  # (M, A) 1 for the axes that count, else 0
    node: FloatArray  # (N, M) bound at the step's node, the smaller one of both sides
    begin: FloatArray  # (N, M) bound where the step begins
    end: FloatArray  # (N, M) and where it ends
    tilt: FloatArray  # (N, M, A) d(ln bound)/dp
    at: FloatArray  # (N+1, A) P
    joint: Array  # (M,) which function
    gradient: FloatArray  # (N+1, Q, A) g
    bend: FloatArray  # (N+1, Q, A, A) H
    convex: FloatArray  # (N+1, 2, Q, A, A) what is positive of H, and of -H
    third: FloatArray  # (N+1, Q) T |v|^3 of the motion before
    heading: FloatArray  # (N+1, A) v/|v|^2 of that; 0 at rest
    pin: FloatArray  # (N, A) n
    pinned: FloatArray  # (N,) n.P


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def ordinates(x, u, counts, w, b):
    """w (3, A) and b (2, A) of the axes that count, of a step with the node x (3 A,) and the controls u
    (A+1,)."""
    axes = len(u) - 1
    h = u[axes]
    for k in range(axes):
        v, a, j = counts[k] * x[axes + k], counts[k] * x[2 * axes + k], counts[k] * u[k]
        w[0, k], w[1, k], w[2, k] = v, v + 0.5 * h * a, v + h * (a + 0.5 * h * j)
        b[0, k], b[1, k] = a, a + h * j


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def multiply(table, one, other, value, of_one, of_other):
    """The ordinates of a product into value (R,), by those of its factors, one (.., A) and other (.., A), and
    their derivatives by these into of_one (R, .., A) and of_other (R, .., A)."""
    for term in range(len(table)):
        r, c, d, share = int(table[term, 0]), int(table[term, 1]), int(table[term, 2]), table[term, 3]
        for k in range(one.shape[1]):
            value[r] += share * one[c, k] * other[d, k]
            of_one[r, c, k] += share * other[d, k]
            of_other[r, d, k] += share * one[c, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def through(x, u, of_w, of_b, by, out):
    """out (4 A + 1,) += `by` times the derivatives of what has those by w and b, of_w (3, A) and of_b (2, A)."""
    axes = len(u) - 1
    h = u[axes]
    for k in range(axes):
        a, j = x[2 * axes + k], u[k]
        n1, n2, m1 = by * of_w[1, k], by * of_w[2, k], by * of_b[1, k]
        out[axes + k] += by * of_w[0, k] + n1 + n2
        out[2 * axes + k] += h * (0.5 * n1 + n2) + by * of_b[0, k] + m1
        out[3 * axes + k] += h * (0.5 * h * n2 + m1)
        out[4 * axes] += 0.5 * n1 * a + n2 * (a + h * j) + m1 * j


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_along(w, rest, value, of_w):
    """Add the ordinates of v.e but the last, by those of the velocity w (3, A), to value (3,), and their derivatives
    by w to of_w (3, 3, A): the directions e turn with w0 and w2. Returns the speeds at the ends together."""
    axes, first, last = w.shape[1], rest * rest, rest * rest
    for k in range(axes):
        first, last = first + w[0, k] * w[0, k], last + w[2, k] * w[2, k]
    first, last = np.sqrt(first), np.sqrt(last)
    w0_e0, w1_e0, w2_e0, w0_e1, w1_e1 = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(axes):
        e0, e1 = w[0, k] / first, w[2, k] / last
        w0_e0, w1_e0, w2_e0 = w0_e0 + w[0, k] * e0, w1_e0 + w[1, k] * e0, w2_e0 + w[2, k] * e0
        w0_e1, w1_e1 = w0_e1 + w[0, k] * e1, w1_e1 + w[1, k] * e1
    value[0] += w0_e0
    value[1] += (w0_e1 + 2.0 * w1_e0) / 3.0
    value[2] += (2.0 * w1_e1 + w2_e0) / 3.0
    for k in range(axes):
        e0, e1 = w[0, k] / first, w[2, k] / last
        of_w[0, 0, k] += e0 + (w[0, k] - w0_e0 * e0) / first
        of_w[1, 0, k] += (e1 + 2.0 * (w[1, k] - w1_e0 * e0) / first) / 3.0
        of_w[1, 1, k] += 2.0 * e0 / 3.0
        of_w[1, 2, k] += (w[0, k] - w0_e1 * e1) / last / 3.0
        of_w[2, 0, k] += (w[2, k] - w2_e0 * e0) / first / 3.0
        of_w[2, 1, k] += 2.0 * e1 / 3.0
        of_w[2, 2, k] += (e0 + 2.0 * (w[1, k] - w1_e1 * e1) / last) / 3.0
    return first + last


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def square_at(begin, end, r):
    """The r-th ordinate of degree 4 of the square of what goes from `begin` to `end`."""
    return FIRST[r] * begin * begin + BOTH[r] * begin * end + FIRST[4 - r] * end * end


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_speed(laws, i, m, x, u, f, by, g, out):
    """The rows of SPEED, as `put_law_rows`; f (2,) are the bound's 1 + tilt.d at both ends of the step, `by`
    (2, 4 A + 1) their derivatives."""
    axes, begin, end = len(u) - 1, laws.begin[i, m], laws.end[i, m]
    w, b, of_w, none = np.empty((3, axes)), np.empty((2, axes)), np.zeros((5, 3, axes)), np.zeros((2, axes))
    ordinates(x, u, laws.counts[m], w, b)
    multiply(SQUARE, w, w, g, of_w, of_w)
    v0, v1 = begin * f[0], end * f[1]
    for r in range(ROWS_OF[SPEED]):
        per = 0.5 / square_at(begin, end, r)
        g[r] = per * (g[r] - square_at(v0, v1, r))
        through(x, u, of_w[r], none, per, out[r])
        of_first = per * begin * (2.0 * FIRST[r] * v0 + BOTH[r] * v1)
        of_last = per * end * (2.0 * FIRST[4 - r] * v1 + BOTH[r] * v0)
        for k in range(4 * axes + 1):
            out[r, k] -= of_first * by[0, k] + of_last * by[1, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_pushed(laws, i, m, x, u, rest, f, by, g, out):
    """The rows of PUSH and of POWER, as `_put_speed`."""
    axes = len(u) - 1
    value, slope = np.zeros((2, 3)), np.zeros((2, 3, 4 * axes + 1))
    w, b, of_w, of_b = (
        np.empty((3, axes)),
        np.empty((2, axes)),
        np.zeros((3, 3, axes)),
        np.zeros((3, 2, axes)),
    )
    ordinates(x, u, laws.counts[m], w, b)
    multiply(PRODUCT, b, w, value[0], of_b, of_w)
    for r in range(3):
        through(x, u, of_w[r], of_b[r], 1.0, slope[0, r])
    if laws.kind[m] == POWER:
        value[1] = 1.0
    else:
        of_w[:], of_b[:] = 0.0, 0.0
        put_along(w, rest, value[1], of_w)
        for r in range(3):
            through(x, u, of_w[r], of_b[r], 1.0, slope[1, r])
    for r in range(3):
        begin, end = laws.node[i, m] if r == 0 else laws.begin[i, m], laws.end[i, m]
        bound = begin * f[0] + (end * f[1] - begin * f[0]) * r / 3.0
        plain = begin + (end - begin) * r / 3.0
        per = 1.0 / (plain * max(value[1, r], rest if laws.kind[m] == PUSH else 1.0))
        of_first, of_last = per * value[1, r] * begin * (1.0 - r / 3.0), per * value[1, r] * end * r / 3.0
        for side in range(2):
            row, sign = 3 * side + r, 1.0 - 2.0 * side
            g[row] = per * (sign * value[0, r] - bound * value[1, r])
            for k in range(4 * axes + 1):
                out[row, k] = per * (sign * slope[0, r, k] - bound * slope[1, r, k])
                out[row, k] -= of_first * by[0, k] + of_last * by[1, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def seen_at(x, u, t, y):
    """y (3, A) = position, velocity and acceleration at the time t of a step."""
    axes = len(u) - 1
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        y[0, k] = x[k] + t * (v + t * (0.5 * a + t * j / 6.0))
        y[1, k] = v + t * (a + 0.5 * t * j)
        y[2, k] = a + t * j


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def chained(u, part, y, by, out):
    """out (4 A + 1,) += the derivatives of what has those by position, velocity, acceleration and jerk, `by`
    (4, A), at a part of a step, where its motion is y (3, A)."""
    axes = len(u) - 1
    t = part * u[axes]
    for k in range(axes):
        p, v, a = by[0, k], by[1, k], by[2, k]
        out[k] += p
        out[axes + k] += t * p + v
        out[2 * axes + k] += t * (0.5 * t * p + v) + a
        out[3 * axes + k] += t * (t * (t * p / 6.0 + 0.5 * v) + a) + by[3, k]
        out[4 * axes] += part * (p * y[1, k] + v * y[2, k] + a * u[k])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _jolt(y, j, counts, rest, by):
    """j.t + |a - (a.t) t|^2/|v| of y (3, A) and j (A,), and its derivatives into `by` (4, A)."""
    vv, av, aa, jv = rest * rest, 0.0, 0.0, 0.0
    for k in range(y.shape[1]):
        v, a = counts[k] * y[1, k], counts[k] * y[2, k]
        vv, av, aa, jv = vv + v * v, av + a * v, aa + a * a, jv + j[k] * v
    s = np.sqrt(vv)
    for k in range(y.shape[1]):
        v, a = y[1, k], y[2, k]
        turned = (jv + aa - 3.0 * av * av / vv) * v + 2.0 * av * a
        by[0, k], by[1, k] = 0.0, counts[k] * (j[k] - turned / vv) / s
        by[2, k], by[3, k] = counts[k] * 2.0 * (a - av / vv * v) / s, counts[k] * v / s
    return (jv + aa - av * av / vv) / s


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _of_joint(laws, n, other, m, order, y, j, by):
    """The derivative of that order of a function of the position by the time, as nodes n and `other` have it
    on the mean, and its derivatives into `by` (4, A)."""
    q, axes = laws.joint[m], y.shape[1]
    value, along = 0.0, 0.0
    by[:] = 0.0
    for k in range(axes):
        along += laws.heading[n, k] * y[1, k]
    for k in range(axes):
        g, hv, ha, hj = 0.5 * (laws.gradient[n, q, k] + laws.gradient[other, q, k]), 0.0, 0.0, 0.0
        for c in range(axes):
            bend = 0.5 * (laws.bend[n, q, k, c] + laws.bend[other, q, k, c])
            g += bend * (y[0, c] - 0.5 * (laws.at[n, c] + laws.at[other, c]))
            hv, ha, hj = hv + bend * y[1, c], ha + bend * y[2, c], hj + bend * j[c]
        if order == 1:
            value += g * y[1, k]
            by[0, k], by[1, k] = hv, g
        elif order == 2:
            value += g * y[2, k] + hv * y[1, k]
            by[0, k], by[1, k], by[2, k] = ha, 2.0 * hv, g
        else:
            value += g * j[k] + 3.0 * hv * y[2, k]
            by[0, k], by[2, k], by[3, k] = hj, 3.0 * hv, g
            by[1, k] = 3.0 * ha + 3.0 * laws.third[n, q] * along * along * laws.heading[n, k]
    return value + laws.third[n, q] * along**3 if order == 3 else value


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_ends(laws, i, m, x, u, rest, f, of_f, g, out):
    """The rows of laws that are watched at places of a step, as `_put_speed`; `of_f` is its `by`."""
    axes, kind = len(u) - 1, laws.kind[m]
    y, by, w, b = np.empty((3, axes)), np.zeros((4, axes)), np.empty((3, axes)), np.empty((2, axes))
    for place in range(ROWS_OF[kind] // 2):
        share = place / (
            ROWS_OF[kind] // 2 - 1
        )  # of the way from the bound at the beginning to that at the end
        part = 0.5 * share if kind in (JOINT_PUSH, JOINT_SPEED) else share
        seen_at(x, u, part * u[axes], y)
        row = out[2 * place]
        if kind == JOLT:
            value = _jolt(y, u, laws.counts[m], rest, by)
        elif kind == JOINT_SPEED and place:  # at the middle, with the ordinate w1 as the velocity
            ordinates(x, u, np.ones(axes), w, b)
            for k in range(axes):
                y[1, k], w[1, k] = w[1, k], y[1, k]
            value = _of_joint(laws, i, i + 1, m, 1, y, u, by)
            for k in range(axes):
                y[1, k], w[0, k], w[1, k], w[2, k], by[1, k] = w[1, k], 0.0, by[1, k], 0.0, 0.0
            b[:] = 0.0
            through(x, u, w, b, 1.0, row)
        else:
            first = i if kind == JOINT_PUSH else i + place
            value = _of_joint(laws, first, i + place, m, kind - JOINT_SPEED + 1, y, u, by)
        chained(u, part, y, by, row)
        bound, high = (
            laws.begin[i, m] + share * (laws.end[i, m] - laws.begin[i, m]),
            f[0] + share * (f[1] - f[0]),
        )
        if place == 0 and kind in (JOINT_SPEED, JOINT_PUSH):
            bound = laws.node[i, m]
        for k in range(4 * axes + 1):
            of_high = of_f[0, k] + share * (of_f[1, k] - of_f[0, k])
            row[k] /= bound
            out[2 * place + 1, k] = -row[k] - of_high
            row[k] -= of_high
        g[2 * place], g[2 * place + 1] = value / bound - high, -value / bound - high


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_law_rows(laws, i, pace, room, aside, x, u, g, out):
    """The rows of step i with the node x (3 A,) and the controls u (A+1,) into g, and their derivatives by p,
    v, a, j and h into out (.., 4 A + 1); pace, room and how far `aside` as of the limits (rows.py)."""
    axes = len(u) - 1
    if len(laws.kind) == 0:
        return
    f, by, y, tilt = np.empty(2), np.zeros((2, 4 * axes + 1)), np.empty((3, axes)), np.zeros((4, axes))
    for m in range(len(laws.kind)):
        own, slope = g[laws.first[m] : laws.first[m + 1]], out[laws.first[m] : laws.first[m + 1]]
        own[:], slope[:], f[:], by[:] = 0.0, 0.0, 1.0, 0.0
        if laws.tilt[i, m].any():
            for end in range(2):
                seen_at(x, u, end * u[axes], y)
                for k in range(axes):
                    tilt[0, k] = laws.tilt[i, m, k]
                    f[end] += tilt[0, k] * (y[0, k] - laws.at[i + end, k])
                chained(u, 1.0 * end, y, tilt, by[end])
                f[end] = max(f[end], TILTED_LEAST)
        rest = REST * pace
        if laws.kind[m] == SPEED:
            _put_speed(laws, i, m, x, u, f, by, own, slope)
        elif laws.kind[m] == PUSH or laws.kind[m] == POWER:
            _put_pushed(laws, i, m, x, u, rest, f, by, own, slope)
        elif laws.kind[m] == PIN:
            own[0] = aside - laws.pinned[i] / room
            for k in range(axes):
                slope[0, k] = laws.pin[i, k] / room
                own[0] += slope[0, k] * x[k]
        else:
            _put_ends(laws, i, m, x, u, rest, f, by, own, slope)
