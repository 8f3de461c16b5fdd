"""Own kernel for the jerk-limited problem: an interior-point method with a Riccati recursion, linear in the grid.

Minimise the time subject to all second-order limits of `FeedrateProblem` and to the axis jerks

    | r'_k j + 3 r''_k v u + r'''_k v^3 | <= j_k                      at both ends of every interval,

with constant jerk j along the path on every interval, the same transcription as nlp.py, so that both can be compared on one grid.
The problem's second-order model is in jerk_rows.py, the step in jerk_kernel.py, the start in jerk_start.py. One iteration models
the Lagrangian at the current profile, minimises the barrier problem's linear-quadratic model exactly and goes as far as slacks,
multipliers and kinematics stay in their domains. 15 to 25 iterations, whatever the size.

**Windows.** A long piece is solved in windows of about `window` intervals. Each window ends in a full stop, which is only a way to
end it: its first part is kept as far as the stop cannot be felt, three ways to brake before it, and the next window starts from
the state reached there. What is kept agrees with the one-piece solution (tested). Memory is that of one window.

**Fall-backs.** A window is tried from the envelope tracked by a motion, where that is found, then from the envelope itself, whose
kinematics are not exact, then from the plain start, and then in smaller windows. Where
even a small one fails the profile stops: at the end of the window before, if the motion comes from there, or after the plain start,
which always keeps the limits. The solution's status is then ACCEPTABLE, and its sentence names the places.

**Feasibility.** At the end a profile may exceed its limits by the solver's tolerance. Slowing a whole piece down by lam >= 1
divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and keeps the kinematics exact; with the smallest lam that
satisfies every row the profile is feasible, always. Its cost, lam - 1, is in the sentence of the solution.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate import jerk_kernel as kernel
from planner.feedrate.jerk_rows import Grid, empty_model, linearise
from planner.feedrate.jerk_start import envelope, envelope_profile, plain_start
from planner.feedrate.lagrangian import acceleration_limits, lagrangian
from planner.feedrate.solution import FeedrateSolution, Multipliers, Prices, Status

START_ROOM = 0.9  # the first profile of a piece keeps every limit times this [-] ...
SLOWER_MAX = 2.0  # ... if it takes no more than this slowing down; from too slow a profile the way is as long as from outside
TRACKING_ROUNDS = 20  # at most, of the first profile; 2 to 6 are the rule
POLISHING_ROUNDS = 3  # of the result, onto exact kinematics: a defect of 1e-9 in feed would be a jerk of its own between samples
POLISHED = 1e-14  # defect, share of the largest feed [-]
GAP_ACCEPTED = 3e-3  # a window that ends with no larger gap than this is still a good profile [-]
RESIDUAL_ACCEPTED = 1e-3  # ... and with no larger residual: slowing down by as much makes it feasible [-]
DEFECT_ACCEPTED = 1e-8  # ... and no larger defect, for which nothing makes up [-]
BRAKING_WAYS = 3.0  # how far a window's stop must be from what is kept, in ways to brake [-]
OVERLAP_SHARE = 0.8  # at most this share of a window is kept [-]
END_SHARE = 0.25  # a window ends where the grid is finest in this last part of it [-]: a stop needs points
SMALLEST_WINDOW = 100  # intervals: a smaller window that does not converge is not divided any further
DIVISION = 5  # into so many smaller windows one that does not converge is divided
INTERVALS_MIN = 4  # from rest to rest: the plain start needs as many
JUMP_ROUNDING = 1e-6  # jumps of r'' below this share of it are rounding [-]
PLACES_NAMED = 3  # in a sentence


@dataclass(frozen=True, kw_only=True)
class JerkLimited:
    """The interior-point solver for third-order problems.

    tol        : relative gap at which a window is optimal
    iterations : at most, per window
    window     : intervals solved at a time
    """

    tol: float = 1e-4
    iterations: int = 100
    window: int = 5_000

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
        )
        found = lagrangian(problem, solution)
        prices = Prices.from_relative(problem, found.acceleration, found.jerk, found.feed_sq_max)
        return replace(solution, prices=prices, solve_time=time.perf_counter() - began)


def _jumps(grid: Grid) -> int:
    """1 if r'' jumps by more than rounding at an inner point."""
    left, right = grid.d2_left[1:-1], grid.d2_right[1:-1]
    return int((np.abs(left - right).max(axis=1) > JUMP_ROUNDING * np.abs(right).max(axis=1)).any())


@dataclass(frozen=True, eq=False, kw_only=True)
class _Window:
    """A solved window in the problem's units; rows (N, A, 4), feed (N, 2) and dynamics (N,) as in `Multipliers`."""

    x: FloatArray
    u: FloatArray
    jerk: FloatArray
    duration: FloatArray
    rows: FloatArray
    feed: FloatArray
    dynamics: FloatArray

    def after(self, point: int) -> _Window:
        """The part from a point on."""
        own = slice(point, None)
        return replace(
            self,
            x=self.x[own],
            u=self.u[own],
            jerk=self.jerk[own],
            duration=self.duration[own],
            rows=self.rows[own],
            feed=self.feed[own],
            dynamics=self.dynamics[own],
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Scaled:
    """A window's problem in units of its own: fastest feed 1, largest acceleration 1."""

    grid: Grid
    per_jerk: FloatArray
    jumps: int
    feed: float
    time: float

    @property
    def rows(self) -> int:
        """Rows per interval."""
        return (3 + self.jumps) * len(self.per_jerk) + 2

    def slowed(
        self, x: FloatArray, u: FloatArray, p: FloatArray, most: float = np.inf
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A profile slow enough to keep its limits with `START_ROOM` to spare, but at most so many times slower."""
        n, axes = len(p), len(self.per_jerk)
        model, h = empty_model(n, self.rows), np.empty(n)
        lam = np.zeros((n, 2 * self.rows - 2))
        linearise(self.grid, self.per_jerk, x, u, p, h, lam, np.zeros(n), model, self.jumps)
        worst = np.abs(model.values).max(axis=0)
        jerk = worst[:-2].reshape(axes, -1)[:, 1:3].copy()
        worst[:-2].reshape(axes, -1)[:, 1:3] = 0.0
        slower = min(max(1.0, np.sqrt(worst.max() / START_ROOM), np.cbrt(jerk.max() / START_ROOM)), most)
        return x / slower**2, u / slower**2, p / slower**2

    def track(self, x: FloatArray, u: FloatArray, p: FloatArray) -> bool:
        """Bring a profile near to itself onto exact kinematics, in place and smoothly; False where that is not found."""
        jerk = float(1.0 / self.per_jerk.max())
        defect = kernel.track(self.grid, jerk, x, u, p, 1.0, TRACKING_ROUNDS, kernel.DEFECT)
        return bool(defect <= kernel.DEFECT)

    def polish(self, x: FloatArray, u: FloatArray, p: FloatArray) -> None:
        """Bring a profile onto exact kinematics, in place, as far as rounding allows."""
        jerk = float(1.0 / self.per_jerk.max())
        kernel.track(self.grid, jerk, x, u, p, 0.0, POLISHING_ROUNDS, POLISHED)

    def window(self, x: FloatArray, u: FloatArray, p: FloatArray, lam: FloatArray, pi: FloatArray) -> _Window:
        """A profile in the problem's units, with the multipliers of its rows and dynamics."""
        vm = 0.5 * (np.sqrt(x[1:]) + np.sqrt(x[:-1]))
        h = 2.0 * self.grid.ds / (vm + np.sqrt(np.maximum(vm * vm - p * self.grid.ds / 3.0, 0.0)))
        feed, t, lower = self.feed, self.time, self.rows - 2
        rows = np.zeros((len(p), len(self.per_jerk), 4))
        rows[:, :, : 3 + self.jumps] = (lam[:, :lower] - lam[:, self.rows :]).reshape(
            len(p), -1, 3 + self.jumps
        )
        of_feed = lam[:, lower : self.rows].copy()
        of_feed[[0, -1], 1] = 0.0  # these limit the kinematics, not the feed
        return _Window(
            x=x * feed**2,
            u=u * feed / t,
            jerk=p / h * feed / t**2,
            duration=h * t,
            rows=rows * t,
            feed=of_feed * t,
            dynamics=pi * t / feed**2,
        )


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
        self.stops: list[int] = []  # points where the profile rests because nothing better was found
        self._rest: _Window | None = None  # what the window before knew of the way ahead, down to its stop
        self.acceleration = acceleration_limits(problem)

    def solve_piece(self, first: int, last: int) -> None:
        """Solve the points first..last in windows."""
        begin, size, divided = first, self.solver.window, False
        while begin < last:
            end = self._window_end(begin, size, last)
            found = self._solve_window(begin, end)
            if found is None:
                if end - begin > SMALLEST_WINDOW and self.x[begin] == 0.0:
                    divided = True
                    size = max((end - begin) // DIVISION, SMALLEST_WINDOW)
                    continue
                begin = self._stop(begin, end)
            else:
                keep = end if end == last else self._unfelt(begin, end, found)
                if keep <= begin:  # the window is shorter than the way to brake
                    if not divided:
                        size *= 2
                        continue
                    keep = end
                    self.stops.append(end)
                self._keep(begin, keep, found)
                begin = keep
            size, divided = self.solver.window, False

    def _window_end(self, begin: int, size: int, last: int) -> int:
        """The last point of a window: where the grid is finest near its end."""
        earliest = begin + size - int(END_SHARE * size)
        if last - begin <= size + INTERVALS_MIN:
            return last
        s = self.problem.s
        spread = s[earliest + 1 : begin + size + 2] - s[earliest - 1 : begin + size]
        return earliest + int(np.argmin(spread))

    def _stop(self, begin: int, end: int) -> int:
        """Where no window converges: down to the last window's stop, or from rest with the plain start; returns where it ends."""
        if self._rest is not None and self.x[begin] > 0.0:
            end = begin + len(self._rest.x) - 1
            self._keep(begin, end, self._rest)
        else:
            self._keep(begin, end, self._plain_window(begin, end))
        self.stops.append(end)
        return end

    def _scaled(self, begin: int, end: int) -> _Scaled:
        """The points begin..end in units of their own."""
        problem, own = self.problem, slice(begin, end + 1)
        feed = float(np.sqrt(problem.feed_sq_max[own].max()))
        t = float(feed / problem.acceleration.max())
        length = feed * t
        grid = Grid(
            ds=np.diff(problem.s[own]) / length,
            x_max=problem.feed_sq_max[own] / feed**2,
            d1=problem.d1[own],
            d2_left=problem.d2_left[own] * length,
            d2_right=problem.d2_right[own] * length,
            d3_left=problem.d3_left[own] * length**2,
            d3_right=problem.d3_right[own] * length**2,
            per_acceleration=feed / t / self.acceleration[own],
        )
        return _Scaled(
            grid=grid, per_jerk=feed / (t * t) / problem.jerk, jumps=_jumps(grid), feed=feed, time=t
        )

    def _solve_window(self, begin: int, end: int) -> _Window | None:
        """Solve the points begin..end, from the state at `begin` to rest at `end`; None if that does not converge."""
        scaled = self._scaled(begin, end)
        for x, u, p in self._starts(begin, end, scaled):
            done, gap, residual, defect, lam, pi = kernel.minimise(
                scaled.grid,
                scaled.per_jerk,
                x,
                u,
                p,
                scaled.jumps,
                self.solver.tol,
                self.solver.iterations,
            )
            self.iterations = max(self.iterations, done)
            if gap <= GAP_ACCEPTED and residual <= RESIDUAL_ACCEPTED and defect <= DEFECT_ACCEPTED:
                scaled.polish(x, u, p)
                return scaled.window(x, u, p, lam, pi)
        return None

    def _starts(
        self, begin: int, end: int, scaled: _Scaled
    ) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        """Profiles to start from, the best first."""
        asked, rate = envelope_profile(envelope(self.problem, begin, end) / scaled.feed**2, scaled.grid.ds)
        x, u = asked.copy(), rate.copy()
        p = np.diff(u)
        tracked = scaled.track(x, u, p)
        if self.x[begin] > 0.0:
            if not tracked:
                x, u, p = asked.copy(), rate.copy(), np.diff(rate)
            x, u, p = self._with_way_ahead(*scaled.slowed(x, u, p, SLOWER_MAX), scaled)
            raw = x.copy(), u.copy(), p.copy()
            if scaled.track(x, u, p):
                yield x, u, p
            yield raw
            return
        if tracked:
            yield scaled.slowed(x, u, p, SLOWER_MAX)
        yield scaled.slowed(asked, rate, np.diff(rate), SLOWER_MAX)
        yield self._plain(begin, end, scaled)

    def _with_way_ahead(
        self, x: FloatArray, u: FloatArray, p: FloatArray, scaled: _Scaled
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A profile from rest put behind the window before: its way ahead, to the last point where that is faster."""
        assert self._rest is not None  # motion comes out of a window
        ahead, rate = self._rest.x / scaled.feed**2, self._rest.u * scaled.time / scaled.feed
        beyond = 1 + int(np.flatnonzero(ahead > x[: len(ahead)])[-1])  # the first at least
        x[:beyond], u[:beyond] = ahead[:beyond], rate[:beyond]
        return x, u, np.diff(u)

    def _plain(self, begin: int, end: int, scaled: _Scaled) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The plain start, slow enough for all limits."""
        x, u = plain_start(np.concatenate([[0.0], np.cumsum(scaled.grid.ds)]))
        return scaled.slowed(x, u, np.diff(u))

    def _plain_window(self, begin: int, end: int) -> _Window:
        """The plain start as a profile: feasible, and slow."""
        scaled = self._scaled(begin, end)
        x, u, p = self._plain(begin, end, scaled)
        return scaled.window(x, u, p, np.zeros((len(p), 2 * scaled.rows - 2)), np.zeros(len(p)))

    def _unfelt(self, begin: int, end: int, found: _Window) -> int:
        """Last point of a window from which its end is far beyond the way to brake."""
        problem = self.problem
        a, j = problem.acceleration.min(), problem.jerk.min()
        brake = found.x / (2.0 * a) + np.sqrt(found.x) * a / (2.0 * j)
        free = np.flatnonzero(problem.s[end] - problem.s[begin : end + 1] >= BRAKING_WAYS * brake)
        free = free[free <= OVERLAP_SHARE * (end - begin)]
        return begin + int(free[-1]) if len(free) else begin

    def _keep(self, begin: int, end: int, found: _Window) -> None:
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
        factor = np.maximum(factor, np.sqrt(self.x / problem.feed_sq_max))
        for points, d2, d3 in (
            (inner, problem.d2_right, problem.d3_right),
            (inner + 1, problem.d2_left, problem.d3_left),
        ):
            d1, d2, d3 = problem.d1[points], d2[points], d3[points]
            x_here, v_here, u_here = self.x[points, None], v[points, None], u[points, None]
            acceleration = np.abs(d1 * u_here + d2 * x_here) / self.acceleration[points]
            jerk = np.abs(d1 * j[inner, None] + v_here * (3.0 * d2 * u_here + d3 * x_here)) / problem.jerk
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
