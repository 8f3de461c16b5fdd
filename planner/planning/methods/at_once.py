"""The search for geometry and feed together straight from the first splines: nothing is done that only a delivered start would need.

A motion on the first splines keeps its limits at the points of a coarse grid. That is no plan, but where the search leaves no step of
it nothing else is asked of it: it is not made slower where it exceeds a limit between grid points, not sampled at the interpolation
period, and not judged. A run of which anything would have to stay, or that does not pass the verdict, is planned by itself in another
way; all others are taken. Where that is more than half of the job, or there are too many such runs, there is no plan from here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.feedrate.solution import Status
from planner.joint.parts import FoundRun, parts_of
from planner.joint.run import tube_runs_of
from planner.joint.splice import Spliced, SplicedRun
from planner.planning.job.by_run import broken_runs, job_of_run
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.methods.all_runs import searched_runs
from planner.planning.methods.free import Start, said, tabled
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.notes import path_notes
from planner.planning.optimal.on_path import OnPath
from planner.verifier import Verdict

# So many runs are planned by themselves at most, and so often once more those that the verdict finds something on.
ALONE_MOST, VERDICTS = 100, 3


class AtOnce(NamedTuple):
    """What the search finds from the first motion.

    plan  : None where it does not find enough of it, and where the motion has more steps than the effort is for
    steps : of the motion
    """

    plan: Plan | None
    steps: int


def searched_at_once(
    job: Job, settings: Settings, planned: OnPath, otherwise: Callable[[Job], Plan]
) -> AtOnce:
    """What the search finds from the first motion.

    job       : a searchable one (free.py)
    planned   : on the first splines (planning/optimal/loop.py, `first_motion`)
    otherwise : plans a job of one run, which the search does not find
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
    alone = _Alone(job, otherwise)
    made = None
    if found is not None and alone.planned(found, [k for k, one in enumerate(found) if not one.whole]):
        for _ in range(VERDICTS):
            motion = Spliced(runs=tuple(part for parts in alone.parts(found, start) for part in parts))
            made = job.deliver(motion)
            if made.verdict.passed or not alone.planned(found, alone.broken(found, start, made.verdict)):
                break
    if found is None or made is None:
        job.tell("search", steps=steps, of_runs=len(runs))
        return AtOnce(None, steps)
    trajectory, verdict = made.trajectory, made.verdict
    kept = sorted(alone.plans)
    facts = {"steps": steps, "alone": len(kept)}
    job.tell("search", found=trajectory.cycle_time, before=start.motion.end, kept=verdict.passed, **facts)
    if not verdict.passed or trajectory.cycle_time > job.line_stop_time:
        return AtOnce(None, steps)
    job.note(*path_notes(job.toolpath, planned))
    status, sentence = said(job, start, found, kept, "", "a path first, then its feed")
    plan = job.plan(
        made,
        method=settings.method,
        corner=settings.corner if isinstance(settings.corner, str) else settings.corner.name,
        solver=planned.solution.solver,
        status=status,
        sentence=sentence,
        grid_points=sum(len(one.steps.h) + 1 for one in found if one.steps is not None),
        tables=tabled(job, None, made, found, kept, {k: plan.grid for k, plan in alone.plans.items()}),
    )
    return AtOnce(plan, steps)


class _Alone:
    """Runs of a job that are planned each by itself.

    plans : by the number of the run
    """

    def __init__(self, job: Job, otherwise: Callable[[Job], Plan]):
        self.job, self._otherwise = job, otherwise
        self.plans: dict[int, Plan] = {}

    def planned(self, found: list[FoundRun], which: list[int]) -> bool:
        """Plan some of the runs, and put that into `found`; False where there are too many, or none that is not planned yet, or one
        does not pass."""
        new = [k for k in which if k not in self.plans]
        if len(which) > len(new) or len(self.plans) + len(new) > ALONE_MOST:
            return False
        for k in new:
            why = (
                found[k].sentence if not found[k].whole else "what was found there does not pass its verdict"
            )
            run = found[k].run
            part = job_of_run(self.job, int(run.first[0]), int(run.first[-1]))
            plan = self._otherwise(part)
            if plan.trajectory is None or plan.verdict is None or not plan.verdict.passed:
                return False
            self.job.note(*part.noted)
            self.plans[k], found[k] = plan, FoundRun(found[k].run, Status.ACCEPTABLE, why)
        return True

    def parts(self, found: list[FoundRun], start: Start) -> list[list[SplicedRun]]:
        """The parts of the motion along each run."""
        return [self._parts(k, one, start) for k, one in enumerate(found)]

    def _parts(self, k: int, one: FoundRun, start: Start) -> list[SplicedRun]:
        if k not in self.plans:
            return parts_of(self.job.toolpath, one, start.spliced(k))
        making = self.plans[k].making
        assert making is not None
        motion = making.motion
        return [SplicedRun(motion=motion, begin=0.0, end=motion.end)]

    def broken(self, found: list[FoundRun], start: Start, verdict: Verdict) -> list[int]:
        """The runs on which a verdict finds something at a known time."""
        lasting = [sum(part.lasting for part in parts) for parts in self.parts(found, start)]
        return broken_runs(np.append(0.0, np.cumsum(lasting)), verdict)
