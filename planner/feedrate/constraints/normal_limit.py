"""The limit of the normal acceleration, kappa feed^2 <= A, in corners and curves (paper 002, eq. (19)).

A is the machine's (`Machine.normal_acceleration`, inf if it names none), and never more than what its axes
give in the direction n of the path's normal, and what the error budget leaves of it (corners/budget.py).
Between grid points a motion may exceed it by as little as any limit; motion/limits_used.py says where. The
judge has code of its own for it (verifier/limits.py).
"""

from __future__ import annotations

from collections.abc import Iterator

from planner.base.arrays import FloatArray
from planner.corners.budget import NORMAL
from planner.feedrate.constraints.limit import Cap, Limit, over
from planner.feedrate.constraints.on_grid import Side
from planner.machine import Machine

NAME = NORMAL


def feed_sq_within(kappa: FloatArray, limit: float) -> FloatArray:
    """(P,) limit / kappa, inf on straights [mm2/s2]."""
    return over(limit, kappa)


class NormalAcceleration(Limit):
    """kappa x <= A, on machines that name A."""

    name, unit, order = NAME, "mm/s2", 2
    key = NAME

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.normal_acceleration is not None:
            yield Cap(self.name, feed_sq_within(side.kappa, machine.normal_acceleration))
