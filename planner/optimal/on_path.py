"""What methods `second-order` and `optimal` share: which path the feedrate problem is solved on, and the plan of its solution."""

from __future__ import annotations

from collections.abc import Callable

from planner.base.errors import InputError
from planner.base.names import SMOOTHINGS
from planner.corners.bezier import BezierCorner
from planner.corners.fir import FirCorner
from planner.corners.kinematic import KinematicCorner
from planner.corners.smooth import CornerShape, SmoothPath
from planner.geometry.toolpath import Toolpath
from planner.job.job import Delivered, Job
from planner.job.plan import Plan
from planner.job.records import PriceList
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.timing import Motion
from planner.optimal.geometry import AUTO, SPLINE, on_spline
from planner.optimal.notes import path_notes
from planner.optimal.reshape import OnPath
from planner.sensitivity.activity import history
from planner.sensitivity.closed_form import corner_table


def corner_shape(
    corner: str | CornerShape, machine: Machine, toolpath: Toolpath, bezier: CornerShape | None = None
) -> CornerShape:
    """The corner shape of that name with the machine's settings; `bezier`: the one of "bezier" and beside splines, None for the
    usual one. Raises InputError for an unknown name."""
    if corner in (AUTO, SPLINE, "bezier"):
        return bezier or BezierCorner()
    if corner == "fir":
        return FirCorner.from_machine(machine, toolpath.axes)
    if corner == "kinematic":
        return KinematicCorner.from_machine(machine, toolpath.axes)
    if isinstance(corner, str):
        raise InputError(f"no corner shape '{corner}'; there are {', '.join(SMOOTHINGS)}")
    return corner


def best_on_path(
    job: Job,
    rounded: SmoothPath,
    corner: str | CornerShape,
    plan_on: Callable[[SmoothPath, float], OnPath],
    *,
    blend_tangents: bool,
    rounds: int | None,
) -> OnPath:
    """The time-optimal motion on rounded corners, or on splines if `corner` says so; the arguments are those of `on_spline`."""
    if corner not in (AUTO, SPLINE):
        return plan_on(rounded, 1.0)
    return on_spline(
        rounded,
        job.machine,
        plan_on,
        blend_tangents=blend_tangents,
        auto=corner == AUTO,
        rounds=rounds,
        stages=job.stages,
    )


def plan_of_solution(
    job: Job,
    best: OnPath,
    made: Delivered | None,
    *,
    method: str,
    corner: str | CornerShape,
    prices: PriceList | None = None,
) -> Plan:
    """The plan of a solution and what was delivered of it, None unless solved."""
    rounded = grid = None
    if made is not None:
        delivered = job.motion_of[made[0]]  # with the standstills that its samples need
        if isinstance(delivered, ShapedMotion):
            delivered = delivered.motion  # what the solution is of
        assert isinstance(delivered, Motion)
        with job.stage("report"):
            rounded = corner_table(best.samples, best.problem, best.solution)
            grid = history(best.problem, best.solution, delivered.law)
        job.note(*path_notes(job.toolpath, best), *best.notes)
    return job.plan(
        made,
        method=method,
        corner=corner if isinstance(corner, str) else corner.name,
        solver=best.solution.solver,
        status=best.solution.status,
        sentence=best.solution.sentence,
        grid_points=len(best.samples),
        rounded=rounded,
        grid=grid,
        prices=prices,
    )
