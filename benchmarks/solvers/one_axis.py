"""The fastest motion along a straight line from rest to rest, with a speed cap on each of its parts, limits of acceleration and
jerk: a convex problem in the arc length, solved by Clarabel.

With b = v^2 over the arc length s, b'/2 is the acceleration and b'' sqrt(b)/2 the jerk. In c >= 1/sqrt(b), the time a length takes,

    least  int c ds      over      b <= F^2,      |b'| <= 2 A,      |b''| <= 2 J c

is convex: a second-order cone program once d <= sqrt(b) stands between (d^2 <= b, c d >= 1). It leaves out c = 1/sqrt(b) only, so its
least time is a lower bound; where the answer has c = 1/sqrt(b) (`SLACK`), b is a motion and the bound is its time.

The first and the last moments are known, and left out: from rest the jerk is at its limit for as long as speed and way allow another
such part to end the acceleration (`HEAD` of that is taken).

b'' is constant on each cell and jerk is bounded by the mean of c at its ends, which is right to second order: with cells
of half the size the time's error is a quarter, so two grids give a time that is right to a higher order. Grids are refined
until two such times agree to `AGREE`. On some grids Clarabel ends with a c that costs no time and is no motion's; then all
is solved once more on others.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from planner.base.arrays import Array, FloatArray

HEAD = 0.5  # of the first moments, the share that is taken as known [-]
COARSEST = (
    0.1,
    0.09,
    0.08,
)  # cells, of the distance from the nearest end or change of the cap, one after the other [-]
HALVED = 5  # times
AGREE = 1e-5  # of two times, each extrapolated from two grids [-]
GAP = 1e-6  # of Clarabel's primal and dual values, at most [-]
SLACK = 1e-2  # c sqrt(b) - 1 on any cell, at most [-], and
SLACK_OF_TIME = 1e-6  # what it makes of the time, at most [-]
TINY = 1e-30  # keeps quotients finite


class Fastest(NamedTuple):
    """The least time [s], and how much of it the last refinement changed [-]."""

    time: float
    error: float


def fastest(length: FloatArray, cap: FloatArray, acceleration: float, jerk: float) -> Fastest:
    """Of a way in parts (K,) [mm] with caps of the speed (K,) [mm/s], limits in mm/s2 and mm/s3.

    Raises RuntimeError where a problem is not solved, its answer is no motion, or the grids do not agree.
    """
    said = ""
    for cell in COARSEST:
        try:
            return _refined(length, cap, acceleration, jerk, cell)
        except RuntimeError as error:
            said = str(error)
    raise RuntimeError(said)


def _refined(length: FloatArray, cap: FloatArray, acceleration: float, jerk: float, cell: float) -> Fastest:
    times = [_on_grid(length, cap, acceleration, jerk, cell)]
    better: list[float] = []
    for k in range(1, HALVED + 1):
        times.append(_on_grid(length, cap, acceleration, jerk, cell / 2**k))
        better.append((4.0 * times[-1] - times[-2]) / 3.0)
        error = abs(better[-1] / better[-2] - 1.0) if k > 1 else np.inf
        if error < AGREE:
            return Fastest(better[-1], error)
    raise RuntimeError(f"grids do not agree: {better}")


def _grid(
    length: FloatArray, cap: FloatArray, jerk: float, head: float, cell: float
) -> tuple[FloatArray, Array]:
    """(n,) nodes [mm] and the part (n - 1,) of each cell: shorter near the ends and where the cap changes."""
    ends = np.append(0.0, np.cumsum(length))
    slower = np.minimum(cap[1:], cap[:-1])
    scale = 0.5 * slower * np.sqrt(slower / jerk)  # of a change of speed from the slower cap
    nodes, parts = [head], []
    for k in range(len(length)):
        begin, end = nodes[-1], ends[k + 1] - (head if k == len(length) - 1 else 0.0)
        course = [begin]
        while course[-1] < end:
            at, step = course[-1], 0.0
            for place in (at, min(at + cell * min(at, abs(ends[-1] - at)), end)):
                near = np.append(np.abs(place - ends[1:-1]) + scale, min(place, max(ends[-1] - place, head)))
                step = cell * near.min() if not step else min(step, cell * near.min())
            course.append(at + step)
        inner = begin + (np.array(course[1:]) - begin) * (end - begin) / (course[-1] - begin)
        nodes += inner.tolist()
        parts += [k] * len(inner)
    return np.array(nodes), np.array(parts)


def _on_grid(length: FloatArray, cap: FloatArray, acceleration: float, jerk: float, cell: float) -> float:
    """The least time with cells of one size [s]."""
    way = float(length.sum())
    t = HEAD * min(acceleration / jerk, (way / 2.0 / jerk) ** (1 / 3), np.sqrt(cap.min() / jerk))
    x, part = _grid(length, cap, jerk, jerk * t**3 / 6.0, cell)
    unit = _speeds(x, length, cap, acceleration, jerk)
    h, n, high = np.diff(x), len(x), np.full(len(x), np.inf)
    np.minimum.at(high, np.arange(n - 1), cap[part])
    np.minimum.at(high, np.arange(1, n), cap[part])
    b, p, c, d = (k * n + np.arange(n) for k in range(4))  # b, b'/(2 A), c, d in units of `unit`
    w, cells = 4 * n + np.arange(n - 1), np.arange(n - 1)  # b'' in units of the jerk
    own, fast = unit**2, np.maximum(unit[1:], unit[:-1])
    rows, ramp = _Rows(), 2.0 * acceleration
    rows.add(
        cells,
        (b[1:], own[1:] / fast**2),
        (b[:-1], -own[:-1] / fast**2),
        *((q, -h * ramp / 2 / fast**2) for q in (p[1:], p[:-1])),
    )
    per = ramp * fast / (2.0 * jerk * h)
    rows.add(cells, (p[1:], per), (p[:-1], -per), (w, -np.ones(n - 1)))
    ends = np.array([0, n - 1])
    rows.add(ends[:2] // (n - 1), (b[ends], np.ones(2)), right=(jerk * t**2 / 2.0) ** 2 / own[ends])
    rows.add(
        ends[:2] // (n - 1), (p[ends], np.ones(2)), right=np.array([1.0, -1.0]) * jerk * t / acceleration
    )
    equal = rows.count
    rows.add(np.arange(n), (b, np.ones(n)), right=high**2 / own)
    for sign in (1.0, -1.0):
        rows.add(np.arange(n), (p, np.full(n, sign)), right=np.ones(n))
        rows.add(
            cells, (w, np.full(n - 1, sign)), (c[:-1], -fast / unit[:-1] / 2), (c[1:], -fast / unit[1:] / 2)
        )
    below, one, node = rows.count - equal, np.ones(n), 3 * np.arange(n)
    rows.cones(n, (node, b, -one), (node + 1, b, -one), (node + 2, d, -2 * one), right=(1.0, -1.0, 0.0))
    rows.cones(
        n, (node, c, -one), (node, d, -one), (node + 1, c, -one), (node + 1, d, one), right=(0.0, 0.0, 2.0)
    )
    cost = np.zeros(5 * n - 1)
    cost[c] = (np.append(h, 0.0) + np.append(0.0, h)) / 2.0 / unit
    found = _solved(cost, rows, equal, below, 2 * n)
    time, least = float(cost @ found), 1.0 / np.sqrt(np.maximum(found[b], TINY))
    if (found[c] / least).max() > 1.0 + SLACK or cost[c] @ (found[c] - least) > SLACK_OF_TIME * time:
        raise RuntimeError(f"the answer is no motion: c sqrt(b) is up to {(found[c] / least).max():.6g}")
    return time + 2.0 * t


def _speeds(
    x: FloatArray, length: FloatArray, cap: FloatArray, acceleration: float, jerk: float
) -> FloatArray:
    """(n,) about how fast the motion is at places [mm/s]: units of the problem."""
    ends = np.append(0.0, np.cumsum(length))
    from_end = np.minimum(x, ends[-1] - x)
    speed = np.minimum(
        jerk * (6.0 * from_end / jerk) ** (2 / 3) / 2.0, np.sqrt(2.0 * acceleration * from_end)
    )
    for begin, end, fastest_there in zip(ends[:-1], ends[1:], cap, strict=True):
        apart = np.maximum(np.maximum(begin - x, x - end), 0.0)
        speed = np.minimum(speed, np.sqrt(fastest_there**2 + 2.0 * acceleration * apart))
    return speed


class _Rows:
    """Rows of a sparse matrix and their right sides, as Clarabel wants them: b - A x in a cone."""

    def __init__(self) -> None:
        self.count = 0
        self.row: list[Array] = []
        self.column: list[Array] = []
        self.value: list[FloatArray] = []
        self.right: list[FloatArray] = []

    def add(self, row: Array, *terms: tuple[Array, FloatArray], right: FloatArray | None = None) -> None:
        """So many rows, each the sum of terms: columns and values, one for each."""
        for column, value in terms:
            self.row.append(self.count + row)
            self.column.append(column)
            self.value.append(value)
        self.right.append(np.zeros(len(row)) if right is None else right)
        self.count += len(row)

    def cones(self, number: int, *terms: tuple[Array, Array, FloatArray], right: tuple[float, ...]) -> None:
        """So many cones of three rows."""
        for row, column, value in terms:
            self.row.append(self.count + row)
            self.column.append(column)
            self.value.append(value)
        self.right.append(np.tile(right, number))
        self.count += 3 * number


def _solved(cost: FloatArray, rows: _Rows, equal: int, below: int, cones: int) -> FloatArray:
    import clarabel

    scale, size = float(cost.sum()), len(cost)
    places = np.concatenate(rows.row), np.concatenate(rows.column)
    matrix = sparse.csc_matrix((np.concatenate(rows.value), places), shape=(rows.count, size))
    kinds: list[Any] = [clarabel.ZeroConeT(equal), clarabel.NonnegativeConeT(below)]
    kinds += [clarabel.SecondOrderConeT(3)] * cones
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter = False, 300
    nothing = sparse.csc_matrix((size, size))
    right = np.concatenate(rows.right)
    answer = clarabel.DefaultSolver(nothing, cost / scale, matrix, right, kinds, settings).solve()
    known = answer.status in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)
    if not known or abs(answer.obj_val - answer.obj_val_dual) > GAP * abs(answer.obj_val):
        raise RuntimeError(f"Clarabel: {answer.status}, {answer.obj_val} and {answer.obj_val_dual}")
    return np.array(answer.x)
