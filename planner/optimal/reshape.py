"""Geometry and feed in turns: a spline reshaped within the tolerance by what its time-optimal motion pays for.

Let x(t) be the time-optimal motion along a spline and lambda its multipliers, those of the axis jerks for instance. With the spline's
parameter as a function of time held fixed, a small change of the control points changes the optimal time by

    dT = sum over grid points and axes of  |lambda| d(|jerk| / limit)  +  the same of accelerations, velocities and feed,

which is the gradient of sum |lambda|/2 (jerk/limit)^2 + ... at the present shape, a convex quadratic in the control points because the
motion is linear in them. A round minimises it, with a pull towards the present shape,

    sum |lambda|/2 (jerk/limit)^2 + ...  +  force/2 integral ((jerk - jerk_now)/limit)^2 dt,

inside the tube (smoothing/), and solves the feedrate problem on the new path. The runs that got faster keep their new shape and are
pulled less in the next round, the others keep the old one and are pulled more. Where nothing can be gained to first order any more,
shape and feed satisfy the optimality conditions of the joint problem, minimum time inside the tolerance. The multipliers jump from
round to round, as limits take turns; their running mean over the rounds, `SHARE` of it the newest, serves better. Without jerk limits
the profile has corners, at which another limit takes over as soon as the shape gives way: there the mean takes in what holds the
shapes that failed, too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.corners.smooth import SmoothPath
from planner.feedrate.solution import FeedrateSolution
from planner.job.stages import Stages
from planner.path.samples import PathSamples
from planner.smoothing.basis import DEGREE
from planner.smoothing.forms import SplineMotion, motion_bands
from planner.smoothing.relax import Goal, relax
from planner.smoothing.spline_path import SplineShape, cusps, with_spline

# Rounds of reshaping, so that all of them together take about as long as so many grid points once, ...
WORK = 150_000
# ... at most so many, and no more once so many of them together gained less than this [-].
ROUNDS_MAX = 40
ROUNDS_SEEN, GAIN_MIN = 5, 5e-5
FIRST_FORCE = 0.5  # of the pull; 0.3 and 1 gain the same within 1e-3 in eight rounds
LESS, MORE = 0.7, 3.0  # factors on a run's force after a gain and after a loss
SHARE = 0.5  # of the newest multipliers in their mean; with 1 eight rounds end 1e-4 to 1e-3 slower (pentagon, zig-zag, spiral)
# Without jerk limits a failed round teaches what holds its shape; so more of them may fail, with less pull each. With the numbers
# above, 4 of 40 random polylines stayed where they began, up to 4.5 % behind the motion with jerk limits.
PATIENCE, MORE_PATIENT = 10, 1.5
PULLED = 0.5  # share of the jerk in which the pull counts, without jerk limits [-]
GAP = 1e-4  # of a round's convex problem, share of the run's time [-]: below what a round gains


@dataclass(frozen=True, eq=False, kw_only=True)
class OnPath:
    """A smooth path, its grid, and the time-optimal motion on it; the shape of its splines, if it has some; sentences on what was
    given up."""

    path: SmoothPath
    samples: PathSamples
    problem: FeedrateProblem
    solution: FeedrateSolution
    shape: SplineShape | None = None
    notes: tuple[str, ...] = ()


PlanOn = Callable[[SmoothPath], OnPath]


def reshaped(
    rounded: SmoothPath, shape: SplineShape, plan_on: PlanOn, rounds: int | None, stages: Stages
) -> tuple[SplineShape, OnPath]:
    """The best of some rounds of reshaping, and the motion on it.

    rounded : the path with the corners that the runs replace
    plan_on : solves the feedrate problem on a path
    rounds  : None for as many as the size of the job lets pay
    """
    best = plan_on(with_spline(rounded, shape))
    if not best.solution.solved or best.solution.multipliers is None or not len(best.path.spline):
        return shape, best
    if rounds is None:
        rounds = min(WORK // len(best.samples), ROUNDS_MAX)
    seen, more = (ROUNDS_SEEN, MORE) if best.solution.jerk_limited else (PATIENCE, MORE_PATIENT)
    force = np.full(len(shape.laid.fits), FIRST_FORCE)
    paid: FloatArray | None = None  # mean over the rounds
    reached = [best.solution.cycle_time]
    for _ in range(rounds):
        if len(reached) > seen and reached[-1] > (1.0 - GAIN_MIN) * reached[-1 - seen]:
            break
        with stages.stage("geometry"):
            H, Q = price_bands(best, shape)
            paid = H if paid is None else paid + SHARE * (H - paid)
            new, _ = _reshape(best, shape, force, paid, Q)
        tried = plan_on(with_spline(rounded, new))
        if not tried.solution.solved:
            break
        better = run_times(tried, new) < run_times(best, shape)
        candidates = [(new, tried)]
        if not (better | ~shape.laid.fits).all():
            mixed = _chosen(shape, new, better)
            candidates.append((mixed, plan_on(with_spline(rounded, mixed))))
        for candidate, planned in candidates:
            if planned.solution.solved and planned.solution.cycle_time < best.solution.cycle_time:
                shape, best = candidate, planned
        if not tried.solution.jerk_limited and not better.all():
            paid = paid + SHARE * (price_bands(tried, new)[0] - paid)
        force = np.where(better, LESS * force, more * force)
        reached.append(best.solution.cycle_time)
    return shape, best


def run_times(planned: OnPath, shape: SplineShape) -> FloatArray:
    """(Q,) time on each run of the shape [s]; 0 for runs that do not fit."""
    span = planned.samples.element - len(planned.samples.table.legs)
    on = np.flatnonzero(span >= 0)
    kept = np.flatnonzero(shape.laid.fits)
    run = kept[np.searchsorted(planned.path.spline.first, span[on], side="right") - 1]
    return np.asarray(np.bincount(run, planned.solution.duration[on], len(shape.laid.fits)), dtype=np.float64)


def _chosen(old: SplineShape, new: SplineShape, better: Array) -> SplineShape:
    """The new shape in the runs that are better, else the old one."""
    of_control = np.repeat(better, np.diff(old.laid.span_first) + DEGREE)
    of_site = np.repeat(better, np.diff(old.laid.site_first))
    of_span = np.repeat(better, np.diff(old.laid.span_first))
    control = np.where(of_control[:, None], new.laid.control, old.laid.control)
    return dataclasses.replace(
        old,
        laid=old.laid._replace(control=control),
        used=np.where(of_site, new.used, old.used),
        left=np.where(of_span, new.left, old.left),
    )


def _reshape(
    planned: OnPath, shape: SplineShape, force: FloatArray, H: FloatArray, Q: FloatArray
) -> tuple[SplineShape, FloatArray]:
    """The shape after one round with the bands H of what is paid and Q of the pull; also what the sites' radii cost (J,)
    [s per mm]."""
    goal = Goal(H, Q, force, GAP * run_times(planned, shape), 0.0, np.ones(len(H)))
    relaxed = relax(shape.corridor, shape.laid, shape.runs, shape.used, shape.left, goal)
    laid = shape.laid._replace(control=relaxed.control)
    new = dataclasses.replace(shape, laid=laid, used=relaxed.used, left=relaxed.left)
    return _chosen(shape, new, relaxed.certified & ~cusps(laid)), -relaxed.multiplier / relaxed.used


def tube_prices(planned: OnPath, shape: SplineShape, more: float = 0.0) -> FloatArray:
    """dT/d(tolerance) at every site (J,) [s/mm]: the multipliers of the tube, so much wider [mm], in a round from the present shape."""
    H, Q = price_bands(planned, shape)
    corridor = shape.corridor
    corridor = corridor._replace(tol=corridor.tol + more, tol_chord=corridor.tol_chord + more)
    wider = dataclasses.replace(shape, corridor=corridor, used=shape.used + more, left=shape.left + more)
    _, prices = _reshape(planned, wider, np.full(len(shape.laid.fits), FIRST_FORCE), H, Q)
    return prices


def price_bands(planned: OnPath, shape: SplineShape) -> tuple[FloatArray, FloatArray]:
    """Bands (A, n, 6) over the control points of all runs: H, whose form 1/2 c'Hc has the time's derivatives at the present shape
    (module text) [s/mm2], and Q, of the integral of the squared jerks over their limits."""
    samples, problem, solution = planned.samples, planned.problem, planned.solution
    laid = shape.laid
    span = samples.element - len(samples.table.legs)
    on = np.flatnonzero((span >= 0) & problem.interval)
    kept = np.flatnonzero(laid.fits)
    row = np.searchsorted(planned.path.spline.first, span[on], side="right") - 1
    within = span[on] - planned.path.spline.first[row]
    interval = np.searchsorted(kept[row], np.arange(len(laid.fits) + 1))
    v = np.sqrt(solution.feed_sq)
    duration, jerk = solution.duration[on], solution.jerk_s[on]
    acc = np.stack([solution.acc_s[on], solution.acc_s[on] + jerk * duration], axis=1)
    motion = SplineMotion(
        interval=interval,
        span=within,
        tau=np.stack([samples.w0[on], samples.w1[on]], axis=1),
        feed=np.stack([v[on], v[on + 1]], axis=1),
        acc=acc,
        jerk=jerk,
        duration=duration,
        price=_prices(problem, solution, on),
    )
    H, Q = motion_bands(laid, motion, np.stack([problem.acceleration, _jerk_scale(planned)]))
    return H, Q


def _jerk_scale(planned: OnPath) -> FloatArray:
    """(A,) jerks that the pull counts in: their limits, or, where the motion keeps none, what takes an axis to its acceleration in the
    time in which that moves it by the tolerance [mm/s3]."""
    problem = planned.problem
    if planned.solution.jerk_limited:
        return problem.jerk
    tolerance = float(np.median(planned.path.toolpath.tolerance))
    return problem.acceleration * np.sqrt(problem.acceleration / tolerance) * PULLED


def _prices(problem: FeedrateProblem, solution: FeedrateSolution, on: Array) -> FloatArray:
    """(I, 2, A, 3) weights of squared velocity, acceleration and jerk at both ends of the intervals `on` (module text) [s]."""
    assert solution.multipliers is not None
    axes = len(problem.axes)
    rows = np.abs(solution.multipliers.rows[on])
    slower = [problem.limit_scale[point][:, None] for point in (on, on + 1)]  # squares of shares of limits
    price = np.zeros((len(on), 2, axes, 3))
    price[:, 0, :, 1], price[:, 1, :, 1] = (0.5 * rows[:, :, k] * slower[k // 3] ** 4 for k in (0, 3))
    price[:, 0, :, 2], price[:, 1, :, 2] = (0.5 * rows[:, :, k] * slower[k - 1] ** 6 for k in (1, 2))
    name = np.array(problem.bound_names)[problem.feed_sq_bound[on]]
    feed = solution.multipliers.feed[on].sum(axis=1) / problem.feed_sq_limit[on]
    price[:, 0, :, 0] = np.where(name == "feed", feed, 0.0)[:, None]
    for k, axis in enumerate(problem.axes):
        at = name == f"velocity.{axis}"
        price[at, 0, k, 0] = feed[at] / problem.d1[on[at], k] ** 2
    return price
