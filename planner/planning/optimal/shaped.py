"""Setpoints that leave the machine's vibration modes at rest: planned for a shaper, and delivered behind it.

The delivered motion D is the mean of delayed copies of a planned motion p (planner/motion/shaping.py). D has
to keep the limits and the tolerance; p does not. It follows that:

* The copies of one mode are half a period apart. Where p accelerates for less than that, D has half of its
  acceleration and jerk, so p may be planned with up to twice the limits.
* D cuts corners on which p moves. A sharp corner costs least time if p stops there for a moment, shorter than
  the shaper (paper 000's overlap of two moves): p stops at every corner that turns by more than an angle,
  with the shortest rest that is enough, and at full stops of the program for the whole length of the shaper.
* D cuts curves off by up to half of the normal acceleration of p times the variance of the shaper's delays,
  so that is limited. Where D turns in less time than the shaper is long it is nearer: there a faster p is
  better.
* Where D exceeds something nevertheless, p gets smaller limits in those places, at the times of all copies,
  and is solved again; what remains then is removed by slowing down runs of p (settling.py).

A shaper that takes little of the tolerance is for the joint search what filters of its variance are: p keeps
the limits as they are, so D does, and stops at no corner (`_searched`). Where it may take `SEARCHED` times
the tolerance p is planned by `CANDIDATES` as well, of which the fastest D is taken, or the one with the
limits as they are, stops at all corners and rests of the whole length, which along straight blocks keeps
everything. Its least time is known beforehand; it is planned when another one takes longer than that.
"""

import dataclasses
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.errors import InputError, NotSolvedError
from planner.corners.budget import normal_anywhere, with_less_normal
from planner.feedrate.solution import Status
from planner.geometry.build import COLLINEAR_ANGLE
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Fir, Machine
from planner.motion.shaping import ShapedMotion, Shaper, shaper_of
from planner.motion.timing import Motion
from planner.planning.attempts import ATTEMPTS
from planner.planning.job.by_run import RunsInTime
from planner.planning.job.choice import counted_time, faster, passed
from planner.planning.job.job import BOLDER, Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.path_motion import plan_of_solution, time_optimal
from planner.planning.optimal.settling import Settling
from planner.planning.page import Tried, tolerant

# Corners that turn by more are stops of p [rad].
SHARP = float(np.deg2rad(20.0))
# What the shaper may take of the tolerance at the largest acceleration for p to be planned in other ways too,
# at least, and to be searched, at most [-] (`python -m benchmarks.net.ablation ROWS --net NET --without
# SEARCHED`, or NOT_SEARCHED).
SEARCHED, NOT_SEARCHED = 1.0, 10.0


class Candidate(NamedTuple):
    """How p is planned: with stops at corners that turn by more than `sharp` [rad], `more` times the
    accelerations and jerks [-], and a `share` of the tolerance for its path [-]; the rest is for the shaper.
    With `curved` p takes curves at no more than `BOLDER` times the acceleration with which the shaper cuts
    them off by that."""

    sharp: float
    more: float
    share: float
    curved: bool


# The first is the gentlest: what it finds ends most of the others early.
CANDIDATES = (
    Candidate(SHARP, 1.0, 0.02, True),
    Candidate(SHARP, 1.75, 0.05, True),
    Candidate(SHARP, 2.0, 0.25, True),
    Candidate(np.inf, 1.75, 0.5, True),
    Candidate(np.inf, 1.75, 0.5, False),
)
STOPPING = Candidate(COLLINEAR_ANGLE, 1.0, 0.5, False)


@dataclass(frozen=True, eq=False, kw_only=True)
class Shaped:
    """A planned motion p, what it comes from, and the delivered motion D."""

    planned: OnPath
    motion: Motion
    delivered: ShapedMotion
    sentence: str


def shaped(job: Job, settings: Settings, candidates: tuple[Candidate, ...] = CANDIDATES) -> Shaped | None:
    """The fastest shaped motion of the candidates, which are time-optimal with larger limits, a smaller
    tolerance and more stops, or the one with stops at all corners where that is faster; None if none of them
    takes less than `job.most`."""
    search = _Search(job, settings)
    seen: set[tuple[int, float, float, bool]] = set()
    for one in candidates:
        stops = int((_stopping(job.toolpath, one.sharp).joint == Joint.STOP).sum())
        if (stops, *one[1:]) not in seen:  # a corner is between the angles
            search.best = search.tried(job, one) or search.best
        seen.add((stops, *one[1:]))
    return search.fastest()


class _Search:
    """The fastest of the candidates so far, and the one with stops at all corners, made if asked for."""

    def __init__(self, job: Job, settings: Settings):
        self.job, self.settings, self.shaper = job, settings, shaper_of(job.machine.modes)
        self.best: Shaped | None = None
        self._stopping = dataclasses.replace(job, toolpath=_stopping(job.toolpath, STOPPING.sharp))
        stops = int((self._stopping.toolpath.joint[1:] == Joint.STOP).sum())
        self._least = job.line_stop_time + self.shaper.length * stops

    def useless(self, time: float) -> bool:
        """Whether a motion that takes so long [s] is no faster than what is there."""
        return time >= min(self.best.delivered.end if self.best else np.inf, self.job.most)

    def fastest(self) -> Shaped | None:
        """The best of the candidates, or the motion with stops at all corners where that is faster."""
        if self.useless(self._least):
            return self.best
        return self.tried(self._stopping, STOPPING) or self.best

    def tried(self, job: Job, one: Candidate) -> Shaped | None:
        """The shaped motion of a job by one candidate; None if it is useless."""
        toolpath = _stopping(job.toolpath, one.sharp)
        toolpath = dataclasses.replace(toolpath, tolerance=one.share * toolpath.tolerance)
        machine = _faster(job.machine, one.more)
        if one.curved:
            # of the largest tolerance: where it is smaller, settling measures what is left to do
            rest = (1.0 - one.share) * float(job.toolpath.tolerance.max())
            machine = with_less_normal(machine, BOLDER * rest / (self.shaper.variance / 2.0))
        candidate = dataclasses.replace(job, machine=machine, toolpath=toolpath)
        try:
            planned = time_optimal(candidate, self.settings)
        except NotSolvedError:  # no grid follows the path
            return None
        if not planned.solution.solved:
            return None
        if machine.normal_acceleration != job.machine.normal_acceleration:
            planned = planned.held_by_filters()
        made = Settling(job, self.shaper, self.settings.order, one.share).settled(planned, self.useless)
        stops = int((toolpath.joint == Joint.STOP).sum())
        job.tell(
            "shaped",
            found=made[2].end if made else np.nan,
            before=self.best.delivered.end if self.best else np.inf,
            kept=made is not None,
            stops=stops,
            limits=one.more,
            share=one.share,
            curved=one.curved,
        )
        said = f"{_said(job, self.shaper)} with {one.more:g} times the accelerations and {stops - 2} stops"
        return Shaped(planned=made[0], motion=made[1], delivered=made[2], sentence=said) if made else None


def _stopping(toolpath: Toolpath, sharp: float) -> Toolpath:
    """The path with stops at corners that turn by more [rad]."""
    return toolpath.with_joints(np.flatnonzero(toolpath.theta > sharp), Joint.STOP)


def _faster(machine: Machine, by: float) -> Machine:
    axes = {
        letter: axis.model_copy(update={"acceleration": by * axis.acceleration, "jerk": by * axis.jerk})
        for letter, axis in machine.axes.items()
    }
    return machine.model_copy(update={"axes": axes})


def shaped_plan(job: Job, settings: Settings) -> Plan:
    """The plan of a job with shaped setpoints. Raises InputError for a machine without vibration modes."""
    if not job.machine.modes:
        raise InputError(
            f"machine '{job.machine.name}' has no vibration modes to shape setpoints for; give it tables [[modes]] with frequency "
            "and damping"
        )
    shaper = shaper_of(job.machine.modes)
    takes = (
        shaper.variance / 2.0 * normal_anywhere(job.machine, job.toolpath.axes) / job.toolpath.tolerance.max()
    )
    best = _searched(job, settings) if takes <= NOT_SEARCHED else None
    if best is None or not passed(best):
        return _in_other_ways(job, settings)
    if takes <= SEARCHED:
        return best
    rest = job.faster_than(best.cycle_time)
    other = tolerant(rest, _in_other_ways(rest, settings), lambda less: _in_other_ways(less, settings))
    return faster(best, other)


def _in_other_ways(job: Job, settings: Settings) -> Plan:
    """The plan of the fastest candidate; of the gentlest where only that passes."""
    plan = _plan_of(job, settings, shaped(job, settings))
    if plan.verdict is None or counted_time(plan) < np.inf:
        return plan
    # slower is not gentler behind a shaper, whose copies then meet elsewhere; with limits as they are D is
    gentle = _plan_of(job, settings, shaped(job, settings, CANDIDATES[:1]))
    kept = counted_time(gentle) < np.inf
    job.tell(
        "shaped, limits as they are",
        found=gentle.cycle_time if gentle.solved else np.nan,
        before=plan.cycle_time,
        kept=kept,
    )
    return gentle if kept else plan


def _searched(job: Job, settings: Settings) -> Plan | None:
    """The plan whose p is found by the joint search, with less of the tolerance where that is left; None
    where there is no search, or it finds none."""
    made = _search(job, settings)
    return made and tolerant(job, made, lambda less: _search(less, settings) or made)


def _search(job: Job, settings: Settings) -> Plan | None:
    """The plan with p of the joint search, to which the shaper is a moving average of the same variance,
    standing for its length where the program stops."""
    shaper, fir, search = shaper_of(job.machine.modes), job.machine.fir, ATTEMPTS[0]
    lengths = (*(fir.time_constants if fir else ()), float(np.sqrt(12.0 * shaper.variance)))
    filters = Fir(time_constants=lengths, phase_lag_max=fir.phase_lag_max if fir else None)
    machine = job.machine.model_copy(update={"fir": filters, "modes": ()})
    planned = dataclasses.replace(job, machine=machine, judged=(machine, job.real[1]))
    p = search.make(planned, settings, Tried()).best if search.applies(planned, settings, Tried()) else None
    if p is None or p.making is None:
        return None
    motion = p.making.motion
    stops = RunsInTime(motion, job).arrival[1:-1]
    if len(stops):
        motion = motion.waiting(stops, np.full(len(stops), shaper.length))
    made = job.deliver(ShapedMotion(motion, shaper), settings.not_limited)
    job.tell("shaped", found=made.trajectory.cycle_time, before=p.cycle_time, kept=made.verdict.passed)
    return job.plan(
        made._replace(filtered=True), method=settings.method, corner=settings.corner_name, solver=p.solver, status=p.status,
        sentence=f"{p.sentence}; {_said(job, shaper)}", grid_points=p.grid_points, notes=p.making.given_up,
    )  # fmt: skip


def _said(job: Job, shaper: Shaper) -> str:
    return f"shaped for {len(job.machine.modes)} vibration modes, {1e3 * shaper.length:.4g} ms longer than what was planned"


def _plan_of(job: Job, settings: Settings, found: Shaped | None) -> Plan:
    """The candidate, delivered and judged."""
    if found is None:
        none = "no motion was found that keeps limits and tolerance behind the shaper; plan without --shaped"
        return job.unsolved(settings.method, Status.NUMERICAL_ERROR, none)
    # D is measured behind filters (settling.py), and p is made slower for it
    made = job.deliver(found.delivered, settings.not_limited)._replace(filtered=True)
    plan = plan_of_solution(job, found.planned, made, settings)
    return dataclasses.replace(plan, sentence=f"{plan.sentence}; {found.sentence}")
