"""The page: from a program to a verified plan, in the order in which it runs.

  path       the programmed path with its joints and tolerances, and the limits on it                       geometry/, machine/
  motion     the method's attempts, one after the other: each makes a motion and delivers it (job.py):
             slower where filters behind the setpoints ask for it, sampled, judged by the verifier          planning/attempts.py
  again      what the verdict finds: single runs planned by themselves (runs_alone.py), all of it with less
             tolerance (less_tolerance.py), or slower in places
  shares     on machines with filters: all of that once more with less of the tolerance for the path
  finish     what limits and tolerance cost                                                                 sensitivity/

Everything that is tried once more is in one table, `RETRIES` of benchmarks/net/ablation.py.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from planner.base.errors import InputError
from planner.feedrate.constraints.extruder import with_extruder_limit
from planner.feedrate.constraints.limits import JERK, TANGENTIAL, TANGENTIAL_JERK, Limits
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.timing import Motion, require_samples
from planner.nc.extents import travel_faults
from planner.nc.faults import require_none
from planner.nc.program import Program
from planner.planning.job.at_tip import LEFT_FREE_MOST, room_for_joints
from planner.planning.job.by_run import RunsInTime, broken_runs, full_stops
from planner.planning.job.choice import beside, faster, inside, not_in_step, passed, shown_time
from planner.planning.job.job import Job
from planner.planning.job.less_tolerance import with_less_tolerance
from planner.planning.job.plan import Plan
from planner.planning.job.runs_alone import with_runs_alone
from planner.planning.job.trace import Log, Progress, Stages
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.geometry import Laid
from planner.planning.optimal.on_path import OnPath
from planner.sensitivity.path_prices import path_prices

# Runs on which the verdict finds something are planned by themselves where they are no more of all [-].
ALONE_SHARE = 0.1
# Of motions in closed form less of the tolerance for the path may be faster (`Method.ways`).
CLOSED_FORM_WAYS = ((1.0, 0.5), (0.8, 0.35), (0.25, 0.35), (0.1, 0.25))


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


class Method(ABC):
    """A way to plan a job. Its repr is its row label in every table.

    ways    : for machines with filters: pairs (share of the tolerance, of filters' lengths in closed forms,
              `Job.with_share`), tried beside (1, 1); the fastest plan is taken
    measures_filters : whether filters slow it down only where it is measured to leave the tolerance
    in_motion        : whether its motions can begin and end in motion
    keeps_tangential : whether its motions keep the machine's limits of the tangential acceleration and jerk
    """

    ways: ClassVar[tuple[tuple[float, float], ...]] = ()
    measures_filters: ClassVar[bool] = False
    in_motion: ClassVar[bool] = False
    keeps_tangential: ClassVar[bool] = True

    @property
    def keeps_power(self) -> bool:
        """Whether its motions keep the limits of the drives' power."""
        return False

    @property
    def keeps_tolerance(self) -> bool:
        """Whether the method promises the tolerance; if not, its motion is delivered as it is."""
        return True

    @abstractmethod
    def plan_job(self, job: Job) -> Plan:
        """Plan a job whose toolpath is laid out. What a method has to provide."""

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
        log       : called with every step of the planning, e.g. a `Trace` (trace.py)

        Raises InputError for a program that cannot be planned, and for a limit that the method does not keep.
        An unsolved problem is the status of the plan.
        """
        job = job_of(program, machine, tolerance, Stages(progress, log))
        shaped = getattr(self, "shaped", False)
        if any(job.toolpath.speeds) and (not self.in_motion or shaped or machine.fir is not None):
            raise InputError(
                "a start or end speed is for methods optimal and second-order, on machines without filters [fir] and without shaped"
            )
        limits = Limits.of(machine, job.toolpath.axes)
        for limit, value in ((TANGENTIAL, limits.tangential), (TANGENTIAL_JERK, limits.tangential_jerk)):
            if np.isfinite(value) and not self.keeps_tangential:
                without_jerk = "second-order, " if limit is TANGENTIAL else ""
                raise InputError(
                    f"the machine limits the {limit.key.replace('_', ' ')} to {value:g} {limit.unit}, which {self!r} does not keep; "
                    f"plan with method optimal, {without_jerk}tube, bezier or stop, or leave {limit.key} out of the machine"
                )
        limited = np.isfinite(limits.power)
        if limited.any() and not self.keeps_power:
            letter = job.toolpath.axes[int(limited.argmax())]
            raise InputError(
                f"the machine limits the power of axis {letter} to {machine.axes[letter].power:g} W/kg, which {self!r} does not keep; "
                f"plan with method optimal or tube, or leave power out of [axes.{letter}]"
            )
        best = within_tolerance(job, self)
        for share, seen in self.ways if _filters_cost_time(best, job, self) else ():
            shared = job.with_share(share, seen, curved=self.measures_filters)
            made = within_tolerance(shared.faster_than(best.cycle_time if passed(best) else np.inf), self)
            before, best = best, faster(best, made)
            found, last = shown_time(made), shown_time(before)
            job.tell(
                "share of tolerance", found=found, before=last, kept=best is made, share=share, filters=seen
            )
        if (why := not_in_step(best, shaped=shaped)) is not None:
            return best.without_motion(why)
        return _finished(best, job)


def job_of(program: Program, machine: Machine, tolerance: float | None, stages: Stages) -> Job:
    """The job: path and limits. Raises InputError for a program that cannot be planned."""
    with stages.stage("geometry"):
        if not program.reading.ignore_travel:
            require_none(travel_faults(program, machine, program.text or b"")[0], program.source)
        toolpath = toolpath_from_program(program, machine, tolerance)
        if (fed := toolpath.extrusion) is not None:
            machine = with_extruder_limit(machine, toolpath.axes, fed.limits, fed.ratio, toolpath.block)
    # at the programmed feed, which no motion exceeds: some jobs can be refused before any work
    at_feed = float(np.sum(toolpath.length / toolpath.feed) + np.sum(toolpath.dwell))
    require_samples(at_feed, machine.dt)
    stages.tell("programmed feed", found=at_feed, segments=len(toolpath), dt=machine.dt)
    return _with_room(Job(program=program, machine=machine, toolpath=toolpath, stages=stages))


def _with_room(job: Job) -> Job:
    """The job with what the tip may leave its chords by taken off the tolerance (planning/job/at_tip.py); it is judged by all."""
    machine, toolpath = job.real
    off = room_for_joints(toolpath, machine)
    if not off:
        return job
    tolerance = np.maximum(toolpath.tolerance - off, (1.0 - LEFT_FREE_MOST) * toolpath.tolerance)
    return dataclasses.replace(
        job, toolpath=dataclasses.replace(toolpath, tolerance=tolerance), judged=(machine, toolpath)
    )


def _filters_cost_time(best: Plan, job: Job, method: Method) -> bool:
    """Whether filters make the plan slower, as far as is known: less tolerance for the path may be faster."""
    if job.machine.fir is None or best.making is None:
        return False
    return not method.measures_filters or not passed(best) or best.making.filtered


def within_tolerance(job: Job, method: Method) -> Plan:
    """The plan of a job, of which the chords between samples keep the tolerance too (delivery/periods.py).

    A motion that takes longer than `job.most` is not planned again.
    """
    made = method.plan_job(job)
    if made.verdict is None or (made.verdict.passed and (inside(made) or not method.keeps_tolerance)):
        return made
    again = made
    if method.keeps_tolerance:
        alone = _runs_alone(job, made, method)
        again = alone or made
        if not passed(again):
            again = faster(with_less_tolerance(job, made, method.plan_job), again.slower_in_places())
    return faster(again, made.slower_in_places())


def tolerant(run: Job, made: Plan, planned: Callable[[Job], Plan]) -> Plan:
    """The plan of a job of one run; with less tolerance, or slower in places, where it does not pass."""
    if made.verdict is None or made.verdict.passed:
        return made
    return faster(with_less_tolerance(run, made, planned), made.slower_in_places())


def best_of(attempts: tuple[Attempt, ...], job: Job, settings: Settings) -> Plan:
    """The plan of the attempts that apply, in turn; the last one makes a plan where there is none."""
    tried = Tried()
    for attempt in attempts:
        if attempt.applies(job, settings, tried):
            job.tell(attempt.name)
            tried = attempt.make(job, settings, tried)
    assert tried.plan is not None
    return tried.plan if tried.slower is None or tried.best is None else beside(tried.best, tried.slower, job)


def _runs_alone(job: Job, made: Plan, method: Method) -> Plan | None:
    """The plan with the runs on which its verdict finds something planned each by itself, and all others as
    they are; None where these are not few, or what comes of it does not pass, not even slower in places."""
    machine, toolpath = job.real
    making, verdict, stops = made.making, made.verdict, full_stops(job.toolpath)
    if (
        making is None
        or verdict is None
        or machine.fir is not None
        or isinstance(making.motion, ShapedMotion)
    ):
        return None
    if len(stops) < 3 or len(stops) != len(full_stops(toolpath)):
        return None
    runs = RunsInTime(making.motion, job)
    broken, few = broken_runs(runs.edges, verdict), ALONE_SHARE * (len(stops) - 1)
    if not 0 < len(broken) <= few:
        return None
    parts = [None if k in broken else [runs.spliced(k)] for k in range(len(stops) - 1)]
    jerk = verdict.limits.get(JERK.called(toolpath.axes[0]))
    not_limited = () if jerk is None or jerk.limited else ("jerk",)
    found = with_runs_alone(job, parts, lambda of_run: within_tolerance(of_run, method), few, not_limited)
    if found is None:
        return None
    grid = made.grid
    if grid is not None:
        grid = dataclasses.replace(grid, t=np.interp(grid.t, runs.edges, found.begin))
    return made.delivering(found.delivered, grid=grid, notes=(*made.notes, *found.notes))


def _finished(best: Plan, job: Job) -> Plan:
    """The plan with what its limits cost, and without what only planning needs."""
    priced = best.making and best.making.priced
    best = dataclasses.replace(best, making=None)
    if not priced:
        return best
    with job.stage("report"):
        prices = path_prices(priced.samples, priced.problem, priced.solution, job.machine)
        return dataclasses.replace(best, prices=prices)
