"""The command: what goes into the filters, as steps of constant velocity.

Each run is a sequence of velocity pulses (legs, or what they are cut into, each with its own speed), with a
gap of standstill at some joints, and ends with a standstill that lasts until the filters are empty, and the
dwell. Times are counted from the start of the run, so that an hour of motion costs no digits.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.fir.guide import Guide


class VelocityPulses(NamedTuple):
    """C velocity pulses in order: legs, or what they are cut into, each run at a constant speed."""

    leg: Array  # (C,) leg of the guide, non-decreasing
    length: FloatArray  # (C,) [mm]
    speed: FloatArray  # (C,) [mm/s]


class Command(NamedTuple):
    """N steps of constant velocity over A axes, in S runs from first[k] on, each ending in a standstill.

    Column A of velocity and position is the length along the guide and its rate: filtered like the axes it
    tells where on the guide the motion belongs.
    """

    first: Array  # (S+1,) first step of each run
    t: FloatArray  # (N,) start [s], from the start of the run
    velocity: FloatArray  # (N, A+1) [mm/s]
    position: FloatArray  # (N, A+1) at the start of the step [mm]
    leg: Array  # (N,) leg that is run, or whose end is waited at
    # T1 and T2: (S,) filters of each run [s]
    T1: FloatArray
    T2: FloatArray
    begin: FloatArray  # (S,) start of each run [s]
    dwell: FloatArray  # (S,) standstill when the filters are empty [s]

    @property
    def end(self) -> FloatArray:
        """(S,) when each run is over, its dwell too [s]."""
        return self.begin + self.t[self.first[1:] - 1] + self.T1 + self.T2 + self.dwell


def command_of(
    guide: Guide, pulses: VelocityPulses, gap: FloatArray, T1: FloatArray, T2: FloatArray
) -> Command:
    """Put the pulses one after another, with gaps at the joints.

    pulses : each leg of the guide has one at least
    gap    : (R+1,) standstill at each joint [s]; not used at full stops
    T1, T2 : (S,) filters of each run [s]
    """
    leg = pulses.leg
    ends_leg = np.flatnonzero(np.append(np.diff(leg) > 0, True))
    joint = leg[ends_leg] + 1
    stop = ~guide.inner[joint]
    waits = stop | (gap[joint] > 0)
    after = ends_leg[waits] + 1  # a gap or a standstill follows these pulses
    duration = np.insert(pulses.length / pulses.speed, after, np.where(stop, 0.0, gap[joint])[waits])
    which = np.insert(leg, after, leg[ends_leg][waits])
    moving = np.insert(np.ones(len(leg), bool), after, False)
    ends_run = np.insert(np.zeros(len(leg), bool), after, stop[waits])
    speed = np.insert(pulses.speed, after, 0.0)
    first = np.concatenate([[0], np.flatnonzero(ends_run) + 1])
    t = _starts(duration, first)
    within = np.cumsum(pulses.length) - pulses.length
    along = np.insert(within - within[np.searchsorted(leg, leg)], after, 0.0)
    start = np.column_stack([guide.point, guide.s])
    position = start[which + ~moving]
    direction = np.column_stack([guide.direction, np.ones(len(guide))])[which[moving]]
    position[moving] += along[moving, None] * direction
    velocity = np.zeros_like(position)
    velocity[moving] = speed[moving, None] * direction
    lasting = t[first[1:] - 1] + T1 + T2 + guide.dwell[1:]
    return Command(
        first=first,
        t=t,
        velocity=velocity,
        position=position,
        leg=which,
        T1=T1,
        T2=T2,
        begin=guide.dwell[0] + np.concatenate([[0.0], np.cumsum(lasting)[:-1]]),
        dwell=guide.dwell[1:],
    )


@njit(cache=True, error_model="numpy")
def _starts(duration, first):
    """(N,) starts of the steps from the start of their run."""
    t = np.empty(len(duration))
    for k in range(len(first) - 1):
        now = 0.0
        for n in range(first[k], first[k + 1]):
            t[n] = now
            now += duration[n]
    return t


@njit(cache=True, error_model="numpy")
def lower_between(order, value, first, last, speed):
    """speed[n] = min(speed[n], value[b]) for all pulses first[b] <= n < last[b], in place; every pulse is
    visited once.

    order              : (B,) indices b, the lowest value first
    value, first, last : (B,) speeds [mm/s] and the pulses that they hold on
    speed              : (C,) of the pulses [mm/s]
    """
    onward = np.arange(len(speed) + 1)  # the next pulse that is not yet painted, or a step towards it
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
