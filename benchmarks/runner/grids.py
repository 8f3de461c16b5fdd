"""The same motion on coarser and finer grids: how its time and what it exceeds between grid points converge.

    grid:F    the first splines, feed with its limits at the grid points, and nothing done about what is between them: its verdict
              fails by what the motion exceeds there
    kept:F    the same, and limits tightened until they hold between the points too (tighten.py): what a plan would deliver

F = 1 is a grid with an interpolation error of `RESOLUTION`; a step F times shorter has F^2 times less of it. The solver's own gap is
far below what grids differ by. What comes of it is told by grid_report.py.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.errors import NotSolvedError
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.machine import Machine
from planner.nc.program import Program
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.geometry import splined_with_stops
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import ThirdOrder
from planner.planning.optimal.path_motion import plan_of_solution
from planner.planning.optimal.tighten import within_limits
from planner.planning.page import Method
from planner.smoothing.spline_path import with_spline

RESOLUTION = 2e-3  # of F = 1: the coarsest final grid of small jobs is 8e-3, the finest 2e-4 (planning/optimal/effort.py)
FACTORS = (0.5, 1.0, 2.0, 4.0, 8.0)
GAP = 1e-7  # of the solver [-]
AT_POINTS, BETWEEN = "grid", "kept"


@dataclass(frozen=True, kw_only=True)
class OnGrid(Method):
    """The planner's first splines and the feed along them, on a grid of its own.

    finer : F (module text)
    kept  : whether limits are kept between grid points
    """

    finer: float
    kept: bool

    @property
    def keeps_tolerance(self) -> bool:
        return False  # delivered as it is

    def plan_job(self, job: Job) -> Plan:
        order, machine = ThirdOrder(JerkLimited(tol=GAP)), job.machine
        given = round_corners(job.toolpath, machine, BezierCorner(), blend_tangents=True)
        rounded, shape = splined_with_stops(given, machine, True, job.tell)
        path = with_spline(rounded, shape)
        samples = sample_path(path, machine, RESOLUTION / self.finer**2, third_order=True)
        samples = refine_for_jerk(samples, machine, self.finer)
        problem = feedrate_problem(samples, machine, measured=True)
        problem = dataclasses.replace(problem, margin=np.zeros(len(samples)))
        planned = OnPath(path=path, samples=samples, problem=problem, solution=order.solver.solve(problem))
        if not planned.solution.solved:
            raise NotSolvedError(planned.solution.sentence)
        motion = planned.motion()
        if self.kept:
            planned, motion = within_limits(planned, order, job.toolpath, machine)
        made = job.deliver(motion, as_it_is=not self.kept)
        settings = Settings(method="optimal", corner="spline", order=order)
        return plan_of_solution(job, planned, made, settings)


def name_of(kept: bool, finer: float) -> str:
    """The way of a grid."""
    return f"{BETWEEN if kept else AT_POINTS}:{finer:g}"


def on_grid(kept: bool, finer: float):
    """A job's plan on a grid, as a way."""

    def planned(program: Program, machine: Machine, tolerance: float | None) -> Plan:
        return OnGrid(finer=finer, kept=kept).plan(program, machine, tolerance)

    return planned


WAYS = {
    name_of(kept, finer): on_grid(kept, finer) for kept in (False, True) for finer in FACTORS
}  # of the suite `grids`
