"""Where the joint search begins: a motion, and the steps into which it is cut along each run."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.guess import DEFAULT_CUT, Cut, Guess, guesses_from
from planner.joint.run import TubeRun
from planner.motion.timing import MotionInTime
from planner.planning.job.by_run import RunsInTime
from planner.planning.job.job import Job

# Times nearer to each other than this share of a leg's mean time are one [-].
LEAST_APART = 1e-6
TOGETHER = 1000  # legs of short runs that are cut together: what is known of their steps stays in a processor's cache


class Start(RunsInTime):
    """A motion from which the search begins, and where in it the runs are.

    guesses : the motion along each run, cut into steps as finely as `cut` says
    """

    def __init__(self, motion: MotionInTime, job: Job, runs: Sequence[TubeRun], cut: Cut = DEFAULT_CUT):
        super().__init__(motion, job)
        size = np.cumsum([len(run) for run in runs])
        edges = np.searchsorted(size, np.arange(0, size[-1], TOGETHER), side="right")
        parts = [runs[begin:end] for begin, end in pairwise([*np.unique(edges).tolist(), len(runs)])]
        first = np.cumsum([0, *map(len, parts)]).tolist()
        self.guesses = [
            guess for at, part in zip(first, parts, strict=False) for guess in self.cut(at, part, cut)
        ]

    def forget(self) -> None:
        """Let go of what only a search needs: half a kilobyte a step."""
        self.guesses.clear()
        vars(self).pop("seen", None)

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
