"""The record of a finished job: what was asked, what was found, and the verdict on it."""

from __future__ import annotations

from dataclasses import dataclass, field

from planner.base.errors import NotSolvedError
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.job.records import CornerTable, GridHistory, PriceList
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.verify import CornerCheck, Verdict


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """A planned job.

    method, corner, solver : what was used; corner is None where the method rounds no corners
    status, sentence       : how it ended
    trajectory, verdict    : None unless solved
    rounded                : the corners that the method rounds each by itself, next to their closed-form speed, or None
    grid                   : the profile at the grid points, or None
    prices                 : what the limits cost, or None where the solver does not tell
    stop_time              : time if every block ran from rest to rest [s], dwells included
    grid_points            : size of the problem that was solved
    notes                  : what was assumed and what was given up, each with its first line and how often
    timings                : computing time per stage [s]
    """

    method: str
    corner: str | None
    solver: str
    program: Program
    machine: Machine
    toolpath: Toolpath
    status: Status
    sentence: str
    trajectory: Trajectory | None
    verdict: Verdict | None
    rounded: CornerTable | None
    grid: GridHistory | None
    stop_time: float
    grid_points: int
    prices: PriceList | None = None
    notes: tuple[str, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)

    @property
    def solved(self) -> bool:
        """True if there is a trajectory."""
        return self.trajectory is not None

    @property
    def corners(self) -> CornerCheck | None:
        """Eq. 18-20 at every programmed corner, as the verdict found them; None unless solved."""
        return self.verdict.corners if self.verdict is not None else None

    def require(self) -> Plan:
        """Return self, or raise NotSolvedError with the sentence."""
        if not self.solved:
            raise NotSolvedError(self.sentence)
        return self
