"""The attempts of methods `optimal` and `second-order` at a motion, in their order (planning/page.py).

The joint search ends where it ends from any start nearby, so it begins on splines with a motion that need not
be fit for delivery. Where it does not end it begins once more from one that is, which stays where it fails
again; where it cannot run, leaves something, or ends at more time than it began with, the motion on that
path is delivered.
"""

from __future__ import annotations

import dataclasses
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from planner.base.names import AUTO
from planner.base.sizes import SIZES
from planner.corners.budget import filters_count
from planner.feedrate.constraints.limits import Limits
from planner.feedrate.solution import Status
from planner.geometry.legs import legs_of
from planner.planning.job.choice import better, counted_time, faster
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.joint_start import between_leads, why_not, with_leads
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.path_motion import first_motion, kept_on_path, plan_on_path
from planner.planning.page import Attempt, Tried, best_of, tolerant

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.motion.timing import Motion
    from planner.planning.joint_search import Others
    from planner.planning.optimal.on_path import OnPath

# A motion of more steps than the second that takes no more than the first over what its feed asks for is not
# searched [-]: on 30,000 lines of dense chords that found nothing; on ten blocks it found 9e-4.
LEAST_LEFT, CHEAP = 1e-3, SIZES.searched_again
SAME_TIME = 1e-4  # less is the gap of the solvers [-]
# Steps that a motion has on a leg at least (joint/guess.py).
LEAST_STEPS = 2
SEARCHED_ONLY = "a start or an end in motion is for path and feed searched together: leave geometry, corner, solver and filters out"
KINEMATIC_MOST = SIZES.rivals_planned  # blocks; of more `kinematic` is planned only where nothing passes


def is_searched(job: Job, settings: Settings, tried: Tried | None = None) -> bool:
    """Whether the joint search knows all limits of the job, and the effort is for so many steps."""
    if not settings.joint:
        return False
    from planner.planning.joint_search import searchable  # other plans need not load what it uses

    if job.real[0].fir is not None and job.machine.fir != job.real[0].fir:  # a share of tolerance and filters
        return False
    known = searchable(job, jerk_limited=settings.order.jerk_limited)
    return known and _least_steps(job) <= settings.effort.search.steps_max


def _joint(job: Job, settings: Settings, tried: Tried) -> Tried:
    """The joint search from a motion on splines."""
    from planner.planning.joint_search import joint_plan

    led = with_leads(job)
    first, steps = first_motion(led, settings), _least_steps(job)
    if first is None:
        return Tried(steps=steps)
    if led is job and steps > CHEAP and first.solution.cycle_time < (1.0 + LEAST_LEFT) * _at_feed(job):
        job.tell("search", left=first.solution.cycle_time / _at_feed(job) - 1.0)
        return Tried(steps=steps, left=False, laid=first.laid)
    laid = first.laid if led is job else None
    kept = cache(partial(kept_on_path, settings=settings, laid=laid))
    planned, began = [dataclasses.replace(first, laid=None)], first.solution.cycle_time
    del first  # the search lets go of it
    found = joint_plan(job, settings, planned, settings.effort.search, _others(ALONE, settings, kept))
    joint = found.plan is not None
    tried = Tried(
        best=found.plan, kept=kept, joint=joint, steps=found.steps, slower=found.slower, began=began
    )
    return dataclasses.replace(tried, laid=None if joint else laid)


def _in_motion(job: Job, settings: Settings, tried: Tried) -> Tried:
    """The joint search of a path that begins or ends in motion; without a motion what can be said of it."""
    asked, led = is_searched(job, settings), with_leads(job)
    tried = _joint(job, settings, tried) if asked else tried
    if tried.plan is not None:
        return tried
    first = first_motion(led, settings) if asked else None
    why = SEARCHED_ONLY if first is None else why_not(between_leads(first.motion(), job, led), job)
    return dataclasses.replace(tried, best=job.unsolved(settings.method, Status.INFEASIBLE, why))


def _not_ended(job: Job, settings: Settings, tried: Tried) -> bool:
    """Whether the search of a small job has not ended; behind long filters the path is planned anyway."""
    small = tried.left and is_searched(job, settings) and settings.effort.search.of(tried.steps).again
    return small and tried.best is None and not filters_count(*job.real)


def _once_more(job: Job, settings: Settings, tried: Tried) -> Tried:
    """The joint search from a motion on splines that keeps its limits everywhere, and stays where that fails."""
    from planner.planning.joint_search import joint_plan

    kept = tried.kept or cache(partial(kept_on_path, settings=settings))
    path = kept(job)
    if path is None:
        return dataclasses.replace(tried, kept=None)
    others = _others(ON_PATH, settings, kept)
    found = joint_plan(job, settings, [path[0]], settings.effort.search, others, path[1])
    slower = min(filter(None, (tried.slower, found.slower)), key=counted_time, default=None)
    joint = found.plan is not None
    return dataclasses.replace(tried, best=found.plan, path=path, kept=None, joint=joint, slower=slower)


def _not_joint(job: Job, settings: Settings, tried: Tried) -> bool:
    """Whether there is no plan yet, not even one that is run slower in places, or the motion on the path takes less time, as
    far as it is known and the search was for the least, or may behind long filters."""
    if filters_count(*job.real) or tried.plan is None:
        return True
    before = tried.began if tried.path is None else tried.path[1].end
    sooner = before < (1.0 - SAME_TIME) * counted_time(tried.plan)
    return sooner and (tried.best is None or not settings.effort.search.smooth)


def _on_path(job: Job, settings: Settings, tried: Tried) -> Tried:
    """The motion on the path, delivered."""
    plan = plan_on_path(job, settings, tried.path, tried.laid)
    joint = tried.joint and tried.best is not None and faster(tried.best, plan) is tried.best
    best = plan if tried.best is None else faster(tried.best, plan)
    return dataclasses.replace(tried, best=best, path=None, joint=joint)


def _closed_form_may_be_faster(job: Job, settings: Settings, tried: Tried) -> bool:
    """Whether nothing passes, full stops take less time, which is known before, or there is only the motion
    on a path of a job that is not long."""
    if settings.corner != AUTO or (tried.joint and settings.effort.search.smooth):
        return False
    stops_sooner = job.line_stop_time < counted_time(tried.plan)
    only_on_path = (tried.best is not None and not tried.joint) or filters_count(*job.real)
    return stops_sooner or (only_on_path and len(job.toolpath) <= KINEMATIC_MOST)


def _closed_form(job: Job, settings: Settings, tried: Tried) -> Tried:
    """Method kinematic, and where it does not pass full stops at all blocks but lines that go straight on."""
    best = tried.plan
    limits = Limits.of(job.machine, job.toolpath.axes)
    if np.isinf([limits.tangential, limits.tangential_jerk]).all():  # which its corners do not keep
        rival = KinematicMethod().plan_job(job.faster_than(counted_time(best)))
        best = better(best, rival, "method kinematic takes less time", job)
    if job.line_stop_time < min(counted_time(best), job.most):
        rival = StopMethod(join_lines=True).plan_job(job.faster_than(counted_time(best)))
        best = better(best, rival, "full stops take less time", job)
    return dataclasses.replace(tried, best=best)


ATTEMPTS = (
    Attempt("joint search", is_searched, _joint),
    Attempt("search, once more", _not_ended, _once_more),
    Attempt("motion on the path", _not_joint, _on_path),
    Attempt("closed form", _closed_form_may_be_faster, _closed_form),
)
IN_MOTION = (Attempt("joint search", lambda job, settings, tried: True, _in_motion),)
# Of a run on which the joint search does not end: the first, and the second one.
ALONE, ON_PATH = ATTEMPTS[1:], ATTEMPTS[2:]


def attempts_at(job: Job) -> tuple[Attempt, ...]:
    """The attempts for a job: one alone makes motions that do not begin or do not end at rest."""
    return IN_MOTION if any(job.toolpath.speeds) else ATTEMPTS


def _others(
    attempts: tuple[Attempt, ...],
    settings: Settings,
    kept: Callable[[Job], tuple[OnPath, Motion] | None],
) -> Others:
    """What there is of runs that the search does not find: these attempts at each, with less tolerance or
    slower in places where that does not pass, and the motion on a path, `kept`."""
    from planner.planning.joint_search import Others

    def alone(run: Job) -> Plan:
        return tolerant(run, best_of(attempts, run, settings), partial(best_of, attempts, settings=settings))

    return Others(alone, kept)


def _least_steps(job: Job) -> int:
    return LEAST_STEPS * len(legs_of(job.toolpath).first)


def _at_feed(job: Job) -> float:
    """Time of the moves at their programmed feed [s]."""
    return float(np.sum(job.toolpath.length / job.toolpath.feed))
