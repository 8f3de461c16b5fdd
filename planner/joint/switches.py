"""Whether a motion goes over to the faster of two feeds no sooner than it is nearest to the vertex between them.

On the step of a time h the way from the vertex is p = d + V x + A x^2 + J x^3 with x = t/h, and p.p falls or rises with

    f  =  p . dp/dx,        of degree 5 in x:

a place is nearest within a step where f goes from below 0 to above. Its zeros lie between those of its derivative, theirs
between those of the next one. Steps are looked at from the vertex on, on the faster leg and on the slower one, so that f is
above 0 where a motion goes away from it; where the feed falls that is backwards in time.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint.run import TubeRun

DEGREE = 5  # of f
HALVED = 60  # a zero is between two places that are halved so often [-]
AWAY = 1e-12  # rounding of distances to a vertex, in tolerances and of the places themselves [-]
SAME = 1e-9  # rounding of a feed, as a share of it [-]
FURTHER = 1.002  # by how much more than was missed a node is to be further [-]


class Beside(NamedTuple):
    """Nodes of N steps that have the row of a change of feed: the leg (N,) that begins at the vertex, -1 of others;
    the place (N, A) that stands for the vertex [mm]; whether they have been asked for before (N,)."""

    leg: Array
    at: FloatArray
    again: Array

    def add(self, others: "Beside") -> None:
        """Take in others of the same nodes."""
        new = others.leg >= 0
        self.again[new] = self.leg[new] >= 0
        self.leg[new], self.at[new] = others.leg[new], others.at[new]


def no_rows_beside(steps: int, axes: int) -> Beside:
    """Of no nodes."""
    return Beside(np.full(steps, -1), np.zeros((steps, axes)), np.zeros(steps, dtype=bool))


@njit(cache=True, error_model="numpy")
def _value(c, x):
    """The polynomial with the coefficients c, the constant first, at x."""
    value = 0.0
    for k in range(len(c) - 1, -1, -1):
        value = value * x + c[k]
    return value


@njit(cache=True, error_model="numpy")
def _nearest(d, v, a, j, h, places):
    """Least squared distance over a step, when [share of it], and the smallest f until then; places (7,) is overwritten."""
    c = np.zeros(DEGREE + 1)
    for k in range(len(d)):
        V, A, J = h * v[k], h * h * a[k] / 2.0, h * h * h * j[k] / 6.0
        c[0] += d[k] * V
        c[1] += V * V + 2.0 * d[k] * A
        c[2] += 3.0 * (V * A + d[k] * J)
        c[3] += 2.0 * A * A + 4.0 * V * J
        c[4] += 5.0 * A * J
        c[5] += 3.0 * J * J
    places[:2], count, least = (0.0, 1.0), 2, c[0]
    of = np.zeros(DEGREE + 2)
    for degree in range(1, DEGREE + 1):
        part, many = np.zeros(degree + 1), 1
        for k in range(degree + 1):  # the derivative of f that has this degree
            part[k] = c[k + DEGREE - degree]
            for n in range(DEGREE - degree):
                part[k] *= k + DEGREE - degree - n
        of[0] = 0.0
        for n in range(count - 1):
            low, high = places[n], places[n + 1]
            rises = _value(part, high) > 0.0
            if (_value(part, low) > 0.0) == rises:
                continue
            for _ in range(HALVED):
                middle = 0.5 * (low + high)
                if (_value(part, middle) > 0.0) == rises:
                    high = middle
                else:
                    low = middle
            of[many] = high
            many += 1
        of[many] = 1.0
        count = many + 1
        places[:count] = of[:count]
        if degree == DEGREE - 1:
            turns, turned = places[:count].copy(), count
    best, when = np.inf, 0.0
    for n in range(count):
        x, square = places[n], 0.0
        for k in range(len(d)):
            p = d[k] + h * x * (v[k] + h * x * (a[k] / 2.0 + h * x * j[k] / 6.0))
            square += p * p
        if square < best:
            best, when = square, x
    for n in range(turned):
        if turns[n] <= when:
            least = min(least, _value(c, turns[n]))
    return best, when, least


@njit(cache=True, error_model="numpy")
def _least(vertex, begin, jerk, h, way):
    """Of steps outwards from a vertex, with way = -1 backwards: the least distance, the step of it, and the smallest f
    in it until then.

    begin (n, 3, A) of the inner node of each, jerk (n, A), h (n,), outwards
    """
    axes, best, at, low = len(vertex), np.inf, 0, 0.0
    d, v, j, places = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(DEGREE + 2)
    for i in range(len(h)):
        off, pace, push, jolt = 0.0, 0.0, 0.0, 0.0
        for k in range(axes):
            d[k], v[k], j[k] = begin[i, 0, k] - vertex[k], way * begin[i, 1, k], way * jerk[i, k]
            off, pace = off + d[k] ** 2, pace + v[k] ** 2
            push, jolt = push + begin[i, 2, k] ** 2, jolt + j[k] ** 2
        way_run = h[i] * (np.sqrt(pace) + h[i] * (np.sqrt(push) / 2.0 + h[i] * np.sqrt(jolt) / 6.0))
        if np.sqrt(off) - way_run >= best:
            continue
        square, _, least = _nearest(d, v, begin[i, 2], j, h[i], places)
        if np.sqrt(square) < best:
            best, at, low = np.sqrt(square), i, least
    return best, at, low


def switches_missed(
    run: TubeRun, leg: Array, h: FloatArray, state: FloatArray, jerk: FloatArray, part: slice = slice(None)
) -> Beside | None:
    """Where N steps run at the larger of two feeds while they are still to be nearer to the vertex between them, in the
    steps `part`, the nodes inside it that get a row for it: that of the vertex; those of the faster leg that are nearer, and
    those within the budget of the vertex on which the way to it is the wrong one; and the node before a step that comes
    nearer between nodes, which is to be further from the vertex by as much. None where there are none.

    leg (N,), h (N,) [s], state (N+1, 3, A) [mm, s], jerk (N, A)
    """
    begin, end, _ = part.indices(len(leg))
    rows = no_rows_beside(*jerk.shape)
    begins = np.flatnonzero(np.diff(leg)) + 1  # the nodes at vertices
    edges = np.concatenate([[0], begins, [len(leg)]])
    for k, node in enumerate(begins):
        r = int(leg[node])
        if run.switch[r] == 0.0:
            continue
        vertex, way = run.vertex[r], -run.switch[r]
        # steps outwards, the nodes where they begin: backwards on the leg before the vertex
        sides = (np.arange(node, edges[k + 2]), 0), (np.arange(node - 1, edges[k] - 1, -1), 1)
        (fast, more), (slow, less) = sides if way > 0.0 else sides[::-1]
        inner = fast + more
        nearest, at, low = _least(vertex, state[inner], jerk[fast], h[fast], way)
        other, _, _ = _least(vertex, state[slow + less], jerk[slow], h[slow], -way)
        other -= AWAY * (run.vertex_budget[r] + np.abs(vertex).max())
        if nearest >= other or not begin <= fast[at] < end:
            continue
        until = slice(0, at + 1)
        if _slow(run, r, state[inner[until]], state[fast[until] + 1 - more], way * h[fast[until]]):
            continue
        off, v = state[inner, 0] - vertex, way * state[inner, 1]
        far, away, speed = np.linalg.norm(off, axis=1), (off * v).sum(axis=1), np.linalg.norm(v[at])
        wrong = inner[(far < other) | ((away < 0.0) & (far <= run.vertex_budget[r]))]
        rows.leg[wrong[wrong < end]], rows.at[wrong[wrong < end]] = r, vertex
        if low < 0.0 <= away[at] and speed > 0.0 and inner[at] < end:
            further = FURTHER * (away[at] - low / h[fast[at]]) / speed
            rows.leg[inner[at]], rows.at[inner[at]] = r, vertex + further * v[at] / speed
        if node < end and rows.leg[node] < 0:
            rows.leg[node], rows.at[node] = r, vertex
    rows.leg[: begin + 1] = -1
    return Beside(*(column[part] for column in rows)) if (rows.leg[part] >= 0).any() else None


def _slow(run: TubeRun, r: int, begin: FloatArray, end: FloatArray, h: FloatArray) -> bool:
    """Whether steps from begin (n, 3, A) to end (n, 3, A), h (n,) below 0 where that is backwards, keep the smaller feed of
    the two where leg r begins: the Bezier ordinates of their velocity do."""
    if run.word.shape[1]:
        return False
    middle = begin[:, 1] + h[:, None] * begin[:, 2] / 2.0
    speeds = np.linalg.norm(np.concatenate([begin[:, 1], middle, end[:, 1]]), axis=1)
    return bool(speeds.max() <= run.feed[r - 1 : r + 1].min() * (1.0 + SAME))
