"""Where the nodes and the inner control points of steps on lines belong to (rows.py)."""

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, smaller, where
from planner.joint.row_kinds import SETS, THIRD


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def rest_of(rest, of, part, k):
    """Of an axis, what the rest (2, A) of a step adds to its node, inner control points or end (0 to 3) of a set."""
    return of * (rest[0, k] + part * THIRD * (rest[1, k] - rest[0, k]))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _place_on_line(axes, group, i, of, x, u, part):
    """The place on the leg of step i that is nearest to its node, first or second inner control point (0 to 2), or its
    end, the node x (3), of a set."""
    h, sag = u[axes], group.sag[of]
    along = 0.0 * h
    for k in range(axes):
        a = x[2 * axes + k]
        c, v = x[k] + sag * a + rest_of(group.rest[i], of, part, k), x[axes + k] + sag * u[k]
        if part == 1:
            c = c + THIRD * h * v
        elif part == 2:
            c = c + h * THIRD * (2.0 * v + 0.5 * h * a)
        along += (c - group.base[i, k]) * group.drift[i, k]
    return smaller(larger(along * group.per_drift[i], 0.0), group.length[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_places(sizes, group, x, u, rows, nearest, top):
    """The places of the nodes and the inner control points of both sets that are on lines (`_put_places`)."""
    for m in range(SETS):
        _put_places(sizes, group, m, x, u, rows, nearest, top)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_places(sizes, group, of, x, u, rows, nearest, top):
    """The places of a set, in order along each leg: a motion may go
    back as far as one place is near enough to what it passes twice. They are halfway between the largest nearest place
    before and the smallest one behind, so that the farthest is moved by as little as can be; nearest (N, 3) and
    top (N,) are overwritten."""
    axes, N, column = len(sizes.axes), sizes.steps, 3 * of
    low, end = 0.0 * u[0, axes], 0.0 * u[0, axes]
    for i in range(N):
        h = u[i, axes]
        for m in range(3):
            nearest[i, m] = _place_on_line(axes, group, i, of, x[i], u[i], m)
        begins = group.begins[i] > 0.0
        nearest[i, 0] = where(begins, where(group.at_vertex[i] > 0.0, 0.0 * h, nearest[i, 0]), nearest[i, 0])
        low = where(begins, nearest[i, 0], low)
        last = group.last[i] > 0.0
        if anywhere(last):
            end = where(last, larger(_place_on_line(axes, group, i, of, x[i + 1], u[i], 3), low), end)
    behind = end
    for i in range(N - 1, -1, -1):
        ends = group.ends[i] > 0.0
        high = where(group.last[i] > 0.0, end, group.length[i])
        top[i] = where(ends, high, top[i + 1 if i + 1 < N else i])
        behind = where(ends, high, behind)
        for m in range(2, -1, -1):
            behind = smaller(behind, nearest[i, m])
            rows.moves[i, column + m] = behind
    before = low
    for i in range(N):
        begins, length = group.begins[i] > 0.0, group.length[i]
        low = where(begins, nearest[i, 0], low)
        before = where(begins, low, before)
        for m in range(3):
            before = larger(before, nearest[i, m])
            place = smaller(larger(0.5 * (before + rows.moves[i, column + m]), low), top[i])
            there = where(magnitude(place - nearest[i, m]) > 0.0, 0.0, 1.0 + 0.0 * place)
            there = where(place <= 0.0, 0.0, where(place >= length, 0.0, there))
            rows.moves[i, column + m] = there
            rows.place[i, column + m] = where(group.line[i] > 0.0, place, rows.place[i, column + m])
        rows.moves[i, column] *= 1.0 - group.at_vertex[i]
