"""The extruder of a 3-D printer along a path: an axis that follows the way, and moves alone at full stops.

Between two joints at which it has its programmed place it feeds in proportion to the length of the motion's
path, so that what is programmed is fed, whatever corners the path cuts. Where its ratio changes its speed
steps, as on printers: no motion that goes on could avoid it. Joints nearer to each other than `APART`
tolerances share one ratio; without that the rounding of E on short blocks would be steps of its own.

Its limits v, a, j are limits v/r, a/r, j/r along the path where the ratio is r. A motion within eps of a
joint's vertex saves at most 2 eps of the length on either side of it (motion/vertex_times.py), so between two
joints

    r <= amount / (length - 2 eps for each of the two that is no full stop)

Alone it moves from rest to rest in the shortest time (base/point_to_point.py), at F at most.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.base.point_to_point import rest_to_rest_times
from planner.machine import EXTRUDER, Machine
from planner.nc.program import Program

APART = 8.0  # joints where the ratio may change are at least so many tolerances apart [-]; 4 of them may be saved between two
SAVED = 2.0  # of the length on either side of a joint [tolerances]
LEAST_LEFT = 0.5  # of the length between two joints, whatever is saved of it [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class Extrusion:
    """The extruder along M segments: K joints with a programmed place, P moves while the axes wait."""

    limits: FloatArray  # (3,) of its velocity [mm/s], acceleration [mm/s2] and jerk [mm/s3]
    joint: Array  # (K,) index, ascending, the first 0 and the last M
    arrive: FloatArray  # (K,) its place on arrival there [mm of filament], 0 at the beginning of the program
    leave: FloatArray  # (K,) its place when the motion goes on [mm]
    ratio: FloatArray  # (M,) mm of filament per mm of way on each segment, at most [-]
    at: Array  # (P,) joint of each move alone, not decreasing
    delay: FloatArray  # (P,) from the arrival at the joint to its begin [s]
    amount: FloatArray  # (P,) of filament, negative back [mm]
    speed: FloatArray  # (P,) that is asked for [mm/s]

    def __post_init__(self) -> None:
        knots, moves = len(self.joint), len(self.at)
        freeze(self, "limits", np.float64, (3,))
        freeze(self, "joint", np.int64, (knots,))
        freeze(self, "arrive leave", np.float64, (knots,))
        freeze(self, "ratio", np.float64, (None,))
        freeze(self, "at", np.int64, (moves,))
        freeze(self, "delay amount speed", np.float64, (moves,))


@dataclass(frozen=True, eq=False, kw_only=True)
class Waits:
    """Standstills in the order of the program, and what the extruder does in them."""

    block: Array  # (W,) of the program
    lasts: FloatArray  # (W,) [s]
    amount: FloatArray  # (W,) of filament [mm]
    speed: FloatArray  # (W,) that is asked for [mm/s]


class Laid(NamedTuple):
    """Block (M,) and length (M,) [mm] of the segments, and which joints are full stops (M+1,)."""

    block: Array
    length: FloatArray
    full_stop: Array


def extruder_limits(machine: Machine) -> FloatArray:
    """(3,) velocity, acceleration and jerk of the machine's extruder [mm/s, mm/s2, mm/s3]."""
    axis = machine.axes[EXTRUDER]
    return np.array([axis.velocity, axis.acceleration, axis.jerk])


def waits(program: Program, machine: Machine, still: Array) -> Waits:
    """The standstills of the blocks `still` (W,): dwells, and moves of the extruder alone."""
    amount = program.extruded[still] if len(program.extruded) else np.zeros(len(still))
    lasts, speed = program.dwell[still].copy(), np.zeros(len(still))
    if amount.any():
        v, a, j = extruder_limits(machine)
        alone = np.flatnonzero(amount)
        speed[alone] = np.minimum(program.feed[still][alone], v)
        of_each = np.ones(len(alone))
        lasts[alone] += rest_to_rest_times(np.abs(amount[alone]), speed[alone], a * of_each, j * of_each)
    return Waits(block=still, lasts=lasts, amount=amount, speed=speed)


def extrusion_of(
    program: Program, limits: FloatArray, laid: Laid, tolerance: FloatArray, found: Waits
) -> Extrusion:
    """The extruder along the M segments of a program that has one.

    limits    : (3,) of the extruder
    tolerance : (M+1,) at the joints [mm]
    found     : the standstills
    """
    block, length, full_stop = laid
    of_block = np.bincount(block, weights=length, minlength=len(program))[block]
    fed = program.extruded[block] * length / of_block
    at = np.searchsorted(block, found.block)
    moved = found.amount != 0.0
    alone = np.zeros(len(block) + 1)
    np.add.at(alone, at, found.amount)
    ends = np.append(block[1:] != block[:-1], True)
    joint = _joints(np.cumsum(length), ends, full_stop[1:], APART * tolerance[1:])
    leave = np.append(0.0, np.cumsum(fed)) + np.cumsum(alone)
    arrive = leave - alone
    way = np.add.reduceat(length, joint[:-1])
    saved = np.where(full_stop, 0.0, SAVED * tolerance)[joint]
    left = way - saved[:-1] - saved[1:]
    most = np.abs(arrive[joint[1:]] - leave[joint[:-1]]) / np.maximum(left, LEAST_LEFT * way)
    return Extrusion(
        limits=limits,
        joint=joint,
        arrive=arrive[joint],
        leave=leave[joint],
        ratio=np.repeat(most, np.diff(joint)),
        at=at[moved],
        delay=_before(at, found.lasts)[moved],
        amount=found.amount[moved],
        speed=found.speed[moved],
    )


def extruding_part(extrusion: Extrusion, kept: Array) -> Extrusion:
    """What the extruder does along the segments `kept` (M,) alone, all or none of those between two full stops.
    What it does while the axes wait at a joint belongs to the segment behind it."""
    behind = np.append(kept, kept[-1])
    touched = (behind | np.append(False, kept))[extrusion.joint]
    old, new = extrusion.joint[touched], np.append(0, np.cumsum(kept))
    leave = np.where(behind[old], extrusion.leave[touched], extrusion.arrive[touched])
    joint, first = np.unique(new[old], return_index=True)
    moves = behind[extrusion.at]
    return replace(
        extrusion,
        joint=joint,
        arrive=extrusion.arrive[touched][first],
        leave=leave[np.append(first[1:], len(old)) - 1],
        ratio=extrusion.ratio[kept],
        at=new[extrusion.at[moves]],
        **{name: getattr(extrusion, name)[moves] for name in ("delay", "amount", "speed")},
    )


def _before(at: Array, lasts: FloatArray) -> FloatArray:
    """(W,) how long the standstills at the same joint, and before each, last [s]."""
    end = np.cumsum(lasts)
    begin = end - lasts
    first = np.searchsorted(at, at)
    return begin - begin[first]


@njit(cache=True, error_model="numpy")
def _joints(end, ends, full_stop, apart):
    """Indices of the joints where the ratio may change: full stops, and ends of blocks `apart` [mm] behind the last."""
    found = np.empty(len(end) + 1, np.int64)
    found[0], count, last = 0, 1, 0.0
    for i in range(len(end)):
        if full_stop[i] or i == len(end) - 1 or (ends[i] and end[i] - last >= apart[i]):
            found[count] = i + 1
            count += 1
            last = end[i]
    return found[:count]
