"""Plans that may be faster than the time-optimal motion on splines and Bezier corners.

A smooth path is not always the fastest. If every corner is sharp and the legs are short, a stop at each corner needs no tolerance and
no grid. Other corner shapes use the tolerance in another way. And if a plan fails its verdict at a long interpolation period, another
plan may pass.

stop         its time is known before it is planned, as the sum of closed forms over the blocks; lines that go straight on are one
kinematic    in closed form too: it is planned, and delivered where it takes less time
fir corners  their time without jerk limits on a coarse grid is a lower bound; if that is short enough, their time with jerk limits on a
             coarse grid is an upper bound, to the share `CHANCE`

Beyond `RIVAL_POINTS` blocks `kinematic` is planned only if nothing passes, and beyond as many grid points fir corners are not.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np

from planner.base.sizes import SIZES
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import RESOLUTION
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.job.trace import Tell
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.optimal.compare_corners import corner_bounds
from planner.planning.optimal.geometry import corner_shape
from planner.planning.optimal.order import Order
from planner.verifier import OF_CHORDS, Kind

RIVAL_POINTS = SIZES.rivals_planned
RIVAL_ESTIMATE = 3 * RIVAL_POINTS  # by the closed form, which may say three times as many (tested)
FIR = "fir"  # the shape that is compared: "auto" has planned Bezier corners itself
# On a grid of so many times the usual resolution a jerk-limited motion takes up to 1.009 times as long as on the usual one (60 shapes
# on random jobs of benchmarks/jobs/random_lines.py): one that takes more than `CHANCE` times the best there is not the fastest [-].
COARSER, CHANCE = 25.0, 1.03
# A rival that is faster by less is taken for the same motion without the grid's error: what holds it and what limits cost is what the
# plan says of itself [-].
SAME_MOTION = 2e-3
FASTER = 1e-4  # less is the same time [-]: the solver's own gap


class Stopped:
    """The plan with full stops at the ends of all blocks, but of lines that go straight on, made when it is asked for; the least that
    it takes is known before."""

    def __init__(self, job: Job):
        self._job = job

    @cached_property
    def plan(self) -> Plan:
        """That plan, made when it is first asked for."""
        return StopMethod(join_lines=True).plan_job(self._job.afresh())

    def sooner_than(self, time: float) -> bool:
        """Whether it takes less time [s]."""
        return self._job.line_stop_time < time and counted_time(self.plan) < time


def with_closed_forms(best: Plan, job: Job, stopped: Stopped) -> Plan:
    """The plan, or full stops or method kinematic where that takes less time, or passes while the plan fails."""
    if stopped.sooner_than(min(counted_time(best), job.most)):
        best = better(best, stopped.plan, "full stops take less time", job.tell)
    most = min(counted_time(best), job.most)
    if len(job.toolpath) <= RIVAL_POINTS or most == np.inf:
        rival = KinematicMethod().plan_job(dataclasses.replace(job.afresh(), most=most))
        best = better(best, rival, "method kinematic takes less time", job.tell)
    return best


def fir_corners_may_be_faster(best: Plan, job: Job, order: Order) -> bool:
    """Whether a motion on fir corners has a chance to take less time than the plan."""
    dwell, most = float(job.toolpath.dwell.sum()), min(counted_time(best), job.most)
    with job.stage("geometry"):
        path = round_corners(
            job.toolpath, job.machine, corner_shape(FIR, job.machine, job.toolpath), blend_tangents=True
        )
    with job.stage("solve"):
        bounds = corner_bounds(path, job.machine, most=RIVAL_ESTIMATE)
    job.tell("bound on corners", found=bounds.time.sum() + dwell, corner=FIR, points=int(bounds.points.sum()))
    if bounds.points.sum() > RIVAL_POINTS or bounds.time.sum() + dwell >= most:
        return False
    coarse = order.solve(path, job, COARSER * RESOLUTION).solution
    return coarse.solved and coarse.cycle_time + dwell < CHANCE * most


def counted_time(plan: Plan) -> float:
    """Cycle time [s], inf unless the verdict is passed, or nothing but chords between samples stands against it: then the job is
    planned again with less tolerance (delivery/periods.py). Chords that leave the contour leave the exact path of G61 as well."""
    if plan.trajectory is None or plan.verdict is None:
        return float("inf")
    kinds = plan.verdict.kinds
    chords = kinds <= OF_CHORDS | ({Kind.EXACT} if kinds & {Kind.CONTOUR, Kind.VERTEX} else set())
    return plan.trajectory.cycle_time if chords else float("inf")


def better(best: Plan, rival: Plan, why: str, tell: Tell) -> Plan:
    """The rival if it takes less time, with the sentence `why`, else the best."""
    kept = counted_time(rival) < (1.0 - FASTER) * counted_time(best)
    tell(
        "compare",
        found=counted_time(rival),
        before=counted_time(best),
        kept=kept,
        method=rival.method,
        corner=rival.corner or "none",
    )
    if kept:
        return dataclasses.replace(rival, sentence=f"{why} than splines; {rival.sentence}")
    return best
