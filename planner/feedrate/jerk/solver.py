"""Own kernel for the jerk-limited problem: an interior-point method with a Riccati recursion, linear in the grid.

Minimise the time subject to all second-order limits of `FeedrateProblem` and to the axis jerks

    | r'_k j + 3 r''_k v u + r'''_k v^3 | <= j_k                      at both ends of every interval,

with constant jerk j along the path on every interval, the same transcription as nlp.py, so that both can be compared on one grid.
One window's problem is in window.py, its second-order model in rows.py, the step in interior_point.py. One iteration models
the Lagrangian at the current profile, minimises the barrier problem's linear-quadratic model exactly and goes as far as slacks,
multipliers and kinematics stay in their domains. 15 to 25 iterations, whatever the size.

**Windows.** A long piece is solved in windows of about `window` intervals, or more if the braking distance is long beside that. Each
window ends in a full stop, which is only there to end it. The part of the window that the stop cannot influence is kept, up to three
braking distances before it, and the next window starts from the state reached there, at a point where the costate of the kinematics
says that more speed would help. A start during hard braking into a bend would leave a problem with hardly any feasible points, and
multipliers that mean nothing. What is kept agrees with the solution in one piece (tested). The memory is that of one window.

**Fall-backs.** A window is tried from three starts (window.py). One that converges from none is divided into smaller ones if it starts
at rest; else, or where even that fails, the profile stops: at the end of the window before, if the motion comes from there, or after
the plain start, which always keeps the limits. The solution's status is then ACCEPTABLE, and its sentence names the places. Of 8,900
windows (3,000 small problems of benchmarks/jerk_campaign.py in windows of 1000, 60 and 20 intervals, eight real programs, the golden
jobs) 34 needed a second start, 3 of them a third, and none was left over.

**Feasibility.** At the end a profile may exceed its limits by the solver's tolerance. Slowing a whole piece down by lam >= 1
divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and keeps the kinematics exact; with the smallest lam that
satisfies every row the profile is feasible, always. Its cost, lam - 1, is in the sentence of the solution.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from planner.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.settings import SETTINGS, InteriorPointSettings
from planner.feedrate.jerk.window import ScaledWindow, Window, columns_of
from planner.feedrate.lagrangian import lagrangian
from planner.feedrate.solution import FeedrateSolution, Multipliers, Prices, Status

# Joining windows. How far a window's stop must be from what is kept, in braking distances [-]: 2 costs 1e-4 of some profiles' time, 5
# gains nothing.
BRAKING_WAYS = 3.0
# At most this fraction of a window is kept [-]: the rest is the way ahead that the next window starts with.
KEPT_SHARE_MAX = 0.95
# ... and at least this fraction of what can be [-]. In between, the point where more speed would help most: to keep all, whatever
# the state there, costs up to 0.8 % of a profile's time.
JOIN_SHARE = 0.85
# Where less than this fraction of a window can be kept [-], windows become twice as large (never: a sixth more windows), ...
KEPT_SHARE_MIN = 0.5
# ... up to so many times the usual one, for the memory's sake, ...
LARGEST = 32
# ... and where more is kept, half as large again, down to the usual one: for the memory's sake too, the time is the same.
KEPT_SHARE_HIGH = 0.8
# A window ends where the grid is finest in this last part of it [-]: a stop needs points.
END_SHARE = 0.25
# Intervals: a smaller window that does not converge is not divided any further: from rest the plain start does for so few.
SMALLEST_WINDOW = 100
# Into so many smaller windows one that does not converge is divided.
DIVISION = 5
INTERVALS_MIN = 4  # from rest to rest: the plain start needs as many
PLACES_NAMED = 3  # in a sentence


@dataclass(frozen=True, kw_only=True)
class JerkLimited:
    """The interior-point solver for third-order problems.

    tol        : relative gap at which a window is optimal
    iterations : at most, per window
    window     : intervals solved at a time
    settings   : of the interior-point method; the same for every problem
    """

    tol: float = 1e-4
    iterations: int = 100
    window: int = 1_000
    settings: InteriorPointSettings = field(default=SETTINGS, repr=False)

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces; ends must be at rest. Failures are a status.

        progress : called with the share of the points that is done
        """
        began = time.perf_counter()
        if problem.feed_sq_start.any() or problem.feed_sq_end.any():
            raise ValueError("JerkLimited: pieces must start and end at rest")
        short = np.flatnonzero(np.diff(problem.piece) <= INTERVALS_MIN)
        if len(short):
            at = problem.s[problem.piece[short[0]]]
            sentence = f"piece {short[0]} (from s = {at:.6g} mm) has fewer than {INTERVALS_MIN} intervals; refine the grid"
            return FeedrateSolution.failed(problem, Status.INFEASIBLE, sentence, repr(self), 0.0)
        profile = _Profile(problem, self, progress)
        for first, beyond in zip(problem.piece[:-1], problem.piece[1:], strict=True):
            profile.solve_piece(int(first), int(beyond) - 1)
        slower = profile.slow_down()
        sentence = f"slowed by {slower - 1.0:.1e} to keep every limit; time-optimal within {self.tol:g} for the limits with jerk"
        if profile.stops:
            places = ", ".join(f"{problem.s[k]:.6g}" for k in profile.stops[:PLACES_NAMED])
            more = ", ..." if len(profile.stops) > PLACES_NAMED else ""
            sentence += (
                f", except {len(profile.stops)} full stops where the method did not converge, at s = {places}{more} mm: "
                "coarsen the path where points nearly coincide, refine it where the feed changes much between points"
            )
        solution = FeedrateSolution(
            status=Status.ACCEPTABLE if profile.stops else Status.OPTIMAL,
            sentence=sentence,
            solver=repr(self),
            feed_sq=profile.x,
            acc_s=profile.u,
            jerk_s=profile.jerk,
            duration=profile.duration,
            solve_time=0.0,
            iterations=profile.iterations,
            jerk_limited=True,
            multipliers=profile.multipliers(),
            effort={
                "windows": profile.windows,
                "other starts": profile.other_starts,
                "other ends": profile.other_ends,
                "divided": profile.divided,
                "standstills": len(profile.stops),
            },
        )
        found = lagrangian(problem, solution)
        prices = Prices.from_relative(problem, found.acceleration, found.jerk, found.feed_sq_max)
        return replace(solution, prices=prices, solve_time=time.perf_counter() - began)


class _Profile:
    """The profile of all points as it grows, window by window."""

    def __init__(
        self, problem: FeedrateProblem, solver: JerkLimited, progress: Callable[[float], None] | None
    ):
        self.problem = problem
        self.solver = solver
        self._progress = progress
        points, axes = problem.d1.shape
        self.x, self.u = np.zeros(points), np.zeros(points)
        self.jerk, self.duration = np.zeros(points), np.zeros(points)
        self.rows, self.feed, self.dynamics = (
            np.zeros((points, axes, 4)),
            np.zeros((points, 2)),
            np.zeros(points),
        )
        self.iterations = 0
        # windows solved; how often not from the first start, not with the first end, and divided into smaller ones
        self.windows = self.other_starts = self.other_ends = self.divided = 0
        self.stops: list[int] = []  # points where the profile rests because nothing better was found
        self._rest: Window | None = None  # what the window before knew of the way ahead, down to its stop
        self.columns, self.room = columns_of(problem), Room()

    def solve_piece(self, first: int, last: int) -> None:
        """Solve the points first..last in windows."""
        begin, size, divided = first, self.solver.window, False
        while begin < last:
            end = self._window_end(begin, size, last)
            found = self._solve_window(begin, end)
            if found is None:
                if end - begin > SMALLEST_WINDOW and self.x[begin] == 0.0:
                    size, divided = max((end - begin) // DIVISION, SMALLEST_WINDOW), True
                    self.divided += 1
                else:
                    begin = self._stop(begin, end)
                    size, divided = self.solver.window, False
                continue
            keep = end if end == last else self._unfelt(begin, end, found)
            share = (keep - begin) / (end - begin)
            if not divided and (
                share == 0.0 or (share < KEPT_SHARE_MIN and size < LARGEST * self.solver.window)
            ):
                size *= 2  # beside this window the way to brake is long
                continue
            if keep == begin:
                keep = end
                self.stops.append(end)
            self._keep(begin, keep, found)
            begin = keep
            if divided:
                size, divided = self.solver.window, False
            elif share > KEPT_SHARE_HIGH and size > self.solver.window:
                size //= 2

    def _window_end(self, begin: int, size: int, last: int) -> int:
        """The last point of a window: where the grid is finest near its end; no sooner than the stop that the way ahead knows."""
        if last - begin <= size + INTERVALS_MIN:
            return last
        earliest = begin + size - int(END_SHARE * size)
        s = self.problem.s
        spread = s[earliest + 1 : begin + size + 2] - s[earliest - 1 : begin + size]
        end = earliest + int(np.argmin(spread))
        if self._rest is not None and self.x[begin] > 0.0:
            end = max(end, begin + len(self._rest.x) - 1)
        return end

    def _stop(self, begin: int, end: int) -> int:
        """Where no window converges: down to the last window's stop, or from rest with the plain start; returns where it ends."""
        if self._rest is not None and self.x[begin] > 0.0:
            end = begin + len(self._rest.x) - 1
            self._keep(begin, end, self._rest)
        else:
            self._keep(begin, end, self._scaled(begin, end).plain())
        self.stops.append(end)
        return end

    def _scaled(self, begin: int, end: int) -> ScaledWindow:
        return ScaledWindow.of(self.problem, self.columns, begin, end, self.room, self.solver.settings)

    def _solve_window(self, begin: int, end: int) -> Window | None:
        """Solve the points begin..end, from the state at `begin` to rest at `end`; None if that does not converge."""
        behind = self._rest if self.x[begin] > 0.0 else None
        found, done, starts = self._scaled(begin, end).solve(behind, self.solver.tol, self.solver.iterations)
        self.iterations = max(self.iterations, done)
        self.windows += 1
        self.other_starts += starts - 1
        return found

    def _unfelt(self, begin: int, end: int, found: Window) -> int:
        """Where to go on from: a point from which the window's end is far beyond the way to brake, one of the last such points.

        Of these the one where more speed would help most (costate times feed^2). Where less would help, while the motion brakes into a
        bend with all its jerk, its state is at the edge of what can still be continued: a problem that starts there has hardly any
        room, and its multipliers say nothing.
        """
        problem = self.problem
        own = slice(begin, end + 1)
        a, j = problem.acceleration_limit[own].min(), problem.jerk_limit[own].min()
        brake = found.x / (2.0 * a) + np.sqrt(found.x) * a / (2.0 * j)
        free = np.flatnonzero(problem.s[end] - problem.s[begin : end + 1] >= BRAKING_WAYS * brake)
        free = free[free <= KEPT_SHARE_MAX * (end - begin)]
        if not len(free):
            return begin
        last = free[free >= JOIN_SHARE * free[-1]]
        return begin + int(last[np.argmin(found.dynamics[last] * found.x[last])])

    def _keep(self, begin: int, end: int, found: Window) -> None:
        """Take over the intervals begin..end of a window and the state at `end`."""
        count = end - begin
        self.x[begin : end + 1], self.u[begin : end + 1] = found.x[: count + 1], found.u[: count + 1]
        self.jerk[begin:end], self.duration[begin:end] = found.jerk[:count], found.duration[:count]
        self.rows[begin:end], self.feed[begin:end] = found.rows[:count], found.feed[:count]
        self.dynamics[begin:end] = found.dynamics[:count]
        if self._progress is not None:
            self._progress(end / len(self.problem))
        self._rest = found.after(count)

    def slow_down(self) -> float:
        """Slow every piece until all rows hold at its grid points; returns the largest factor."""
        problem, axes = self.problem, len(self.problem.axes)
        inner = np.flatnonzero(problem.interval)
        factor = np.ones(len(problem))
        v, u, j = np.sqrt(self.x), self.u, self.jerk
        factor = np.maximum(factor, np.sqrt(self.x / problem.feed_sq_limit))
        for points, d2, d3 in (
            (inner, problem.d2_right, problem.d3_right),
            (inner + 1, problem.d2_left, problem.d3_left),
        ):
            d1, d2, d3 = problem.d1[points], d2[points], d3[points]
            x_here, v_here, u_here = self.x[points, None], v[points, None], u[points, None]
            acceleration = np.abs(d1 * u_here + d2 * x_here) / self.columns.acceleration[points]
            jerk = np.abs(d1 * j[inner, None] + v_here * (3.0 * d2 * u_here + d3 * x_here))
            jerk = jerk / problem.jerk_limit[points]
            worst = np.maximum(np.sqrt(acceleration), np.cbrt(jerk)).reshape(-1, axes).max(axis=1)
            factor[inner] = np.maximum(factor[inner], worst)
        largest = np.maximum.reduceat(factor, problem.piece[:-1])
        by = np.repeat(largest, np.diff(problem.piece))
        self.x, self.u, self.jerk = self.x / by**2, self.u / by**2, self.jerk / by**3
        self.duration = self.duration * by
        return float(largest.max())

    def multipliers(self) -> Multipliers:
        """Of all intervals."""
        return Multipliers(rows=self.rows, feed=self.feed, dynamics=self.dynamics)
