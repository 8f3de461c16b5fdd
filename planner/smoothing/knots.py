"""Where a spline needs its knots: near to each other where the path turns much within its tolerance.

A control polygon that follows the path leaves it by about a quarter of the turning between two knots times their distance. So knots
stand at distances

    h(u) = the longest h with  turning within h around u  *  h <= FITTING * tolerance,

one corner of theta: h = FITTING tol/theta; an arc of radius R: h = sqrt(FITTING tol R), however it is cut into chords. They grow
by `GROWTH` of the distance from there, and stay below what a motion needs to build up its acceleration.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit

# Control points on the path leave a corner by sin(theta/2) sqrt(h^2/2) sqrt(2/pi) = 0.28 theta h, so by 0.56 of the tolerance.
FITTING = 2.0
# Neighbouring spans then differ by a third at most.
GROWTH = 0.3
STEP = 0.1  # of the distance between knots, to integrate its inverse in [-]: over a step it changes by GROWTH STEP = 3 %
BEYOND = 1e-3  # ... or up to so little beyond a place, so that the next step begins after the kink there [-]
TURN_MIN = 1e-12  # [rad]: a tangent joint, for which knots may stand as far apart as they like


@njit(cache=True, error_model="numpy")
def graded(place, h):
    """h (m,) lowered to grow by no more than GROWTH of the distance from place to place."""
    m = len(place)
    h = h.copy()
    for k in range(1, m):
        h[k] = min(h[k], h[k - 1] + GROWTH * (place[k] - place[k - 1]))
    for k in range(m - 2, -1, -1):
        h[k] = min(h[k], h[k + 1] + GROWTH * (place[k + 1] - place[k]))
    return h


@njit(cache=True, error_model="numpy")
def spacing(place, turn, tol, longest):
    """Largest distance between knots (m,) at the turns `turn` [rad] at ascending places (m,) [mm]; `tol` (m,), `longest` [mm]."""
    m = len(place)
    h = np.empty(m)
    begin = 0
    total = 0.0
    # windows that end at turn k: shrink from the left until they fit; every turn inside takes the window's length
    for k in range(m):
        h[k] = min(longest, FITTING * tol[k] / max(turn[k], TURN_MIN))
    for k in range(m):
        total += turn[k]
        while begin < k and total * (place[k] - place[begin]) > FITTING * tol[k]:
            # turns begin .. k do not fit into one interval: the next ones must be nearer than they are
            width = place[k] - place[begin]
            for j in (begin, k):
                h[j] = min(h[j], max(width, FITTING * tol[j] / total))
            total -= turn[begin]
            begin += 1
    return graded(place, h)


@njit(cache=True, error_model="numpy")
def spread(place, h, begin, end, longest, least):
    """Breaks (S+1,) from begin to end whose distances follow h at the places and grow by GROWTH from there, at most `longest`;
    at least `least` spans."""
    # density 1/h integrated in small steps: between two places h is the smaller of the two cones
    count = 0.0
    for sweep in range(2):
        if sweep == 1:
            spans = max(int(np.ceil(count)), least)
            breaks = np.empty(spans + 1)
            breaks[0] = begin
            target = count / spans
            filled = 1
        u = begin
        done = 0.0
        k = 0
        while u < end:
            while k < len(place) and place[k] < u:
                k += 1
            here = longest
            ahead = end
            if k < len(place):
                here = min(here, h[k] + GROWTH * (place[k] - u))
                ahead = min(ahead, place[k])
            if k > 0:
                here = min(here, h[k - 1] + GROWTH * (u - place[k - 1]))
            du = min(STEP * here, end - u)
            if ahead > u:
                du = min(du, ahead - u + BEYOND * here)
            part = du / here
            if sweep == 1:
                while filled < spans and done + part >= target * filled:
                    breaks[filled] = u + du * (target * filled - done) / part
                    filled += 1
            done += part
            u += du
        count = done
    breaks[filled:] = end
    return breaks
