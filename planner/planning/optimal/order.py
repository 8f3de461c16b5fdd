"""The feedrate problem on one path, with jerk limits or without, solved on a grid of its own.

The grid is made for the motion. With jerk limits the second-order problem is solved first, because it says
where straight legs need points (feedrate/grid.py). Without jerk limits the points where the profile switches
on straight legs are added and the problem is solved once more, so that every switch falls on a point.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from planner.corners.smooth import SmoothPath
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import add_switching_points, refine_for_jerk
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.solvers import ThirdOrderSolver
from planner.machine import Machine
from planner.planning.job.job import Job
from planner.planning.optimal.on_path import OnPath


@dataclass(frozen=True)
class Order(ABC):
    """Which limits a motion keeps, and the `solver` of the feed along a path for them."""

    solver: FeedrateSolver

    jerk_limited: ClassVar[bool]

    def solve(self, path: SmoothPath, job: Job, resolution: float) -> OnPath:
        """The time-optimal motion on a path, on a grid of that resolution (feedrate/sampling/samples.py); a
        failure is the status of its solution. Raises NotSolvedError where no grid follows the path."""
        with job.stage("geometry"):
            samples = [sample_path(path, job.machine, resolution, third_order=self.jerk_limited)]
        with job.stage("solve") as progress:  # on a grid of its own: this one is held by no name from here on
            planned = self._solved(path, samples.pop(), job.machine, progress)
        facts: dict[str, Any] = {"points": len(planned.samples), "runs": len(planned.samples.piece) - 1}
        facts["resolution"] = resolution
        if planned.solution.iterations:
            facts["iterations"] = planned.solution.iterations
        facts |= {name: count for name, count in planned.solution.effort.items() if count}
        job.tell("solve", found=planned.solution.cycle_time, **facts)
        return planned

    @abstractmethod
    def _solved(
        self, path: SmoothPath, samples: PathSamples, machine: Machine, progress: Callable[[float], None]
    ) -> OnPath:
        """The motion on a grid, with the points that it needs besides."""


@dataclass(frozen=True)
class ThirdOrder(Order):
    """All limits with jerk, on a grid with points where jerk needs them; multipliers come with the solution.

    Limits are kept at the grid points. What the motion exceeds between them is measured afterwards, and made
    good where it is (tighten.py): to leave a margin for it everywhere costs 3e-4 of the time on the usual
    grid and 4e-3 on the coarse one.
    """

    solver: ThirdOrderSolver

    jerk_limited: ClassVar[bool] = True

    def _solved(
        self, path: SmoothPath, samples: PathSamples, machine: Machine, progress: Callable[[float], None]
    ) -> OnPath:
        samples = refine_for_jerk(samples, machine)
        problem = feedrate_problem(samples, machine, measured=True)
        problem = dataclasses.replace(problem, margin=np.zeros(len(samples)))
        solution = self.solver.solve(problem, progress)
        return OnPath(path=path, samples=samples, problem=problem, solution=solution)


@dataclass(frozen=True)
class SecondOrder(Order):
    """All limits but jerk, on a grid with points where the profile switches.

    to_tighten : limits will be tightened in places, on straight elements too, which then need points inside
    """

    to_tighten: bool = False

    jerk_limited: ClassVar[bool] = False

    def _solved(
        self, path: SmoothPath, samples: PathSamples, machine: Machine, progress: Callable[[float], None]
    ) -> OnPath:
        if self.to_tighten:
            samples = refine_for_jerk(samples, machine)
        return second_order(path, samples, machine, self.solver)


def solve_again(planned: OnPath, problem: FeedrateProblem, solver: FeedrateSolver) -> OnPath:
    """The motion of another problem on the same grid."""
    return dataclasses.replace(planned, problem=problem, solution=solver.solve(problem))


def second_order(path: SmoothPath, samples: PathSamples, machine: Machine, solver: FeedrateSolver) -> OnPath:
    """Solve, add the points where the profile switches on straight elements, and solve again."""
    problem = feedrate_problem(samples, machine, measured=True)
    solution = solver.solve(problem)
    if solution.solved:
        samples = add_switching_points(samples, problem, solution, machine)
        problem = feedrate_problem(samples, machine, measured=True)
        solution = solver.solve(problem)
    return OnPath(path=path, samples=samples, problem=problem, solution=solution)
