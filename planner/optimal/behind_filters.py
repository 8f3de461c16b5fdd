"""Corners taken slowly enough for the filters behind the setpoints, before delivery/filters.py slows down whole runs.

A filtered motion passes a vertex at the mean of its positions within Td: the longer the motion takes for the corner itself, the less
the way in and out counts. Therefore only the feed close to a place where the filtered motion leaves the tolerance is limited; the
motion brakes and speeds up as steeply as the axes allow. The feedrate problem is solved again with that bound, feed squared reduced in
proportion to the error, until no such place is left.

Along arcs, where curvature and feed are constant, a closed form gives the bound beforehand (constraints/assemble.py).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.limits import FILTER_ERROR
from planner.constraints.problem import FeedrateProblem
from planner.delivery.filters import ROOM_LEAST, Behind, Violations, kept, rested
from planner.job.job import Job
from planner.motion.timing import Motion
from planner.optimal.on_path import OnPath
from planner.optimal.order import Order, solve_again
from planner.optimal.tighten import within_limits

ROUNDS = 10  # at most; pentagon and zig-zag behind 20/13 and 50/30 ms take 1 to 7
# The feed is limited this far on both sides of a place [tolerances]. Pentagon at 20/13 and 50/30 ms with 0.3, 1, 2, 4: 1.030, 1.033,
# 1.055, 1.102 s and 1.177, 1.195, 1.221, 1.307 s: the shorter, the more it is like waiting at the vertex.
REACH = 0.3
# The error of a corner goes with the square of its feed, so that the square changes by the factor by which the error has to; in a round
# by no more than these [-], since braking and speeding up around the corner change that factor.
CHANGE_MIN, CHANGE_MAX = 0.1, 2.0
AIM = 0.01  # of the tolerance: what the search leaves unused [-]; it ends where no feed may grow by more than WORTH [-]
WORTH = 0.05
CREEP = 1e-3  # of the feed before the first round: it is not limited to less [-], or the motion would stand where it cannot go on
# A round may take longer than the plan that comes of it all, by this factor at most [-]: by 1.09 in 45 plans of random jobs.
BACK = 1.1
BOUND = FILTER_ERROR.name


def within_filters(
    planned: OnPath, motion: Motion, order: Order, job: Job, useless: Callable[[float], bool]
) -> tuple[OnPath, Motion]:
    """The fastest motion found that keeps the tolerance behind the machine's filters, and the solution that it comes from.

    motion  : that of `planned`, which keeps all limits
    useless : whether a motion that takes so long [s] is not asked for: the search ends there, without what it looks for
    """
    machine, toolpath = job.real
    if machine.fir is None or useless(motion.end):
        return planned, motion
    behind = Behind(toolpath, machine)
    path, plain = behind.path_shares(motion), planned.problem
    corner = np.full(len(path[1]), np.inf)  # square of the feed that each vertex allows
    elsewhere = plain.feed_sq_max.copy()
    least = CREEP**2 * np.square(motion.law.feed)
    best: tuple[OnPath, Motion] | None = None
    for _ in range(ROUNDS):
        waiting = rested(behind, motion)
        if useless(waiting.end / BACK):
            return best or (planned, waiting)
        places = behind.places(waiting, path)
        if not len(places.time) and (best is None or waiting.end < best[1].end):
            best = planned, waiting
        job.tell(
            "filters",
            found=waiting.end,
            places=len(places.time),
            kept=best is not None and best[1] is waiting,
        )
        zone = _zones(plain, waiting, behind, places.near_time)
        now = np.array([waiting.law.feed[a:b].min() ** 2 for a, b in zone])
        change = np.where(now > 0.0, _change(places, path[1]), 1.0)  # a full stop is not made slower
        if not len(places.time) and not (np.isfinite(corner) & (change > 1.0 + WORTH)).any():
            break
        corner = np.where(change < 1.0, np.minimum(corner, now), corner) * np.where(
            np.isfinite(corner) | (change < 1.0), change, 1.0
        )
        elsewhere = _elsewhere(elsewhere, plain, waiting, behind, places)
        limited = _limited(plain, zone, corner, elsewhere, least)
        if np.array_equal(limited.feed_sq_max, planned.problem.feed_sq_max):
            break  # nothing else would be found again
        slower = solve_again(planned, limited, order.solver)
        if not slower.solution.solved:
            break
        planned, motion = within_limits(slower, order, job.toolpath, job.machine)
    if best is not None and best[0] is planned:
        return best
    if best is None and useless(motion.end):
        return planned, motion
    last = planned, kept(motion, toolpath, machine)
    return last if best is None or last[1].end < best[1].end else best


def _change(places: Violations, path: FloatArray) -> FloatArray:
    """(N+1,) by what the square of the feed at every vertex may change."""
    room = np.maximum(1.0 - AIM - path, ROOM_LEAST)
    return np.clip(room / np.maximum(places.near - path, room / 4.0), CHANGE_MIN, CHANGE_MAX)


def _zones(
    problem: FeedrateProblem, motion: Motion, behind: Behind, near_time: FloatArray
) -> list[tuple[int, int]]:
    """Grid points [a, b) around the places that the motion passes half of the delay before the times (n,)."""
    law = motion.law
    middle = near_time - behind.filters.delay / 2
    at = np.clip(np.searchsorted(law.t, middle, side="right") - 1, 0, len(law.t) - 1)
    tau = np.clip(middle - law.t[at], 0.0, np.append(np.diff(law.t), 0.0)[at])
    s = law.s[at] + tau * (law.feed[at] + tau * (law.acc_s[at] / 2 + tau * law.jerk_s[at] / 6))
    reach = REACH * behind.tolerance
    first, last = np.searchsorted(problem.s, s - reach), np.searchsorted(problem.s, s + reach, side="right")
    near = np.clip(np.searchsorted(problem.s, s), 1, len(problem) - 1)
    near -= s - problem.s[near - 1] < problem.s[near] - s
    none = first == last  # then the nearest point
    first, last = np.where(none, near, first), np.where(none, near + 1, last)
    return list(zip(first.tolist(), last.tolist(), strict=True))


def _elsewhere(
    bound: FloatArray, problem: FeedrateProblem, motion: Motion, behind: Behind, places: Violations
) -> FloatArray:
    """The bound (P,), smaller where the filtered motion leaves the contour."""
    bound, now = bound.copy(), np.square(motion.law.feed)
    contour = (places.vertex < 0) & ~behind.beside_stop(motion, places.time)
    less = np.ones(len(bound))
    for (a, b), by in zip(
        _zones(problem, motion, behind, places.time[contour]), places.less[contour], strict=True
    ):
        less[a:b] = np.minimum(less[a:b], by)
    return np.where(less < 1.0, np.minimum(bound, now * less), bound)


def _limited(
    problem: FeedrateProblem,
    zone: list[tuple[int, int]],
    corner: FloatArray,
    elsewhere: FloatArray,
    least: FloatArray,
) -> FeedrateProblem:
    bound = elsewhere.copy()
    for i in np.flatnonzero(np.isfinite(corner)):
        a, b = zone[i]
        bound[a:b] = np.minimum(bound[a:b], corner[i])
    bound = np.maximum(bound, least)
    tighter = (bound < problem.feed_sq_max) & (bound > 0.0)
    names = problem.bound_names if BOUND in problem.bound_names else (*problem.bound_names, BOUND)
    return dataclasses.replace(
        problem,
        feed_sq_max=np.where(tighter, bound, problem.feed_sq_max),
        feed_sq_bound=np.where(tighter, names.index(BOUND), problem.feed_sq_bound),
        bound_names=names,
    )
