"""The tangential acceleration |a.t| <= A_t, t = v/|v| of x, y and z, sample by sample.

Twice: on the delivered columns, and by the lengths run between three samples. The mean speeds of two periods,
L/h, differ by at most A_t (h1 + h2)/2. A length L is at least its chord c. With a normal acceleration of at
most N and a speed of at least v = c/h - |a| h the direction turns by no more than N h/(2 v) from that of the
middle, so that L - c <= N^2 h^3/(24 v), which is taken off.
"""

from __future__ import annotations

import math

import numpy as np

from planner.base.arrays import FloatArray
from planner.verifier.limits import ACCELERATION, FEED_AT_REST, GROUPS, TANGENTIAL
from planner.verifier.worst import COLUMN, DIFFERENCE, Limits, SampleBlock, Worst, position_error


def look_at_tangential(block: SampleBlock, limits: Limits, worst: Worst) -> None:
    """Take in what a block of samples shows of the tangential acceleration, if it is limited."""
    if not math.isfinite(limits.tangential):
        return
    row = GROUPS * len(limits.axes) + TANGENTIAL
    if limits.judged[:2].all():
        v, a = block.velocity[:, limits.linear], block.acceleration[:, limits.linear]
        speed = np.linalg.norm(v, axis=1)
        pushed = np.abs(np.einsum("na,na->n", v, a)) / np.maximum(speed, FEED_AT_REST)
        worst.take(row, pushed[:, None], limits.tangential, COLUMN, block, span=ACCELERATION)
    worst.take(row, _gained(block, limits)[:, None], limits.tangential, DIFFERENCE, block)


def _gained(block: SampleBlock, limits: Limits) -> FloatArray:
    """(n,) change of the mean speed from one period to the next, as far as it is certain, over the time
    [mm/s2]."""
    found = np.zeros(len(block.t))
    if len(block.t) < 3:
        return found
    linear, h = limits.linear, np.diff(block.t)
    chord = np.linalg.norm(np.diff(block.position[:, linear], axis=0), axis=1)
    off = np.linalg.norm(position_error(block, limits)[:, linear], axis=1)
    error = off[1:] + off[:-1]
    most = float(np.linalg.norm(limits.per_axis[1, linear]))
    slowest = (chord - error) / h - most * h
    bow = np.full(len(h), np.inf)
    np.divide(min(limits.normal, most) ** 2 * h**3, 24.0 * slowest, out=bow, where=slowest > 0.0)
    unsure = (error + bow) / h
    certain = np.abs(np.diff(chord / h)) - unsure[1:] - unsure[:-1]
    found[2:] = np.maximum(certain, 0.0) * 2.0 / (h[1:] + h[:-1])
    return found
