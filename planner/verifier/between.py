"""What a motion does between two times at which it was looked at, where it is a cubic there.

At every time position, velocity, acceleration and jerk are known, and so is the cubic through them. On a piece of the
motion all places have to agree on it: what each says of the next one, in position, velocity and acceleration, is what is
found there (`ROUNDING`); and the pieces meet, in acceleration too where jerk is limited. There are four and more at random
in every piece (reading.py), where nothing but the one cubic does that. Over h from one time to the next, or to the end of the
piece and back from the next time to it,

    acceleration   is straight: extremes at the ends
    velocity       has its extreme where the acceleration is 0
    speed          |v|^2 has the degree 4: below the largest of its Bernstein ordinates, of `PARTS` parts where one is above the ends
    position       is within |a| h^2 / 8 of the chord, |a| the larger one at the ends; a chord of the length l whose ends are d off
                   a circle of the radius R is at most d + l^2 / (8 (R - eps)) off, eps the tolerance

Where the places do not agree, as on a path that is no cubic in time, what lies between them is not known.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.verifier.kernel import kernel
from planner.verifier.pieces import PERIOD_ROUNDING, PLACE_ROUNDING, STRAIGHT

ROUNDING = 1e-7  # by which places of one cubic may disagree, of the limits of velocity and acceleration [-]
PARTS = 32  # of the time between two places, where speed has a maximum: its ordinates are then good to 1/1000 of what they were
ABOVE = 1e-9  # by which an ordinate is above the ends if there is a maximum, and not rounding [-]
# In `known`: largest distance from the chord [mm]; how often what lies between is not known; how often the path is a curve.
OPEN, UNKNOWN, BENT = range(3)


class Between(NamedTuple):
    """What lies before each of n places, since the one before: largest velocity and acceleration of each axis (n, A),
    and speed (n,), 0 where it has no maximum; how long its cubic stands for the
    motion, then that of the place itself (n,) [s], NaN where several pieces lie between."""

    velocity: FloatArray
    acceleration: FloatArray
    speed: FloatArray
    cut: FloatArray


@kernel()
def look_between(t, state, edges, edge, limits, skip, pieces, piece, work, found, known):
    """Into `found` what lies before the places `skip` and later, and into `known` (3,) how much is left open.

    t       : (n,) [s]
    state   : (n, 4, A) position and its derivatives there
    edges   : (L,) where the pieces of the motion begin, non-decreasing [s]; `edge` is the first after the place before `skip`
    limits  : (3, A) of velocity, acceleration and jerk; inf where acceleration may jump from piece to piece
    piece   : (n,) of the path, on which they are
    work    : (3, A)
    """
    last, n, axes = len(edges), len(t), state.shape[2]
    e = edge
    for k in range(max(skip, 1), n):
        before = e
        while e < last and edges[e] <= t[k]:
            e += 1
        h = t[k] - t[k - 1]
        whole = e == before
        to = h if whole else edges[before] - t[k - 1]
        back = 0.0 if whole else t[k] - edges[e - 1]
        single = whole or h - to - back <= PERIOD_ROUNDING
        found.cut[k] = h - back if single else np.nan
        if not (single and _agree(state, limits, k, to, back)):
            known[UNKNOWN] += 1.0
            found.cut[k] *= 0.5 if whole else 1.0
            to = back = 0.0
        _segment(state, k - 1, to, k, work, found)
        _segment(state, k, -back, k, work, found)
        push, length = 0.0, 0.0
        for i in range(axes):
            push += found.acceleration[k, i] ** 2
            length += (state[k, 0, i] - state[k - 1, 0, i]) ** 2
        off = np.sqrt(push) * h * h / 8.0
        on = pieces.piece[piece[k]]
        if on["arc"] > STRAIGHT:
            off += length / (8.0 * max(pieces.turn[on["arc"], 0] - on["budget"], PLACE_ROUNDING))
        elif on["arc"] < STRAIGHT:
            known[BENT] += 1.0
        known[OPEN] = max(known[OPEN], off)


@kernel(inline=True)
def _agree(state, limits, k, to, back):
    """Whether the cubics of the places k - 1 and k meet: `to` after the one, and `back` before the other."""
    for i in range(state.shape[2]):
        v, a, j = state[k - 1, 1, i], state[k - 1, 2, i], state[k - 1, 3, i]
        x = state[k - 1, 0, i] + to * (v + to * (a / 2 + to * j / 6))
        v, a = v + to * (a + to * j / 2), a + to * j
        v1, a1, j1 = state[k, 1, i], state[k, 2, i], state[k, 3, i]
        x1 = state[k, 0, i] - back * (v1 - back * (a1 / 2 - back * j1 / 6))
        v1, a1 = v1 - back * (a1 - back * j1 / 2), a1 - back * j1
        jumps = abs(a - a1) > ROUNDING * limits[1, i] and (back == 0.0 or limits[2, i] < np.inf)
        if jumps or abs(x - x1) > PLACE_ROUNDING or abs(v - v1) > ROUNDING * limits[0, i]:
            return False
    return True


@kernel(inline=True)
def _segment(state, at, h, k, work, found):
    """Take in the cubic of the place `at` over h, which is below 0 for what lies before it, into `found` at k."""
    ends = 0.0, 0.0
    inner, first, second = 0.0, 0.0, 0.0
    for i in range(state.shape[2]):
        v, a, j = state[at, 1, i], state[at, 2, i], state[at, 3, i]
        v1, a1 = v + h * (a + h * j / 2), a + h * j
        most = max(abs(v), abs(v1))
        if a * a1 < 0.0:
            most = max(most, abs(v - a * a / (2.0 * j)))
        found.velocity[k, i] = max(found.velocity[k, i], most)
        found.acceleration[k, i] = max(found.acceleration[k, i], max(abs(a), abs(a1)))
        middle = v + h * a / 2
        work[0, i], work[1, i], work[2, i] = v, middle, v1
        ends = ends[0] + v * v, ends[1] + v1 * v1
        first, second = first + v * middle, second + v1 * middle
        inner += (v * v1 + 2.0 * middle * middle) / 3.0
    least = max(ends[0], ends[1]) * (1.0 + ABOVE)
    if max(inner, max(first, second)) <= least:
        return
    most = 0.0
    for part in range(PARTS):
        p, q = part / PARTS, (part + 1) / PARTS
        b0, b1, b2, b3, b4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(state.shape[2]):
            w0, w1, w2 = work[0, i], work[1, i], work[2, i]
            d0, d1 = w1 - w0, w2 - w1
            u0 = w0 + p * (2.0 * d0 + p * (d1 - d0))
            u2 = w0 + q * (2.0 * d0 + q * (d1 - d0))
            u1 = w0 + (p + q) * d0 + p * q * (d1 - d0)
            b0, b1, b2 = b0 + u0 * u0, b1 + u0 * u1, b2 + (u0 * u2 + 2.0 * u1 * u1) / 3.0
            b3, b4 = b3 + u1 * u2, b4 + u2 * u2
        most = max(most, max(max(b0, b4), max(b2, max(b1, b3))))
    found.speed[k] = max(found.speed[k], np.sqrt(most))
