"""The search for geometry and feed together from a plan that could be delivered: what it does not find stays as it is planned."""

from __future__ import annotations

from typing import NamedTuple

from planner.joint.parts import FoundRun
from planner.joint.run import tube_runs_of
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.methods.all_runs import searched_runs
from planner.planning.methods.free import Start, delivered, said, tabled
from planner.planning.optimal.effort import Search
from planner.sensitivity.records import Making


class Freed(NamedTuple):
    """A plan after the search.

    kept : share of the time on which the motion from which it began stays [-]; 1 where there was no search
    """

    plan: Plan
    kept: float


def freed(job: Job, plan: Plan, dial: Search) -> Freed:
    """The plan with a faster motion near its own where one is found (joint/own.py), else the plan.

    job  : a searchable one
    dial : how finely, and up to which size: a motion that has more steps of constant jerk is left as it is

    What holds the motion, and what limits cost, is told from the search (`tabled`).
    """
    if plan.trajectory is None or plan.making is None or plan.verdict is None or not plan.verdict.passed:
        return Freed(plan, 1.0)
    with job.stage("search") as report:
        runs = list(tube_runs_of(job.toolpath, job.machine))
        start = Start(plan.making.motion, job, dial.cut, plan)
        steps = sum(len(start.guess(k, run)) for k, run in enumerate(runs))
        if steps > dial.steps_max:
            job.tell("search", steps=steps, of=dial.steps_max)
            return Freed(plan, 1.0)
        found = searched_runs(runs, start, dial.of(steps), report, divide=True)
        assert found is not None  # as it divides windows that fail
    made, kept, why = delivered(job, start, found)
    better = made.trajectory is not plan.trajectory
    share = _share_kept(start, found, kept) if better else 1.0
    time = made.trajectory.cycle_time
    job.tell("search", found=time, before=plan.trajectory.cycle_time, kept=better, steps=steps)
    if not better:
        return Freed(plan, share)
    tables = tabled(job, plan, made, found, kept)
    faster = plan.delivering(
        made,
        rounded=None,
        grid=tables.grid,
        prices=tables.prices,
        making=Making(made.motion, made.slower, tables.pricing),
        grid_points=sum(len(one.steps.h) + 1 for one in found if one.steps is not None),
        sentence=said(job, start, found, kept, why, "a path first, then its feed")[1],
        notes=(*plan.notes, *(note for note in job.noted if note not in plan.notes)),
        timings=job.stages.timings,
    )
    return Freed(faster, share)


def _share_kept(start: Start, found: list[FoundRun], kept: list[int]) -> float:
    """Share of the time on which the start's motion stays [-]."""
    stays = 0.0
    for k, one in enumerate(found):
        if one.run.left:  # there is nothing to be found
            continue
        if k in kept or one.steps is None:
            stays += start.lasting(k)
        elif one.kept is not None:
            stays += float(one.steps.h[one.kept].sum())
    return stays / sum(start.lasting(k) for k in range(len(found)))
