"""Method `toppra`: smoothed path, all second-order constraints, time-optimal by reachability analysis.

The machine's jerk limits are not used: the acceleration steps at grid points. The verdict reports the jerk as not limited.
"""

from __future__ import annotations

from dataclasses import dataclass

from planner.constraints.assemble import feedrate_problem
from planner.corners.bezier import BezierCorner
from planner.corners.fir import FirCorner
from planner.corners.kinematic import KinematicCorner
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.errors import InputError
from planner.feedrate.grid import add_switching_points
from planner.feedrate.reachability import Reachability
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.toppra_adapter import ToppraSolver
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.methods.activity import history
from planner.methods.closed_form import corner_table
from planner.methods.geometry import AUTO, SPLINE, on_spline
from planner.methods.plan import Plan
from planner.methods.reshape import OnPath
from planner.methods.stages import Progress, Stages, deliver, stop_time
from planner.nc.program import Program
from planner.path import RESOLUTION, PathSamples, sample_path
from planner.timing import Motion, law_of_solution

CORNERS = (AUTO, SPLINE, "bezier", "fir", "kinematic")
SOLVERS: dict[str, FeedrateSolver] = {"reachability": Reachability(), "toppra": ToppraSolver()}


@dataclass(frozen=True, kw_only=True)
class ToppraMethod:
    """Second-order time-optimal planning on rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : name of the solver, "reachability" (own kernel) or "toppra" (the package, for comparison), or a solver
    """

    corner: str | CornerShape = AUTO
    solver: str | FeedrateSolver = "reachability"

    def plan(
        self,
        program: Program,
        machine: Machine,
        tolerance: float | None = None,
        progress: Progress | None = None,
    ) -> Plan:
        """Plan a program. Raises InputError for what cannot be planned; an unsolved problem is the plan's status."""
        stages = Stages(progress)
        solver = SOLVERS[self.solver] if isinstance(self.solver, str) else self.solver
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
            spline = self.corner in (SPLINE, AUTO)
            shape = corner_shape("bezier" if spline else self.corner, machine, toolpath)
            path = round_corners(toolpath, machine, shape)

        def on_path(path: SmoothPath, finer: float = 1.0) -> OnPath:
            with stages.stage("geometry"):
                samples = sample_path(path, machine, None if finer == 1.0 else RESOLUTION * finer)
            with stages.stage("solve"):
                return _solve(path, samples, machine, solver)

        auto = self.corner == AUTO
        best = (
            on_spline(path, machine, on_path, auto=auto, rounds=0, stages=stages) if spline else on_path(path)
        )
        samples, problem, solution = best.samples, best.problem, best.solution
        trajectory = verdict = corners = grid = None
        if solution.solved:
            law = law_of_solution(samples, solution)
            trajectory, verdict = deliver(
                Motion(samples=samples, law=law), toolpath, machine, stages, not_limited=("jerk",)
            )
            with stages.stage("report"):
                corners = corner_table(samples, problem, solution)
                grid = history(problem, solution, law)
        return Plan(
            method="toppra",
            corner=str(self.corner) if spline else shape.name,
            solver=solution.solver,
            program=program,
            machine=machine,
            toolpath=toolpath,
            status=solution.status,
            sentence=solution.sentence,
            trajectory=trajectory,
            verdict=verdict,
            corners=corners,
            grid=grid,
            stop_time=stop_time(toolpath, machine),
            grid_points=len(samples),
            timings=stages.timings,
        )


def corner_shape(corner: str | CornerShape, machine: Machine, toolpath: Toolpath) -> CornerShape:
    """The corner shape of that name with the machine's settings. Raises InputError for an unknown name."""
    if corner == "bezier":
        return BezierCorner()
    if corner == "fir":
        return FirCorner.from_machine(machine, toolpath.axes)
    if corner == "kinematic":
        return KinematicCorner.from_machine(machine, toolpath.axes)
    if isinstance(corner, str):
        raise InputError(f"no corner shape '{corner}'; there are {', '.join(CORNERS)}")
    return corner


def _solve(path: SmoothPath, samples: PathSamples, machine: Machine, solver: FeedrateSolver) -> OnPath:
    """Solve, add the points where the profile switches on straight stretches, and solve again."""
    problem = feedrate_problem(samples, machine)
    solution = solver.solve(problem)
    if solution.solved:
        samples = add_switching_points(samples, problem, solution, machine)
        problem = feedrate_problem(samples, machine)
        solution = solver.solve(problem)
    return OnPath(path=path, samples=samples, problem=problem, solution=solution)
