"""Which of two plans is taken, and whether one passes."""

import dataclasses

import numpy as np

from planner.base.names import KINEMATIC, OPTIMAL
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.verifier import OF_CHORDS, Kind

IN_STEP = (OPTIMAL, KINEMATIC)  # methods for threads
# A plan that is faster by less is taken for the same motion without the grid's error: what limits it and what
# limits cost is what the other says of itself [-].
SAME_MOTION = 2e-3


def passed(plan: Plan) -> bool:
    """Whether there is a motion, and its verdict is passed."""
    return plan.trajectory is not None and plan.verdict is not None and plan.verdict.passed


def shown_time(plan: Plan) -> float:
    """Cycle time [s], NaN for a motion that does not pass."""
    return plan.cycle_time if passed(plan) else np.nan


def inside(made: Plan) -> bool:
    """True if samples and chords keep the tolerance, at corners (eq. 18) wherever the samples fall."""
    verdict = made.verdict
    return verdict is None or not (
        verdict.vertex.broken or verdict.contour.broken or verdict.corners.overdrawn.any()
    )


def faster(plan: Plan, other: Plan) -> Plan:
    """Of two plans the one that passed; if both did, the faster one; the first if they are equal."""
    if plan.trajectory is None or plan.verdict is None or other.trajectory is None or other.verdict is None:
        return plan
    if plan.verdict.passed != other.verdict.passed:
        return plan if plan.verdict.passed else other
    return other if other.trajectory.cycle_time < plan.trajectory.cycle_time else plan


def counted_time(plan: Plan | None) -> float:
    """Cycle time [s], inf unless the verdict is passed, or nothing but chords between samples stands against
    it: then the job is planned again with less tolerance (less_tolerance.py). Chords that leave the contour
    leave the exact path of G61 as well."""
    if plan is None or plan.trajectory is None or plan.verdict is None:
        return float("inf")
    kinds = plan.verdict.kinds
    chords = kinds <= OF_CHORDS | ({Kind.EXACT} if kinds & {Kind.CONTOUR, Kind.VERTEX} else set())
    return plan.trajectory.cycle_time if chords else float("inf")


def beside(best: Plan, slower: Plan, job: Job) -> Plan:
    """Of the best plan and one that passes as its motion was run slower in places the faster one; where the best does
    not pass, and may with less tolerance, it is kept, with the other beside it (`slower_in_places`)."""
    time, before = slower.cycle_time, counted_time(best)
    taken = time <= before
    job.tell(
        "compare", found=time, before=before, kept=taken, method=slower.method, corner=slower.corner or "none"
    )
    if taken or passed(best) or best.making is None:
        return slower if taken else best
    return dataclasses.replace(best, making=best.making._replace(instead=slower))


def better(best: Plan | None, rival: Plan, why: str, job: Job) -> Plan:
    """The rival if it takes less time, with the sentence `why`, else the best; named as that is."""
    time, before = counted_time(rival), counted_time(best)
    taken = best is None or time < before
    job.tell(
        "compare", found=time, before=before, kept=taken, method=rival.method, corner=rival.corner or "none"
    )
    if best is None or not taken:
        return rival if best is None else best
    said = f"{why}; {rival.sentence}"
    rival = dataclasses.replace(
        rival, method=best.method, corner=best.corner, sentence=said, timings=job.stages.timings
    )
    if before < (1.0 + SAME_MOTION) * time:
        making = rival.making and rival.making._replace(priced=best.making and best.making.priced)
        rival = dataclasses.replace(rival, prices=best.prices, making=making, grid=best.grid)
    return rival


def not_in_step(plan: Plan, *, shaped: bool) -> str | None:
    """Why a plan with a thread out of step with the spindle is not delivered; None where all are in step."""
    bad = [thread for thread in (plan.verdict.threads if plan.verdict else ()) if thread.broken]
    if not bad:
        return None
    fault = max(bad, key=lambda thread: thread.ratio).fault()
    return f"{fault}: the feed is reached behind the run-in; {thread_remedy(plan.method, shaped=shaped)}"


def thread_remedy(method: str, *, shaped: bool) -> str:
    """The action for a thread that a method does not keep in step."""
    others = " or ".join(name for name in IN_STEP if name != method)
    return "plan threads without --shaped" if shaped else f"plan threads by method {others}"
