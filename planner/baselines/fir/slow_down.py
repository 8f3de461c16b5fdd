"""From first speeds to a motion that keeps tolerance and limits: filter, measure, slow down where something
is exceeded, repeat.

How a plan gets slower is the paper's affair (`SpeedPlan.slower`); it must come to an end. Runs between full
stops do not know of each other: one whose motion exceeds nothing stays as it is, and of several plans each
run has the one that is fastest for it.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self, TypeVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.fir.command import Command
from planner.baselines.fir.guide import Guide
from planner.baselines.fir.measure import Measured, measure
from planner.baselines.fir.superpose import Filtered, superpose
from planner.machine import Machine

# More rounds than any plan takes until it is done: from their 40th on both papers' plans keep to what must
# end.
ROUNDS = 120
# What rounding may add to a ratio [-]; the verifier allows twice as much.
RATIO_ROUNDING = 5e-7
# One round slows down by the root of what is exceeded, since most of it falls with the square of the speed,
# and a little more, but not to less than half [-].
BEYOND, SLOWEST = 0.995, 0.5


@dataclass(frozen=True, eq=False, kw_only=True)
class SpeedPlan(ABC):
    """How fast a guide is commanded, and the filters of its S runs.

    T1, T2 : (S,) T1 >= T2 [s]
    rows   : the fields with a row for each "run", "leg" or "joint"
    """

    rows: ClassVar[dict[str, str]] = {"T1": "run", "T2": "run"}
    guide: Guide
    T1: FloatArray
    T2: FloatArray

    @abstractmethod
    def command(self) -> Command:
        """The input of the filters."""

    @abstractmethod
    def time(self) -> FloatArray:
        """(S,) durations of the runs [s], dwells not counted."""

    @abstractmethod
    def slower(self, made: Made, machine: Machine, n: int) -> Self:
        """A slower plan, with the same for runs that exceed nothing.

        made : the motion of this plan
        n    : rounds before this one
        """


class Made(NamedTuple):
    """A motion with what made it, and what it does."""

    command: Command
    motion: Filtered
    seen: Measured

    def largest(self, ratio: FloatArray) -> FloatArray:
        """(S,) the largest of a measured `ratio` (n,) in each run [-]."""
        return np.maximum.reduceat(ratio, np.searchsorted(self.seen.t, self.motion.begin))

    @property
    def wrong(self) -> Array:
        """(S,) True for runs that exceed something."""
        return np.asarray(self.largest(self.seen.worst) > 1.0 + RATIO_ROUNDING)


P = TypeVar("P", bound=SpeedPlan)


def make(plan: SpeedPlan, machine: Machine) -> Made:
    """The motion of a plan, measured."""
    command = plan.command()
    motion = superpose(command)
    return Made(command, motion, measure(plan.guide, motion, machine))


def slowing(ratio: FloatArray, most: float = BEYOND) -> FloatArray:
    """(n,) factor on the speed for a measured `ratio` (n,) [-]: 1 where nothing is exceeded, `most` at most
    elsewhere."""
    slower = np.clip(BEYOND / np.sqrt(np.maximum(ratio, 1.0)), SLOWEST, most)
    return np.where(ratio > 1.0 + RATIO_ROUNDING, slower, 1.0)


def slow_down(plan: P, machine: Machine) -> P:
    """Slow a plan down until it keeps tolerance and limits, or `ROUNDS` times."""
    for n in range(ROUNDS):
        made = make(plan, machine)
        if not made.wrong.any():
            break
        plan = plan.slower(made, machine, n)
    return plan


def fastest_of(plans: Iterable[P], machine: Machine) -> P:
    """Some plans of one guide, slowed down: each run with the one that is fastest for it."""
    slowed = [slow_down(plan, machine) for plan in plans]
    best = np.argmin([plan.time() for plan in slowed], axis=0)
    run = slowed[0].guide.run
    which = {"run": best, "leg": best[run], "joint": best[np.append(run, run[-1])]}
    columns = {
        name: np.stack([getattr(plan, name) for plan in slowed])[which[of], np.arange(len(which[of]))]
        for name, of in slowed[0].rows.items()
    }
    return dataclasses.replace(slowed[0], **columns)
