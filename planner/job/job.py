"""What every method shares: its way into a job, the filters and periods, sampling, verification, and the plan at the end."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar
from weakref import WeakKeyDictionary

import numpy as np

from planner.base.names import OPTIMAL, SECOND_ORDER
from planner.delivery import periods
from planner.delivery.filters import kept
from planner.delivery.pacing import TimedT
from planner.delivery.periods import settled
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program
from planner.geometry.passing import segments_at
from planner.geometry.toolpath import Joint, Toolpath
from planner.job.notes import job_notes
from planner.job.plan import Plan
from planner.job.records import CornerTable, GridHistory, PriceList
from planner.job.stages import Progress, Stages
from planner.job.trace import Log, Tell
from planner.lookahead.rest_to_rest import block_limits, rest_to_rest_times
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.timing import MotionInTime, require_samples, sample_motion
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.verify import Verdict, verify

Delivered = tuple[Trajectory, Verdict]
# A job is planned again at most so often with less tolerance where chords between samples leave it; every time the samples fall
# elsewhere, but what one phase may do to a corner is known after the first.
PERIOD_ROUNDS = 8
# Other methods are tried then on jobs with up to so many grid points: 10 blocks with tight jerks can have 22,000.
INSTEAD_POINTS = 50_000


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """A program on its way to a plan.

    program   : the blocks as they were read
    machine   : limits, interpolation period, filters
    toolpath  : the path that is planned: the exact programmed path with its tolerances, or with smaller ones (`with_share`,
                delivery/periods.py)
    stages    : the clock
    noted     : what the method has noted so far (`note`)
    judged    : machine and toolpath by which the motion is judged, if it is planned with others; else None
    motion_of : the motions of the trajectories delivered so far, as long as the trajectories exist
    """

    program: Program
    machine: Machine
    toolpath: Toolpath
    stages: Stages
    noted: list[str] = field(default_factory=list)
    judged: tuple[Machine, Toolpath] | None = None
    motion_of: WeakKeyDictionary[Trajectory, MotionInTime] = field(default_factory=WeakKeyDictionary)

    @property
    def real(self) -> tuple[Machine, Toolpath]:
        """Machine and toolpath by which the motion is judged."""
        return self.judged or (self.machine, self.toolpath)

    def with_share(self, share: float, seen: float) -> Job:
        """The job with smaller tolerances, so that the rest is left to the filters behind the setpoints.

        share : of the tolerances, 0 < share <= 1 [-]
        seen  : of the lengths of the filters, as far as closed forms use them [-]

        Only for machines with filters.
        """
        machine, toolpath = self.real
        assert machine.fir is not None
        by = seen * float(np.sqrt(share))  # T^2 over tolerance stays
        lag = machine.fir.phase_lag_max
        filters = {
            "time_constants": tuple(by * T for T in machine.fir.time_constants),
            "phase_lag_max": None if lag is None else by * lag,
        }
        return dataclasses.replace(
            self,
            machine=machine.model_copy(update={"fir": machine.fir.model_copy(update=filters)}),
            toolpath=dataclasses.replace(toolpath, tolerance=share * toolpath.tolerance),
            judged=(machine, toolpath),
            noted=[],
        )

    def stage(self, name: str) -> AbstractContextManager[Callable[[float], None]]:
        """Run a stage under the clock. Yields a function to call with the fraction done (0 to 1)."""
        return self.stages.stage(name)

    @property
    def tell(self) -> Tell:
        """Tell of a step (job/trace.py)."""
        return self.stages.tell

    def note(self, *sentences: str) -> None:
        """Add sentences to the notes of the plan: what was given up, with the first line and a count. Repeated ones are dropped."""
        for sentence in sentences:
            if sentence not in self.noted:
                self.noted.append(sentence)
                self.tell("given up", what=sentence)

    def afresh(self) -> Job:
        """The same job with no notes, for another plan of it."""
        return dataclasses.replace(self, noted=[])

    @cached_property
    def stop_time(self) -> float:
        """Cycle time if every block ran from rest to rest [s], dwells included: the baseline of the plan."""
        machine, toolpath = self.real
        times = rest_to_rest_times(toolpath.length, *block_limits(toolpath, machine))
        return float(times.sum() + np.sum(toolpath.dwell))

    def behind_filters(self, motion: TimedT) -> TimedT:
        """The motion, slowed down where it would leave the tolerance behind the filters of the machine (delivery/filters.py)."""
        with self.stage("filters"):
            machine, toolpath = self.real
            return kept(motion, toolpath, machine)

    def deliver(self, motion: MotionInTime, not_limited: tuple[str, ...] = (), seed: int = 0) -> Delivered:
        """Sample a motion at the interpolation period and have it judged, between the samples too.

        not_limited : quantities that are reported and not judged, "jerk" for example
        seed        : of the times at which the verifier looks; use another one if a verdict was fed back into the motion

        Standstills are added where the chords between samples would cut off a full stop (delivery/periods.py).

        Returns the trajectory and the verdict.
        """
        machine, toolpath = self.real
        with self.stage("sample"):
            motion = self.settled(motion, not_limited)
            trajectory = self._named(sample_motion(motion, machine.dt))
        self.motion_of[trajectory] = motion
        with self.stage("verify") as progress:
            verdict = verify(
                trajectory,
                toolpath,
                machine,
                motion=motion,
                seed=seed,
                not_limited=not_limited,
                progress=progress,
            )
        return trajectory, verdict

    def settled(self, motion: MotionInTime, not_limited: tuple[str, ...] = ()) -> MotionInTime:
        """The motion as it is delivered, with the standstills that its samples need."""
        machine, toolpath = self.real
        return settled(motion, toolpath, machine, "jerk" not in not_limited)

    def _named(self, trajectory: Trajectory) -> Trajectory:
        """The trajectory with each sample at the block whose programmed path it is at, in order; where that cannot be told, the
        method's own blocks and a note."""
        _, toolpath = self.real
        segment = segments_at(toolpath, trajectory.position, trajectory.feed)
        if segment is None:
            self.note(
                "the motion leaves the programmed path: the lines and blocks of the trajectory are those that the method planned"
            )
            return trajectory
        return dataclasses.replace(trajectory, block=toolpath.block[segment], line=toolpath.line[segment])

    def plan(
        self,
        made: Delivered | None,
        *,
        method: str,
        corner: str | None,
        solver: str,
        status: Status,
        sentence: str,
        grid_points: int,
        rounded: CornerTable | None = None,
        grid: GridHistory | None = None,
        prices: PriceList | None = None,
    ) -> Plan:
        """The plan of the job.

        made : trajectory and verdict, or None if the job could not be solved

        The other arguments are fields of `Plan`.
        """
        trajectory, verdict = made or (None, None)
        held: dict[str, Any] = {} if grid is None else {"held_by": _largest_shares(grid)}
        self.tell(
            "plan",
            found=np.nan if trajectory is None else trajectory.cycle_time,
            method=method,
            corner=corner or "none",
            points=grid_points,
            passed=verdict is not None and verdict.passed,
            **held,
        )
        self._note_ringing(trajectory, method)
        return Plan(
            method=method,
            corner=corner,
            solver=solver,
            program=self.program,
            machine=self.real[0],
            toolpath=self.real[1],
            status=status,
            sentence=sentence,
            trajectory=trajectory,
            verdict=verdict,
            rounded=rounded,
            grid=grid,
            stop_time=self.stop_time,
            grid_points=grid_points,
            prices=prices,
            notes=(*job_notes(self.program, *self.real), *self.noted),
            timings=self.stages.timings,
        )

    def _note_ringing(self, trajectory: Trajectory | None, method: str) -> None:
        """Say so where vibration modes are excited; method fir makes its filters as long as leaves them at rest."""
        shaped = trajectory is None or isinstance(self.motion_of.get(trajectory), ShapedMotion)
        if self.machine.modes and not shaped and method != "fir":
            can = (
                "give --shaped"
                if method in (OPTIMAL, SECOND_ORDER)
                else f"{OPTIMAL} and {SECOND_ORDER} do with --shaped"
            )
            self.note(
                f"method {method} does not shape its setpoints for the machine's vibration modes; {can}"
            )


def _largest_shares(grid: GridHistory) -> str:
    """The three limits that hold a motion longest."""
    return ", ".join(f"{name} {share:.0%}" for name, share in grid.ranked()[:3])


class Method(ABC):
    """A way to plan a job. Its repr is its row label in every table.

    ways    : for machines with filters: pairs (share of the tolerance, share of the filters' lengths that closed forms use), see
              `Job.with_share`; they are tried beside (1, 1), and the fastest plan is taken
    instead : methods that are tried as well if the chords between samples need some of the tolerance, because another one may then be
              faster
    """

    instead: Sequence[Method] = ()
    ways: ClassVar[tuple[tuple[float, float], ...]] = ()

    def plan(
        self,
        program: Program,
        machine: Machine,
        tolerance: float | None = None,
        progress: Progress | None = None,
        log: Log | None = None,
    ) -> Plan:
        """Plan a program, sample the motion and have it judged.

        tolerance : contour tolerance [mm]; None for the one of the program (G64 P) or the machine
        progress  : called with the stage's name and the fraction done (0 to 1)
        log       : called with every step of the planning, e.g. a `Trace` (job/trace.py)

        Raises InputError for a program that cannot be planned. An unsolved problem is the status of the plan.
        """
        stages = Stages(progress, log)
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
        # at the programmed feed, which no motion exceeds: some jobs can be refused before any work
        require_samples(float(np.sum(toolpath.length / toolpath.feed) + np.sum(toolpath.dwell)), machine.dt)
        return self.plan_best(Job(program=program, machine=machine, toolpath=toolpath, stages=stages))

    def plan_best(self, job: Job) -> Plan:
        """The plan of a job; on a machine with filters the fastest of those that are tried (`ways`)."""
        best = self.plan_within_periods(job)
        if job.machine.fir is None or not best.solved:
            return best
        for share, seen in self.ways:
            made = self.plan_within_periods(job.with_share(share, seen))
            before, best = best, faster(best, made)
            job.tell(
                "share of tolerance",
                found=_time(made),
                before=_time(before),
                kept=best is made,
                share=share,
                filters=seen,
            )
        return best

    @property
    def keeps_tolerance(self) -> bool:
        """Whether the method promises the tolerance. If not, its motion is delivered as it is, and the verdict says the rest."""
        return True

    def plan_within_periods(self, job: Job) -> Plan:
        """Plan a job such that the chords between its samples keep the tolerance too (delivery/periods.py)."""
        made = self.plan_job(job)
        given, planned, (machine, programmed) = job, job.toolpath, job.real
        for again in range(1, PERIOD_ROUNDS + 1):
            if not self.keeps_tolerance or made.trajectory is None or _inside(made):
                break
            with job.stage("geometry"):
                near, far = periods.missed(job.motion_of[made.trajectory], programmed, machine.dt)
                less = periods.with_less_tolerance(planned, programmed, near, far)
            if less is None:
                break
            planned = less
            stops = int((less.joint == Joint.STOP).sum() - (programmed.joint == Joint.STOP).sum())
            job.tell(
                "less for the period",
                round=again,
                corners=int((less.tolerance < programmed.tolerance).sum()),
                stops=stops,
            )
            job = dataclasses.replace(given, toolpath=planned, judged=(machine, programmed), noted=[])
            made = self.plan_job(job)
        if job is given:
            return made
        # what less tolerance costs is not in the problem's prices
        made = dataclasses.replace(made, prices=None, notes=(*made.notes, _said(made, programmed, planned)))
        for other in self.instead if made.grid_points <= INSTEAD_POINTS else ():
            rival = other.plan_within_periods(given.afresh())
            wins = faster(made, rival) is rival
            job.tell(
                "another method",
                found=_time(rival),
                before=_time(made),
                kept=wins,
                method=rival.method,
                corner=rival.corner or "none",
            )
            if wins:
                what = (
                    f"{rival.corner} corners lose"
                    if rival.method == made.method
                    else f"method {rival.method} loses"
                )
                said = f"{what} less to the period; {rival.sentence}"
                made = dataclasses.replace(rival, method=made.method, corner=made.corner, sentence=said)
        return made

    @abstractmethod
    def plan_job(self, job: Job) -> Plan:
        """Plan a job whose toolpath is laid out. What a method has to provide."""


def faster(plan: Plan, other: Plan) -> Plan:
    """Of two plans the one that passed; if both did, the faster one; the first if they are equal."""
    if plan.trajectory is None or plan.verdict is None or other.trajectory is None or other.verdict is None:
        return plan
    if plan.verdict.passed != other.verdict.passed:
        return plan if plan.verdict.passed else other
    return other if other.trajectory.cycle_time < plan.trajectory.cycle_time else plan


def _time(plan: Plan) -> float:
    """Cycle time [s], NaN for a motion that does not pass."""
    passed = plan.trajectory is not None and plan.verdict is not None and plan.verdict.passed
    return plan.trajectory.cycle_time if passed and plan.trajectory is not None else np.nan


def _inside(made: Plan) -> bool:
    """True if the motion's samples and chords keep the tolerance, at corners (eq. 18) wherever the samples fall."""
    verdict = made.verdict
    return verdict is None or not (
        verdict.vertex.broken or verdict.contour.broken or verdict.corners.overdrawn.any()
    )


def _said(made: Plan, programmed: Toolpath, planned: Toolpath) -> str:
    """What the period took from the corners, for the notes."""
    stops = (planned.joint == Joint.STOP) & (programmed.joint != Joint.STOP)
    less = (planned.tolerance < programmed.tolerance) & ~stops
    first = programmed.line[np.flatnonzero(stops | less)[0] - 1]
    return (
        f"samples {made.machine.dt * 1e3:g} ms apart: {less.sum()} corners are planned with less of the tolerance, and "
        f"{stops.sum()} are full stops; the first is at the end of line {first}"
    )
