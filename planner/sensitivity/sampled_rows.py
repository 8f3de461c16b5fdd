"""The rows of the linear programme over samples of lines (sampled_lines.py)."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.sensitivity.linear_program import Programme
from planner.sensitivity.straight_time import TINY
from planner.sensitivity.waypoints import Way

FACTORIAL = (1.0, 1.0, 2.0, 6.0)
STRAIGHT = 1e-6  # turns that are none [rad]
NONE, RESTS = -2, -1  # instead of a variable: no sample, one that is at its waypoint


class Lines(NamedTuple):
    """L lines of several chains, W = L + chains waypoints, of which line l joins window[l] and the next."""

    window: Array  # (L,)
    way: Way  # of these waypoints and lines only
    front: FloatArray  # (L, S) times of samples behind the begin [s]
    back: FloatArray  # (L, S) before the end
    begins: Array  # (W,) whether a waypoint is the first of its chain
    ends: Array  # (W,) whether it is the last
    speeds: tuple[tuple[FloatArray, FloatArray], ...]  # directions (L, A), and the largest speed (L,) in them


class Layout(NamedTuple):
    """The first variable of what belongs to lines and waypoints."""

    waypoint: Array  # (W,)
    front: Array  # (L, S)
    back: Array  # (L, S)
    gap: Array  # (L,)
    part: Array  # (n,) the chain of each variable


class Rows:
    """Rows of a programme: entries and bounds."""

    def __init__(self) -> None:
        self.entries: list[tuple[Array, Array, FloatArray]] = []
        self.bounds: list[tuple[FloatArray, FloatArray]] = []
        self.count = 0

    def add(
        self, column: Array, value: FloatArray, high: FloatArray | float, two_sided: bool = False
    ) -> None:
        """Rows of e entries each, `column` (.., e), negative for what is 0, and `value` (.., e), at most
        `high` (..,) or, two-sided, that in size; those without a variable are left out."""
        column, value = np.broadcast_arrays(column, value)
        width, high = column.shape[-1], np.broadcast_to(high, column.shape[:-1]).ravel()
        column, value = column.reshape(-1, width), value.reshape(-1, width)
        some = (column >= 0).any(axis=1)
        column, value, high = column[some], value[some], high[some]
        entry = column >= 0
        row = np.broadcast_to(self.count + np.arange(len(column))[:, None], column.shape)
        self.entries.append((row[entry], column[entry], value[entry]))
        self.bounds.append((-high if two_sided else np.full(len(high), -np.inf), high))
        self.count += len(column)

    def programme(self, cost: FloatArray, start: FloatArray, reach: FloatArray) -> Programme:
        """All rows, by their first variable, with `cost`, `start` and `reach` (n,)."""
        row, column, value = (np.concatenate(of) for of in zip(*self.entries, strict=True))
        least = np.minimum.reduceat(column, np.searchsorted(row, np.arange(self.count)))
        order = np.lexsort((column, row, least[row]))
        row, column, value = row[order], column[order], value[order]
        first = np.append(np.flatnonzero(np.diff(row, prepend=-1)), len(row))
        low, high = (np.concatenate(of)[row[first[:-1]]] for of in zip(*self.bounds, strict=True))
        width = int((column[first[1:] - 1] - column[first[:-1]]).max()) + 1
        return Programme(cost, first, column, value, low, high, start, reach, width)


def _columns(first: Array, axes: int) -> Array:
    """(.., axes) variables, negative where there are none."""
    return np.where(first[..., None] >= 0, first[..., None] + np.arange(axes), first[..., None])


def differences(time: FloatArray, order: int) -> FloatArray:
    """(W, M - order, order + 1) what values at `time` (W, M) are multiplied by, for a mean of their derivative."""
    knots = np.lib.stride_tricks.sliding_window_view(time, order + 1, axis=1)
    apart = knots[..., :, None] - knots[..., None, :]
    return FACTORIAL[order] / np.where(np.eye(order + 1, dtype=bool), 1.0, apart).prod(axis=-1)


def add_derivatives(rows: Rows, lines: Lines, at: Layout) -> None:
    """Limits of axes, and of the speed along lines, on samples around waypoints."""
    way, (_, axes), samples = lines.way, lines.way.point.shape, lines.front.shape[1]
    variable = np.full((len(lines.begins), 2 * samples + 1), NONE)
    time = np.zeros(variable.shape)
    rests = way.stop
    variable[rests & lines.begins, :samples] = variable[rests & lines.ends, samples + 1 :] = RESTS
    variable[:, samples] = np.where(rests, RESTS, at.waypoint)
    window, behind = lines.window, lines.window + 1
    time[window, :samples], time[behind, samples + 1 :] = -lines.front[:, ::-1], lines.back
    time[behind, :samples], time[window, samples + 1 :] = -lines.back[:, ::-1], lines.front
    variable[behind, :samples], variable[window, samples + 1 :] = at.back[:, ::-1], at.front
    for order in (1, 2, 3):
        factor = differences(time, order)
        nodes = np.lib.stride_tricks.sliding_window_view(variable, order + 1, axis=1)
        there = (nodes > NONE).all(axis=-1)
        of = _columns(nodes[there], axes)
        for k in range(axes):
            if order > 1 or way.limit[0, k] < way.feed.max():
                rows.add(of[..., k], factor[there] / way.limit[order - 1, k], 1.0, two_sided=True)
    for nodes, times in (
        (variable[window, samples:], time[window, samples:]),
        (variable[behind, : samples + 1], time[behind, : samples + 1]),
    ):
        of = _columns(np.stack([nodes[:, :-1], nodes[:, 1:]], axis=-1), axes).reshape(len(nodes), samples, -1)
        for along, speed in lines.speeds:
            by = np.concatenate([-along, along], axis=1) / speed[:, None]
            rows.add(of, by[:, None] / np.diff(times, axis=1)[..., None], 1.0)


def add_places(rows: Rows, lines: Lines, at: Layout, outer: FloatArray) -> None:
    """The tolerances of lines and waypoints; `outer` (2, P, A) y of the legs before chains and behind them."""
    way, (_, axes) = lines.way, lines.way.point.shape
    within = np.maximum(way.tolerance[lines.window], way.tolerance[lines.window + 1])[:, None, None]
    for first, beside, sign in ((at.front, 1, -1.0), (at.back, -1, 1.0)):
        of = _columns(first, axes)
        for normal in _normals(way.tangent, np.roll(way.tangent, beside, axis=0)):
            rows.add(of, normal[:, None] / within, 1.0, two_sided=True)
        rows.add(of, sign * way.tangent[:, None] / within, 1.0)
    before, after = (np.zeros(way.point.shape) for _ in range(2))
    before[lines.window + 1] = after[lines.window] = way.tangent
    unit = outer / np.maximum(np.linalg.norm(outer, axis=2), TINY)[..., None]
    before[lines.begins], after[lines.ends] = unit
    turn = after - before
    size = np.linalg.norm(turn, axis=1)
    inner = ~way.stop
    of = _columns(at.waypoint, axes)
    for direction, some in (
        (turn / np.maximum(size, TINY)[:, None], inner & (size > STRAIGHT)),
        *((np.broadcast_to(unit, turn.shape), inner) for unit in np.eye(axes)),
    ):
        rows.add(of[some], direction[some] / way.tolerance[some, None], 1.0, two_sided=True)


def _normals(along: FloatArray, beside: FloatArray) -> list[FloatArray]:
    """(L, A) unit vectors across lines and each other, the first in the plane of the line beside it."""
    found: list[FloatArray] = []
    axes = along.shape[1]
    units = [np.broadcast_to(unit, along.shape) for unit in np.eye(axes)]
    for n in range(axes - 1):
        left = [beside, *units] if n == 0 else units
        for one in (along, *found):
            left = [vector - (vector * one).sum(axis=1)[:, None] * one for vector in left]
        size = np.array([np.linalg.norm(vector, axis=1) for vector in left])
        best = size.argmax(axis=0)
        if n == 0:
            best[size[0] > STRAIGHT] = 0
        rows = np.arange(len(along))
        found.append(np.array(left)[best, rows] / size[best, rows][:, None])
    return found


def add_gaps(rows: Rows, lines: Lines, at: Layout) -> None:
    """What lines are between their last samples, in the time tau."""
    way, (_, axes) = lines.way, lines.way.point.shape
    step = np.diff(way.point, axis=0)[lines.window]
    gap, front, back = at.gap[:, None], at.front, at.back
    rows.add(gap, -np.ones(gap.shape), 0.0)
    of = np.concatenate([_columns(front[:, -1], axes), _columns(back[:, -1], axes), gap], axis=1)
    for along, speed in lines.speeds:
        by = np.concatenate([-along, along, -speed[:, None]], axis=1)
        rows.add(of, by / way.length[:, None], -(along * step).sum(axis=1) / way.length)
    for k in range(axes):
        if way.limit[0, k] >= way.feed.max():
            continue
        for sign in (1.0, -1.0):
            by = np.array([-sign, sign, -way.limit[0, k]]) / way.length[:, None]
            rows.add(of[:, [k, axes + k, -1]], by, -sign * step[:, k] / way.length)
    for order in (1, 2):
        mine, other = lines.front[:, -order - 1 :], -lines.back[:, -order - 1 :]
        apart = mine[:, -1] - mine.mean(axis=1) + other.mean(axis=1) - other[:, -1]
        change = [-differences(mine, order)[:, 0], differences(other, order)[:, 0]]
        for k in range(axes):
            of = np.concatenate([front[:, -order - 1 :] + k, back[:, -order - 1 :] + k, gap], axis=1)
            unit = apart[:, None] * way.limit[order, k]
            for sign in (1.0, -1.0):
                unequal = [sign * change[0], sign * change[1], np.full(gap.shape, -way.limit[order, k])]
                rows.add(of, np.concatenate(unequal, axis=1) / unit, 1.0)
