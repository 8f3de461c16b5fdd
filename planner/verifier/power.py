"""The power of each drive over the mass that it moves, |v a| <= P, sample by sample.

Twice: on the delivered columns, and on the mean speeds u1, u2 of two periods, from the positions. Over those
the axis changes its speed by |u2 - u1| = (h1 + h2)/2 times a mean of |a|, and |a| <= P/|v|. With |a| <= A no
speed meanwhile is below s = min(|u1|, |u2|) - A max(h1, h2), so that

    P >= s |u2 - u1| 2/(h1 + h2).
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import ROTARY_AXES, Machine
from planner.verifier.excess import NAMES
from planner.verifier.worst import COLUMN, DIFFERENCE, Limits, SampleBlock, Worst, position_error

PER_MM2 = 1e-6  # m2 in a mm2: 1 mm2/s3 is 1e-6 W/kg


def units_of(machine: Machine, axes: tuple[str, ...]) -> FloatArray:
    """(A,) W/kg in 1 mm2/s3, of rotary axes W/(kg m2) at the machine's radius."""
    return np.array([machine.radius**-2.0 if letter in ROTARY_AXES else PER_MM2 for letter in axes])


def look_at_power(block: SampleBlock, limits: Limits, worst: Worst, first: int) -> None:
    """Take in what a block shows of the power of the axes, rows from `first` on, where it is limited."""
    if not np.isfinite(limits.power).any():
        return
    if limits.judged[:2].all():
        power = np.abs(block.velocity * block.acceleration) * limits.power_unit
        worst.take(first, power, limits.power, COLUMN, block, span=NAMES.index("power"))
    worst.take(first, _certain(block, limits) * limits.power_unit, limits.power, DIFFERENCE, block)


def _certain(block: SampleBlock, limits: Limits) -> FloatArray:
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
