"""Corners taken slowly enough for the filters behind: what methods `optimal` and `toppra` do before `behind.kept` has the last word.

A filtered motion passes a vertex by the mean of where the motion was within Td: the longer the motion takes for the corner itself, the
less its way in and out counts. So it is the feed close to a place where the filtered motion leaves the tolerance that is limited, and
nothing else: braking and speeding up stay as steep as the axes allow. The feedrate problem is solved again with that bound, its square
smaller than the feed was by as much as the error has to be, until nothing is left.

Along arcs, where curvature and feed are constant, the closed form says it beforehand (constraints/assemble.py).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.methods.behind import Behind, Places, kept, rested
from planner.methods.reshape import OnPath
from planner.timing import Motion

ROUNDS = 8
# The feed is limited this far on both sides of a place [tolerances]: about the length of a corner rounded within half of it.
REACH = 4.0
POWER = 1.3  # of the factor that the error has to fall by, on the square of the feed
CREEP = 1e-3  # of the feed before the first round: it is not limited to less [-]
BOUND = "filter_error"

Finish = Callable[[OnPath, FeedrateProblem], tuple[OnPath, Motion] | None]


def within_filters(
    planned: OnPath, motion: Motion, solve: Finish, toolpath: Toolpath, machine: Machine
) -> tuple[OnPath, Motion]:
    """The fastest motion found that keeps the tolerance behind the machine's filters, and the solution that it comes from.

    motion : that of `planned`, which keeps all limits
    solve  : the motion of another problem on the same grid, None if there is none
    """
    if machine.fir is None:
        return planned, motion
    behind = Behind(toolpath, machine)
    path = behind.path_shares(motion)
    least = CREEP**2 * np.square(motion.law.feed)
    for _ in range(ROUNDS):
        places = behind.places(rested(behind, motion), path)
        if not len(places.time):
            break
        slower = solve(planned, _limited(planned.problem, motion, behind, places, least))
        if slower is None:
            break
        planned, motion = slower
    return planned, kept(motion, toolpath, machine)


def _limited(
    problem: FeedrateProblem, motion: Motion, behind: Behind, places: Places, least: FloatArray
) -> FeedrateProblem:
    law = rested(behind, motion).law
    middle = places.time - behind.filters.delay / 2
    at = np.clip(np.searchsorted(law.t, middle, side="right") - 1, 0, len(law.t) - 1)
    tau = np.clip(middle - law.t[at], 0.0, np.append(np.diff(law.t), 0.0)[at])
    s = law.s[at] + tau * (law.feed[at] + tau * (law.acc_s[at] / 2 + tau * law.jerk_s[at] / 6))
    reach = REACH * behind.tolerance
    first, last = np.searchsorted(problem.s, s - reach), np.searchsorted(problem.s, s + reach, side="right")
    less = np.ones(len(problem))
    for a, b, by in zip(first, last, places.less, strict=True):
        less[a:b] = np.minimum(less[a:b], by)
    now = np.maximum(np.square(law.feed), least)
    bound = np.where(less < 1.0, np.maximum(now * less**POWER, least), np.inf)
    tighter = (bound < problem.feed_sq_max) & (bound > 0.0)
    names = problem.bound_names if BOUND in problem.bound_names else (*problem.bound_names, BOUND)
    return dataclasses.replace(
        problem,
        feed_sq_max=np.where(tighter, bound, problem.feed_sq_max),
        feed_sq_bound=np.where(tighter, names.index(BOUND), problem.feed_sq_bound),
        bound_names=names,
    )
