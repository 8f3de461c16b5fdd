"""Limits beside those of the axes, sample by sample: each on the delivered columns, and on the positions.

**Power** of each drive over the mass that it moves, |v a| <= P. Over the mean speeds u1, u2 of two periods the axis changes
its speed by |u2 - u1| = (h1 + h2)/2 times a mean of |a|, and |a| <= P/|v|. With |a| <= A no speed meanwhile is below s =
min(|u1|, |u2|) - A max(h1, h2), so that P >= s |u2 - u1| 2/(h1 + h2).

**Tangential** acceleration |a.t| <= A_t and jerk |j.t + |a - (a.t) t|^2/|v|| <= J_t, t = v/|v| in x, y, z. With the mean speed
u = L/h of every period, twice the change from one to the next over the time of both is a mean of the acceleration, and three
times the change of two of those over the time of all three is one of the jerk. A length L is at least its chord c. With a
normal acceleration of at most N and a speed of at least v = c/h - |a| h the direction turns by no more than N h/(2 v) from
that of the middle, so that L - c <= N^2 h^3/(24 v), which is taken off.

**The user's** limits come with the machine (`Machine.own`); of each the judge asks its bounds on velocity, acceleration
and jerk at places, and its value q there, and nothing of what was planned with. Where q is the length of the path

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
from planner.verifier.excess import NAMES
from planner.verifier.limits import ACCELERATION, FEED_AT_REST, GROUPS, JERK, ROWS_ALONE, TANGENTIAL
from planner.verifier.worst import (
    BACK,
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


def look_at_power(block: SampleBlock, limits: Limits, worst: Worst) -> None:
    """Take in what a block shows of the power of the axes, where it is limited."""
    if not np.isfinite(limits.power).any():
        return
    first = GROUPS * len(limits.axes) + ROWS_ALONE
    if limits.judged[:2].all():
        power = np.abs(block.velocity * block.acceleration) * limits.power_unit
        worst.take(first, power, limits.power, COLUMN, block, span=NAMES.index("power"))
    worst.take(first, _certain_power(block, limits) * limits.power_unit, limits.power, DIFFERENCE, block)


def _certain_power(block: SampleBlock, limits: Limits) -> FloatArray:
    """(n, A) power that the positions show [mm2/s3]."""
    found = np.zeros(block.position.shape)
    if len(block.t) < 3:
        return found
    h = np.diff(block.t)[:, None]
    error = position_error(block, limits)
    off = (error[1:] + error[:-1]) / h
    mean = np.diff(block.position, axis=0) / h
    slow = np.minimum(np.abs(mean[1:]) - off[1:], np.abs(mean[:-1]) - off[:-1])
    slow = np.maximum(slow - limits.per_axis[1] * np.maximum(h[1:], h[:-1]), 0.0)
    change = np.maximum(np.abs(np.diff(mean, axis=0)) - off[1:] - off[:-1], 0.0)
    found[2:] = slow * change * 2.0 / (h[1:] + h[:-1])
    return found


def look_at_tangential(block: SampleBlock, limits: Limits, worst: Worst) -> None:
    """Take in what a block of samples shows of the tangential acceleration and jerk, if one is limited."""
    if not np.isfinite(limits.tangential).any():
        return
    row, (largest, fastest) = GROUPS * len(limits.axes) + TANGENTIAL, limits.tangential
    if limits.judged[:2].all():
        v, a, j = (one[:, limits.linear] for one in (block.velocity, block.acceleration, block.jerk))
        speed = np.linalg.norm(v, axis=1)
        t = v / np.maximum(speed, FEED_AT_REST)[:, None]
        along = np.einsum("na,na->n", a, t)
        worst.take(row, np.abs(along)[:, None], largest, COLUMN, block, span=ACCELERATION)
        if limits.judged[2]:
            turning = np.square(a - along[:, None] * t).sum(axis=1) / np.maximum(speed, FEED_AT_REST)
            change = np.where(speed > FEED_AT_REST, np.einsum("na,na->n", j, t) + turning, 0.0)
            worst.take(row + 1, np.abs(change)[:, None], fastest, COLUMN, block, span=JERK)
    for order, seen in enumerate(_gained(block, limits)):
        worst.take(row + order, seen[:, None], limits.tangential[order], DIFFERENCE, block)


def _gained(block: SampleBlock, limits: Limits) -> FloatArray:
    """(2, n) means of the tangential acceleration over two periods [mm/s2] and of the tangential jerk over
    three [mm/s3], as far as they are certain."""
    t, linear = block.t, limits.linear
    found = np.zeros((2, len(t)))
    if len(t) < 2:
        return found
    h = np.diff(t)
    chord = np.linalg.norm(np.diff(block.position[:, linear], axis=0), axis=1)
    off = np.linalg.norm(position_error(block, limits)[:, linear], axis=1)
    error = off[1:] + off[:-1]
    most = float(np.linalg.norm(limits.per_axis[1, linear]))
    slowest = (chord - error) / h - most * h
    bow = np.full(len(h), np.inf)
    np.divide(min(limits.normal, most) ** 2 * h**3, 24.0 * slowest, out=bow, where=slowest > 0.0)
    mean, unsure = chord / h, (error + bow) / h
    for order in range(2, min(len(t), BACK + 1)):
        over = order / (t[order:] - t[:-order])
        mean, unsure = over * np.diff(mean), over * (unsure[1:] + unsure[:-1])
        found[order - 2, order:] = np.maximum(np.abs(mean) - unsure, 0.0)
    return found


def look_at_user_limits(block: SampleBlock, limits: Limits, worst: Worst) -> None:
    """Take in what a block of samples shows of the user's limits."""
    if not limits.user:
        return
    path, direction = along_path(block, delivered=bool(limits.judged[0]))
    error = position_error(block, limits)
    # places are shared by the limits: what one computes there others need not
    place = _place(limits.axes, block.position.T, direction)
    values = [limit.value(place) for limit in limits.user]
    motion = np.stack([block.position, block.velocity, block.acceleration, block.jerk])
    in_motion = _moving_place(limits.axes, motion, motion[1])
    along_axes = range(len(limits.axes) if any(q is not None for q in values) else 0)
    moved = [_moving_place(limits.axes, _along_axis(block, k), direction) for k in along_axes]
    for row, (limit, q) in enumerate(zip(limits.user, values, strict=True)):
        row = (GROUPS + 1) * len(limits.axes) + ROWS_ALONE + 3 * row
        bounds = np.stack([np.broadcast_to(b, len(block.t)) for b in limit.bounds(place)], axis=1)
        judged = limits.judged if q is None else [limits.judged.all()] * 3
        rates = path if q is None else _rates(limit, in_motion, len(block.t)) if judged[0] else None
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
            off = ROUNDING_ULPS * 2.0**-52 * np.abs(q)
            for k, there in enumerate(moved):  # dq/dx times the error of x
                found = limit.value(there)
                if isinstance(found, Series):
                    off = off + np.abs(found.derivatives[1]) * error[:, k]
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


def _moving_place(axes: tuple[str, ...], motion: FloatArray, direction: FloatArray) -> SimpleNamespace:
    """The places of a motion (4, n, A), with its derivatives."""
    return _place(axes, [Series(motion[:, :, k]) for k in range(len(axes))], direction)


def _along_axis(block: SampleBlock, axis: int) -> FloatArray:
    """(4, n, A) a motion along one of the axes, at its pace 1, through the samples."""
    motion = np.zeros((4, *block.position.shape))
    motion[0], motion[1, :, axis] = block.position, 1.0
    return motion


def _rates(limit: Any, in_motion: SimpleNamespace, count: int) -> FloatArray:
    """(3, n) derivatives of q by the time."""
    found = limit.value(in_motion)
    rates: FloatArray = found.derivatives[1:] if isinstance(found, Series) else np.zeros((3, count))
    return rates


def _largest(bound: FloatArray, back: int) -> FloatArray:
    """(n,) the largest bound of each sample and the `back` before it."""
    found = bound.copy()
    for k in range(1, min(back, len(bound) - 1) + 1):
        found[k:] = np.maximum(found[k:], bound[:-k])
    return found
