"""The time-optimal motion without jerk limits on a path: method `second-order`, and what any motion on a path takes at least."""

from __future__ import annotations

from planner.constraints.assemble import feedrate_problem
from planner.corners.smooth import SmoothPath
from planner.feedrate.grid import add_switching_points
from planner.feedrate.solution import FeedrateSolver
from planner.machine import Machine
from planner.optimal.reshape import OnPath
from planner.path.samples import PathSamples


def second_order(path: SmoothPath, samples: PathSamples, machine: Machine, solver: FeedrateSolver) -> OnPath:
    """Solve, add the points where the profile switches on straight stretches, and solve again; a failure is the solution's status."""
    problem = feedrate_problem(samples, machine, measured=True)
    solution = solver.solve(problem)
    if solution.solved:
        samples = add_switching_points(samples, problem, solution, machine)
        problem = feedrate_problem(samples, machine, measured=True)
        solution = solver.solve(problem)
    return OnPath(path=path, samples=samples, problem=problem, solution=solution)
