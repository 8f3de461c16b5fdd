"""The search for geometry and feed together straight from the first splines: nothing is done that only a delivered start would need.

A motion on the first splines keeps its limits at the points of a coarse grid. That is no plan, but where the search leaves no step of
it nothing else is asked of it: it is not made slower where it exceeds a limit between grid points, not sampled at the interpolation
period, not judged, and not compared with other corners, which are slower than what is found (docs/joint.md). Where anything of it
would have to stay, or what is found does not pass its verdict, there is no plan from here.
"""

from __future__ import annotations

from typing import NamedTuple

from planner.job.job import Job
from planner.job.plan import Plan
from planner.methods.all_runs import searched_runs
from planner.methods.free import Start, said, tabled
from planner.optimal.loop import Settings
from planner.optimal.notes import path_notes
from planner.optimal.on_path import OnPath
from planner.tube.parts import parts_of
from planner.tube.run import tube_runs_of
from planner.tube.splice import Spliced, SplicedRun


class AtOnce(NamedTuple):
    """What the search finds from the first motion.

    plan  : None where it does not find all of it, and where the motion has more steps than the effort is for
    steps : of the motion
    """

    plan: Plan | None
    steps: int


def searched_at_once(job: Job, settings: Settings, planned: OnPath) -> AtOnce:
    """What the search finds from the first motion.

    job     : a searchable one (free.py)
    planned : on the first splines (optimal/loop.py, `first_motion`)
    """
    dial = settings.effort.search
    with job.stage("search") as report:
        start = Start(planned.motion(), job, dial.cut)
        runs = list(tube_runs_of(job.toolpath, job.machine))
        steps = sum(len(start.guess(k, run)) for k, run in enumerate(runs))
        most = dial.steps_max
        if steps > dial.small:  # no finer than what is delivered
            most = min(most, start.motion.end / job.machine.dt)
        if steps > most:
            job.tell("search", steps=steps, of=most)
            return AtOnce(None, steps)
        dial = dial.of(steps)
        found = searched_runs(runs, start, dial, report, divide=False)
        if found is None:
            job.tell("search", steps=steps, of_runs=len(runs))
            return AtOnce(None, steps)
        parts: list[SplicedRun] = []
        for k, one in enumerate(found):
            parts += parts_of(job.toolpath, one, start.spliced(k))
    made = job.deliver(Spliced(runs=tuple(parts)))
    trajectory, verdict = made
    job.tell("search", found=trajectory.cycle_time, before=start.motion.end, kept=verdict.passed, steps=steps)
    if not verdict.passed or trajectory.cycle_time > job.line_stop_time:
        return AtOnce(None, steps)
    job.note(*path_notes(job.toolpath, planned))
    status, sentence = said(job, start, found, [], "", "a path first, then its feed")
    plan = job.plan(
        made,
        method=settings.method,
        corner=settings.corner if isinstance(settings.corner, str) else settings.corner.name,
        solver=planned.solution.solver,
        status=status,
        sentence=sentence,
        grid_points=sum(len(one.steps.h) + 1 for one in found if one.steps is not None),
        tables=tabled(job, None, trajectory, found, []),
    )
    return AtOnce(plan, steps)
