"""Runs of a motion that are planned each by itself, as jobs of one run, where the others stay as they are."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.parts import Spliced, SplicedRun
from planner.planning.job.by_run import RunsInTime, broken_runs, full_stops, job_of_run
from planner.planning.job.job import Job
from planner.planning.job.plan import Delivered, Plan

# So many runs are planned by themselves, and so often more those that the verdict finds something on.
ALONE_MOST, VERDICTS = 100, 3


class Alone(NamedTuple):
    """A motion that passes, or does so when it is run slower in places."""

    delivered: Delivered
    # (G+1,) when its runs begin, and its end, as it was delivered without standstills between samples [s]
    begin: FloatArray
    plans: dict[int, Plan]  # of the runs that are planned by themselves, by their number
    stays: frozenset[int]  # runs of the motion that is kept where there is no other
    notes: tuple[str, ...]  # what these gave up


def with_runs_alone(
    job: Job,
    parts: Sequence[list[SplicedRun] | None],
    planned: Callable[[Job], Plan],
    most: float,
    not_limited: tuple[str, ...] = (),
    kept: Callable[[], RunsInTime | None] = lambda: None,
) -> Alone | None:
    """The motion with those runs planned by themselves that have no parts, and then those on which the
    verdict finds something. Where these are more than `most` or all, or one of them does not pass, they are
    of the motion that is `kept`; None without one, and where the whole does not pass, not even slower in
    places: what is left at last is the motion with the least time when it is.

    parts   : of the motion, run by run between the job's full stops
    planned : plans a job of one run
    kept    : a motion that keeps all limits
    """
    stops, plans, stays = full_stops(job.toolpath), dict[int, Plan](), set[int]()
    runs = list(parts)
    new = [k for k, part in enumerate(runs) if part is None]
    least, slowed = np.inf, None
    for _ in range(VERDICTS):
        few = len(plans) + len(new) <= min(most, len(runs) - 1)
        for k in new:
            plan = planned(job_of_run(job, int(stops[k]), int(stops[k + 1]))) if few else None
            if plan and plan.making and plan.verdict and plan.verdict.passed:
                motion = plan.making.motion
                plans[k], runs[k] = plan, [SplicedRun(motion=motion, begin=0.0, end=motion.end)]
            elif (whole := kept()) is not None:
                stays.add(k)
                runs[k] = [whole.spliced(k)]
            else:
                return slowed
        made = job.deliver(Spliced(runs=tuple(part for of_run in runs for part in of_run or ())), not_limited)
        if plans:
            time, passed = made.trajectory.cycle_time, made.verdict.passed
            job.tell("runs alone", found=time, runs=len(plans), kept=passed)
        begin = np.cumsum([0.0, *(sum(part.lasting for part in of_run or ()) for of_run in runs)])
        noted = (note for plan in plans.values() if plan.making for note in plan.making.given_up)
        found = Alone(made, begin, dict(plans), frozenset(stays), tuple(dict.fromkeys(noted)))
        if made.verdict.passed:
            return found if made.trajectory.cycle_time <= least else slowed
        if made.slower is not None and (time := made.slower.trajectory.cycle_time) < least:
            least, slowed = time, found
        broken = broken_runs(begin, made.verdict)
        new = [k for k in broken if k not in plans and k not in stays]
        if len(new) < len(broken) or not new:
            break
    return slowed
