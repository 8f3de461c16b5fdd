"""The plan of a solution: its active limits and what they cost."""

import dataclasses

from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.slowed import times_of_pieces
from planner.planning.job.job import Job
from planner.planning.job.made import NO_TABLES, Delivered, Tables
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.notes import path_notes
from planner.planning.optimal.on_path import OnPath
from planner.sensitivity.activity import history


def plan_of_solution(
    job: Job, best: OnPath, made: Delivered | None, settings: Settings, tables: Tables = NO_TABLES
) -> Plan:
    """The plan of a solution and what was delivered of it, None unless solved."""
    grid = None
    notes: tuple[str, ...] = ()
    if made is not None:
        delivered = made.motion
        if isinstance(delivered, ShapedMotion):
            delivered = delivered.motion  # what the solution is of
        with job.stage("report"):
            grid = history(best.problem, best.solution, *times_of_pieces(delivered))
        notes = (*path_notes(job.toolpath, best), *best.notes)
    return job.plan(
        made,
        method=settings.method,
        corner=settings.corner_name,
        solver=best.solution.solver,
        status=best.solution.status,
        sentence=best.solution.sentence,
        grid_points=len(best.samples),
        tables=dataclasses.replace(tables, grid=grid),
        notes=notes,
    )


def priced(best: OnPath, machine: Machine) -> bool:
    """Whether the limits of a motion have prices: not where it has no jerk limits or its solver does not
    tell, nor behind filters, of which the problem knows only a part."""
    solution = best.solution
    return solution.jerk_limited and solution.multipliers is not None and machine.fir is None
