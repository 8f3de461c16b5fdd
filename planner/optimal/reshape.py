"""A round of reshaping: splines give way, within the tolerance, where limits cost their time-optimal motion most.

Let x(t) be the time-optimal motion along a spline and lambda its multipliers, those of the axis jerks for instance. If the parameter of
the spline is kept as a function of time, a small change of the control points changes the optimal time by

    dT = sum over grid points and axes of  |lambda| d(|jerk| / limit)  +  the same of accelerations, velocities and feed,

which is the gradient of sum |lambda|/2 (jerk/limit)^2 + ... at the present shape. This sum is a convex quadratic in the control points,
because the motion is linear in them. A round minimises it, with a pull towards the present shape,

    sum |lambda|/2 (jerk/limit)^2 + ...  +  force/2 integral ((jerk - jerk_now)/limit)^2 dt,

inside the corridor (smoothing/). The feedrate problem is then solved on the new path. Runs that got faster keep their new shape and are
pulled less in the next round; the others keep their old shape and are pulled more (optimal/loop.py). When nothing can be gained to
first order, shape and feed satisfy the optimality conditions of the joint problem, minimum time inside the tolerance.

The multipliers jump from round to round, because limits take turns; their running mean over the rounds works better. Without jerk
limits the profile has corners, at which another limit takes over as soon as the shape gives way; there the mean also includes the
multipliers of the shapes that failed.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.constraints.limits import FEED, VELOCITY
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution
from planner.optimal.on_path import OnPath
from planner.smoothing.basis import DEGREE
from planner.smoothing.forms import SplineMotion, motion_bands
from planner.smoothing.relax import Goal, relax
from planner.smoothing.spline_path import SplineShape, cusps

FIRST_FORCE = 0.5  # of the pull; 0.3 and 1 gain the same within 1e-3 in eight rounds
GAUSS = 0.5 - np.sqrt(3.0) / 6.0  # place of Gauss's rule of two points, from each end of an interval [-]
PULLED = 0.5  # share of the jerk in which the pull counts, without jerk limits [-]
GAP = 1e-4  # of a round's convex problem, share of the run's time [-]: below what a round gains


def run_times(planned: OnPath) -> FloatArray:
    """(Q,) time on each run of splines [s]; 0 for runs that have none."""
    laid = _shape(planned).laid
    span = planned.samples.element - len(planned.samples.table.legs)
    on = np.flatnonzero(span >= 0)
    kept = np.flatnonzero(laid.fits)
    run = kept[np.searchsorted(planned.path.spline.first, span[on], side="right") - 1]
    return np.asarray(np.bincount(run, planned.solution.duration[on], len(laid.fits)), dtype=np.float64)


def chosen(planned: OnPath, new: SplineShape, better: Array) -> SplineShape:
    """The new shape in the runs (Q,) that are better, else that of `planned`."""
    old = _shape(planned)
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


def reshape(
    planned: OnPath, force: FloatArray, H: FloatArray, Q: FloatArray
) -> tuple[SplineShape, FloatArray]:
    """The shape after one round with the bands H of what is paid and Q of the pull (`price_bands`), the latter times `force` (Q,) of
    each run; also what the sites' radii cost (J,) [s/mm]. A run without a certificate keeps its shape."""
    shape = _shape(planned)
    goal = Goal(H, Q, force, GAP * run_times(planned), 0.0, np.ones(len(H)))
    relaxed = relax(shape.corridor, shape.laid, shape.runs, shape.used, shape.left, goal)
    laid = shape.laid._replace(control=relaxed.control)
    new = dataclasses.replace(shape, laid=laid, used=relaxed.used, left=relaxed.left)
    return chosen(planned, new, relaxed.certified & ~cusps(laid)), -relaxed.multiplier / relaxed.used


def corridor_prices(planned: OnPath, more: float = 0.0) -> FloatArray:
    """dT/d(tolerance) at every site (J,) [s/mm]: the multipliers of a corridor wider by `more` [mm], in a round from the present
    shape."""
    shape = _shape(planned)
    H, Q = price_bands(planned)
    corridor = shape.corridor
    corridor = corridor._replace(tol=corridor.tol + more, tol_chord=corridor.tol_chord + more)
    wider = dataclasses.replace(shape, corridor=corridor, used=shape.used + more, left=shape.left + more)
    force = np.full(len(shape.laid.fits), FIRST_FORCE)
    _, prices = reshape(dataclasses.replace(planned, shape=wider), force, H, Q)
    return prices


def price_bands(planned: OnPath) -> tuple[FloatArray, FloatArray]:
    """Bands (A, n, 6) over the control points of all runs: H, whose form 1/2 c'Hc has the time's derivatives at the present shape
    (module text) [s/mm2], and Q, of the integral of the squared jerks over their limits."""
    samples, problem, solution = planned.samples, planned.problem, planned.solution
    laid = _shape(planned).laid
    span = samples.element - len(samples.table.legs)
    on = np.flatnonzero((span >= 0) & problem.interval)
    kept = np.flatnonzero(laid.fits)
    row = np.searchsorted(planned.path.spline.first, span[on], side="right") - 1
    within = span[on] - planned.path.spline.first[row]
    interval = np.searchsorted(kept[row], np.arange(len(laid.fits) + 1))
    duration, jerk = solution.duration[on], solution.jerk_s[on]
    axes = problem.machine_axes
    motion = SplineMotion(
        interval=interval,
        span=within,
        tau=_inside(samples.w0[on], samples.w1[on]),
        feed=np.sqrt(_inside(solution.feed_sq[on], solution.feed_sq[on + 1])),
        acc=_inside(solution.acc_s[on], solution.acc_s[on] + jerk * duration),
        jerk=jerk,
        duration=duration,
        price=_inside(*np.moveaxis(_prices(problem, solution, on), 1, 0)),
    )
    H, Q = motion_bands(laid, motion, np.stack([problem.acceleration[:axes], _jerk_scale(planned)[:axes]]))
    return H, Q


def _inside(start: FloatArray, end: FloatArray) -> FloatArray:
    """(I, 2, ..) values at the two places of Gauss's rule inside each interval, from those at its ends (I, ..): the multipliers of the
    ends stand for what the limits cost along the interval, and a shape that is only paid for at grid points bends between them (after
    16 rounds on the bracket 8e-4 of the time, on a zig-zag 2e-3)."""
    return np.stack([start + GAUSS * (end - start), end + GAUSS * (start - end)], axis=1)


def _shape(planned: OnPath) -> SplineShape:
    assert planned.shape is not None, "a motion on splines keeps their shape"
    return planned.shape


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
