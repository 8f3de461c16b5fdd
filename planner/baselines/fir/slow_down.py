"""From first speeds to a motion that keeps tolerance and limits: filter, measure, slow down, repeat.

How a plan gets slower is the paper's affair (`SpeedPlan.slower`); it must come to an end. Runs between full
stops do not know of each other: each is done as soon as its motion exceeds nothing.

Plans with the times that they promise are settled in that order, for each run by itself.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self, TypeVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.fir.command import Command
from planner.baselines.fir.guide import Guide, chosen_rows, freeze_columns, per, picked, put_back
from planner.baselines.fir.measure import Measured, measure
from planner.baselines.fir.superpose import Filtered, superpose
from planner.machine import Machine

# More rounds than any plan takes: from their 40th on both papers' plans keep to what must end.
ROUNDS = 120
# What rounding may add to a ratio [-]; the verifier allows twice as much.
RATIO_ROUNDING = 5e-7
# A round slows down by the root of what is exceeded and a little more, but not to less than half [-].
BEYOND, SLOWEST = 0.995, 0.5
# A plan is settled if it promises to save this fraction of the time [-].
WORTH = 2e-3


@dataclass(frozen=True, eq=False, kw_only=True)
class SpeedPlan(ABC):
    """How fast a guide is commanded, and the filters of its S runs.

    T1, T2 : (S,) T1 >= T2 [s]
    """

    guide: Guide
    T1: FloatArray = per("run")
    T2: FloatArray = per("run")

    def __post_init__(self) -> None:
        guide = self.guide
        freeze_columns(self, {"run": guide.runs, "leg": len(guide), "joint": len(guide) + 1}, len(guide.axes))

    @abstractmethod
    def command(self) -> Command:
        """The input of the filters."""

    @abstractmethod
    def time(self) -> FloatArray:
        """(S,) durations of the runs [s], dwells not counted."""

    @abstractmethod
    def slower(self, made: Made, machine: Machine, n: int) -> Self:
        """A plan slower than that of the motion `made`, after n rounds; only runs that exceed something are used."""

    def pick(self, chosen: Array) -> Self:
        """The plan of the runs `chosen` (S,) of its guide."""
        columns = picked(self, chosen_rows(self.guide.first, chosen))
        return dataclasses.replace(self, guide=self.guide.pick(chosen), **columns)

    def put(self, chosen: Array, plan: Self) -> Self:
        """This plan with `plan`, of these runs alone, for the runs `chosen` (S,)."""
        return dataclasses.replace(self, **put_back(self, chosen_rows(self.guide.first, chosen), plan))


class Made(NamedTuple):
    """A motion with what made it, and what it does."""

    command: Command
    motion: Filtered
    seen: Measured

    def largest(self, ratio: FloatArray) -> FloatArray:
        """(S,) the largest of a measured `ratio` (n,) in each run [-]."""
        return np.maximum.reduceat(ratio, np.searchsorted(self.seen.t, self.motion.begin))


P = TypeVar("P", bound=SpeedPlan)


def make(plan: SpeedPlan, machine: Machine) -> Made:
    """The motion of a plan, measured."""
    command = plan.command()
    motion = superpose(command)
    return Made(command, motion, measure(plan.guide, motion, machine))


def slowing(ratio: FloatArray, most: float = BEYOND) -> FloatArray:
    """(n,) factor on the speed for a `ratio` (n,) [-]: 1 where nothing is exceeded, else `most` at most."""
    slower = np.clip(BEYOND / np.sqrt(np.maximum(ratio, 1.0)), SLOWEST, most)
    return np.where(ratio > 1.0 + RATIO_ROUNDING, slower, 1.0)


def slow_down(plan: P, machine: Machine) -> P:
    """Slow a plan down until it keeps tolerance and limits, or `ROUNDS` times."""
    left = np.ones(plan.guide.runs, bool)
    for n in range(ROUNDS):
        chosen = plan.pick(left)
        made = make(chosen, machine)
        wrong: Array = made.largest(made.seen.worst) > 1.0 + RATIO_ROUNDING
        if not wrong.any():
            break
        slower = chosen.slower(made, machine, n).pick(wrong)
        left[left] = wrong
        plan = plan.put(left, slower)
    return plan


def settled_fastest(plans: Sequence[P], times: FloatArray, machine: Machine) -> P:
    """The fastest of a few plans of a guide once slowed down, each run with its most promising one.

    times : (K, S) what the K plans promise [s]; slowed down they take longer
    """
    best, time = plans[0], np.full(times.shape[1], np.inf)
    for rank in np.argsort(times, axis=0, kind="stable"):
        promised = np.take_along_axis(times, rank[None], axis=0)[0]
        tried = promised < time * (1 - WORTH)
        if not tried.any():
            break
        mixed = plans[0]  # each run with its own of the plans
        for k in np.unique(rank[rank > 0]):
            mixed = mixed.put(rank == k, plans[k].pick(rank == k))
        new = slow_down(mixed.pick(tried), machine)
        new_time = new.time()
        better = new_time < time[tried]
        tried[tried] = better
        if better.any():
            best = best.put(tried, new.pick(better))
        time[tried] = new_time[better]
    return best
