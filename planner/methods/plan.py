"""The record of a finished job: what was asked, what was found, and the verdict on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Array, FloatArray
from planner.errors import NotSolvedError
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.methods.closed_form import CornerTable
from planner.methods.prices import PriceList
from planner.nc.program import Program
from planner.trajectory import Trajectory
from planner.verify import CornerCheck, Verdict


@dataclass(frozen=True, eq=False, kw_only=True)
class GridHistory:
    """The profile at the solver's grid points, and which limit holds it there (methods/activity.py).

    t, s, feed   : (P,) time [s], arc length [mm], feed [mm/s]
    active       : (P,) index in `active_names` of what holds the interval to the right of each point
    active_names : limits, then "none" and "rest"
    share        : of the cycle time that each of them holds [-]; they add up to 1
    """

    t: FloatArray
    s: FloatArray
    feed: FloatArray
    active: Array
    active_names: tuple[str, ...]
    share: FloatArray

    def ranked(self) -> list[tuple[str, float]]:
        """What holds any time, with its share: limits, the largest first, then "none" and "rest"."""
        limits, others = (
            np.flatnonzero(self.share[:-2]),
            len(self.share) - 2 + np.flatnonzero(self.share[-2:]),
        )
        order = [*limits[np.argsort(-self.share[limits], kind="stable")], *others]
        return [(self.active_names[k], float(self.share[k])) for k in order]


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
