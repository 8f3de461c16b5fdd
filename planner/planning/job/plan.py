"""The record of a finished job: what was asked, what was found, and the verdict on it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

from planner.base.errors import NotSolvedError
from planner.base.names import AUTO, SINGLE_CORNERS, SPLINE
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.planning.job.beside import Beside, beside_motion
from planner.planning.job.shown import Shown
from planner.planning.optimal.on_path import OnPath
from planner.sensitivity.least_time import least_time
from planner.sensitivity.records import GridHistory, PriceList
from planner.verifier import CornerCheck, Verdict


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


class Making(NamedTuple):
    """A plan in the making, which may not be the one that is taken.

    motion, slower, filtered : as in `Delivered`
    priced                   : the solution whose prices are the plan's; None if there, or not to be had
    given_up                 : what the method has noted
    instead                  : another plan, which passes, for one that does not; else None
    """

    motion: MotionInTime
    slower: Delivered | None = None
    filtered: bool = False
    priced: OnPath | None = None
    given_up: tuple[str, ...] = ()
    instead: Plan | None = None


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Plan(Shown):
    """A planned job: its records, and how it shows itself in Python and notebooks (shown.py).

    method, solver      : names of what was used
    corner              : name of the shape of single corners, or the geometry; None where none is rounded
    program, machine    : what was planned, and for which machine
    toolpath            : the exact programmed path with its tolerances
    status, sentence    : how the solution ended
    trajectory, verdict : the motion at the interpolation period, and the verdict on it; None unless solved
    joints              : with the tool centre point on the motion as setpoints of the joints, else None
    grid                : the profile at the grid points, or None
    prices              : cycle time saved per limit, or None where the solver gives no multipliers
    making              : of a plan on its way what only planning needs; None in a finished one
    stop_time           : cycle time if every block ran from rest to rest [s], dwells included, without limits of one's own,
                          of joints behind the tool centre point and of drive power
    grid_points         : number of grid points of the problem that was solved
    notes               : what was assumed and what was given up, each with its first line and a count
    timings             : computing time by stage [s]
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
    grid: GridHistory | None
    stop_time: float
    grid_points: int
    joints: Trajectory | None = None
    prices: PriceList | None = None
    making: Making | None = None
    notes: tuple[str, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Program, machine, method, cycle time and verdict, in a line."""
        verdict = "not solved" if self.verdict is None else "passed" if self.verdict.passed else "failed"
        time = "" if self.trajectory is None else f"{self.trajectory.cycle_time:.4f} s, "
        source = self.program.source.replace("\\", "/").rpartition("/")[2]
        return f"<Plan of {source} on {self.machine.name} by {self.method}: {time}{verdict}>"

    @property
    def cycle_time(self) -> float:
        """Duration of the motion [s]. Raises NotSolvedError if there is none."""
        if self.trajectory is None:
            raise NotSolvedError(self.sentence)
        return self.trajectory.cycle_time

    @property
    def setpoints(self) -> Trajectory | None:
        """The setpoints of the axes: the joints' where the tool centre point is on, else the trajectory."""
        return self.trajectory if self.joints is None else self.joints

    @property
    def geometry(self) -> str | None:
        """How the path is smoothed: "auto", "spline", or "corners" alone; None where none is rounded."""
        if self.corner is None:
            return None
        return self.corner if self.corner in (AUTO, SPLINE) else SINGLE_CORNERS

    @property
    def beside(self) -> tuple[Beside, ...]:
        """The events while the axes stand still, and how long they take; no part of the cycle time."""
        return beside_motion(self.program, self.machine)

    def delivering(self, made: Delivered, **changes: Any) -> Plan:
        """The plan with another motion, which has its prices, and with other `changes` of its fields."""
        making = self.making and self.making._replace(motion=made.motion, slower=made.slower)
        motion: dict[str, Any] = {"trajectory": made.trajectory, "verdict": made.verdict, "making": making}
        return replace(self, **motion | changes)

    def slower_in_places(self) -> Plan:
        """The plan with its motion run slower where the verdict found something, or the one that there is instead, the
        faster of those that there are; else as it is."""
        if self.making is None:
            return self
        slower, instead = self.making.slower, self.making.instead
        mended = self if slower is None else self.delivering(slower)
        if instead is None or (slower is not None and mended.cycle_time <= instead.cycle_time):
            return mended
        return instead

    def without_motion(self, why: str) -> Plan:
        """The plan without its motion, which is not delivered."""
        gone = dict.fromkeys(("trajectory", "verdict", "grid", "prices", "making"))
        return replace(self, status=Status.INFEASIBLE, sentence=why, **gone)  # type: ignore[arg-type]

    @cached_property
    def least_time(self) -> float | None:
        """A time that no motion within the tolerance, the feed and the limits of the axes falls short of [s]
        (sensitivity/least_time.py); None unless solved, behind filters, and for axes of which it is not known."""
        if self.verdict is None or self.program.tool_point is not None:
            return None
        return least_time(self.toolpath, self.machine, self.verdict.not_limited)

    @property
    def solved(self) -> bool:
        """True if there is a trajectory."""
        return self.trajectory is not None

    @property
    def corners(self) -> CornerCheck | None:
        """Eq. 18-20 at every programmed corner, as the verdict found them; None unless solved."""
        return self.verdict.corners if self.verdict is not None else None

    def require(self) -> Plan:
        """Return the plan itself. Raises NotSolvedError with `sentence` if there is no trajectory."""
        if not self.solved:
            raise NotSolvedError(self.sentence)
        return self
