"""Grid points on straight elements: where a second-order profile switches, and what a jerk-limited one needs.

Between rest and feed, or between two corners, a straight element is one interval; its end speeds are already
exact, because the limits do not change along it. Inside it the optimum accelerates at the largest rate b,
holds the speed limit, decelerates at b:

    peak below the limit:  one switch,  sigma = (x1 - x0 + 2 b L) / (4 b)
    limit x_c reached:     two,         sigma = (x_c - x0)/(2 b)  and  L - (x_c - x1)/(2 b)

With these points added the profile on the grid *is* the optimum, however long the element.

A jerk-limited profile rounds switches off: on an element of length L, with limits a and j, in about

    tau = min(a/j, (L / (16 j))^(1/3)),

the time to build up a, or half a phase of the move from rest to rest that never reaches a. The second-order
profile with the acceleration j tau, as slow at corners as the jerk asks for at constant speed, tells when and
where things happen; between its events the points are spread in time, every `STEP` tau for the first `NEAR`
tau after an event and before the next, and ever wider in between: step/distance stays STEP/NEAR.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.assemble import feedrate_problem, interval_feed_sq_max
from planner.feedrate.constraints.built_in import feed_sq_at_constant_speed
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import insert_points, straight
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine

# Nearer switches than this share of their interval are one [-]: a peak that just touches the limit. A point
# nearer to an end is that end: rounding put points of tiny intervals there.
SWITCH_MIN = 1e-9

# Spacing of points for jerk-limited profiles (module text) [tau].
STEP = 0.25
NEAR = 1.0


def add_switching_points(
    samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution, machine: Machine
) -> PathSamples:
    """Split the straight intervals of a solved problem where the profile switches. Raises NotSolvedError."""
    x = solution.require().feed_sq
    cap = interval_feed_sq_max(samples, machine)
    interval = _straight(samples)
    x0, x1, cap = x[interval], x[interval + 1], cap[interval]
    length = samples.s[interval + 1] - samples.s[interval]
    along = np.abs(problem.d1[interval]) / problem.acceleration_limit[interval]
    rate = (1.0 - samples.margin[interval]) / along.max(axis=1)
    single = (x1 - x0 + 2.0 * rate * length) / (4.0 * rate)
    capped = x0 + 2.0 * rate * single > cap
    rise = np.where(capped, (cap - x0) / (2.0 * rate), single)
    fall = np.where(capped, length - (cap - x1) / (2.0 * rate), np.inf)
    s0, s1 = samples.s[interval, None], samples.s[interval + 1, None]
    places = s0 + np.stack([rise, fall], axis=1)
    least = SWITCH_MIN * length[:, None]
    real = (places > s0 + least) & (places < s1 - least)
    real[:, 1] &= places[:, 1] - places[:, 0] > SWITCH_MIN * length
    row, _ = np.nonzero(real)
    return insert_points(samples, interval[row], places[real])


def refine_for_jerk(samples: PathSamples, machine: Machine, finer: float = 1.0) -> PathSamples:
    """Split the straight intervals of freshly sampled paths for a jerk-limited solver.

    finer : divides the spacing of the points, for convergence studies [-]

    Raises NotSolvedError where even the second-order problem has no solution.
    """
    axes = samples.path.toolpath.axes
    straight = _straight(samples)
    along = np.abs(samples.d1[straight])
    a = 1.0 / (along / machine.limits("acceleration", axes)).max(axis=1)
    j = 1.0 / (along / machine.limits("jerk", axes)).max(axis=1)
    length = samples.s[straight + 1] - samples.s[straight]
    tau = np.zeros(len(samples))
    tau[straight] = np.minimum(a / j, np.cbrt(length / (16.0 * j)))
    margin = samples.margin.copy()
    margin[straight] = np.maximum(1.0 - tau[straight] * j / a, 0.0)  # leaves the acceleration j tau
    model = replace(samples, margin=margin)
    problem = _slow_at_corners(feedrate_problem(model, machine, measured=True))
    model = add_switching_points(model, problem, Reachability().solve(problem), machine)
    problem = _slow_at_corners(feedrate_problem(model, machine, measured=True))
    solution = Reachability().solve(problem).require()
    interval = _straight(model)
    parent = np.searchsorted(samples.s[straight], model.s[interval], side="right") - 1
    tau_here = tau[straight][parent]
    row, t = _spread(solution.duration[interval] / tau_here, finer)
    at, t = interval[row], t * tau_here[row]
    s = model.s[at] + t * (np.sqrt(solution.feed_sq[at]) + 0.5 * solution.acc_s[at] * t)
    least = SWITCH_MIN * (model.s[at + 1] - model.s[at])
    inside = (s > model.s[at] + least) & (s < model.s[at + 1] - least)
    inside[1:] &= (np.diff(s) > least[1:]) | (np.diff(at) > 0)
    margin = model.margin.copy()
    margin[interval] = 0.0  # straight: nothing to interpolate
    return insert_points(replace(model, margin=margin), at[inside], s[inside])


def _slow_at_corners(problem: FeedrateProblem) -> FeedrateProblem:
    """The problem with what jerks allow at constant speed, |r'''_k| v^3 <= j_k, among its feed bounds."""
    d3 = np.maximum(np.abs(problem.d3_left), np.abs(problem.d3_right))
    allowed = feed_sq_at_constant_speed(d3, problem.jerk_limit)
    return replace(problem, feed_sq_max=np.minimum(problem.feed_sq_max, allowed))


def _spread(whole: FloatArray, finer: float) -> tuple[Array, FloatArray]:
    """Points inside intervals of durations `whole` (n,) [tau], denser at both ends: interval and time."""
    step = STEP / finer
    half = whole / 2.0
    most = np.where(half <= NEAR, half, NEAR * (1.0 + np.log(np.maximum(half, NEAR) / NEAR))) / step
    steps = np.where(whole > step, np.ceil(most), 0).astype(np.int64)  # from each end to the middle
    count = np.maximum(2 * steps - 1, 0)
    row = np.repeat(np.arange(len(whole)), count)
    k = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1
    steps, most = steps[row], most[row]
    from_left = k <= steps
    x = step * np.where(from_left, k, 2 * steps - k) * most / steps
    near = np.where(x <= NEAR, x, NEAR * np.exp(np.maximum(x / NEAR - 1.0, 0.0)))
    return row, np.where(from_left, near, whole[row] - near)


def _straight(samples: PathSamples) -> Array:
    """Indices of the intervals on straight legs."""
    interval = samples.intervals
    return interval[straight(samples.table.legs, samples.element[interval])]
