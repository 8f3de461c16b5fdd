"""What every method shares: its way into a job, and planning it again where samples and filters ask for it."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from planner.base.errors import InputError
from planner.base.names import KINEMATIC, OPTIMAL
from planner.delivery import periods
from planner.feedrate.constraints.extruder import with_extruder_limit
from planner.feedrate.constraints.limits import JERK, Limits
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint, Toolpath
from planner.joint.splice import Spliced, SplicedRun
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.timing import require_samples
from planner.nc.program import Program
from planner.planning.job.by_run import RunsInTime, broken_runs, full_stops, job_of_run
from planner.planning.job.job import FILTERS, Job
from planner.planning.job.plan import Plan
from planner.planning.job.stages import Progress, Stages
from planner.planning.job.trace import Log
from planner.verifier import ThreadCheck, Verdict

# A job is planned again at most so often with less tolerance where chords between samples leave it; every time the samples fall
# elsewhere, but what one phase may do to a corner is known after the first.
PERIOD_ROUNDS = 8
# From the arcs beside corners it is taken where a round for the corners changed nothing, or after so many of them; inside blocks it is
# more and more from then on (without that the verdict of 53750 of the campaign fails). Where a round changed nothing the next one takes
# twice as much.
CORNER_ROUNDS = 4
# Runs on which the verdict finds something are planned each by itself where they are no more than this share of all [-], and so often
# those on which it finds something then.
ALONE_MOST, ALONE_ROUNDS = 0.1, 3
SAME_TIME = 1e-12  # share of a time that is rounding [-]
# Of motions in closed form, whose accelerations bound what filters do to them: these four are as fast in the mean as seven were, for
# 0.7 of the processor time (48 random jobs by `kinematic` and `bezier`).
CLOSED_FORM_WAYS = ((1.0, 0.5), (0.8, 0.35), (0.25, 0.35), (0.1, 0.25))
IN_STEP = (OPTIMAL, KINEMATIC)  # methods for threads


class Method(ABC):
    """A way to plan a job. Its repr is its row label in every table.

    ways    : for machines with filters: pairs (share of the tolerance, share of the filters' lengths that closed forms use), see
              `Job.with_share`; they are tried beside (1, 1), and the fastest plan is taken
    measures_filters : whether filters make its motions slower only where they are measured to leave the tolerance
    keeps_tangential : whether its motions keep the machine's limit of the tangential acceleration
    """

    ways: ClassVar[tuple[tuple[float, float], ...]] = ()
    measures_filters: ClassVar[bool] = False
    keeps_tangential: ClassVar[bool] = True

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
        log       : called with every step of the planning, e.g. a `Trace` (planning/job/trace.py)

        Raises InputError for a program that cannot be planned, and for a limit that the method does not keep. An unsolved problem is
        the status of the plan.
        """
        stages = Stages(progress, log)
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
            if (fed := toolpath.extrusion) is not None:
                machine = with_extruder_limit(machine, toolpath.axes, fed.limits, fed.ratio, toolpath.block)
        if not self.keeps_tangential and np.isfinite(Limits.of(machine, toolpath.axes).tangential):
            raise InputError(
                f"the machine limits the tangential acceleration to {machine.tangential_acceleration:g} mm/s2, which {self!r} does not "
                "keep; plan with method optimal, second-order, bezier or stop, or leave tangential_acceleration out of the machine"
            )
        # at the programmed feed, which no motion exceeds: some jobs can be refused before any work
        at_feed = float(np.sum(toolpath.length / toolpath.feed) + np.sum(toolpath.dwell))
        require_samples(at_feed, machine.dt)
        stages.tell("programmed feed", found=at_feed, segments=len(toolpath), dt=machine.dt)
        made = self.plan_best(Job(program=program, machine=machine, toolpath=toolpath, stages=stages))
        if (lost := _out_of_step(made)) is not None:  # it would be no thread
            return _not_delivered(
                made, f"{lost.fault()}: the feed is reached behind the run-in; {self._in_step(made)}"
            )
        making, made = made.making, dataclasses.replace(made, making=None)
        if making is None or making.pricing is None:
            return made
        with stages.stage("report"):
            return dataclasses.replace(made, prices=making.pricing())

    def plan_best(self, job: Job) -> Plan:
        """The plan of a job; on a machine with filters the fastest of those that are tried (`ways`)."""
        best = self.plan_within_periods(job)
        if job.machine.fir is None or not best.solved:
            return best
        if self.measures_filters and FILTERS not in job.slowed_by and _passed(best):
            return best  # with less of the tolerance for the path it would not be faster
        for share, seen in self.ways:
            shared = job.with_share(share, seen, curved=self.measures_filters)
            made = self.plan_within_periods(_faster_than(best, shared))
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
        """Plan a job such that the chords between its samples keep the tolerance too (delivery/periods.py).

        A motion that takes longer than `job.most` is not planned again: with less tolerance it would hardly be faster.
        """
        made = self.plan_job(job)
        if made.verdict is None or (made.verdict.passed and (_inside(made) or not self.keeps_tolerance)):
            return made
        return faster(self._planned_again(job, made), _slower_in_places(made))

    def _planned_again(self, job: Job, made: Plan) -> Plan:
        """The plan with the runs that leave the tolerance planned by themselves, or with less tolerance."""
        if (alone := self._runs_alone(job, made)) is not None:
            return alone
        return self._with_less(made, job) if self.keeps_tolerance else made

    def _runs_alone(self, job: Job, made: Plan) -> Plan | None:
        """The plan with the runs on which its verdict finds something planned each by itself, and all others as they are; None where
        these are not few, or what comes of it does not pass."""
        machine, toolpath = job.real
        if made.making is None or made.verdict is None or machine.fir is not None or not self.keeps_tolerance:
            return None
        motion = made.making.motion
        stops = full_stops(job.toolpath)
        if len(stops) < 3 or isinstance(motion, ShapedMotion) or len(stops) != len(full_stops(toolpath)):
            return None
        runs, verdict = RunsInTime(motion, job), made.verdict
        parts = [runs.spliced(k) for k in range(len(stops) - 1)]
        left = set(range(len(parts)))
        for _ in range(ALONE_ROUNDS):
            edges = np.append(0.0, np.cumsum([part.lasting for part in parts]))
            broken = broken_runs(edges, verdict)
            left -= set(broken)
            if not broken or len(left) < (1.0 - ALONE_MOST) * len(parts):
                return None
            for k in broken:
                of_run = job_of_run(job, int(stops[k]), int(stops[k + 1]))
                plan = self.plan_within_periods(of_run)
                if plan.making is None or not _passed(plan):
                    return None
                own = plan.making.motion
                parts[k] = SplicedRun(motion=own, begin=0.0, end=own.end)
            jerk = made.verdict.limits.get(JERK.called(toolpath.axes[0]))
            not_limited = () if jerk is None or jerk.limited else ("jerk",)
            whole = Spliced(runs=tuple(parts))
            again = job.deliver(whole, not_limited)
            verdict, found = again.verdict, again.trajectory.cycle_time
            job.tell("runs alone", found=found, before=made.cycle_time, runs=len(parts) - len(left))
            if verdict.passed:
                grid = made.grid
                if grid is not None:
                    grid = dataclasses.replace(grid, t=np.interp(grid.t, runs.edges(), whole.begin))
                return made.delivering(again, grid=grid)
        return None

    def _with_less(self, made: Plan, job: Job) -> Plan:
        """The plan made again with less and less tolerance until chords between samples keep it, as long as it takes no longer than
        `job.most`."""
        given, planned, (machine, programmed) = job, job.toolpath, job.real
        before, times = np.nan, 1.0
        for again in range(1, PERIOD_ROUNDS + 1):
            if made.making is None or _inside(made) or made.cycle_time > job.most:
                break
            with job.stage("geometry"):
                near, far = periods.missed(made.making.motion, programmed, machine.dt)
                same = abs(made.cycle_time - before) <= SAME_TIME * made.cycle_time
                times = 2.0 * times if same else 1.0
                before = made.cycle_time
                beside = same or again > CORNER_ROUNDS
                less = periods.with_less_tolerance(planned, programmed, near, far, times, beside)
                if less is None and made.verdict is not None and (worst := _worst(made.verdict)) is not None:
                    times *= max(again - CORNER_ROUNDS, 1)
                    less = periods.with_less_inside(planned, programmed, *worst, far, times)
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
        said = _said(made, programmed, planned)
        making = made.making and made.making._replace(pricing=None)
        return dataclasses.replace(made, prices=None, making=making, notes=(*made.notes, said))

    def _in_step(self, made: Plan) -> str:
        """What to do about a thread that this method does not keep in step."""
        if getattr(self, "shaped", False):
            return "plan threads without --shaped"
        return f"plan threads by method {' or '.join(name for name in IN_STEP if name != made.method)}"

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


def _slower_in_places(plan: Plan) -> Plan:
    """The plan with its motion run slower where the verdict found something, if that is kept; else as it is."""
    slower = plan.making.slower if plan.making is not None else None
    return plan if slower is None else plan.delivering(slower)


def _faster_than(plan: Plan, job: Job) -> Job:
    """The job, of which only motions are asked for that take less time than the plan, if that passes."""
    return dataclasses.replace(job, most=min(job.most, plan.cycle_time)) if _passed(plan) else job


def _passed(plan: Plan) -> bool:
    """Whether there is a motion, and its verdict is passed."""
    return plan.trajectory is not None and plan.verdict is not None and plan.verdict.passed


def _out_of_step(plan: Plan) -> ThreadCheck | None:
    """The thread that is most out of step with the spindle; None where none is."""
    threads = plan.verdict.threads if plan.verdict is not None else ()
    bad = [thread for thread in threads if thread.broken]
    return max(bad, key=lambda thread: thread.ratio) if bad else None


def _not_delivered(plan: Plan, why: str) -> Plan:
    """The plan without its motion."""
    return dataclasses.replace(
        plan, status=Status.INFEASIBLE, sentence=why, trajectory=None, verdict=None, rounded=None, grid=None, prices=None, making=None
    )  # fmt: skip


def _time(plan: Plan) -> float:
    """Cycle time [s], NaN for a motion that does not pass."""
    return plan.cycle_time if _passed(plan) else np.nan


def _inside(made: Plan) -> bool:
    """True if the motion's samples and chords keep the tolerance, at corners (eq. 18) wherever the samples fall."""
    verdict = made.verdict
    return verdict is None or not (
        verdict.vertex.broken or verdict.contour.broken or verdict.corners.overdrawn.any()
    )


def _worst(verdict: Verdict) -> tuple[int, float] | None:
    """Where chords are most off in the judge's eyes: the NC line, and how far off as a share of the tolerance; None where they keep
    it. Eq. (18) bounds them by the curvature at the vertex, which can be more than any phase of the samples shows."""
    for check in (verdict.contour, verdict.vertex):
        if check.broken:
            return check.line, check.ratio
    corners = verdict.corners
    if not corners.overdrawn.any():
        return None
    at = int(corners.budget_ratio.argmax())
    return int(corners.line[at]), float(corners.budget_ratio[at])


def _said(made: Plan, programmed: Toolpath, planned: Toolpath) -> str:
    """What the period took from the corners, for the notes."""
    stops = (planned.joint == Joint.STOP) & (programmed.joint != Joint.STOP)
    less = (planned.tolerance < programmed.tolerance) & ~stops
    first = programmed.line[max(int(np.flatnonzero(stops | less)[0]) - 1, 0)]
    return (
        f"samples {made.machine.dt * 1e3:g} ms apart: {less.sum()} corners are planned with less of the tolerance, and "
        f"{stops.sum()} are full stops; the first is at the end of line {first}"
    )
