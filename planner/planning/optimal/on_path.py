"""The time-optimal motion on a path: what its stages (path_motion.py) hand to each other."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.budget import NORMAL
from planner.corners.smooth import SmoothPath
from planner.feedrate.constraints.limits import FILTER_ERROR
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.samples import PathSamples
from planner.feedrate.solution import FeedrateSolution
from planner.motion.timing import Motion, law_of_solution
from planner.planning.optimal.geometry import Laid
from planner.smoothing.spline_path import SplineShape


@dataclass(frozen=True, eq=False, kw_only=True)
class OnPath:
    """A smooth path and the time-optimal motion on it."""

    path: SmoothPath  # rounded corners or splines
    samples: PathSamples  # its grid
    problem: FeedrateProblem  # the feedrate problem on the grid
    solution: FeedrateSolution  # the motion, or the status of a failure
    # what the path's splines are made of, if it has some
    shape: SplineShape | None = None
    laid: Laid | None = None  # these as they were laid, with the path under them, for who lays no others
    notes: tuple[str, ...] = ()  # sentences on what was given up

    def faster_than(self, other: OnPath) -> bool:
        """True if this motion was found and takes less time than another that was found."""
        return self.solution.solved and self.solution.cycle_time < other.solution.cycle_time

    def held_by_filters(self) -> OnPath:
        """The same, its normal acceleration named after the filters, for which alone it is limited."""
        problem = self.problem
        names = tuple(FILTER_ERROR.name if name == NORMAL else name for name in problem.bound_names)
        first = np.array([names.index(name) for name in names])
        problem = dataclasses.replace(problem, bound_names=names, feed_sq_bound=first[problem.feed_sq_bound])
        return dataclasses.replace(self, problem=problem)

    def without_prices(self) -> OnPath:
        """The same without what the solver knows of prices, 150 bytes a point."""
        return dataclasses.replace(self, solution=dataclasses.replace(self.solution, multipliers=None))

    def motion(self) -> Motion:
        """The motion in time; the problem must be solved."""
        return Motion(samples=self.samples, law=law_of_solution(self.samples, self.solution))

    def stop_to_stop(self) -> FloatArray:
        """(G,) time between full stops [s]."""
        return np.add.reduceat(self.solution.duration, self.samples.piece[:-1])
