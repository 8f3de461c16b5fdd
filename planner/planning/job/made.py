"""The records between the stages of a plan: a motion that was delivered, and the tables beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory
from planner.planning.optimal.on_path import OnPath
from planner.sensitivity.records import GridHistory, PriceList
from planner.verifier import Verdict


class Delivered(NamedTuple):
    """A motion that was sampled and judged.

    trajectory : its samples
    verdict    : on them and on the motion
    motion     : with the standstills that the samples need
    slower     : where the verdict failed, the same motion slower in places so that it passes; else None
    filtered   : whether the filters behind the setpoints made the motion slower than its limits did
    notes      : what the samples do not tell
    """

    trajectory: Trajectory
    verdict: Verdict
    motion: MotionInTime
    slower: Delivered | None = None
    filtered: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Tables:
    """The tables of a plan besides the motion, as far as it can: fields of `Plan`."""

    grid: GridHistory | None = None
    prices: PriceList | None = None
    priced: OnPath | None = None


NO_TABLES = Tables()
