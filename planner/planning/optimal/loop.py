"""The default algorithm on one page: choose a geometry, solve, reshape, solve, tighten, deliver, compare.

  geometry  round the corners; lay splines over the runs between full stops                       corners/, smoothing/
  solve     the time-optimal feed on that path, all limits at grid points                         order.py, feedrate/
  reshape   path and feed improved together, all limits linearised, inside the
            tolerance; solve on the new path; in turns                                 rounds.py, reshape.py, smoothing/
  compare   single corners between the full stops, where they may be faster                       compare_corners.py
  tighten   where the motion exceeds a limit between grid points, allow less and solve again      tighten.py
  filters   the same where it leaves the tolerance behind the machine's own filters               behind_filters.py
  deliver   setpoints at the interpolation period, judged by the verifier                         planning/job/job.py, verifier/
  compare   full stops, fir corners, method kinematic, where they may be faster                   compare_plans.py

From the motion that this ends with, method `optimal` searches geometry and feed together (planning/methods/free.py); where it does,
it takes the first splines, with no round of reshaping.

Methods `optimal` (third order: with jerk limits) and `second-order` (second order: without) run the same loop with another `Order`.

What is tried more than once:

  what                           when                                      at most           costs         afterwards
  -----------------------------  ----------------------------------------  ----------------  ------------  -----------------------------
  full stop where a run gets no  no curve inside the tolerance, or a cusp  2 times           splines anew  at last fenced by two stops,
    spline                                                                                                   with its single corners
  round of reshaping             on splines, while the last one promised   effort.py; a run  shape, solve  faster runs keep the new one,
                                   more than effort.py asks for              2 in vain                       others are pulled more
  only the runs that got faster  others got slower                         each round        solve         the fastest of three stays
  corners between full stops     "auto", a bound on their time is lower    3                 solve         splines stay where faster
  path without added stops       "auto", a bound on its time is lower      1                 solve         the faster one
  final grid                     rounds of reshaping are on a coarse one   1                 finer solve   that of the plan
  tighter limits in places       excess above 1e-5 between points          2, long jobs 4    ranges        runs slower by the rest
  less feed in places            filters leave the tolerance               16                solve         waiting, slower runs
  slower in places               the verdict finds something               6                 verdict       the verdict stands
  another plan                   "auto", it takes less time or the plan   3                 a plan        the fastest that passes
                                   fails; fir corners by a bound

Inside a solve, windows of the interior-point method have retries of their own (feedrate/jerk/solver.py); inside a shape, sites whose
certificate fails are tightened (smoothing/relax.py; in a round of reshaping smoothing/combined.py, twice at most). Around the loop, a
job is planned again with less tolerance where chords between samples leave it, and with shares of the tolerance on machines with
filters (planning/job/method.py). How often these fire, and what plans lose without them, `python -m benchmarks.net.ablation` shows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

from planner.base.errors import NotSolvedError
from planner.base.names import AUTO, QUICK, SPLINE
from planner.base.sizes import SIZES
from planner.base.threads import beside, threads
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import Status
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.behind_filters import within_filters
from planner.planning.optimal.compare_corners import COMPARED_POINTS, corner_bounds, with_corners
from planner.planning.optimal.compare_plans import (
    FIR,
    RIVAL_POINTS,
    SAME_MOTION,
    Stopped,
    better,
    counted_time,
    fir_corners_may_be_faster,
    with_closed_forms,
)
from planner.planning.optimal.effort import COARSE, EFFORTS, Grids, Settings
from planner.planning.optimal.geometry import corner_shape, lost_joints, splined_with_stops
from planner.planning.optimal.notes import no_spline_note, not_compared_note
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.result import plan_of_solution, pricing_of
from planner.planning.optimal.rounds import reshaped, tell_of
from planner.planning.optimal.tighten import within_limits
from planner.sensitivity.records import Tables
from planner.smoothing.spline_path import SplineShape, spline_shape, with_spline

PRICED_BESIDE = SIZES.priced_beside


def fastest_plan(job: Job, settings: Settings) -> Plan:
    """The plan on a smooth path; with "auto" another plan if that takes less time or passes while the smooth one fails. The sentence of
    the plan says which."""
    if settings.corner != AUTO:
        return plan_on_path(job, settings)
    stopped = Stopped(job)
    smooth = plan_on_path(job, settings, stopped)
    best = with_closed_forms(smooth, job, stopped)
    small = settings.order.jerk_limited and smooth.grid_points <= RIVAL_POINTS
    if small and fir_corners_may_be_faster(best, job, settings.order):
        rival = dataclasses.replace(job.afresh(), most=min(counted_time(best), job.most))
        cornered = plan_on_path(rival, dataclasses.replace(settings, corner=FIR))
        best = better(best, cornered, "fir corners take less time", job.tell)
    if best is smooth:
        return smooth
    best = dataclasses.replace(best, method=smooth.method, corner=smooth.corner, timings=job.stages.timings)
    if counted_time(smooth) < (1.0 + SAME_MOTION) * counted_time(best):
        pricing = smooth.making and smooth.making.pricing
        making = best.making and best.making._replace(pricing=pricing)
        best = dataclasses.replace(best, prices=smooth.prices, making=making, grid=smooth.grid)
    return best


def plan_on_path(job: Job, settings: Settings, stopped: Stopped | None = None) -> Plan:
    """The plan on a smooth path: time-optimal, tightened where it exceeds a limit between grid points, delivered; without a trajectory
    if it takes longer than `job.most`, or than full stops."""

    def useless(time: float) -> bool:
        return time > job.most or (stopped is not None and stopped.sooner_than(time / (1.0 + SAME_MOTION)))

    try:
        found = [time_optimal(job, settings)]
    except NotSolvedError as fault:  # no grid follows the path
        return job.plan(
            None, method=settings.method, corner=None, solver="", status=Status.NUMERICAL_ERROR, grid_points=0, sentence=str(fault)
        )  # fmt: skip
    if job.machine.normal_acceleration != job.real[0].normal_acceleration:
        found = [found.pop().held_by_filters()]
    return _plan_of(job, settings, found, useless)


def _plan_of(job: Job, settings: Settings, found: list[OnPath], useless: Callable[[float], bool]) -> Plan:
    """The plan of the one motion found, with its limits kept at grid points. The list is emptied, so that tightening lets go of it: a
    third of a kilobyte a point.

    useless : whether a motion that takes so long [s] need not be delivered
    """
    made = prices = pricing = None
    if found[0].solution.solved:
        with job.stage("solve"):
            best, motion = within_limits(found.pop(), settings.order, job.toolpath, job.machine, job.tell)
        with job.stage("filters"):
            best, motion = within_filters(best, motion, settings.order, job, useless)
        if useless(motion.end):
            return plan_of_solution(job, best, None, method=settings.method, corner=settings.corner)
        not_limited = () if settings.order.jerk_limited else ("jerk",)
        if settings.order.jerk_limited:
            pricing = pricing_of(best, job.machine)
        if pricing is not None and len(best.samples) > PRICED_BESIDE and threads() > 1:
            made, prices = beside(lambda: job.deliver(motion, not_limited), pricing)
            pricing = None
        else:
            made = job.deliver(motion, not_limited)
    else:
        best = found.pop()
    tables = Tables(prices=prices, pricing=pricing)
    return plan_of_solution(job, best, made, method=settings.method, corner=settings.corner, tables=tables)


def time_optimal(job: Job, settings: Settings) -> OnPath:
    """The time-optimal motion, limits kept at grid points, on rounded corners or on splines shaped for it."""
    order, machine = settings.order, job.machine

    # Geometry: corners rounded each by itself, or splines in their place; a full stop where a run gets none.
    given = _rounded(job, settings)
    if settings.corner not in (AUTO, SPLINE):
        return order.solve(given, job, grids_for(given, job, settings)[0].final)
    with job.stage("geometry"):
        rounded, splines = splined_with_stops(given, machine, order.jerk_limited, job.tell)
    if not splines.splines.fits.any():
        cornered = order.solve(given, job, grids_for(given, job, settings)[0].final)
        return dataclasses.replace(cornered, notes=no_spline_note(rounded, splines))

    # Solve and reshape in turns, on a coarse grid; then once on the final one. The coarse motion is let go of before: 0.5 kB a point.
    # Where not one round is worth its work the final grid is the first one.
    best, grids, resolution = _first(with_spline(rounded, splines), splines, job, settings)
    if best.solution.solved and resolution != grids.final:
        best = reshaped(rounded, best, job, settings, resolution)
        path, splined, coarse = best.path, best.shape, best.solution.cycle_time
        del best
        best = dataclasses.replace(order.solve(path, job, grids.final), shape=splined)
        job.tell(
            "final grid",
            found=best.solution.cycle_time,
            before=coarse,
            kept=best.solution.solved,
        )
    notes: tuple[str, ...] = ()

    # Single corners where they are faster: between full stops, and everywhere, without the stops that were added for the splines.
    if settings.corner == AUTO:
        with job.stage("solve"):
            bounds = corner_bounds(rounded, machine, order.jerk_limited)
            of_given = bounds if rounded is given else corner_bounds(given, machine, order.jerk_limited)
        best, left = with_corners(rounded, best, bounds, job, order, grids)
        notes = not_compared_note(rounded, left, bounds.points)
        small = of_given.points.sum() <= COMPARED_POINTS
        if rounded is not given and small and of_given.time.sum() < best.solution.cycle_time:
            without = order.solve(given, job, grids.final, [best])
            tell_of(job, "no added stops", without, best)
            if without.faster_than(best):
                return without

    return dataclasses.replace(best, notes=notes)


@dataclass(frozen=True)
class FirstMotion:
    """A motion to search from (planning/methods/at_once.py).

    planned   : None where a run gets no spline, and where there is no solution
    too_large : whether it was not planned, because the splines have more spans than the steps that are searched
    """

    planned: OnPath | None
    too_large: bool = False


def first_motion(job: Job, settings: Settings) -> FirstMotion:
    """The time-optimal motion on the first splines, on a coarse grid and with its limits kept at grid points only."""
    rounded = _rounded(job, settings)
    with job.stage("geometry"):
        shape = spline_shape(rounded, job.machine)
        whole = shape.splines.fits.all() and not len(lost_joints(rounded, shape, fence=False))
    if shape.splines.span_first[-1] > settings.effort.search.steps_max:
        return FirstMotion(None, too_large=True)
    if not whole:
        return FirstMotion(None)
    try:
        planned = settings.order.solve(with_spline(rounded, shape), job, EFFORTS[QUICK].sizes[-1].final)
    except NotSolvedError:  # no grid follows the splines
        return FirstMotion(None)
    return FirstMotion(planned if planned.solution.solved else None)


def _rounded(job: Job, settings: Settings) -> SmoothPath:
    """The path with every corner rounded by itself."""
    with job.stage("geometry"):
        shape = corner_shape(settings.corner, job.machine, job.toolpath, settings.bezier)
        return round_corners(job.toolpath, job.machine, shape, blend_tangents=settings.order.jerk_limited)


def _first(path: SmoothPath, shape: SplineShape, job: Job, settings: Settings) -> tuple[OnPath, Grids, float]:
    """The motion on the first splines, the grids, and the resolution of the one that it is on."""
    spans, effort = len(path.spline.spans), settings.effort  # a grid has a point for each span at least
    if settings.rounds is None and spans > effort.work and effort.grids(spans) is effort.sizes[-1]:
        grids = effort.sizes[-1]
        return (
            dataclasses.replace(settings.order.solve(path, job, grids.final), shape=shape),
            grids,
            grids.final,
        )
    grids, samples = grids_for(path, job, settings)
    reshaped_at_all = settings.effort.work >= len(samples) if settings.rounds is None else settings.rounds > 0
    resolution = grids.rounds if reshaped_at_all else grids.final
    known = samples if resolution == COARSE else None
    del samples
    planned = settings.order.solve(path, job, resolution, samples=known)
    return dataclasses.replace(planned, shape=shape), grids, resolution


def grids_for(path: SmoothPath, job: Job, settings: Settings) -> tuple[Grids, PathSamples]:
    """The grids that a path of this size is worth, and the coarse one by which that is told."""
    with job.stage("geometry"):
        coarse = sample_path(path, job.machine, COARSE, third_order=settings.order.jerk_limited)
    return settings.effort.grids(len(coarse)), coarse
