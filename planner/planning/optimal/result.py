"""The plan of a solution: its active limits and what they cost."""

from __future__ import annotations

import dataclasses
from functools import partial

from planner.corners.smooth import CornerShape
from planner.feedrate.constraints.limits import Limits
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.slowed import times_of_pieces
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.notes import path_notes
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.reshape import corridor_prices
from planner.sensitivity.activity import history
from planner.sensitivity.closed_form import corner_table
from planner.sensitivity.path_prices import SitePrices, path_prices
from planner.sensitivity.records import NO_TABLES, Delivered, PriceList, Pricing, Tables


def plan_of_solution(
    job: Job,
    best: OnPath,
    made: Delivered | None,
    *,
    method: str,
    corner: str | CornerShape,
    tables: Tables = NO_TABLES,
) -> Plan:
    """The plan of a solution and what was delivered of it, None unless solved."""
    rounded = grid = None
    if made is not None:
        delivered = made.motion
        if isinstance(delivered, ShapedMotion):
            delivered = delivered.motion  # what the solution is of
        with job.stage("report"):
            rounded = corner_table(best.samples, best.problem, best.solution)
            grid = history(best.problem, best.solution, *times_of_pieces(delivered))
        job.note(*path_notes(job.toolpath, best), *best.notes)
    return job.plan(
        made,
        method=method,
        corner=corner if isinstance(corner, str) else corner.name,
        solver=best.solution.solver,
        status=best.solution.status,
        sentence=best.solution.sentence,
        grid_points=len(best.samples),
        tables=dataclasses.replace(tables, rounded=rounded, grid=grid),
    )


def pricing_of(best: OnPath, machine: Machine) -> Pricing | None:
    """What finds the prices of a jerk-limited motion's limits; None where the solver does not tell, and behind filters, of which the
    problem knows only a part."""
    if not best.solution.multipliers or machine.fir is not None:
        return None
    return partial(_prices, best, machine)


def _prices(best: OnPath, machine: Machine) -> PriceList | None:
    """The prices of its limits. With limits that are no axis' the tolerance of splines has no price: the machine alone pulls at their
    shapes."""
    by_site = None
    along = Limits.of(machine, best.path.toolpath.axes).along
    # what the corridor of the splines costs
    if best.shape is not None and len(best.path.spline) and not along:
        by_site = SitePrices(place=best.shape.splines.sites.place, price=corridor_prices(best))
    return path_prices(best.samples, best.problem, best.solution, machine, by_site)
