"""Whether a motion goes over to the faster of two feeds no sooner than it is nearest to the vertex between them.

On the step of a time h the way from the vertex is p = d + V x + A x^2 + J x^3 with x = t/h, and p.p falls or rises with

    f  =  p . dp/dx,        of degree 5 in x:

a place is nearest within a step where f goes from below 0 to above. Its zeros lie between those of its derivative, theirs
between those of the next one. Steps are looked at from the vertex on, on the faster leg and on the slower one, so that f is
above 0 where a motion goes away from it; where the feed falls that is backwards in time.

Vertices that are nearer to each other than the tolerance may be passed together, a short block with an F of its own as well as
the points of a narrow arc, of which one is passed every `MARK`. There the motion is at all of them in order, at the places
that are together nearest (least sum of squares); of those that would be out of order that is one place, nearest to their mean, which
stands for the vertex: what is nearest to the vertex itself does not count. Between the places of a slow block no step may be faster
than its F, whichever leg it belongs to.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint.run import TubeRun

DEGREE = 5  # of f
PARTS = 8  # of a step, at which the order of places is looked for [-]
HALVED = 60  # a zero is between two places that are halved so often [-]
AWAY = 1e-12  # rounding of distances to a vertex, in tolerances and of the places themselves [-]
SAME = 1e-9  # rounding of a feed, as a share of it, and of a place, in steps [-]
FURTHER = 1.002  # by how much more than was missed a node is to be further [-]
# Points are looked at that are so many tolerances from a vertex [-], and so many at most before and behind it.
LOOKED_AT, LOOKED_MOST = 4.0, 16


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
    in it until then."""
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


@njit(cache=True, error_model="numpy")
def _beside(point, first, last, state, jerk, h, room):
    """Where N steps are nearest to a point beside the places `first` to `last` of their `PARTS`, in steps; room: p, v and a
    (3, A), and 7 places."""
    (d, v, a), places = room
    best, at = np.inf, 0.0
    for q in range(max(first - 1, 0), min(last + 1, len(h) * PARTS)):
        n = q // PARTS
        t = h[n] * (q / PARTS - n)
        for k in range(len(point)):
            a[k], v[k] = (
                state[n, 2, k] + t * jerk[n, k],
                state[n, 1, k] + t * (state[n, 2, k] + t * jerk[n, k] / 2.0),
            )
            d[k] = state[n, 0, k] - point[k] + t * (v[k] - t * (a[k] / 2.0 - t * jerk[n, k] / 6.0))
        square, share, _ = _nearest(d, v, a, jerk[n], h[n] / PARTS, places)
        if square < best:
            best, at = square, (q + share) / PARTS
    return at


@njit(cache=True, error_model="numpy")
def places_in_order(points, state, jerk, h):
    """Where N steps are at the points (P, A) in order: at their places (P,), in steps; and the points (P, A) that stand for
    them, means of those that are passed together. In order are those of `PARTS` places of every step with the least sum."""
    count, many = len(points), len(h) * PARTS + 1
    cost, better = np.zeros(many), np.zeros((count, many), np.bool_)
    for i in range(count):
        least = np.inf
        for q in range(many):
            n = min(q // PARTS, len(h) - 1)
            t, square = h[n] * (q / PARTS - n), cost[q]
            for k in range(points.shape[1]):
                off = t * (state[n, 1, k] + t * (state[n, 2, k] / 2.0 + t * jerk[n, k] / 6.0))
                square += (state[n, 0, k] - points[i, k] + off) ** 2
            better[i, q] = square < least
            cost[q] = least = min(least, square)
    part, q = np.zeros(count, np.int64), many - 1
    for i in range(count - 1, -1, -1):
        while not better[i, q]:
            q -= 1
        part[i] = q
    room = np.zeros((3, points.shape[1])), np.zeros(DEGREE + 2)
    place, group, stands = np.zeros(count), np.ones(count, np.int64), points.copy()
    for i in range(count):
        place[i], n = _beside(points[i], part[i], part[i], state, jerk, h, room), i
        while n > 0 and place[n] <= place[n - 1]:
            n -= group[n - 1]
            for m in range(n, i + 1):
                for k in range(points.shape[1]):
                    stands[m, k] = points[n : i + 1, k].mean()
            place[n : i + 1] = _beside(stands[i], part[n], part[i], state, jerk, h, room)
            group[n : i + 1] = i + 1 - n
    return place, stands


@njit(cache=True, error_model="numpy")
def _fast_steps(state, jerk, h, begin, end, feed):
    """(N,) which of the steps run faster than `feed` between the places `begin` and `end`, in steps."""
    found, axes = np.zeros(len(h), np.bool_), jerk.shape[1]
    for n in range(len(h)):
        low, high = max(begin - n, 0.0), min(end - n, 1.0)
        if high - low <= SAME:
            continue
        most, t = 0.0, low * h[n]
        span = high * h[n] - t
        for x in (0.0, 0.5, 1.0):  # Bezier ordinates of the velocity there
            square = 0.0
            for k in range(axes):
                a, j = state[n, 2, k], jerk[n, k]
                v, a = state[n, 1, k] + t * (a + t * j / 2.0), a + t * j
                square += (v + span * x * (a + (span * j / 2.0 if x == 1.0 else 0.0))) ** 2
            most = max(most, square)
        found[n] = np.sqrt(most) > feed * (1.0 + SAME)
    return found


def _together(run: TubeRun, r: int) -> tuple[FloatArray, Array]:
    """(P, A) the points around the vertex where leg r begins that may be passed together with it, in order, and (P,) the
    legs that begin there, -1 of points on arcs."""
    vertex, reach = run.vertex[r], LOOKED_AT * run.vertex_budget[r]
    before, behind = np.arange(r - 1, max(r - 1 - LOOKED_MOST, -1), -1), np.arange(r, r + LOOKED_MOST)
    points, of = [vertex[None]], [np.array([r])]
    for legs, way in ((before, -1), (behind[behind < len(run)], 1)):
        marks = run.marks[legs]
        ends = np.cumsum(marks)
        many = int(ends[ends - marks < LOOKED_MOST][-1])
        leg, last = np.repeat(legs, marks)[:many], np.isin(np.arange(many) + 1, ends)
        number = np.arange(many) + 1 - np.repeat(ends - marks, marks)[:many]  # from the vertex outwards
        share = (number if way > 0 else run.marks[leg] - number) * (1.0 / run.marks[leg])
        found = run.points(leg, run.length[leg] * np.where(last & (way > 0), 1.0, share))
        at = np.where(last, leg + (way > 0), -1)
        near = (np.linalg.norm(found - vertex, axis=1) <= reach) & (at != 0) & (at != len(run))
        until = many if near.all() else int(near.argmin())
        points.insert(way + 1, found[:until][::way])
        of.insert(way + 1, at[:until][::way])
    return np.concatenate(points), np.concatenate(of)


def _too_fast(
    run: TubeRun, r: int, leg: Array, h: FloatArray, state: FloatArray, jerk: FloatArray
) -> tuple[Array, FloatArray, bool]:
    """The nodes of N steps that are beyond the vertex, where leg r begins, on the slower side, and run at more than its F
    meanwhile; the point (A,) that stands for the vertex (module text), and whether that is the vertex alone."""
    points, of = _together(run, r)
    legs = of[of >= 0]
    steps = np.arange(*np.searchsorted(leg, [legs[0] - 1, legs[-1] + 1]))
    part = state[steps], jerk[steps], h[steps]
    place, stands = places_in_order(points, *part)
    at, falls = int(np.flatnonzero(of == r)[0]), run.switch[r] > 0.0
    edges = np.concatenate([[-np.inf], place[of >= 0], [np.inf]])  # of the legs from legs[0] - 1 on
    fast = np.zeros(len(steps), dtype=bool)
    for leg_on in range(r, legs[-1] + 1) if falls else range(legs[0] - 1, r):
        begin, end = edges[leg_on + 1 - legs[0] :][:2]
        fast |= _fast_steps(*part, begin, end, float(run.feed[leg_on]))
    fast &= (leg[steps] < r) == falls
    return steps[fast] + int(falls), stands[at], np.count_nonzero(place == place[at]) == 1


def switches_missed(
    run: TubeRun, leg: Array, h: FloatArray, state: FloatArray, jerk: FloatArray, part: slice = slice(None)
) -> Beside | None:
    """Where N steps run at the larger of two feeds while they are still to be nearer to the vertex between them, in the
    steps `part`, the nodes inside it that get a row for it: that of the vertex; those of the faster leg that are nearer, and
    those within the budget of the vertex on which the way to it is the wrong one; and the node before a step that comes
    nearer between nodes, which is to be further from the vertex by as much. Of a vertex that is passed together with others, where
    the place that counts is not its own, and of one beside others that is not missed so: the nodes of the steps that are too fast
    between the places of a slow block. None where there are none.

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
        legs = (np.arange(edges[k], node), np.arange(node, edges[k + 2]))
        wrong, at, alone = np.zeros(0, dtype=int), run.vertex[r], True
        if run.crowded[r] and not run.word.shape[1]:
            wrong, at, alone = _too_fast(run, r, leg, h, state, jerk)
        if alone and _passed_late(run, r, legs, h, state, jerk, (begin, end), rows):
            continue
        if len(wrong):
            wrong = np.append(wrong, node)
            wrong = wrong[(wrong > begin) & (wrong < end)]
            rows.leg[wrong], rows.at[wrong] = r, at
    rows.leg[: begin + 1] = -1
    return Beside(*(column[part] for column in rows)) if (rows.leg[part] >= 0).any() else None


def _passed_late(
    run: TubeRun,
    r: int,
    legs: tuple[Array, Array],
    h: FloatArray,
    state: FloatArray,
    jerk: FloatArray,
    part: tuple[int, int],
    rows: Beside,
) -> bool:
    """Whether steps of the faster one of the `legs` before and behind the vertex where leg r begins come nearer to it than
    those of the slower one, in the `part`: then `rows` are set, as `switches_missed` says."""
    (before, behind), (begin, end) = legs, part
    node, vertex, way = int(behind[0]), run.vertex[r], -run.switch[r]
    # steps outwards, the nodes where they begin: backwards on the leg before the vertex
    sides = (behind, 0), (before[::-1], 1)
    (fast, more), (slow, less) = sides if way > 0.0 else sides[::-1]
    inner = fast + more
    nearest, at, low = _least(vertex, state[inner], jerk[fast], h[fast], way)
    other, _, _ = _least(vertex, state[slow + less], jerk[slow], h[slow], -way)
    other -= AWAY * (run.vertex_budget[r] + np.abs(vertex).max())
    if nearest >= other or not begin <= fast[at] < end:
        return False
    until = slice(0, at + 1)
    if _slow(run, r, state[inner[until]], state[fast[until] + 1 - more], way * h[fast[until]]):
        return False
    off, v = state[inner, 0] - vertex, way * state[inner, 1]
    far, away, speed = np.linalg.norm(off, axis=1), (off * v).sum(axis=1), np.linalg.norm(v[at])
    wrong = inner[(far < other) | ((away < 0.0) & (far <= run.vertex_budget[r]))]
    rows.leg[wrong[wrong < end]], rows.at[wrong[wrong < end]] = r, vertex
    if low < 0.0 <= away[at] and speed > 0.0 and inner[at] < end:
        further = FURTHER * (away[at] - low / h[fast[at]]) / speed
        rows.leg[inner[at]], rows.at[inner[at]] = r, vertex + further * v[at] / speed
    if node < end and rows.leg[node] < 0:
        rows.leg[node], rows.at[node] = r, vertex
    return True


def _slow(run: TubeRun, r: int, begin: FloatArray, end: FloatArray, h: FloatArray) -> bool:
    """Whether steps from begin (n, 3, A) to end (n, 3, A), h (n,) below 0 where that is backwards, keep the smaller feed of
    the two where leg r begins: the Bezier ordinates of their velocity do."""
    if run.word.shape[1]:
        return False
    middle = begin[:, 1] + h[:, None] * begin[:, 2] / 2.0
    speeds = np.linalg.norm(np.concatenate([begin[:, 1], middle, end[:, 1]]), axis=1)
    return bool(speeds.max() <= run.feed[r - 1 : r + 1].min() * (1.0 + SAME))
