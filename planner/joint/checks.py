"""Whether steps keep everything exactly: their limits at every time, and the tolerance by the control points
of their cubics.

Jerk is constant on a step, acceleration linear and the velocity of an axis a parabola. The square of the feed
has degree 4: where its Bernstein coefficients are not all within the limit it is looked at in `PLACES` places
and, from the highest of them, where its derivative 2 v.a is zero (Newton). The normal acceleration is looked at
in the same places. For the tolerance see nlp.py: control points within the budget of those of the leg's own
cubic, along places that never go back (legs.py). On arcs a step is looked at in `PIECES`, and what the arc is
off its own cubic (run.py) counts too.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint.legs import LegFormulas, along_tangent, formula_point, nearest_point, put_places

PLACES = 33  # where a step is looked at first [-]
NEWTON_STEPS = 4  # from the highest of them: 1/32 of a step becomes exact to rounding [-]
# Shares of a chord at which it is looked at beside a vertex [-].
PASSED = (0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9)
# Of a step on an arc; what the arc is off its cubic goes with the fourth power of their length.
PIECES = 4


class Keeps(NamedTuple):
    """The limits of steps on R legs with A axes."""

    legs: LegFormulas
    velocity: FloatArray  # (A,)
    acceleration: FloatArray  # (A,)
    jerk: FloatArray  # (A,)
    feed: FloatArray  # (R,)
    normal: FloatArray  # (R,)
    budget: FloatArray  # (R,)
    curvature: FloatArray  # (R,)
    vertex_budget: FloatArray  # (R+1,)
    passed: Array  # (R,)
    lag: FloatArray  # (K, 2) of the filters (run.py) [s], [-]
    chord: float  # half of one [s]


@njit(cache=True, error_model="numpy")
def _at(v, a, j, t):
    """Squared speed, v.a, and the squared normal acceleration times the squared speed, at time t in a
    step."""
    square, along, push = 0.0, 0.0, 0.0
    for k in range(len(v)):
        w, b = v[k] + t * (a[k] + 0.5 * t * j[k]), a[k] + t * j[k]
        square, along, push = square + w * w, along + w * b, push + b * b
    return square, along, push * square - along * along


@njit(cache=True, error_model="numpy")
def _fastest(h, v, a, j):
    """No speed in a step is above that: the root of the largest Bernstein coefficient of its square."""
    first, second, third, fourth, last = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(v)):
        middle, end = v[k] + 0.5 * h * a[k], v[k] + h * (a[k] + 0.5 * h * j[k])
        first, second = first + v[k] * v[k], second + v[k] * middle
        third += (2.0 * middle * middle + v[k] * end) / 3.0
        fourth, last = fourth + middle * end, last + end * end
    return np.sqrt(max(first, second, third, fourth, last))


@njit(cache=True, error_model="numpy")
def _of_limits(keeps, r, h, v, a, j):
    """The largest share of a limit in a step on leg r; of the feed a bound of it where that is at most 1."""
    worst, axes = 0.0, len(v)
    for k in range(axes):
        worst = max(worst, abs(j[k]) / keeps.jerk[k])
        worst = max(worst, max(abs(a[k]), abs(a[k] + h * j[k])) / keeps.acceleration[k])
        turn = -a[k] / j[k] if j[k] != 0.0 else 0.0
        turn = turn if 0.0 < turn < h else 0.0
        fastest = max(abs(v[k]), abs(v[k] + h * (a[k] + 0.5 * h * j[k])), abs(v[k] + 0.5 * turn * a[k]))
        worst = max(worst, fastest / keeps.velocity[k])
    bound = _fastest(h, v, a, j) / keeps.feed[r]
    if bound <= 1.0 and keeps.normal[r] == np.inf:
        return max(worst, bound)
    best, at = 0.0, 0.0
    for n in range(PLACES):
        t = h * n / (PLACES - 1)
        square, _, across = _at(v, a, j, t)
        if square > best:
            best, at = square, t
        if square > 0.0 and across > square * (worst * keeps.normal[r]) ** 2:  # spares most places the root
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
def _apart(c, point, tangent, far):
    """Distance of c (A,) from the point (A,) `far` along a tangent (A,) from another."""
    square = 0.0
    for k in range(len(c)):
        square += (c[k] - point[k] - far * tangent[k]) ** 2
    return np.sqrt(square)


@njit(cache=True, error_model="numpy")
def bend_of(curvature, rate, s):
    """Bound of |d4/dt4 P(x(t))|/384 for the places x of a cubic piece with the ordinates s (4,) on an arc."""
    first = 3.0 * max(s[1] - s[0], s[2] - s[1], s[3] - s[2])
    second = 6.0 * max(abs(s[2] - 2.0 * s[1] + s[0]), abs(s[3] - 2.0 * s[2] + s[1]))
    third = 6.0 * abs(s[3] - 3.0 * s[2] + 3.0 * s[1] - s[0])
    turned = abs(rate) * first * first
    fourth = turned * (turned + 6.0 * second)
    return curvature * (fourth + 3.0 * second * second + 4.0 * first * third) / 384.0


@njit(cache=True, error_model="numpy")
def _split(c, part, piece):
    """The Bezier ordinates c (4, B) of a cubic: `piece` (4, B) gets those of its first part, c keeps those of
    the rest."""
    piece[0] = c[0]
    for level in range(3):  # de Casteljau
        for m in range(3 - level):
            c[m] += part * (c[m + 1] - c[m])
        piece[level + 1] = c[0]


@njit(cache=True, error_model="numpy")
def _in_pieces(keeps, r, c, s, budgets, work):
    """The largest share of the tolerance of a step with the control points c (4, A) whose places are the cubic
    with the ordinates s (4, 1), both overwritten; budgets (2,) of both ends."""
    legs, budget, worst = keeps.legs, keeps.budget[r], 0.0
    point, ahead, tangent, ahead_tangent, bend, piece, _, part_of_s = work
    formula_point(legs, r, s[0, 0], ahead, ahead_tangent, bend)
    for n in range(PIECES):
        part = 1.0 / (PIECES - n)
        _split(c, part, piece)
        _split(s, part, part_of_s)
        x = part_of_s[:, 0]
        point[:], tangent[:] = ahead, ahead_tangent
        formula_point(legs, r, x[3], ahead, ahead_tangent, bend)
        inner = max(
            _apart(piece[1], point, tangent, x[1] - x[0]),
            _apart(piece[2], ahead, ahead_tangent, x[2] - x[3]),
        )
        begin = _apart(piece[0], point, tangent, 0.0) / (budgets[0] if n == 0 else budget)
        last = _apart(piece[3], ahead, ahead_tangent, 0.0) / (budgets[1] if n == PIECES - 1 else budget)
        far = max(begin, inner / budget, last)
        worst = max(worst, far + bend_of(keeps.curvature[r], legs.rate[r], x) / budget)
    return worst


@njit(cache=True, error_model="numpy")
def _of_passed(keeps, r, c, s0, s3, budgets, work):
    """The same of a step on a leg that is passed, evenly from the place s0 to s3."""
    s = work[6]
    for m in range(4):
        s[m, 0] = s0 + (s3 - s0) * m / 3.0
    return _in_pieces(keeps, r, c, s, budgets, work), s3


@njit(cache=True, error_model="numpy")
def _of_arc(keeps, r, c, s0, end, known, budgets, work):
    """The largest share of the tolerance of a step on an arc with the control points c (4, A), overwritten,
    from the place s0; budgets (2,) of both ends. It ends at the place `end`, or, if that is not known, at one
    sought from there. Returns where it ends too."""
    legs = keeps.legs
    point, ahead, tangent, ahead_tangent, bend, _, s, _ = work
    s3 = end if known else max(nearest_point(legs, r, c[3], end, point, tangent), s0)
    formula_point(legs, r, s3, ahead, ahead_tangent, bend)
    s[2, 0] = s3 + along_tangent(legs.length[r], c[2], s3, False, ahead, ahead_tangent)
    formula_point(legs, r, s0, ahead, ahead_tangent, bend)
    s[1, 0] = s0 + along_tangent(legs.length[r], c[1], s0, True, ahead, ahead_tangent)
    s[0, 0], s[1, 0], s[2, 0], s[3, 0] = s0, min(s[1, 0], s3), max(s[2, 0], s0), s3
    if s[1, 0] > s[2, 0]:
        s[1, 0] = s[2, 0] = 0.5 * (s[1, 0] + s[2, 0])
    return _in_pieces(keeps, r, c, s, budgets, work), s3


@njit(cache=True, error_model="numpy")
def _of_line(keeps, r, c, places, end, budgets):
    """The same on a line, of control points with the places (3,) and `end` on it."""
    worst, base, drift = 0.0, keeps.legs.base[r], keeps.legs.drift[r]
    for m in range(4):
        budget = budgets[m // 3] if m % 3 == 0 else keeps.budget[r]
        worst = max(worst, _apart(c[m], base, drift, end if m == 3 else places[m]) / budget)
    return worst


@njit(cache=True, error_model="numpy", nogil=True)
def worst_shares(keeps, leg, h, state, jerk, place):
    """The largest share of a limit in N steps, and of the tolerance in each of them (2, N): at setpoints, and on the chords
    between them.

    leg (N,), h (N,), state (N+1, 3, A), jerk (N, A); place (N, 3) of the nodes and the inner control points
    along the leg: where places on arcs are sought from; whether the first node is where its leg begins, on a line (0)
    """
    N, axes = jerk.shape
    limit, tube, x = 0.0, np.zeros((2, N)), np.empty((N + 1, 3 * axes))
    mean, wider = chord_means(keeps, leg, h, state, jerk)
    for i in range(N):
        limit = max(limit, _of_limits(keeps, leg[i], h[i], state[i, 1], state[i, 2], jerk[i]))
    for seen in range(2):
        for i in range(N + 1):
            x[i, :axes], x[i, 2 * axes :] = mean[i] if seen else state[i, 0], state[i, 2]
        for i in range(N):  # between nodes they are off the motion by a linear share
            for k in range(axes):
                off = x[i + 1, k] - state[i + 1, 0, k] - (x[i, k] - state[i, 0, k])
                x[i, axes + k] = state[i, 1, k] + off / h[i]
        _put_tube(keeps, leg, h, x, place, seen * wider, tube[seen])
    return limit, tube


@njit(cache=True, error_model="numpy", nogil=True)
def chord_means(keeps, leg, h, state, jerk):
    """(N+1, A) the middles of the chords, behind filters, that are there when the motion is at the nodes, at a vertex p + dt^2/8 a
    of eq. (18) where that is farther from it; (N+1,) by how much chords that pass a vertex at another place than their middle
    are farther from it. Arguments as above."""
    nodes, axes = len(state), jerk.shape[1]
    point, tangent, bend, other = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)
    node, mean, wider = np.append(0.0, np.cumsum(h)), np.zeros((nodes, axes)), np.zeros(nodes)
    for i in range(nodes):
        _add_chord(keeps, node, state, jerk, node[i], 0.5, mean[i])
        if 0 < i < nodes - 1 and leg[i] != leg[i - 1] and keeps.chord > 0.0:
            formula_point(keeps.legs, leg[i], 0.0, point, tangent, bend)
            for side in PASSED:
                other[:] = 0.0
                _add_chord(keeps, node, state, jerk, node[i], side, other)
                wider[i] = max(wider[i], _apart(other, point, tangent, 0.0))
            for k in range(axes):
                other[k] = state[i, 0, k] + 0.5 * keeps.chord * keeps.chord * state[i, 2, k]
            if _apart(other, point, tangent, 0.0) > _apart(mean[i], point, tangent, 0.0):
                mean[i] = other
            wider[i] = max(wider[i] - _apart(mean[i], point, tangent, 0.0), 0.0)
    return mean, wider


@njit(cache=True, error_model="numpy")
def _add_chord(keeps, node, state, jerk, t, share, x):
    """To x (A,) is added where on a chord, behind filters, its `share` is at time t; node (N+1,) times of the nodes."""
    for k in range(len(keeps.lag)):
        for end in range(2):
            later = keeps.lag[k, 0] + 2.0 * keeps.chord * (end - share)
            weight = keeps.lag[k, 1] * (share if end else 1.0 - share)
            _add_later(node, state, jerk, t + later, weight, x)


@njit(cache=True, error_model="numpy")
def _add_later(node, state, jerk, time, weight, x):
    """The position at a time, times a weight, is added to x (A,); beyond the steps there are, the acceleration stays as at
    their end."""
    N = len(node) - 1
    n = max(np.searchsorted(node, time, side="right") - 1, 0)
    t = time - node[n]
    for k in range(len(x)):
        j = jerk[n, k] if n < N and t >= 0.0 else 0.0
        x[k] += weight * (state[n, 0, k] + t * (state[n, 1, k] + t * (0.5 * state[n, 2, k] + t * j / 6.0)))


@njit(cache=True, error_model="numpy")
def _put_tube(keeps, leg, h, x, place, less, tube):
    """Into `tube` (N,) the shares that steps use of the tolerance whose states at their beginnings are x (N+1, 3 A); it is
    `less` (N+1,) at vertices."""
    N, axes, before = len(h), x.shape[1] // 3, 0.0
    c, budgets = np.empty((4, axes)), np.empty(2)
    work = (
        *(np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)),
        *(np.zeros((4, axes)), np.zeros((4, 1)), np.zeros((4, 1))),
    )
    on_line = np.zeros((N, 3))
    last = put_places(keeps.legs, leg, place[0, 0] <= 0.0, x, h, on_line, np.zeros((N, 3), np.bool_))
    for i in range(N):
        r, third = leg[i], h[i] / 3.0
        begins, ends = i > 0 and leg[i - 1] != r, i < N - 1 and leg[i + 1] != r
        for k in range(axes):
            c[0, k], c[1, k] = x[i, k], x[i, k] + third * x[i, axes + k]
            c[2, k] = x[i, k] + third * (2.0 * x[i, axes + k] + 1.5 * third * x[i, 2 * axes + k])
            c[3, k] = x[i + 1, k]
        budgets[:] = keeps.budget[r]
        if begins:
            before, budgets[0] = 0.0, min(budgets[0], keeps.vertex_budget[r]) - less[i]
        elif i == 0:
            before = nearest_point(keeps.legs, r, c[0], place[i, 0], work[0], work[1])
        if ends:
            budgets[1] = min(budgets[1], keeps.vertex_budget[r + 1]) - less[i + 1]
        end = keeps.legs.length[r] if ends else max(place[i, 2], before)
        if keeps.passed[r]:
            end = place[i, 0] + 3.0 * (place[i, 1] - place[i, 0])
            share, before = _of_passed(keeps, r, c, place[i, 0], end, budgets, work)
        elif keeps.legs.radius[r] > 0.0:
            share, before = _of_arc(keeps, r, c, before, end, ends, budgets, work)
        else:
            end = keeps.legs.length[r] if ends else last if i == N - 1 else on_line[i + 1, 0]
            share = _of_line(keeps, r, c, on_line[i], end, budgets)
        tube[i] = share
