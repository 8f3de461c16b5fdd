"""Corners taken slowly enough for filters, before delivery/filters.py slows down whole runs.

A filtered motion passes a vertex at the mean of its positions within Td: the longer the motion takes for the
corner itself, the less the way in and out counts. So only the feed close to a corner that is missed is
limited; the motion brakes and speeds up as steeply as the axes allow. The error of a corner rises with a
power of the square of its feed: each corner looks for the root of its own error, by secants in logarithms,
and the problem is solved again with all of them, until no corner is missed and none has room left. Where the
contour is left away from corners, the feed is limited wherever the filters hold the motion at that moment.

The rounds keep limits at grid points; what they end with keeps them between, and the tolerance (`kept`).
Along arcs a closed form gives the bound beforehand (constraints/assemble.py).
"""

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.delivery.filters import ROOM_LEAST, Behind, Violations, kept, rested
from planner.delivery.path_errors import SPARE, Errors
from planner.feedrate.constraints.limits import FILTER_ERROR
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.motion.timing import Motion
from planner.planning.job.job import Job
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import Order, solve_again
from planner.planning.optimal.tighten import within_limits

# Rounds at most.
ROUNDS = 16
# The feed is limited this far on both sides of a corner [tolerances]: the shorter, the more it is like
# waiting at the vertex. Where the least feed is not enough, a point more on each side.
REACH = 0.3
# Vertices that turn by more are corners [rad], others are places of the contour.
SHARP = float(np.deg2rad(20.0))
POWER = (0.5, 4.0)  # of the feed squared with which an error is taken to rise, least and most [-]; at first 1
CHANGE = 10.0  # by what the square of a feed changes in a round at most [-]
EDGE = 0.1  # of the way from too slow to too fast that a secant keeps from both, in logarithms [-]
AIM = 0.01  # of the tolerance: what the search leaves unused [-]; it ends where no feed squared may grow by more than WORTH [-]
WORTH = 0.05
HELD = 1e-3  # a square of a feed that is below its bound by less than this share is held by it [-]
CREEP = 1e-3  # of the feed before the first round: it is not limited to less [-], or the motion would stand where it cannot go on
# A motion that leaves the tolerance takes less time than what comes of it, or at most so much more [-].
BACK = 1.1
BOUND = FILTER_ERROR.name


def within_filters(planned: OnPath, motion: Motion, order: Order, job: Job) -> tuple[OnPath, Motion, bool]:
    """The fastest motion found that keeps the tolerance behind the machine's filters, the solution that it
    comes from, and whether the filters made it slower. A motion that takes longer than `job.most` is not
    asked for: the search ends there, without what it looks for.

    motion : that of `planned`, which keeps all limits
    """
    machine, toolpath = job.real
    if machine.fir is None or motion.end > job.most:
        return planned, motion, False
    behind, plain = Behind(toolpath, machine), planned.problem
    of_path = behind.path_errors(motion)
    corners = CornerFeeds(plain, motion, behind, of_path)
    contour = _Contour(corners, behind, of_path)
    best, fastest = planned, np.inf
    filtered = BOUND in (plain.bound_names[k] for k in np.unique(plain.feed_sq_bound))
    for _ in range(ROUNDS):
        waiting = rested(behind, motion)
        places = behind.places(waiting, of_path)
        missed = len(places.time) > 0
        slowed = waiting.end / np.sqrt(places.less.min(initial=1.0))  # what `kept` would make of it, about
        job.tell("filters", found=waiting.end, places=len(places.time), kept=bool(slowed < fastest))
        filtered |= missed or waiting.end > motion.end
        late = missed and waiting.end > BACK * job.most
        if late or not (missed or planned.problem is not plain):
            return planned, waiting, filtered
        if slowed < fastest:
            best, fastest = planned, slowed
        of = corners.of_places(places)
        more = max(corners.step(waiting, places, of), contour.step(waiting, places, of))
        if not missed and more <= 1.0 + WORTH:
            break
        bound = np.minimum(corners.at_points(), contour.bound)
        limited = _limited(plain, np.maximum(bound, corners.least))
        if np.array_equal(limited.feed_sq_max, planned.problem.feed_sq_max):
            break  # nothing else would be found again
        planned = solve_again(planned, limited, order.solver)
        if not planned.solution.solved:
            break
        motion = planned.motion()
    best, motion = within_limits(best, order, job.toolpath, job.machine)
    return best, kept(motion, toolpath, machine), filtered


class CornerFeeds:
    """The squares of the feeds that the corners allow, of N+1 vertices on P grid points.

    zone  : grid points [a, b) that each bound is for
    bound : (N+1,) [mm2/s2]; inf for a corner that was never missed, and for vertices that are none
    """

    def __init__(self, problem: FeedrateProblem, motion: Motion, behind: Behind, of_path: Errors):
        self.zone = _zones(problem, motion, of_path.near_time, REACH * behind.tolerance)
        self.least = CREEP**2 * np.square(motion.law.feed)
        self.sharp = np.zeros(len(of_path.near), bool)
        self.sharp[behind.path.joint] = behind.toolpath.theta > SHARP
        self.delay, self.path = behind.filters.delay, of_path.near
        self.room = np.maximum(1.0 - AIM - self.path, ROOM_LEAST)
        count = len(self.zone)
        self.bound, self.fast, self.slow = np.full(count, np.inf), np.full(count, np.inf), np.zeros(count)
        self.power, self.before = np.ones(count), np.full((2, count), np.nan)

    def of_places(self, places: Violations) -> Array:
        """(n,) the corner passed next to each place, within half of the delay; -1 where none is."""
        corner = np.flatnonzero(self.sharp)
        corner = np.concatenate([[-1], corner[np.argsort(places.near_time[corner], kind="stable")], [-1]])
        time = np.concatenate([[-np.inf], places.near_time[corner[1:-1]], [np.inf]])
        after = np.searchsorted(time, places.time).clip(1)
        nearer = after - (places.time - time[after - 1] < time[after] - places.time)
        return np.where(np.abs(time[nearer] - places.time) <= self.delay / 2, corner[nearer], -1)

    def step(self, motion: Motion, places: Violations, of: Array) -> float:
        """The next bounds; by what factor one of them grows at most [-].

        of : (n,) the corner of each place
        """
        feed_sq = np.square(motion.law.feed)
        near = places.near.copy()
        np.maximum.at(near, of[of >= 0], places.ratio[of >= 0])
        missed = self.sharp & (near > 1.0 - SPARE)
        for i in np.flatnonzero(missed):
            a, b = self.zone[i]
            if (feed_sq[a:b] <= self.least[a:b] * (1.0 + HELD)).all():
                self.zone[i] = max(a - 1, 0), min(b + 1, len(feed_sq))
        now = np.array([feed_sq[a:b].max() for a, b in self.zone])
        moving = np.array([feed_sq[a:b].min() for a, b in self.zone]) > 0.0  # a full stop is not made slower
        now = np.where(moving, now, 1.0)
        to = self.secant(now, np.maximum((near - self.path) / self.room, ROOM_LEAST))
        held = moving & (self.bound < np.inf) & (now > self.bound * (1.0 - HELD))
        self.bound = np.where((moving & missed) | held, to, self.bound)
        return float((to[held] / now[held]).max(initial=1.0))

    def secant(self, now: FloatArray, error: FloatArray) -> FloatArray:
        """(N+1,) the squares of the feeds at which the errors would be 1.

        now   : (N+1,) those of a motion [mm2/s2]
        error : (N+1,) its errors, over what they may be [-]
        """
        x, y = np.log(now), np.log(error)
        run, rise = x - self.before[0], y - self.before[1]
        power = np.divide(rise, run, out=self.power.copy(), where=np.abs(run) > HELD)
        self.power, self.before = np.clip(power, *POWER), np.array([x, y])
        self.fast = np.where(y > 0.0, now, np.where(self.fast > now, self.fast, np.inf))
        self.slow = np.where(y > 0.0, np.where(self.slow < now, self.slow, 0.0), now)
        between = (self.slow > 0.0) & (self.fast < np.inf)
        edge = np.divide(self.fast, self.slow, out=np.ones(len(now)), where=between) ** EDGE
        to = now * np.exp(np.clip(-y / self.power, -np.log(CHANGE), np.log(CHANGE)))
        return np.where(between, np.clip(to, self.slow * edge, self.fast / edge), to)

    def at_points(self) -> FloatArray:
        """(P,) the bounds at the grid points."""
        bound = np.full(len(self.least), np.inf)
        for i in np.flatnonzero(self.bound < np.inf):
            a, b = self.zone[i]
            bound[a:b] = np.minimum(bound[a:b], self.bound[i])
        return bound


class _Contour:
    """The squares of the feeds (P,) that grid points allow where the filtered motion leaves the contour away
    from corners: less while it does, and more while the whole piece of the path has room, up to halfway to
    what was too fast, in logarithms."""

    def __init__(self, corners: CornerFeeds, behind: Behind, of_path: Errors):
        points = len(corners.least)
        self.behind, self.path = behind, of_path.worst
        self.room = np.maximum(1.0 - AIM - self.path, ROOM_LEAST)
        self.piece = np.searchsorted([(a + b) / 2 for a, b in corners.zone[1:-1]], np.arange(points))
        self.bound, self.fast = np.full((2, points), np.inf)

    def step(self, motion: Motion, places: Violations, of: Array) -> float:
        """The next bounds; by what factor one of them grows at most [-].

        of : (n,) the corner of each place: what is beside one that is missed is left to it
        """
        at = (of < 0) | (places.near[of] <= 1.0 - SPARE)
        at &= ~self.behind.beside_stop(motion, places.time)
        t, time, delay = motion.law.t, places.time[at], self.behind.filters.delay
        first, last = (
            np.searchsorted(t, time - 0.75 * delay),
            np.searchsorted(t, time - 0.25 * delay, side="right"),
        )
        less = np.ones(len(self.bound))
        for a, b, by in zip(first, np.maximum(last, first + 1), places.less[at], strict=True):
            less[a:b] = np.minimum(less[a:b], max(by, 1.0 / CHANGE))
        feed_sq = np.square(motion.law.feed)
        over, held = less < 1.0, feed_sq > self.bound * (1.0 - HELD)
        grows = (self.bound < np.inf) & (self.bound > 0.0) & ~over
        half = np.sqrt(np.divide(self.fast, self.bound, out=np.ones(len(less)), where=grows))
        room = self.room / np.maximum(places.worst - self.path, self.room / CHANGE)
        more = np.clip(room[self.piece], 1.0, np.maximum(half, 1.0))
        self.fast = np.where(over, feed_sq, self.fast)
        self.bound = np.where(over, np.minimum(self.bound, feed_sq * less), self.bound * more)
        return float(more[held].max(initial=1.0))


def _zones(problem: FeedrateProblem, motion: Motion, time: FloatArray, reach: float) -> list[tuple[int, int]]:
    """Grid points [a, b) within `reach` [mm] of where the motion is at times (n,), one at least."""
    law = motion.law
    at = np.clip(np.searchsorted(law.t, time, side="right") - 1, 0, len(law.t) - 1)
    tau = np.clip(time - law.t[at], 0.0, np.append(np.diff(law.t), 0.0)[at])
    s = law.s[at] + tau * (law.feed[at] + tau * (law.acc_s[at] / 2 + tau * law.jerk_s[at] / 6))
    first, last = np.searchsorted(problem.s, s - reach), np.searchsorted(problem.s, s + reach, side="right")
    near = np.clip(np.searchsorted(problem.s, s), 1, len(problem) - 1)
    near -= s - problem.s[near - 1] < problem.s[near] - s
    none = first == last
    first, last = np.where(none, near, first), np.where(none, near + 1, last)
    return list(zip(first.tolist(), last.tolist(), strict=True))


def _limited(problem: FeedrateProblem, bound: FloatArray) -> FeedrateProblem:
    """The problem with bounds (P,) of the square of the feed."""
    tighter = (bound < problem.feed_sq_max) & (bound > 0.0)
    names = problem.bound_names if BOUND in problem.bound_names else (*problem.bound_names, BOUND)
    return dataclasses.replace(
        problem,
        feed_sq_max=np.where(tighter, bound, problem.feed_sq_max),
        feed_sq_bound=np.where(tighter, names.index(BOUND), problem.feed_sq_bound),
        bound_names=names,
    )
