"""The legs of a run (run.py) as kernels see them: points, tangents, and nearest places."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.geometry.curves import curve_point

NEAREST_STEPS = 3  # Gauss-Newton steps to the nearest place of an arc or a curve, from the last one


class LegFormulas(NamedTuple):
    """R legs of a run (run.py), in the units of the problem."""

    length: FloatArray  # (R,)
    base: FloatArray  # (R, A)
    drift: FloatArray  # (R, A)
    e1: FloatArray  # (R, A)
    e2: FloatArray  # (R, A)
    radius: FloatArray  # (R,)
    rate: FloatArray  # (R,)
    curve: Array  # (R,) row in the tables of the curves, or -1
    points: FloatArray  # (K, 4, A)
    weight: FloatArray  # (K, 2)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _curve_of(legs, r, x, out):
    """Point and three derivatives, out (4, A), of leg r, a curve, at the place x."""
    p, w = legs.points[legs.curve[r]], legs.weight[legs.curve[r]]
    curve_point((p[0], p[1], p[2], p[3]), (w[0], w[1]), legs.length[r], x, out)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _nearest_on_curve(legs, r, c, x, point, tangent):
    """`nearest_point` on a curve."""
    out = np.empty((4, len(c)))
    for n in range(NEAREST_STEPS + 1):
        _curve_of(legs, r, x, out)
        miss, square = 0.0, 0.0
        for k in range(len(c)):
            point[k], tangent[k] = out[0, k], out[1, k]
            miss += (c[k] - point[k]) * tangent[k]
            square += tangent[k] * tangent[k]
        if n < NEAREST_STEPS:
            x = min(max(x + miss / square, 0.0), legs.length[r])
    return x


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def nearest_point(legs, r, c, x, point, tangent):
    """point (A,) of leg r nearest to c (A,), from the place x on arcs and curves; its tangent (A,), and its
    place."""
    if legs.curve[r] >= 0:
        return _nearest_on_curve(legs, r, c, x, point, tangent)
    axes, length = len(c), legs.length[r]
    radius, rate = legs.radius[r], legs.rate[r]
    if radius == 0.0:
        miss, square = 0.0, 0.0
        for k in range(axes):
            miss += (c[k] - legs.base[r, k]) * legs.drift[r, k]
            square += legs.drift[r, k] * legs.drift[r, k]
        x = min(max(miss / square, 0.0), length)
        for k in range(axes):
            point[k], tangent[k] = legs.base[r, k] + legs.drift[r, k] * x, legs.drift[r, k]
        return x
    for n in range(NEAREST_STEPS + 1):
        cos, sin = np.cos(rate * x), np.sin(rate * x)
        miss, square = 0.0, 0.0
        for k in range(axes):
            circle, across = (
                cos * legs.e1[r, k] + sin * legs.e2[r, k],
                cos * legs.e2[r, k] - sin * legs.e1[r, k],
            )
            point[k] = legs.base[r, k] + legs.drift[r, k] * x + radius * circle
            tangent[k] = legs.drift[r, k] + radius * rate * across
            miss += (c[k] - point[k]) * tangent[k]
            square += tangent[k] * tangent[k]
        if n < NEAREST_STEPS:
            x = min(max(x + miss / square, 0.0), length)
    return x


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _in_order(place, low, high):
    """Make places (n,) of points in turn such that they never go back: halfway between the largest before and the
    smallest behind, so that the farthest of them is moved by as little as can be; from `low` to `high`."""
    least, before, behind = np.empty(len(place)), low, high
    for k in range(len(place) - 1, -1, -1):
        behind = min(behind, place[k])
        least[k] = behind
    for k in range(len(place)):
        before = max(before, place[k])
        place[k] = min(max(0.5 * (before + least[k]), low), high)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_places(legs, leg, at_vertex, x, h, place, stays):
    """The places of the nodes and the inner control points of N steps that are on lines into `place` (N, 3), in order:
    a motion may go back along a leg as far as one place is near enough to what it passes twice. `stays` (N, 3):
    whether a place is no nearest one that moves with its point. Returns the place of the last node if that is on a
    line.

    leg       : (N,) of the steps
    at_vertex : whether the first node is where its leg begins
    x         : (N+1, 3 A) position, velocity and acceleration at the nodes
    h         : (N,) durations
    """
    N, axes, begin, last = len(leg), x.shape[1] // 3, 0, 0.0
    c, point, tangent = np.empty(axes), np.empty(axes), np.empty(axes)
    while begin < N:
        r, end, vertex = leg[begin], begin + 1, at_vertex or begin > 0
        while end < N and leg[end] == r:
            end += 1
        if legs.radius[r] == 0.0:
            nearest = np.empty(3 * (end - begin))
            for n in range(len(nearest)):
                i, m = begin + n // 3, n % 3
                third = h[i] / 3.0
                for k in range(axes):
                    c[k] = x[i, k] + m * third * x[i, axes + k]
                    if m == 2:
                        c[k] += 1.5 * third * third * x[i, 2 * axes + k]
                nearest[n] = nearest_point(legs, r, c, 0.0, point, tangent)
            nearest[0] = 0.0 if vertex else nearest[0]
            last = nearest_point(legs, r, x[N, :axes], 0.0, point, tangent)
            last = max(last, nearest[0])
            order = nearest.copy()
            _in_order(order, nearest[0], last if end == N else legs.length[r])
            for n in range(len(order)):
                i, m = begin + n // 3, n % 3
                place[i, m] = order[n]
                stays[i, m] = order[n] != nearest[n] or order[n] <= 0.0 or order[n] >= legs.length[r]
        begin = end
    return last


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def formula_point(legs, r, x, point, tangent, bend):
    """point (A,) of leg r at the place x, with its tangent and second derivative (A,)."""
    if legs.curve[r] >= 0:
        out = np.empty((4, len(point)))
        _curve_of(legs, r, x, out)
        for k in range(len(point)):
            point[k], tangent[k], bend[k] = out[0, k], out[1, k], out[2, k]
        return
    radius, rate = legs.radius[r], legs.rate[r]
    cos, sin = np.cos(rate * x), np.sin(rate * x)
    for k in range(len(point)):
        circle, across = cos * legs.e1[r, k] + sin * legs.e2[r, k], cos * legs.e2[r, k] - sin * legs.e1[r, k]
        point[k] = legs.base[r, k] + legs.drift[r, k] * x + radius * circle
        tangent[k] = legs.drift[r, k] + radius * rate * across
        bend[k] = -radius * rate * rate * circle


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def along_tangent(length, c, x, ahead, point, tangent):
    """How far along the tangent (A,) at the place x of a leg, from its point (A,), c (A,) is: ahead of it or
    else behind it, and within the leg."""
    miss, square = 0.0, 0.0
    for k in range(len(c)):
        miss += (c[k] - point[k]) * tangent[k]
        square += tangent[k] * tangent[k]
    far = miss / square
    return min(max(far, 0.0), length - x) if ahead else max(min(far, 0.0), -x)
