"""The command: what goes into the filters, as intervals of constant velocity.

Each stretch is a row of cells (legs, or parts of them, each with its own speed), with a gap of standstill at some joints, and ends
with a rest that lasts until the filters are empty, and the dwell. Times are counted from the start of the stretch, so that an hour
of motion costs no digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.fir.polyline import Polyline


@dataclass(frozen=True, eq=False, kw_only=True)
class Cells:
    """Parts of legs with a speed each, in order.

    leg    : (C,)
    length : (C,) [mm]
    speed  : (C,) [mm/s]
    """

    leg: Array
    length: FloatArray
    speed: FloatArray

    def __post_init__(self) -> None:
        cells = len(self.leg)
        freeze(self, "leg", np.int64, (cells,))
        freeze(self, "length", np.float64, (cells,))
        freeze(self, "speed", np.float64, (cells,))


@dataclass(frozen=True, eq=False, kw_only=True)
class Command:
    """N intervals of constant velocity over A axes, in S stretches: first[k] .. first[k+1] - 1, the last of them the rest.

    Column A of velocity and position is the length along the course and its rate: filtered like the axes it tells where on the
    course the motion belongs.

    first    : (S+1,)
    t        : (N,) start [s], from the start of the stretch
    velocity : (N, A+1) [mm/s]
    position : (N, A+1) at the start of the interval [mm]
    leg      : (N,) leg that is run, or whose end is waited at
    T1, T2   : (S,) filters of each stretch [s]
    begin    : (S,) start of each stretch [s]
    dwell    : (S,) standstill when the filters are empty [s]
    """

    first: Array
    t: FloatArray
    velocity: FloatArray
    position: FloatArray
    leg: Array
    T1: FloatArray
    T2: FloatArray
    begin: FloatArray
    dwell: FloatArray

    def __post_init__(self) -> None:
        stretches, intervals = len(self.begin), len(self.t)
        freeze(self, "first", np.int64, (stretches + 1,))
        freeze(self, "t", np.float64, (intervals,))
        freeze(self, "velocity", np.float64, (intervals, None))
        freeze(self, "position", np.float64, self.velocity.shape)
        freeze(self, "leg", np.int64, (intervals,))
        for name in ("T1", "T2", "begin", "dwell"):
            freeze(self, name, np.float64, (stretches,))

    @property
    def end(self) -> FloatArray:
        """(S,) when each stretch is over, its dwell too [s]."""
        return self.begin + self.t[self.first[1:] - 1] + self.T1 + self.T2 + self.dwell


def command_of(course: Polyline, cells: Cells, gap: FloatArray, T1: FloatArray, T2: FloatArray) -> Command:
    """Put the cells one after another, with the gaps (R+1,) [s] at the joints."""
    leg, rest = cells.leg, np.append(np.diff(cells.leg) > 0, True)
    ends_leg = np.flatnonzero(rest)
    joint = leg[ends_leg] + 1
    stop = ~course.inner[joint]
    waits = stop | (gap[joint] > 0)
    after = ends_leg[waits] + 1  # a gap or a rest follows these cells

    duration = np.insert(cells.length / cells.speed, after, np.where(stop, 0.0, gap[joint])[waits])
    which = np.insert(leg, after, leg[ends_leg][waits])
    moving = np.insert(np.ones(len(leg), bool), after, False)
    is_rest = np.insert(np.zeros(len(leg), bool), after, stop[waits])
    speed = np.insert(cells.speed, after, 0.0)

    first = np.concatenate([[0], np.flatnonzero(is_rest) + 1])
    t = _starts(duration, first)

    within = np.cumsum(cells.length) - cells.length
    first_cell = np.searchsorted(leg, leg)
    along = np.insert(within - within[first_cell], after, 0.0)
    start = np.column_stack([course.point, course.s])
    position = start[which + ~moving]
    position[moving] += (
        along[moving, None] * np.column_stack([course.direction, np.ones(len(course))])[which[moving]]
    )
    velocity = np.zeros_like(position)
    velocity[moving] = (
        speed[moving, None] * np.column_stack([course.direction, np.ones(len(course))])[which[moving]]
    )

    lasting = t[first[1:] - 1] + T1 + T2 + course.dwell[1:]
    return Command(
        first=first,
        t=t,
        velocity=velocity,
        position=position,
        leg=which,
        T1=T1,
        T2=T2,
        begin=course.dwell[0] + np.concatenate([[0.0], np.cumsum(lasting)[:-1]]),
        dwell=course.dwell[1:],
    )


@njit(cache=True, error_model="numpy")
def _starts(duration, first):
    """Starts of the intervals from the start of their stretch."""
    t = np.empty(len(duration))
    for k in range(len(first) - 1):
        now = 0.0
        for n in range(first[k], first[k + 1]):
            t[n] = now
            now += duration[n]
    return t


@njit(cache=True, error_model="numpy")
def lower_between(order, value, first, last, speed):
    """speed[n] = min(speed[n], value[b]) for all cells first[b] <= n < last[b]; every cell is visited once, the lowest value first."""
    onward = np.arange(len(speed) + 1)  # the next cell that is not yet painted, or a step towards it
    for b in order:
        n = first[b]
        while True:
            root = n
            while onward[root] != root:
                root = onward[root]
            while onward[n] != root:
                onward[n], n = root, onward[n]
            n = root
            if n >= last[b]:
                break
            speed[n] = min(speed[n], value[b])
            onward[n] = n + 1
