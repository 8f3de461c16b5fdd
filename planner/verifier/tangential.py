"""The tangential acceleration |a.t| <= A_t and jerk |j.t + |a - (a.t) t|^2/|v|| <= J_t, t = v/|v| in x, y, z.

Twice: on the delivered columns, and by the lengths run between samples. With the mean speed u = L/h of every
period, twice the change from one to the next over the time of both is a mean of the tangential acceleration,
and three times the change of two of those over the time of all three is one of the tangential jerk. A length
L is at least its chord c. With a normal acceleration of at most N and a speed of at least v = c/h - |a| h the
direction turns by no more than N h/(2 v) from that of the middle, so that L - c <= N^2 h^3/(24 v), which is
taken off.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.verifier.limits import ACCELERATION, FEED_AT_REST, GROUPS, JERK, TANGENTIAL
from planner.verifier.worst import BACK, COLUMN, DIFFERENCE, Limits, SampleBlock, Worst, position_error


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
