"""Own kernel for the jerk-limited problem: an interior-point method with a Riccati recursion, linear in the grid.

Minimise the time subject to all second-order limits of `FeedrateProblem` and to the axis jerks

    | r'_k j + 3 r''_k v u + r'''_k v^3 | <= j_k                      at both ends of every interval,

with constant jerk j along the path on every interval, the same transcription as nlp.py, so that both can be compared on one grid.
The step is in jerk_kernel.py, the start in jerk_start.py. One iteration linearises dynamics and rows at the current profile,
solves the barrier problem's linear-quadratic model exactly and goes as far as slacks and multipliers stay positive; infeasible
starts are allowed. 17 to 35 iterations, whatever the size.

**Windows.** A long piece is solved in windows of `window` intervals. Each window ends in a full stop, which is only a way to end
it: its first part is kept as far as the stop cannot be felt, three ways to brake before it, and the next window starts from the
state reached there. What is kept agrees with the one-piece solution (tested). Memory is that of one window.

**Feasibility.** At the end a profile may exceed its limits by the solver's tolerance. Slowing a whole piece down by lam >= 1
divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and keeps the kinematics exact; with the smallest lam that
satisfies every row the profile is feasible, always. Its cost, lam - 1, is in the sentence of the solution.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from planner.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate import jerk_kernel as kernel
from planner.feedrate.jerk_start import smooth_start
from planner.feedrate.solution import FeedrateSolution, Prices, Status

ROWS_PER_AXIS = 3  # acceleration, jerk at both ends; one more where r'' jumps
SLACK_MIN = 1e-2  # of the first slacks [-]
START_GAP = 0.1  # complementarity of the start, share of the time per row
RESIDUAL = 1e-6  # of the rows at the end, share of the limits [-]
DEFECT = 1e-9  # of the kinematics at the end, share of the largest feed [-]
GAP_ACCEPTED = 3e-3  # a window that ends with no larger gap than this is still a good profile [-]
RESIDUAL_ACCEPTED = 1e-3  # ... and with no larger residual: slowing down by as much makes it feasible [-]
DEFECT_ACCEPTED = 1e-8  # ... and no larger defect, for which nothing makes up [-]
BRAKING_WAYS = 3.0  # how far a window's stop must be from what is kept, in ways to brake [-]
OVERLAP_SHARE = 0.8  # at most this share of a window is kept [-]
JUMP_ROUNDING = 1e-6  # jumps of r'' below this share of it are rounding [-]
GAP_FLOOR = 0.1  # the barrier stays above this share of the gap asked for [-]


@dataclass(frozen=True, kw_only=True)
class JerkLimited:
    """The interior-point solver for third-order problems.

    tol        : relative gap at which a window is optimal
    iterations : at most, per window
    window     : intervals solved at a time
    """

    tol: float = 1e-4
    iterations: int = 120
    window: int = 200_000

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Jerk-limited profile of all pieces; ends must be at rest. Failures are a status."""
        began = time.perf_counter()
        if problem.feed_sq_start.any() or problem.feed_sq_end.any():
            raise ValueError("JerkLimited: pieces must start and end at rest")
        profile = _Profile(problem)
        for g in range(len(problem.piece) - 1):
            trouble = self._solve_piece(profile, problem.piece[g], problem.piece[g + 1] - 1)
            if trouble:
                at = problem.s[problem.piece[g]]
                sentence = f"piece {g} (from s = {at:.6g} mm): {trouble}"
                took = time.perf_counter() - began
                return FeedrateSolution.failed(problem, Status.ITERATION_LIMIT, sentence, repr(self), took)
        slower = profile.slow_down()
        return FeedrateSolution(
            status=Status.OPTIMAL,
            sentence=f"slowed by {slower - 1.0:.1e} to keep every limit; time-optimal within {self.tol:g} for the limits with jerk",
            solver=repr(self),
            feed_sq=profile.x,
            acc_s=profile.u,
            jerk_s=profile.jerk,
            duration=profile.duration,
            solve_time=time.perf_counter() - began,
            iterations=profile.iterations,
            jerk_limited=True,
            prices=profile.prices(),
        )

    def _solve_piece(self, profile: _Profile, first: int, last: int) -> str:
        """Solve the points first..last in windows; returns what went wrong, or nothing."""
        begin, size = first, self.window
        while True:
            end = min(begin + size, last)
            found = profile.solve_window(begin, end, self)
            if found is None:
                return (
                    "the interior-point method did not converge; coarsen the path where points nearly coincide, "
                    "or use method toppra"
                )
            keep = end if end == last else profile.unfelt(begin, end, found)
            if keep <= begin:  # the window is shorter than the way to brake
                size *= 2
                continue
            profile.keep(begin, keep, found)
            if keep == last:
                return ""
            begin, size = keep, self.window


def _jumps(grid: kernel.Grid) -> bool:
    """True if r'' jumps by more than rounding at an inner point."""
    left, right = grid.d2_left[1:-1], grid.d2_right[1:-1]
    return bool((np.abs(left - right).max(axis=1) > JUMP_ROUNDING * np.abs(right).max(axis=1)).any())


@dataclass(frozen=True, eq=False, kw_only=True)
class _Window:
    """A solved window in the problem's units; `lam` are the multipliers of its scaled rows."""

    x: FloatArray
    u: FloatArray
    jerk: FloatArray
    duration: FloatArray
    lam: FloatArray
    time_unit: float


class _Profile:
    """The profile of all points as it grows, window by window."""

    def __init__(self, problem: FeedrateProblem):
        self.problem = problem
        points, axes = problem.d1.shape
        self.x, self.u = np.zeros(points), np.zeros(points)
        self.jerk, self.duration = np.zeros(points), np.zeros(points)
        self.price_acceleration, self.price_jerk = np.zeros(axes), np.zeros(axes)
        self.price_feed_sq = np.zeros(points)
        self.iterations = 0
        self._tail = (np.zeros(0), np.zeros(0))
        margin = problem.margin.copy()
        margin[problem.piece[1:] - 1] = 0.0
        before = np.concatenate([[0.0], margin[:-1]])
        self.acceleration = problem.acceleration * (1.0 - np.maximum(margin, before))[:, None]

    def solve_window(self, begin: int, end: int, solver: JerkLimited) -> _Window | None:
        """Solve the points begin..end, from the state at `begin` to rest at `end`."""
        problem, own = self.problem, slice(begin, end + 1)
        feed = np.sqrt(problem.feed_sq_max[own].max())
        t = feed / problem.acceleration.max()
        length = feed * t
        grid = kernel.Grid(
            ds=np.diff(problem.s[own]) / length,
            x_max=problem.feed_sq_max[own] / feed**2,
            d1=problem.d1[own],
            d2_left=problem.d2_left[own] * length,
            d2_right=problem.d2_right[own] * length,
            d3_left=problem.d3_left[own] * length**2,
            d3_right=problem.d3_right[own] * length**2,
            acceleration=self.acceleration[own] * t / feed,
        )
        x, u = self._guess(begin, end)
        x, u = x / feed**2, u * t / feed
        done, gap, residual, defect, p, h, lam = kernel.minimise(
            grid,
            problem.jerk * t * t / feed,
            x,
            u,
            0.0,
            _jumps(grid),
            solver.tol,
            solver.iterations,
            SLACK_MIN,
            START_GAP,
            RESIDUAL,
            DEFECT,
            GAP_FLOOR,
        )
        self.iterations = max(self.iterations, done)
        if not (gap <= GAP_ACCEPTED and residual <= RESIDUAL_ACCEPTED and defect <= DEFECT_ACCEPTED):
            return None
        return _Window(
            x=x * feed**2, u=u * feed / t, jerk=p / h * feed / t**2, duration=h * t, lam=lam, time_unit=t
        )

    def _guess(self, begin: int, end: int) -> tuple[FloatArray, FloatArray]:
        """Where to start a window from: slow and smooth, and what the window before knew, where that is faster."""
        x, u = smooth_start(self.problem, begin, end)
        if begin not in self.problem.piece:
            tail_x, tail_u = (tail[: len(x)] for tail in self._tail)
            faster = np.flatnonzero(tail_x > x[: len(tail_x)])
            x[faster], u[faster] = tail_x[faster], tail_u[faster]
            x[0], u[0] = self.x[begin], self.u[begin]
        return x, u

    def _price(self, begin: int, count: int, found: _Window) -> None:
        """Add the multipliers of the kept intervals to the prices; a scaled row g <= 1 costs lam per unit of its limit."""
        lam, axes = found.lam[:count] * found.time_unit, len(self.problem.axes)
        per_axis = (found.lam.shape[1] - 2) // axes
        for k in range(axes):
            rows = lam[:, k * per_axis : (k + 1) * per_axis].sum(axis=2)
            self.price_jerk[k] -= rows[:, 1:3].sum()
            self.price_acceleration[k] -= rows[:, 0].sum() + rows[:, 3:].sum()
        at_point, between = lam[:, -2, 0], lam[:, -1, 0] / 2.0
        limit = self.problem.feed_sq_max
        point = np.arange(begin, begin + count)
        self.price_feed_sq[point] -= (at_point + between) / limit[point]
        self.price_feed_sq[point + 1] -= between / limit[point + 1]

    def unfelt(self, begin: int, end: int, found: _Window) -> int:
        """Last point of a window from which its end is far beyond the way to brake."""
        problem = self.problem
        a, j = problem.acceleration.min(), problem.jerk.min()
        brake = found.x / (2.0 * a) + np.sqrt(found.x) * a / (2.0 * j)
        free = np.flatnonzero(problem.s[end] - problem.s[begin : end + 1] >= BRAKING_WAYS * brake)
        free = free[free <= OVERLAP_SHARE * (end - begin)]
        return begin + int(free[-1]) if len(free) else begin

    def keep(self, begin: int, end: int, found: _Window) -> None:
        """Take over the intervals begin..end of a window and the state at `end`."""
        count = end - begin
        self.x[begin : end + 1], self.u[begin : end + 1] = found.x[: count + 1], found.u[: count + 1]
        self.jerk[begin:end], self.duration[begin:end] = found.jerk[:count], found.duration[:count]
        self._tail = (
            found.x[count:],
            found.u[count:],
        )  # what comes after, down to the window's stop: the next guess
        self._price(begin, count, found)

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

    def prices(self) -> Prices:
        """Derivatives of the time with respect to the limits (the multipliers, unscaled)."""
        problem = self.problem
        velocity = np.zeros(len(problem.axes))
        for k, axis in enumerate(problem.axes):
            if f"velocity.{axis}" in problem.bound_names:
                held = problem.feed_sq_bound == problem.bound_names.index(f"velocity.{axis}")
                velocity[k] = (
                    2.0 * (self.price_feed_sq * problem.feed_sq_max)[held].sum() / problem.velocity[k]
                )
        return Prices(
            velocity=velocity,
            acceleration=self.price_acceleration / problem.acceleration,
            jerk=self.price_jerk / problem.jerk,
            feed_sq_max=self.price_feed_sq,
        )
