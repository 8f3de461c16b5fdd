"""A job run by run, between full stops of the program: where runs are in a motion, and their jobs."""

import dataclasses
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Joint, Toolpath
from planner.joint.parts import SplicedRun
from planner.motion.timing import MotionInTime, in_chunks
from planner.motion.trajectory import joined
from planner.motion.vertex_times import passing_times, standstills
from planner.planning.job.job import Job
from planner.verifier import Verdict

# A motion is sampled at this fraction of a/j, an axis' time for its acceleration [-], or so often in all.
PERIOD, SAMPLES = 0.02, 200_000


class RunsInTime:
    """Where in a motion the runs of its job are.

    seen               : samples of the motion, so near to each other that between them it runs straight
    times              : (M+1,) when it passes the joints [s]
    arrival, departure : (G+1,) when it comes to rest at the full stops, and when it leaves them [s]
    """

    def __init__(self, motion: MotionInTime, job: Job):
        acceleration, jerk = (job.machine.limits(q, job.toolpath.axes) for q in ("acceleration", "jerk"))
        period = max(PERIOD * float((acceleration / jerk).min()), motion.end / SAMPLES)
        even = np.arange(0.0, motion.end, period)
        edges = np.append(motion.t, motion.end)
        self.motion = motion
        self.seen = joined(list(in_chunks(motion, period, np.concatenate([even, edges]))))
        self.times = passing_times(self.seen, job.toolpath)
        self.arrival, self.departure = standstills(self.seen, job.toolpath, self.times)

    def lasting(self, k: int) -> float:
        """Time along run k [s]."""
        return float(self.arrival[k + 1] - self.departure[k])

    def spliced(self, k: int) -> SplicedRun:
        """The motion along run k, with the standstill before it, and the one at the end of the job."""
        begin, end = self.edges[k : k + 2].tolist()
        return SplicedRun(motion=self.motion, begin=begin, end=end)

    @cached_property
    def edges(self) -> FloatArray:
        """(G+1,) when the standstill before each run begins, and the end of the motion [s]."""
        return np.concatenate([[0.0], self.arrival[1:-1], [self.motion.end]])


def broken_runs(edges: FloatArray, verdict: Verdict) -> list[int]:
    """The runs between the times `edges` (G+1,) [s] on which a verdict finds something at a known time."""
    at = np.array([[each.begin, each.end] for each in verdict.excesses]).reshape(-1, 2)
    first, last = np.clip(np.searchsorted(edges[1:], at), 0, len(edges) - 2).T
    return sorted({k for a, b in zip(first.tolist(), last.tolist(), strict=True) for k in range(a, b + 1)})


def full_stops(toolpath: Toolpath) -> Array:
    """(G+1,) the joints between which the G runs are."""
    return np.flatnonzero(toolpath.joint == Joint.STOP)


def job_of_run(job: Job, first: int, last: int) -> Job:
    """The job of the run between the full stops `first` and `last`, with the standstill before it."""

    def part(toolpath: Toolpath) -> Toolpath:
        kept = np.zeros(len(toolpath), bool)
        kept[first:last] = True
        # before the part is made: a full stop of the job need not be one of the path it is judged by
        of_run = toolpath.with_joints(np.array([first, last]), Joint.STOP)
        columns = {
            name: getattr(of_run, name)[first : last + 1].copy()
            for name in ("joint", "theta", "tolerance", "dwell")
        }
        if last < len(toolpath):  # what stands there belongs to the next run
            columns["dwell"][-1] = 0.0
        return dataclasses.replace(of_run.part(kept), **columns)

    machine, judged_by = job.real
    judged = None if job.judged is None else (machine, part(judged_by))
    return dataclasses.replace(job, toolpath=part(job.toolpath), judged=judged, most=np.inf)
