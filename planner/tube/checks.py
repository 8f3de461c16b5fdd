"""Whether steps keep everything exactly: their limits at every time, and the tolerance by the control points of their cubics.

Jerk is constant on a step, acceleration linear and the velocity of an axis a parabola. The square of the feed has degree 4: it is
looked at in `PLACES` places and, from the highest of them, where its derivative 2 v.a is zero (Newton). The normal acceleration is
looked at in the same places. For the tolerance see nlp.py: control points within the budget of places on the leg that never go back,
and on arcs kappa (s3 - s0)^2/8 for the bending between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.tube.rows import Legs, nearest_point

PLACES = 33
NEWTON_STEPS = 4


class Keeps(NamedTuple):
    """What steps on R legs with A axes have to keep."""

    legs: Legs
    velocity: FloatArray  # (A,)
    acceleration: FloatArray  # (A,)
    jerk: FloatArray  # (A,)
    feed: FloatArray  # (R,)
    normal: FloatArray  # (R,)
    budget: FloatArray  # (R,)
    curvature: FloatArray  # (R,)
    vertex_budget: FloatArray  # (R+1,)


@njit(cache=True, error_model="numpy")
def _at(v, a, j, t):
    """Squared speed, v.a, and the squared normal acceleration times the squared speed, at time t in a step."""
    square, along, push = 0.0, 0.0, 0.0
    for k in range(len(v)):
        w, b = v[k] + t * (a[k] + 0.5 * t * j[k]), a[k] + t * j[k]
        square, along, push = square + w * w, along + w * b, push + b * b
    return square, along, push * square - along * along


@njit(cache=True, error_model="numpy")
def _of_limits(keeps, r, h, v, a, j):
    """The largest share of a limit in a step on leg r."""
    worst, axes = 0.0, len(v)
    for k in range(axes):
        worst = max(worst, abs(j[k]) / keeps.jerk[k])
        worst = max(worst, max(abs(a[k]), abs(a[k] + h * j[k])) / keeps.acceleration[k])
        turn = -a[k] / j[k] if j[k] != 0.0 else 0.0
        turn = turn if 0.0 < turn < h else 0.0
        fastest = max(abs(v[k]), abs(v[k] + h * (a[k] + 0.5 * h * j[k])), abs(v[k] + 0.5 * turn * a[k]))
        worst = max(worst, fastest / keeps.velocity[k])
    best, at = 0.0, 0.0
    for n in range(PLACES):
        t = h * n / (PLACES - 1)
        square, _, across = _at(v, a, j, t)
        if square > best:
            best, at = square, t
        if square > 0.0 and across > 0.0:
            worst = max(worst, np.sqrt(across / square) / keeps.normal[r])
    for _ in range(NEWTON_STEPS):
        _, along, _ = _at(v, a, j, at)
        slope = 0.0
        for k in range(axes):
            b = a[k] + at * j[k]
            slope += b * b + (v[k] + at * (a[k] + 0.5 * at * j[k])) * j[k]
        if slope < 0.0:
            at = min(max(at - along / slope, 0.0), h)
    return max(worst, np.sqrt(max(best, _at(v, a, j, at)[0])) / keeps.feed[r])


@njit(cache=True, error_model="numpy")
def worst_shares(keeps, leg, h, state, jerk, place):
    """The largest share of a limit, and of the tolerance, in N steps.

    leg (N,), h (N,), state (N+1, 3, A), jerk (N, A); place (N, 3) of the nodes and the inner control points along the leg: where the
    search for them begins
    """
    N, axes = jerk.shape
    limit, tube = 0.0, 0.0
    c, point, tangent, far = np.empty(axes), np.empty(axes), np.empty(axes), np.empty(4)
    before = 0.0
    for i in range(N):
        r = leg[i]
        limit = max(limit, _of_limits(keeps, r, h[i], state[i, 1], state[i, 2], jerk[i]))
        begins, ends = i > 0 and leg[i - 1] != r, i < N - 1 and leg[i + 1] != r
        s0 = 0.0
        for m in range(4):
            for k in range(axes):
                p, q = state[i, 0, k], state[i + 1, 0, k]
                third = h[i] / 3.0
                c[k] = (p, p + third * state[i, 1, k], q - third * state[i + 1, 1, k], q)[m]
            s = nearest_point(keeps.legs, r, c, place[i, min(m, 2)], point, tangent)
            budget = keeps.budget[r]
            if m == 0:
                s = 0.0 if begins else (s if i == 0 else before)
                s0 = s
                if begins:
                    budget = min(budget, keeps.vertex_budget[r])
            else:
                s = max(s, before)
            if m == 3 and ends:
                s = keeps.legs.length[r]
                budget = min(budget, keeps.vertex_budget[r + 1])
            before = s
            square = 0.0
            cos, sin = np.cos(keeps.legs.rate[r] * s), np.sin(keeps.legs.rate[r] * s)
            for k in range(axes):
                on = keeps.legs.base[r, k] + keeps.legs.drift[r, k] * s
                on += keeps.legs.radius[r] * (cos * keeps.legs.e1[r, k] + sin * keeps.legs.e2[r, k])
                square += (c[k] - on) ** 2
            far[m] = np.sqrt(square) / budget
        bend = keeps.curvature[r] * (before - s0) ** 2 / 8.0 / keeps.budget[r]
        tube = max(tube, far.max() + bend)
    return limit, tube
