"""Where the joint search begins: a motion, and the steps into which it is cut along each run; and what is said of paths that
begin or end in motion where it does not end.

The search itself begins and ends with any velocity (joint/guess.py); splines and the feed along them go from rest to
rest. So these are laid for a path with straight ways before and behind it, on which the feed is the speed asked for,
and of the motion along all of it what is between the two joints is cut out. If the path can be left, or reached, at
that speed, it passes there with it and hardly any acceleration; if it cannot, it is slower there, which tells how fast
it can be.
"""

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limits import Limits
from planner.joint.guess import DEFAULT_CUT, Cut, Guess, guesses_from
from planner.joint.parts import Spliced, SplicedRun
from planner.joint.run import TubeRun
from planner.motion.timing import MotionInTime
from planner.planning.job.by_run import RunsInTime
from planner.planning.job.job import Job

# Times nearer to each other than this share of a leg's mean time are one [-].
LEAST_APART = 1e-6
SLOWER = 1e-3  # a motion that passes an end slower by more tells that the speed is not to be had there [-]
TOGETHER = 1000  # legs of short runs that are cut together: what is known of their steps stays in a processor's cache


class Start(RunsInTime):
    """A motion from which the search begins, and where in it the runs are.

    guesses : the motion along each run, by its number, cut into steps as finely as `cut` says: who searches a run takes it
    end     : of the motion [s]
    """

    def __init__(self, motion: MotionInTime, job: Job, runs: Sequence[TubeRun], cut: Cut = DEFAULT_CUT):
        super().__init__(motion, job)
        size = np.cumsum([len(run) for run in runs])
        edges = np.searchsorted(size, np.arange(0, size[-1], TOGETHER), side="right")
        parts = pairwise([*np.unique(edges).tolist(), len(runs)])
        of_runs = (guess for lo, hi in parts for guess in self.cut(lo, runs[lo:hi], cut))
        self.guesses, self.end = dict(enumerate(of_runs)), motion.end

    def forget(self, *, stays: bool) -> None:
        """Let go of what only `cut` needs, of the motion too unless parts of it may stay: a quarter of a gigabyte for 250,000
        blocks."""
        for name in ["seen"] if stays else ["seen", "motion"]:
            vars(self).pop(name, None)

    def cut(self, first: int, runs: Sequence[TubeRun], cut: Cut) -> list[Guess]:
        """The motion along the runs from the first one on, cut into steps; exact at the nodes, so that parts of it can
        stay."""
        times = [self._passed(first + k, run) for k, run in enumerate(runs)]
        return guesses_from(runs, self.seen, times, cut, lambda t: self.motion.at(t, 1.0))

    def _passed(self, k: int, run: TubeRun) -> FloatArray:
        """(R+1,) when the motion passes the vertices of run k [s]."""
        begin, end = self.departure[k], self.arrival[k + 1]
        t = np.clip(self.times[run.first], begin, end)
        t[[0, -1]] = begin, end
        # Blocks whose ends the motion is nearest to at the same time share the time of their neighbours.
        apart = LEAST_APART * (end - begin) / len(run)
        seen = np.append(True, np.diff(t) > apart)
        seen[1:] &= t[1:] < end - apart
        seen[-1] = True
        return t if seen.all() else np.interp(run.offset, run.offset[seen], t[seen])


def with_leads(job: Job) -> Job:
    """The job with ways before and behind its path, twice as long as the ramps; itself where it is at rest at both ends."""
    toolpath = job.toolpath
    if not any(toolpath.speeds):
        return job
    limits = Limits.of(job.machine, toolpath.axes)
    lengths = []
    for speed, along in zip(
        toolpath.speeds, (toolpath.tangent_start[0], toolpath.tangent_end[-1]), strict=True
    ):
        with np.errstate(divide="ignore"):
            a, j = ((limit / np.abs(along)).min() for limit in (limits.acceleration, limits.jerk))
        a, j = min(a, limits.tangential), min(j, limits.tangential_jerk)
        lengths.append(float(speed * (speed / a + a / j)))  # a ramp lasts no longer than v/a + a/j
    return dataclasses.replace(job, toolpath=toolpath.with_leads((lengths[0], lengths[1])))


def between_leads(motion: MotionInTime, job: Job, led: Job) -> MotionInTime:
    """What a motion along the path of `led` does along that of the job."""
    if led is job:
        return motion
    times = RunsInTime(motion, led).times
    begin, end = (float(time) for time in np.clip(times[[1, -2]], 0.0, motion.end))
    begin = begin if job.toolpath.speeds[0] else 0.0
    end = end if job.toolpath.speeds[1] else motion.end
    return Spliced(
        runs=(SplicedRun(motion=motion, begin=begin, end=end, moving=job.toolpath.speeds[1] > 0.0),)
    )


def why_not(motion: MotionInTime, job: Job) -> str:
    """Why no motion was found that begins and ends as the job asks; motion: where the search began."""
    passed = motion.at(np.array([0.0, motion.end]), 1.0).feed
    for name, asked, found in zip(("start", "end"), job.toolpath.speeds, passed.tolist(), strict=True):
        if found < (1.0 - SLOWER) * asked:
            can = "left" if name == "start" else "reached"
            cannot = f"this path cannot be {can} so fast within the limits"
            return f"{name} speed {asked:g} mm/s: {cannot}: less than {found:.4g} mm/s is possible"
    return "no motion was found that begins and ends at these speeds; give the path more tolerance, or ask for less speed"
