"""The user's limits, sample by sample: the law of each, held against the delivered motion.

The limits come with the machine (`Machine.own`); of each the judge asks its bounds on velocity, acceleration
and jerk at places, and its value q there, and nothing of what was planned with. Where q is the length of the
path, with t = v/|v|

    velocity |v|,     acceleration a.t,     jerk j.t + |a - (a.t) t|^2/|v|

of the delivered columns; and the distance of two samples over the time between them, which no motion within
the bound exceeds. Elsewhere twice, as for the axes (limits.py): the derivatives of q by the time from the
columns (base/series.py), and the divided differences of q at the delivered positions, which are means of its
derivatives, against the largest bound of the samples that they are taken from. Off those are taken the
rounding of q and of the positions, times dq/dx.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.series import Series
from planner.verifier.limits import FEED_AT_REST
from planner.verifier.worst import (
    COLUMN,
    DIFFERENCE,
    ROUNDING_ULPS,
    Limits,
    SampleBlock,
    Worst,
    differences,
    less_error,
    position_error,
)


def look_at_user_limits(block: SampleBlock, limits: Limits, worst: Worst, first: int) -> None:
    """Take in what a block of samples shows of the user's limits, whose rows begin at `first`."""
    if not limits.user:
        return
    path, direction = along_path(block, delivered=bool(limits.judged[0]))
    error = position_error(block, limits)
    for row, limit in enumerate(limits.user):
        row = first + 3 * row
        place = _place(limits.axes, block.position.T, direction)
        bounds = np.stack([np.broadcast_to(b, len(block.t)) for b in limit.bounds(place)], axis=1)
        q = limit.value(place)
        judged = limits.judged if q is None else [limits.judged.all()] * 3
        rates = path if q is None else _rates(limit, limits.axes, block) if judged[0] else None
        for order in range(3):
            if all(judged[: order + 1]) and rates is not None:
                value, bound = np.abs(rates[order]), bounds[:, order]
                worst.take(row + order, value[:, None], bound[:, None], COLUMN, block, span=order)
        if q is None:  # of the length the chord alone is known, which is shorter
            chord = np.linalg.norm(np.diff(block.position, axis=0, prepend=block.position[:1]), axis=1)
            certain = np.maximum(chord - 2.0 * np.linalg.norm(error, axis=1), 0.0)
            seen = [(certain / np.diff(block.t, prepend=-np.inf))[:, None]]
        else:
            q = np.broadcast_to(np.asarray(q, dtype=np.float64), len(block.t))
            off = _value_error(limit, limits.axes, block, direction, error, q)
            seen = list(map(less_error, differences(block.t, q[:, None], off[:, None], limit.turn)))
        for order, value in enumerate(seen):
            bound = _largest(bounds[:, order], order + 1)
            worst.take(row + order, value, bound[:, None], DIFFERENCE, block)


def _place(axes: tuple[str, ...], columns: Any, direction: FloatArray) -> SimpleNamespace:
    return SimpleNamespace(axes=axes, direction=direction, **dict(zip(axes, columns, strict=True)))


def along_path(block: SampleBlock, *, delivered: bool) -> tuple[FloatArray, FloatArray]:
    """(3, n) speed, acceleration and jerk along the path, nothing at rest; and the direction (n, A), by the
    chord to the sample before if no velocity was `delivered`."""
    v, a, j = block.velocity, block.acceleration, block.jerk
    if not delivered:
        steps = np.diff(block.position, axis=0, prepend=block.position[:1])
        v = steps / np.diff(block.t, prepend=-np.inf)[:, None]
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
        lines = np.zeros((len(axes), 4, len(q)))
        lines[:, 0], lines[moved, 1] = block.position.T, 1.0
        found = limit.value(_place(axes, [Series(line) for line in lines], direction))
        if isinstance(found, Series):
            off = off + np.abs(found.derivatives[1]) * error[:, moved]
    return off


def _largest(bound: FloatArray, back: int) -> FloatArray:
    """(n,) the largest bound of each sample and the `back` before it."""
    found = bound.copy()
    for k in range(1, min(back, len(bound) - 1) + 1):
        found[k:] = np.maximum(found[k:], bound[:-k])
    return found
