"""Where the joint search begins: a motion, and the steps into which it is cut along each run."""

import dataclasses

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.guess import DEFAULT_CUT, Cut, Guess, guess_from
from planner.joint.run import TubeRun
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory
from planner.planning.job.by_run import RunsInTime
from planner.planning.job.job import Job

# Times nearer to each other than this share of a leg's mean time are one [-].
LEAST_APART = 1e-6


class Start(RunsInTime):
    """A motion from which the search begins, and where in it the runs are.

    cut : how finely it is cut into steps
    """

    def __init__(self, motion: MotionInTime, job: Job, cut: Cut = DEFAULT_CUT):
        super().__init__(motion, job)
        self.cut = cut
        self._guesses: dict[int, Guess] = {}

    def forget(self) -> None:
        """Let go of what only a search needs: half a kilobyte a step."""
        self._guesses.clear()
        vars(self).pop("seen", None)

    def guess(self, k: int, run: TubeRun) -> Guess:
        """The motion along run k, cut into steps."""
        if k not in self._guesses:
            self._guesses[k] = self.guess_in(k, run, self.cut)
        return self._guesses[k]

    def guess_in(self, k: int, run: TubeRun, cut: Cut) -> Guess:
        """The motion along run k, cut into steps; exact at the nodes, so that parts of it can stay."""
        guess = guess_from(run, *self.window(k, run), cut)
        inner = self.departure[k] + np.cumsum(guess.h[:-1])
        seen = self.motion.at(inner, 1.0)
        state = guess.state.copy()
        for m, name in enumerate(("position", "velocity", "acceleration")):
            state[1:-1, m] = getattr(seen, name)[:, run.axis]
        return dataclasses.replace(guess, state=state)

    def window(self, k: int, run: TubeRun) -> tuple[Trajectory, FloatArray]:
        """The motion along run k, and when it passes the run's vertices (R+1,) [s]."""
        begin, end = self.departure[k], self.arrival[k + 1]
        inside = np.searchsorted(self.seen.t, [begin, end])
        window = slice(inside[0], inside[1] + 1)
        columns = {name: getattr(self.seen, name)[window] for name in self.seen.columns}
        along = dataclasses.replace(self.seen, **columns)
        t = np.clip(self.times[run.first], begin, end)
        t[[0, -1]] = begin, end
        # Blocks whose ends the motion is nearest to at the same time share the time of their neighbours.
        apart = LEAST_APART * (end - begin) / len(run)
        seen = np.append(True, np.diff(t) > apart)
        seen[1:] &= t[1:] < end - apart
        seen[-1] = True
        return along, np.interp(run.offset, run.offset[seen], t[seen])
