"""The feedrate problem on one path, of third order (with jerk limits) or second order (without), solved on a grid of its own.

The grid is made for the motion. With jerk limits the second-order problem is solved first, because it says where straight legs need
points (feedrate/grid.py). Without jerk limits the points where the profile switches on straight legs are added and the problem is
solved once more, so that every switch falls on a point.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from planner.constraints.assemble import feedrate_problem
from planner.constraints.problem import FeedrateProblem
from planner.corners.smooth import SmoothPath
from planner.feedrate.costates import second_order_multipliers
from planner.feedrate.grid import add_switching_points, refine_for_jerk
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.solvers import ThirdOrderSolver
from planner.job.job import Job
from planner.machine import Machine
from planner.optimal.on_path import OnPath
from planner.path.samples import RESOLUTION, PathSamples, sample_path


class Order(Protocol):
    """Which limits a motion keeps, and the solver for them."""

    jerk_limited: ClassVar[bool]

    @property
    def solver(self) -> FeedrateSolver:
        """What finds the feed along a path."""
        ...

    def solve(self, path: SmoothPath, job: Job, finer: float = 1.0) -> OnPath:
        """The time-optimal motion on a path; a failure is the solution's status.

        finer : factor on the grid's usual resolution [-]
        """
        ...


@dataclass(frozen=True)
class ThirdOrder:
    """All limits with jerk; multipliers come with the solution."""

    solver: ThirdOrderSolver

    jerk_limited: ClassVar[bool] = True

    def solve(self, path: SmoothPath, job: Job, finer: float = 1.0) -> OnPath:
        """The time-optimal motion with jerk limits, on a grid with points where jerk needs them; `finer` as of `Order`."""
        with job.stage("geometry"):
            samples = sample_path(path, job.machine, _resolution(finer), third_order=True)
        with job.stage("solve") as progress:
            samples = refine_for_jerk(samples, job.machine)
            problem = feedrate_problem(samples, job.machine, measured=True)
            solution = self.solver.solve(problem, progress)
        planned = OnPath(path=path, samples=samples, problem=problem, solution=solution)
        _tell(job, planned, finer)
        return planned


@dataclass(frozen=True)
class SecondOrder:
    """All limits but jerk; multipliers are found from the profile (feedrate/costates.py).

    to_tighten : limits will be tightened in places, on straight elements too, which then need points inside
    """

    solver: FeedrateSolver
    to_tighten: bool = False

    jerk_limited: ClassVar[bool] = False

    def solve(self, path: SmoothPath, job: Job, finer: float = 1.0) -> OnPath:
        """The time-optimal motion without jerk limits, on a grid with points where the profile switches; `finer` as of `Order`."""
        with job.stage("geometry"):
            samples = sample_path(path, job.machine, _resolution(finer))
        with job.stage("solve"):
            if self.to_tighten:
                samples = refine_for_jerk(samples, job.machine)
            planned = second_order(path, samples, job.machine, self.solver)
            _tell(job, planned, finer)
            if not planned.solution.solved:
                return planned
            multipliers = second_order_multipliers(planned.problem, planned.solution)
            solution = dataclasses.replace(planned.solution, multipliers=multipliers)
        return dataclasses.replace(planned, solution=solution)


def solve_again(planned: OnPath, problem: FeedrateProblem, solver: FeedrateSolver) -> OnPath:
    """The motion of another problem on the same grid."""
    return dataclasses.replace(planned, problem=problem, solution=solver.solve(problem))


def second_order(path: SmoothPath, samples: PathSamples, machine: Machine, solver: FeedrateSolver) -> OnPath:
    """Solve, add the points where the profile switches on straight elements, and solve again; a failure is the solution's status."""
    problem = feedrate_problem(samples, machine, measured=True)
    solution = solver.solve(problem)
    if solution.solved:
        samples = add_switching_points(samples, problem, solution, machine)
        problem = feedrate_problem(samples, machine, measured=True)
        solution = solver.solve(problem)
    return OnPath(path=path, samples=samples, problem=problem, solution=solution)


def _tell(job: Job, planned: OnPath, finer: float) -> None:
    facts: dict[str, Any] = {"points": len(planned.samples), "runs": len(planned.samples.piece) - 1}
    if finer != 1.0:
        facts["resolution"] = finer
    if planned.solution.iterations:
        facts["iterations"] = planned.solution.iterations
    facts |= {name: count for name, count in planned.solution.effort.items() if count}
    job.tell("solve", found=planned.solution.cycle_time, **facts)


def _resolution(finer: float) -> float | None:
    return None if finer == 1.0 else RESOLUTION * finer
