"""The worst of some quantities over a motion, and divided differences of positions, by which they are seen.

The n-th divided difference is a mean of the n-th derivative (Hermite-Genocchi), so n! times it can exceed a
limit only if the motion does, whatever the spacing of the samples:

    d1 = dx / dt,    d2 = 2 (d1' - d1) / (t2 - t0),    d3 = 3 (d2' - d2) / (t3 - t0)

No slack is needed but for rounding. A position carries an error of `ROUNDING_ULPS` units in the last place of
what it is computed from: the coordinate, the path length run so far and (limit times) the time. To it come
the digits that a file was written with: those of the position, and those of the time at the speed that the
motion can have there. The error is carried through the same recursion and taken off: at 1 m of coordinates,
100 m of path and 1 ms it is worth 2e-10 mm, 1e-7 mm/s, 4e-4 mm/s2, 2 mm/s3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Spans, above
from planner.verifier.given import DERIVATIVES
from planner.verifier.kernel import kernel

ROUNDING_ULPS = 4.0  # of the position, in units of 2^-52 of the numbers it is computed from
COLUMN, DIFFERENCE = 0, 1  # how a value was seen
BACK = 3  # periods that a third difference reaches back


class Worst:
    """The worst so far of R quantities, and where they are exceeded.

    names : of each quantity name and unit; no name for what is no limit of its own
    row   : (R, 4) ratio, value, limit, `COLUMN` or `DIFFERENCE`
    time  : (R,) [s]; at: (R, A) [mm]; piece: (R,)
    least : (R,) the least limit; inf where nothing limited it
    over  : spans in which the columns exceed limits
    """

    def __init__(self, names: Sequence[tuple[str, str]], axes: int):
        self.names, self.over, count = tuple(names), Spans(), len(names)
        self.row, self.time, self.at = np.zeros((count, 4)), np.zeros(count), np.zeros((count, axes))
        self.piece, self.least = np.zeros(count, dtype=np.int64), np.full(count, np.inf)

    def take(
        self, first: int, value: FloatArray, limit: Any, how: int, block: SampleBlock, span: int = -1
    ) -> None:
        """Take in samples of the quantities `first`, `first` + 1, ... of a block.

        value : (n, K); limit: what is allowed, of a shape that fits it
        span  : index in `NAMES` of the quantity, where spans above the limit are noted
        """
        ratio = (value / limit)[block.skip :]
        if not len(ratio):
            return
        least = np.asarray(limit)[block.skip :].min(axis=0) if np.ndim(limit) == 2 else limit
        self.bound(first, np.broadcast_to(least, value.shape[1:]))
        limit, most = np.broadcast_to(limit, value.shape), 0.0
        for k, n in enumerate(ratio.argmax(axis=0).tolist()):
            most = max(most, ratio[n, k])
            if ratio[n, k] > self.row[first + k, 0]:
                at = block.skip + n
                seen = float(ratio[n, k]), float(value[at, k]), float(limit[at, k]), how
                self.keep(first + k, seen, float(block.t[at]), block.position[at], int(block.piece[at]))
        if span >= 0 and most > 1.0:
            self.exceeded(span, value / limit, block)

    def exceeded(self, span: int, ratio: FloatArray, block: SampleBlock) -> None:
        """Note where a `ratio` (n, K) of a quantity of `NAMES` is above 1 in a block."""
        over = above(ratio[block.skip :].max(axis=1))
        if over.any():
            self.over.add(span, block.t[block.skip :], over)

    def bound(self, first: int, limit: FloatArray | float) -> None:
        """The quantities from `first` on are limited: to `limit` (K,), or one to a number."""
        rows = slice(first, first + np.size(limit))
        self.least[rows] = np.minimum(self.least[rows], limit)

    def keep(self, row: int, seen: tuple[float, ...], time: float, at: FloatArray, piece: int) -> None:
        """Ratio, value, limit and how it was `seen` are now the worst of a quantity, there: at (A,) [mm]."""
        self.row[row], self.time[row], self.at[row], self.piece[row] = seen, time, at, piece


def position_error(block: SampleBlock, limits: Limits) -> FloatArray:
    """(n, A) largest error of the positions (module text) [mm]."""
    t, position = block.t, block.position
    far = block.travelled_to()[:, None]
    ulp = ROUNDING_ULPS * 2.0**-52
    error: FloatArray = ulp * (np.abs(position) + far + limits.per_axis[0] * t[:, None]) + limits.rounding
    if limits.time_rounding > 0.0 and len(t) > 1:
        lasting = np.diff(t)[:, None]
        speed = np.abs(np.diff(position, axis=0)) / lasting + limits.per_axis[1] * lasting
        error[1:] += limits.time_rounding * speed
        error[0] += limits.time_rounding * speed[0]
    return error


def differences(
    t: FloatArray, values: FloatArray, error: FloatArray, turn: float | None = None
) -> list[tuple[FloatArray, FloatArray]]:
    """n! times the n-th divided differences, n = 1, 2, 3, and their error, at the last of its samples.

    values : (n, K) at the times t (n,) [s]; error: (n, K) of them
    turn   : what values may jump by because they start again; None if they do not
    """
    found, off = values, error
    every = [(np.zeros_like(values), np.zeros_like(values)) for _ in range(3)]
    for order in range(1, min(len(values), 4)):
        over = (order / (t[order:] - t[:-order]))[:, None]
        step = np.diff(found, axis=0)
        if order == 1 and turn is not None:
            step = step - turn * np.round(step / turn)
        found, off = over * step, over * (off[1:] + off[:-1])
        every[order - 1][0][order:], every[order - 1][1][order:] = found, off
    return every


def less_error(difference: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(n, K) the size of a difference, less its error, both (n, K)."""
    return np.maximum(np.abs(difference[0]) - difference[1], 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Limits:
    """The limits of the motion: (3, A) velocity, acceleration, jerk; and the rest."""

    axes: tuple[str, ...]
    per_axis: FloatArray
    linear: Array  # (A,) True on x, y and z, of which the normal acceleration is
    judged: Array  # (3,) True for the columns velocity, acceleration, jerk that were delivered
    rounding: FloatArray  # (A,) largest error of a position by its digits [mm]
    time_rounding: float  # the same of a time [s]
    normal: float  # acceleration [mm/s2], or inf
    tangential: FloatArray  # (2,) acceleration [mm/s2] and jerk [mm/s3], or inf
    power: FloatArray  # (A,) of the drives [W/kg], [W/(kg m2)], or inf
    power_unit: FloatArray  # (A,) of them in 1 mm2/s3
    acceleration_at_stop: FloatArray  # (A,) inf where acceleration is not limited [mm/s2]
    jerk_limited: bool
    user: tuple[Any, ...] = ()  # the user's limits (other_limits.py)


@dataclass(frozen=True, eq=False, kw_only=True)
class SampleBlock:
    """Samples n of a motion, those before `skip` for the differences only."""

    t: FloatArray  # (n,) [s]
    state: FloatArray  # (n, 4, A) position, velocity, acceleration, jerk, zeros where they were not delivered
    piece: Array  # (n,) the piece of the path that each is on
    skip: int = 0
    travelled: float = 0.0  # path length run before [mm]

    position = property(lambda self: self.state[:, 0])
    velocity = property(lambda self: self.state[:, 1])
    acceleration = property(lambda self: self.state[:, 2])
    jerk = property(lambda self: self.state[:, 3])

    def travelled_to(self) -> FloatArray:
        """(n,) path length run at each sample [mm]."""
        step = np.linalg.norm(np.diff(self.position, axis=0, prepend=self.position[:1]), axis=1)
        step[: max(self.skip, 1)] = 0.0
        return self.travelled + np.cumsum(step)


def state_of(
    chunk: Trajectory, part: slice = slice(None), before: tuple[FloatArray, FloatArray] | None = None
) -> tuple[FloatArray, FloatArray]:
    """t (n,) and state (n, 4, A), as in `SampleBlock`, of a part of a chunk of samples, behind those `before`."""
    new, axes = chunk.t[part], chunk.position.shape[1]
    t, state = before or (new[:0], np.empty((0, 1 + len(DERIVATIVES), axes)))
    whole = np.empty((len(t) + len(new), *state.shape[1:]))
    whole[: len(t)] = state
    columns = tuple(getattr(chunk, name)[part] for name in ("position", *DERIVATIVES))
    _put_together(columns, whole[len(t) :])
    return np.concatenate([t, new]), whole


@kernel()
def _put_together(columns, state):
    """Four columns (n, A) into `state` (n, 4, A): rows of a few numbers take numpy four times as long."""
    x, v, a, j = columns
    for k in range(len(x)):
        for i in range(x.shape[1]):
            state[k, 0, i], state[k, 1, i] = x[k, i], v[k, i]
            state[k, 2, i], state[k, 3, i] = a[k, i], j[k, i]
