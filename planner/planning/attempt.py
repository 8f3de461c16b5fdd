"""An attempt at a motion, and what the attempts before it have left."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from planner.motion.timing import Motion
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.geometry import Laid
from planner.planning.optimal.on_path import OnPath


@dataclass(frozen=True, kw_only=True)
class Tried:
    """The outcome of the attempts so far."""

    best: Plan | None = None  # the fastest plan; None before there is one
    # the time-optimal motion on a path, its limits kept between grid points, not delivered; None before
    path: tuple[OnPath, Motion] | None = None
    # plans the motion `path` once, and what the joint search has planned of it is not planned again; None before
    kept: Callable[[Job], tuple[OnPath, Motion] | None] | None = None
    laid: Laid | None = None  # the splines of that path, where they are known
    slower: Plan | None = None  # of a search whose motion passes only when it is run slower in places
    joint: bool = False  # whether the best is of the joint search
    steps: int = 0  # of constant jerk, that the joint search has
    left: bool = True  # whether the joint search has anything to gain
    began: float = float("inf")  # time of the motion that the joint search began with [s]

    @property
    def plan(self) -> Plan | None:
        """The best plan, or the one that is run slower in places where there is no other; None before there is one."""
        return self.best or self.slower


class Attempt(NamedTuple):
    """One way to a motion."""

    name: str  # as the trace has it
    applies: Callable[[Job, Settings, Tried], bool]  # whether it is made, after what was tried before
    make: Callable[[Job, Settings, Tried], Tried]  # what is there after it
