"""A round of reshaping: splines and the motion along them are improved together, within the tolerance.

Along the time-optimal motion of the present path all limits are linearised in the control points and in the
time that every part of it takes; smoothing/combined.py solves that convex problem inside the corridor, with a
pull towards the present shape. The feedrate problem is then solved on the new path. Runs that got faster keep
their new shape, and are pulled less or more in the next round by how much of the promised gain came true; the
others keep their old shape and are pulled more (rounds.py). Where nothing can be gained to first order, shape
and feed satisfy the optimality conditions of the combined problem, minimum time inside the tolerance.

What a wider corridor is worth is asked of another problem, with the multipliers lambda of the motion. If the
parameter of the spline is kept as a function of time, a small change of the control points changes the
optimal time by

    dT = sum over grid points and axes of  |lambda| d(|jerk| / limit)  +  the same of accelerations, velocities and feed,

which is the gradient of sum |lambda|/2 (jerk/limit)^2 + ... at the present shape, a convex quadratic in the
control points. The multipliers of the corridor in

    minimise  sum |lambda|/2 (jerk/limit)^2 + ...  +  force/2 integral ((jerk - jerk_now)/limit)^2 dt

are dT/d(tolerance) at its sites (`corridor_prices`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.feedrate.constraints.limits import CHORD_ERROR, FEED, VELOCITY
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution
from planner.planning.optimal.on_path import OnPath
from planner.smoothing.basis import DEGREE, ORDER
from planner.smoothing.combined import WINDOWS, MotionLimits, StepAim, improve
from planner.smoothing.forms import SplineMotion, add_motion_bands, motion_bands
from planner.smoothing.relax import USED, Goal, relax
from planner.smoothing.spline_path import SplineShape, cusps
from planner.smoothing.windows import REACH

BOUND = 0.98  # of what bounds the square of the feed: from there on it does [-]
PRICED = SIZES.prices_at_once
FORCE = 0.5  # of the pull in `corridor_prices`
GAUSS = 0.5 - np.sqrt(3.0) / 6.0  # place of Gauss's rule of two points, from each end of an interval [-]
PULLED = 0.5  # share of the jerk in which the pull counts, without jerk limits [-]
GAP = 1e-4  # of the convex problem with the multipliers, share of the run's time [-]
# Times at most in windows around sites that are tightened.
AGAIN = 2
UNBOUNDED = 1e12  # stands for a feed or an acceleration that nothing bounds [mm/s], [mm/s2]


def run_times(planned: OnPath) -> FloatArray:
    """(Q,) time on each run of splines [s]; 0 for runs that have none."""
    return _on_runs(planned, planned.solution.duration)


def times_on_chords(planned: OnPath) -> FloatArray:
    """(Q,) time on each run for which the chord error bounds the feed [s]."""
    problem, solution = planned.problem, planned.solution
    chords = np.array([name == CHORD_ERROR.name for name in problem.bound_names])[problem.feed_sq_bound]
    held = chords & (solution.feed_sq > BOUND * problem.feed_sq_limit)
    return _on_runs(planned, np.where(held, solution.duration, 0.0))


def _on_runs(planned: OnPath, values: FloatArray) -> FloatArray:
    """(Q,) sums of values (P,) of the grid's intervals on each run of splines."""
    splines = _shape(planned).splines
    span = planned.samples.element - len(planned.samples.table.legs)
    on = np.flatnonzero(span >= 0)
    kept = np.flatnonzero(splines.fits)
    run = kept[np.searchsorted(planned.path.spline.first, span[on], side="right") - 1]
    return np.asarray(np.bincount(run, values[on], len(splines.fits)), dtype=np.float64)


def chosen(planned: OnPath, new: SplineShape, better: Array) -> SplineShape:
    """The new shape in the runs (Q,) that are better, else that of `planned`."""
    old = _shape(planned)
    of_control = np.repeat(better, np.diff(old.splines.span_first) + DEGREE)
    of_site = np.repeat(better, np.diff(old.splines.site_first))
    of_span = np.repeat(better, np.diff(old.splines.span_first))
    control = np.where(of_control[:, None], new.splines.control, old.splines.control)
    return dataclasses.replace(
        old,
        splines=old.splines._replace(control=control),
        used=np.where(of_site, new.used, old.used),
        left=np.where(of_span, new.left, old.left),
    )


def reshape(planned: OnPath, pull: FloatArray, gap: float) -> tuple[SplineShape, FloatArray]:
    """The shape after one round with the pull (Q,) of each run, inf for those that stay as they are, and what
    it gains to first order (Q,) [s]. A run without a certificate keeps its shape.

    gap : of the convex problem, share of the time [-]
    """
    shape, problem = _shape(planned), planned.problem
    axes, splines, scale = problem.machine_axes, shape.splines, _jerk_scale(planned)
    jerk = problem.jerk if planned.solution.jerk_limited else np.full(len(problem.jerk), UNBOUNDED)
    limits = np.stack([problem.velocity[:axes], problem.acceleration[:axes], jerk[:axes]])
    motion, on = _motion(planned, _ends)
    step = improve(
        shape.corridor,
        splines,
        shape.runs,
        shape.used,
        motion,
        MotionLimits(limits, scale[:axes].copy(), _bounds(planned, on)),
        StepAim(pull, gap, AGAIN, WINDOWS, REACH),
    )
    # where the curve leaves the tolerance between its sites, the nearest one that does not
    new = splines._replace(control=step.control)
    inside, _ = _motion(planned, _inside)
    _, Q = motion_bands(splines, inside, np.stack([problem.acceleration[:axes], scale[:axes]]))
    one = np.ones(len(splines.fits))
    goal = Goal(np.zeros_like(Q), Q, one, GAP * run_times(planned), 0.0, np.ones(axes), REACH)
    kept = relax(shape.corridor, new, shape.runs, step.used, shape.left, goal, only_outside=True)
    splines = splines._replace(control=kept.control)
    used = np.minimum(kept.used, USED * splines.sites.radius)
    found = dataclasses.replace(shape, splines=splines, used=used, left=kept.left)
    return chosen(planned, found, kept.certified & ~cusps(splines)), step.gain


def _bounds(planned: OnPath, on: Array) -> FloatArray:
    """(I, 2) bounds of the feed [mm/s] and of the acceleration across the path [mm/s2] in the intervals `on`:
    programmed feed, and what the bounds of the feed that go with the curvature allow."""
    problem, samples = planned.problem, planned.samples
    of_path = np.array([name == FEED.name or name.startswith(VELOCITY.name) for name in problem.bound_names])
    kappa = np.maximum(samples.kappa_left, samples.kappa_right)
    across = np.where(of_path[problem.feed_sq_bound], UNBOUNDED, kappa * problem.feed_sq_limit)
    feed = np.minimum(planned.path.toolpath.feed[samples.segment[on]], UNBOUNDED)
    return np.stack([feed, np.minimum(across[on], across[on + 1])], axis=1)


def corridor_prices(planned: OnPath) -> FloatArray:
    """dT/d(tolerance) at every site (J,) [s/mm]: the multipliers of the corridor in a round from the present
    shape."""
    shape, (H, Q) = _shape(planned), price_bands(planned)
    goal = Goal(
        H, Q, np.full(len(shape.splines.fits), FORCE), GAP * run_times(planned), 0.0, np.ones(len(H)), REACH
    )
    relaxed = relax(shape.corridor, shape.splines, shape.runs, shape.used, shape.left, goal)
    return np.asarray(-relaxed.multiplier / relaxed.used, dtype=np.float64)


def price_bands(planned: OnPath) -> tuple[FloatArray, FloatArray]:
    """Bands (A, n, 6) over the control points of all runs: H, whose form 1/2 c'Hc has the time's derivatives
    at the present shape (module text) [s/mm2], and Q, of the integral of the squared jerks over their
    limits."""
    problem, splines = planned.problem, _shape(planned).splines
    axes = problem.machine_axes
    limits = np.stack([problem.acceleration[:axes], _jerk_scale(planned)[:axes]])
    H, Q = np.zeros((2, axes, len(splines.control), ORDER))
    for first in range(0, len(problem), PRICED):
        part = slice(first, first + PRICED)
        motion, on = _motion(planned, _inside, part)
        motion = motion._replace(price=_inside(*np.moveaxis(_prices(problem, planned.solution, on), 1, 0)))
        add_motion_bands(splines, motion, limits, H, Q)
    return H, Q


def _motion(
    planned: OnPath, places: Callable[[FloatArray, FloatArray], FloatArray], part: slice = slice(None)
) -> tuple[SplineMotion, Array]:
    """The motion on the splines, which pays nothing, at `places` of each interval, and the intervals of the
    grid (I,) that are on them; of the intervals `part` only."""
    samples, problem, solution = planned.samples, planned.problem, planned.solution
    splines = _shape(planned).splines
    span = samples.element - len(samples.table.legs)
    on = np.arange(len(span))[part]
    on = on[(span[on] >= 0) & problem.interval[on]]
    kept = np.flatnonzero(splines.fits)
    row = np.searchsorted(planned.path.spline.first, span[on], side="right") - 1
    duration, jerk = solution.duration[on], solution.jerk_s[on]
    motion = SplineMotion(
        interval=np.searchsorted(kept[row], np.arange(len(splines.fits) + 1)),
        span=span[on] - planned.path.spline.first[row],
        tau=places(samples.w0[on], samples.w1[on]),
        feed=np.sqrt(places(solution.feed_sq[on], solution.feed_sq[on + 1])),
        acc=places(solution.acc_s[on], solution.acc_s[on] + jerk * duration),
        jerk=jerk,
        duration=duration,
        price=np.zeros((len(on), 2, problem.machine_axes, 3)),
    )
    return motion, on


def _inside(start: FloatArray, end: FloatArray) -> FloatArray:
    """(I, 2, ..) values at the two places of Gauss's rule inside each interval, from those at its ends (I,
    ..): the multipliers of the ends stand for what the limits cost along the interval, and a shape that is
    only paid for at grid points bends between them."""
    return np.stack([start + GAUSS * (end - start), end + GAUSS * (start - end)], axis=1)


def _ends(start: FloatArray, end: FloatArray) -> FloatArray:
    """(I, 2) the values at the ends."""
    return np.column_stack([start, end])


def _shape(planned: OnPath) -> SplineShape:
    assert planned.shape is not None, "a motion on splines keeps their shape"
    return planned.shape


def _jerk_scale(planned: OnPath) -> FloatArray:
    """(A,) jerks that the pull counts in: their limits, or, where the motion keeps none, what takes an axis
    to its acceleration in the time in which that moves it by the tolerance [mm/s3]."""
    problem = planned.problem
    if planned.solution.jerk_limited:
        return problem.jerk
    tolerance = float(np.median(planned.path.toolpath.tolerance))
    return problem.acceleration * np.sqrt(problem.acceleration / tolerance) * PULLED


def _prices(problem: FeedrateProblem, solution: FeedrateSolution, on: Array) -> FloatArray:
    """(I, 2, A, 3) weights of squared velocity, acceleration and jerk at both ends of the intervals `on`
    (module text) [s]."""
    assert solution.multipliers is not None
    axes = problem.machine_axes
    rows = np.abs(solution.multipliers.rows[on, :axes])
    slower = [problem.limit_scale[point][:, None] for point in (on, on + 1)]  # squares of shares of limits
    price = np.zeros((len(on), 2, axes, 3))
    price[:, 0, :, 1], price[:, 1, :, 1] = (0.5 * rows[:, :, k] * slower[k // 3] ** 4 for k in (0, 3))
    price[:, 0, :, 2], price[:, 1, :, 2] = (0.5 * rows[:, :, k] * slower[k - 1] ** 6 for k in (1, 2))
    name = np.array(problem.bound_names)[problem.feed_sq_bound[on]]
    feed = solution.multipliers.feed[on].sum(axis=1) / problem.feed_sq_limit[on]
    price[:, 0, :, 0] = np.where(name == FEED.name, feed, 0.0)[:, None]
    for k, axis in enumerate(problem.axes[:axes]):
        at = name == VELOCITY.called(axis)
        price[at, 0, k, 0] = feed[at] / problem.d1[on[at], k] ** 2
    return price
