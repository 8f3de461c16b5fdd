"""How much of the limits that are no axis' own a motion uses at its samples: for the planner.

The judge has code of its own for each of them (verifier/limits.py, verifier/other_limits.py).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limits import NORMAL, Limits
from planner.machine import LINEAR_AXES
from planner.machine.user_limit import Moving, OwnLimit, Place, along_path, bounds_at, limit_derivatives
from planner.motion.trajectory import Trajectory

REST = 1e-6  # [mm/s] below this, the direction of a velocity is rounding


def ratios(limits: Limits, motion: Trajectory) -> Iterator[tuple[int, FloatArray]]:
    """Of every limit that is no axis' own its order and the motion's ratios (T,) to it at its T samples."""
    if np.isfinite(limits.normal):
        yield NORMAL.order, _normal(motion) / limits.normal
    yield from _along(limits.along, motion)


def _normal(motion: Trajectory) -> FloatArray:
    """(T,) normal acceleration of x, y and z, 0 at rest [mm/s2]."""
    v, a = _linear(motion)
    square, along = np.sum(v * v, axis=1), np.sum(v * a, axis=1)
    moving = square > REST**2
    share = np.divide(along, square, out=np.zeros(len(v)), where=moving)
    return np.where(moving, np.linalg.norm(a - share[:, None] * v, axis=1), 0.0)


def slowest(motion: Trajectory) -> FloatArray:
    """(n,) times between samples at which the motion is slowest, by constant acceleration [s]: there it
    turns most quickly, and its normal acceleration can have peaks."""
    v, a = _linear(motion)
    square = np.sum(a * a, axis=1)
    step = np.divide(-np.sum(v * a, axis=1), square, out=np.full(len(v), np.inf), where=square > 0.0)
    before, after = np.diff(motion.t, prepend=motion.t[0]), np.diff(motion.t, append=motion.t[-1])
    inside = (step > -before) & (step < after) & (step != 0.0)
    return motion.t[inside] + step[inside]


def _linear(motion: Trajectory) -> tuple[FloatArray, FloatArray]:
    """(T, n) velocities and accelerations of the linear axes x, y and z."""
    of = np.isin(motion.axes, LINEAR_AXES)
    return motion.velocity[:, of], motion.acceleration[:, of]


def _along(limits: Sequence[OwnLimit], motion: Trajectory) -> Iterator[tuple[int, FloatArray]]:
    """For every quantity of every limit its order, 1 to 3, and the motion's ratio to it (n,)."""
    columns = (motion.velocity, motion.acceleration, motion.jerk)
    if not limits:
        return
    _, direction = along_path(*columns)
    place = Place(motion.axes, list(motion.position.T), direction, motion.block)
    moving = Moving.of(motion.axes, (motion.position, *columns))
    for limit in limits:
        bounds = bounds_at(limit, place, len(motion.t))
        values = limit_derivatives(limit, moving)
        for k in range(3):
            yield k + 1, np.abs(values[k]) / bounds[:, k]
