"""An attempt at a motion, and what the attempts before it have left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from planner.motion.timing import Motion
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.on_path import OnPath


@dataclass(frozen=True, kw_only=True)
class Tried:
    """The outcome of the attempts so far.

    best  : the fastest plan; None before there is one
    path  : the time-optimal motion on a path, and in time with its limits kept between grid points, not
            delivered yet; None before
    joint : whether the best is of the joint search
    steps : of constant jerk, that the joint search has
    left  : whether the joint search has anything to gain
    """

    best: Plan | None = None
    path: tuple[OnPath, Motion] | None = None
    joint: bool = False
    steps: int = 0
    left: bool = True


class Attempt(NamedTuple):
    """One way to a motion.

    name    : as the trace has it
    applies : whether it is made, after what was tried before
    make    : what is there after it
    """

    name: str
    applies: Callable[[Job, Settings, Tried], bool]
    make: Callable[[Job, Settings, Tried], Tried]
