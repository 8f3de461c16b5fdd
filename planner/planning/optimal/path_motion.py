"""The time-optimal motion on a path: rounded corners, or splines.

  geometry  round the corners; lay splines over the runs between full stops                       corners/, smoothing/
  solve     the time-optimal feed on that path, all limits at grid points                         order.py, feedrate/
  compare   single corners between the full stops, where they may be faster                       compare_corners.py

and then, delivered as a plan,

  tighten   where the motion exceeds a limit between grid points, allow less and solve again      tighten.py
  filters   the same where it leaves the tolerance behind the machine's own filters               behind_filters.py
  deliver   setpoints at the interpolation period, judged by the verifier                         planning/job/job.py, verify/
"""

import dataclasses

from planner.base.errors import NotSolvedError
from planner.base.names import AUTO, SPLINE
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion
from planner.motion.slowed import times_of_pieces
from planner.motion.timing import Motion
from planner.planning.job.job import Job
from planner.planning.job.plan import NO_TABLES, Delivered, Plan, Tables
from planner.planning.job.trace import Tell, tell_nobody
from planner.planning.optimal.behind_filters import within_filters
from planner.planning.optimal.compare_corners import corner_bounds, with_corners
from planner.planning.optimal.effort import BEGINNING, COARSE, Grids, Settings
from planner.planning.optimal.geometry import Laid, corner_shape, splined_with_stops, tell_splines
from planner.planning.optimal.notes import no_spline_note, not_compared_note, noted, path_notes
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.tighten import within_limits
from planner.sensitivity.activity import history
from planner.smoothing.spline_path import with_spline


def kept_on_path(job: Job, settings: Settings, laid: Laid | None = None) -> tuple[OnPath, Motion] | None:
    """The time-optimal motion on a smooth path, its limits kept between grid points too; None if none.

    laid : its splines, if they have been laid (`OnPath.laid`)
    """
    try:
        found = time_optimal(job, settings, laid)
    except NotSolvedError:  # no grid follows the path
        return None
    if not found.solution.solved:
        return None
    with job.stage("solve"):
        return within_limits(found, settings.order, job.toolpath, job.machine, job.tell)


def plan_on_path(
    job: Job, settings: Settings, known: tuple[OnPath, Motion] | None = None, laid: Laid | None = None
) -> Plan:
    """The plan on a smooth path: time-optimal, tightened where it exceeds a limit between grid points,
    delivered; without a trajectory if it takes longer than `job.most`.

    known : its motion, if there is one already (`kept_on_path`)
    laid  : as there
    """
    try:
        found = [known[0] if known else time_optimal(job, settings, laid)]
    except NotSolvedError as fault:  # no grid follows the path
        return job.unsolved(settings.method, Status.NUMERICAL_ERROR, str(fault))
    if job.machine.normal_acceleration != job.real[0].normal_acceleration:
        found = [found.pop().held_by_filters()]
    if not found[0].solution.solved:
        return plan_of_solution(job, found[0], None, settings)
    # held by no name from here on, so that tightening lets go of it: a third of a kilobyte a point
    with job.stage("solve"):
        best, motion = known or within_limits(
            found.pop(), settings.order, job.toolpath, job.machine, job.tell
        )
    with job.stage("filters"):
        best, motion, filtered = within_filters(best, motion, settings.order, job)
    if motion.end > job.most:
        return plan_of_solution(job, best, None, settings)
    made = job.deliver(motion, settings.not_limited)
    tables = Tables(priced=best if priced(best, job.machine) else None)
    return plan_of_solution(job, best, made._replace(filtered=filtered), settings, tables)


def time_optimal(job: Job, settings: Settings, laid: Laid | None = None) -> OnPath:
    """The time-optimal motion, limits kept at grid points, on rounded corners or on splines; `laid`: as above."""
    order, machine = settings.order, job.machine

    # Geometry: corners rounded each by itself, or splines in their place; a full stop where a run gets none.
    if settings.corner not in (AUTO, SPLINE):
        given = _rounded(job, settings)
        return order.solve(given, job, grids_for(given, job, settings).final)
    rounded, splines = laid or _splined(job, settings, job.tell)
    if laid:
        added = (rounded.toolpath.joint == Joint.STOP).sum() - (job.toolpath.joint == Joint.STOP).sum()
        tell_splines(splines, job.tell, int(added))
    if not splines.splines.fits.any():
        given = _rounded(job, settings)
        cornered = order.solve(given, job, grids_for(given, job, settings).final)
        return dataclasses.replace(cornered, notes=no_spline_note(rounded, splines))

    path = with_spline(rounded, splines)
    grids = grids_for(path, job, settings)
    best = dataclasses.replace(order.solve(path, job, grids.final), shape=splines)
    notes: tuple[str, ...] = ()

    # Single corners between full stops where they are faster.
    if settings.corner == AUTO:
        with job.stage("solve"):
            bounds = corner_bounds(rounded, machine)
        best, left = with_corners(rounded, best, bounds, job, order, grids)
        notes = not_compared_note(rounded, left, bounds.points)

    return dataclasses.replace(best, notes=notes)


def first_motion(job: Job, settings: Settings) -> OnPath | None:
    """The time-optimal motion on splines, on a coarse grid and with its limits kept at grid points
    only, with a full stop where a run gets none; None where no run has one, where there is no solution, and
    where the splines have more spans than the steps that are searched."""
    rounded, shape = _splined(job, settings)
    fits = shape.splines.fits
    if (len(fits) and not fits.any()) or shape.splines.span_first[-1] > settings.effort.search.steps_max:
        return None
    try:
        planned = settings.order.solve(with_spline(rounded, shape), job, BEGINNING)
    except NotSolvedError:  # no grid follows the splines
        return None
    if not planned.solution.solved:
        return None
    return dataclasses.replace(planned.without_prices(), laid=(rounded, shape))


def _rounded(job: Job, settings: Settings) -> SmoothPath:
    """The path with every corner rounded by itself."""
    with job.stage("geometry"):
        shape = corner_shape(settings.corner, job.machine, job.toolpath, settings.bezier)
        return round_corners(job.toolpath, job.machine, shape, blend_tangents=settings.order.jerk_limited)


def _splined(job: Job, settings: Settings, tell: Tell = tell_nobody) -> Laid:
    """Splines over the runs between full stops."""
    given = _rounded(job, settings)
    with job.stage("geometry"):
        return splined_with_stops(given, job.machine, settings.order.jerk_limited, tell)


def grids_for(path: SmoothPath, job: Job, settings: Settings) -> Grids:
    """The grids for a path of this size: by its points on a coarse one, one a span at least."""
    of_spans = settings.effort.grids(len(path.spline.spans))
    if of_spans is settings.effort.sizes[-1]:
        return of_spans
    with job.stage("geometry"):
        coarse = sample_path(path, job.machine, COARSE, third_order=settings.order.jerk_limited)
    return settings.effort.grids(len(coarse))


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
        notes = (*path_notes(job.toolpath, noted(job.toolpath, best)), *best.notes)
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
