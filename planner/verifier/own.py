"""Limits of one's own, sample by sample: the law of each, held against the delivered motion.

The limits come with the machine (`Machine.own`); of each the judge asks its bounds on velocity, acceleration and jerk at places, and
its value q there, and nothing of what was planned with. Where q is the length of the path, with t = v/|v|

    velocity |v|,     acceleration a.t,     jerk j.t + |a - (a.t) t|^2/|v|

of the delivered columns; and the distance of two samples over the time between them, which no motion within the bound exceeds.
Elsewhere twice, as for the axes (limits.py): the derivatives of q by the time from the columns (base/series.py), and the divided
differences of q at the delivered positions, which are means of its derivatives, against the largest bound of the samples that they
are taken from. Off those are taken the rounding of q and of the positions, times dq/dx.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.series import Series
from planner.verifier.excess import Spans, above
from planner.verifier.limits import COLUMN, DIFFERENCE, FEED_AT_REST, ROUNDING_ULPS
from planner.verifier.sample_block import Limits, SampleBlock

QUANTITIES = ("velocity", "acceleration", "jerk")
UNITS = ("/s", "/s2", "/s3")


class OwnSeen:
    """The worst of each quantity of the limits seen so far: rows of (ratio, value, limit, `COLUMN` or `DIFFERENCE`)."""

    def __init__(self, own: tuple[Any, ...], axes: tuple[str, ...]):
        self.own, self.axes = own, axes
        count = 3 * len(own)
        self.worst = np.zeros((count, 4))
        self.time, self.at = np.zeros(count), np.zeros((count, len(axes)))
        self.piece = np.zeros(count, dtype=np.int64)
        self.bounded = np.zeros(count, dtype=bool)  # True where a bound was finite anywhere
        self.least = np.full(count, np.inf)  # the least bound
        self.over = Spans()

    def take(self, block: SampleBlock, limits: Limits) -> None:
        """Look at a block of samples."""
        if not self.own:
            return
        path, direction = _along_path(block, limits.judged[0])
        error = _position_error(block, limits)
        for n, limit in enumerate(self.own):
            place = _place(self.axes, block.position.T, direction)
            bounds = np.stack([np.broadcast_to(b, len(block.t)) for b in limit.bounds(place)], axis=1)
            q = limit.value(place)
            self._bound(3 * n, bounds)
            if q is None:
                for order in range(3):
                    if limits.judged[: order + 1].all():
                        self._keep(3 * n + order, np.abs(path[order]), bounds[:, order], COLUMN, block)
                chord = np.linalg.norm(np.diff(block.position, axis=0), axis=1)
                mean = np.maximum(chord - 2.0 * np.linalg.norm(error[1:], axis=1), 0.0) / np.diff(block.t)
                self._keep(3 * n, np.append(0.0, mean), _largest(bounds[:, 0], 1), DIFFERENCE, block)
                continue
            if limits.judged.all():
                rates = _rates(limit, self.axes, block)
                for order in range(3):
                    self._keep(3 * n + order, np.abs(rates[order]), bounds[:, order], COLUMN, block)
            q = np.broadcast_to(np.asarray(q, dtype=np.float64), len(block.t))
            off = _value_error(limit, self.axes, block, direction, error, q)
            for order, value in enumerate(_differences(block.t, q, off, limit.turn)):
                self._keep(3 * n + order, value, _largest(bounds[:, order], order + 1), DIFFERENCE, block)

    def _bound(self, row: int, bounds: FloatArray) -> None:
        self.least[row : row + 3] = np.minimum(self.least[row : row + 3], bounds.min(axis=0))
        self.bounded[row : row + 3] |= np.isfinite(bounds).any(axis=0)

    def _keep(self, row: int, value: FloatArray, bound: FloatArray, how: int, block: SampleBlock) -> None:
        ratio = value / bound
        ratio[: block.skip] = 0.0
        k = int(ratio.argmax())
        if how == COLUMN and (over := above(ratio)).any():
            self.over.add(row % len(QUANTITIES), block.t, over)
        if ratio[k] > self.worst[row, 0]:
            self.worst[row] = ratio[k], value[k], bound[k], how
            self.time[row], self.at[row], self.piece[row] = block.t[k], block.position[k], block.piece[k]

    def name(self, row: int) -> tuple[str, str]:
        """Name and unit of a row."""
        limit = self.own[row // 3]
        return f"{QUANTITIES[row % 3]}.{limit.name}", limit.unit + UNITS[row % 3]


def _place(axes: tuple[str, ...], columns: Any, direction: FloatArray) -> SimpleNamespace:
    return SimpleNamespace(axes=axes, direction=direction, **dict(zip(axes, columns, strict=True)))


def _along_path(block: SampleBlock, delivered: bool) -> tuple[FloatArray, FloatArray]:
    """(3, n) speed, acceleration and jerk along the path, nothing at rest; and the direction (n, A), by the chord to the sample before
    if no velocity was delivered."""
    v, a, j = block.velocity, block.acceleration, block.jerk
    if not delivered:
        v = (
            np.diff(block.position, axis=0, prepend=block.position[:1])
            / np.append(np.inf, np.diff(block.t))[:, None]
        )
    speed = np.sqrt(np.einsum("nk,nk->n", v, v))
    moving = speed > FEED_AT_REST
    t = np.where(moving[:, None], v / np.where(moving, speed, 1.0)[:, None], 0.0)
    along = np.einsum("nk,nk->n", a, t)
    normal = a - along[:, None] * t
    turning = np.einsum("nk,nk->n", normal, normal) / np.where(moving, speed, np.inf)
    return np.stack([speed, along, np.einsum("nk,nk->n", j, t) + turning]) * moving, t


def _rates(limit: Any, axes: tuple[str, ...], block: SampleBlock) -> FloatArray:
    """(3, n) derivatives of q by the time."""
    motion = np.stack([block.position, block.velocity, block.acceleration, block.jerk])
    found = limit.value(_place(axes, [Series(motion[:, :, k]) for k in range(len(axes))], motion[1]))
    rates: FloatArray = found.derivatives[1:] if isinstance(found, Series) else np.zeros((3, len(block.t)))
    return rates


def _position_error(block: SampleBlock, limits: Limits) -> FloatArray:
    """(n, A) largest error of the positions, as in limits.py [mm]."""
    ulp = ROUNDING_ULPS * 2.0**-52
    far = block.travelled + np.append(0.0, np.linalg.norm(np.diff(block.position, axis=0), axis=1)).cumsum()
    error = (
        ulp * (np.abs(block.position) + far[:, None] + limits.per_axis[0] * block.t[:, None])
        + limits.rounding
    )
    if limits.time_rounding and len(block.t) > 1:
        speed = np.abs(np.diff(block.position, axis=0)) / np.diff(block.t)[:, None]
        error[1:] += limits.time_rounding * speed
        error[0] += limits.time_rounding * speed[0]
    return error


def _value_error(
    limit: Any,
    axes: tuple[str, ...],
    block: SampleBlock,
    direction: FloatArray,
    error: FloatArray,
    q: FloatArray,
) -> FloatArray:
    """(n,) largest error of q."""
    off = ROUNDING_ULPS * 2.0**-52 * np.abs(q)
    for moved in range(len(axes)):
        columns = []
        for k in range(len(axes)):
            line = np.zeros((4, len(q)))
            line[0], line[1] = block.position[:, k], float(k == moved)
            columns.append(Series(line))
        found = limit.value(_place(axes, columns, direction))
        if isinstance(found, Series):
            off = off + np.abs(found.derivatives[1]) * error[:, moved]
    return off


def _differences(t: FloatArray, q: FloatArray, off: FloatArray, turn: float | None) -> list[FloatArray]:
    """n! times the n-th divided differences of q for n = 1, 2, 3, less their error; each at the last of its samples, 0 before."""
    step = np.diff(q)
    if turn is not None:
        step = step - turn * np.round(step / turn)
    found, error = step / np.diff(t), (off[1:] + off[:-1]) / np.diff(t)
    values = []
    for order in (1, 2, 3):
        if order > 1:
            over = order / (t[order:] - t[:-order])
            found, error = over * np.diff(found), over * (error[1:] + error[:-1])
        value = np.zeros(len(t))
        value[order:] = np.maximum(np.abs(found) - error, 0.0)
        values.append(value)
        if len(found) < 2:
            values += [np.zeros(len(t))] * (3 - order)
            break
    return values


def _largest(bound: FloatArray, back: int) -> FloatArray:
    """(n,) the largest bound of each sample and the `back` before it."""
    found = bound.copy()
    for k in range(1, min(back, len(bound) - 1) + 1):
        found[k:] = np.maximum(found[k:], bound[:-k])
    return found
