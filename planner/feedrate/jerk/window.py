"""One window of a jerk-limited problem: in its own units, from a start for the kernel to its result.

A window goes from rest, or from the way ahead that the window before knew, to rest. It is tried from the
envelope tracked by a motion, where that is found, then from the envelope itself, whose kinematics are not
exact, and then from the plain start as fast as the envelope (start.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.feedrate.jerk.interior_point import SOLVED, minimise_time, within_domain
from planner.feedrate.jerk.layout import (
    CONVEX,
    COSTATE,
    DS,
    GRADIENT,
    LAM_LOW,
    LAM_UP,
    LANES,
    PI,
    ROW,
    STEP,
    STEP_END,
    X_END,
    Blocks,
    H,
    P,
    ProblemColumns,
    Room,
    U,
    X,
    profile,
    put,
    rows_of,
)
from planner.feedrate.jerk.riccati import forward, offsets, riccati
from planner.feedrate.jerk.rows import PASSING, duration, kinematics
from planner.feedrate.jerk.settings import SETTINGS, InteriorPointSettings
from planner.feedrate.jerk.start import envelope, envelope_profile, plain_start

# A start keeps every limit times this [-]: without room its slacks block the first steps ...
START_ROOM = 0.9
# ... if it takes no more than this slowing down [-]; from too slow a profile the way is as long as from outside the limits.
SLOWER_MAX = 2.0
TRACKING_ROUNDS = (
    20  # at most, of a start; 2 to 6 are the rule. A start that is not tracked takes 17 % more iterations
)
POLISHING_ROUNDS = 3  # of the result, onto exact kinematics: a defect of 1e-9 in feed would be a jerk of its own between samples
POLISHED = 1e-14  # defect, share of the largest feed [-]


class Way(NamedTuple):
    """x and u at some points in a row."""

    x: FloatArray
    u: FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Window:
    """The profile of a window, or of a whole problem as it grows, in the problem's units; rows (N, A, 4) ...
    as in `Multipliers`."""

    x: FloatArray
    u: FloatArray
    jerk: FloatArray
    duration: FloatArray
    rows: FloatArray
    feed: FloatArray
    dynamics: FloatArray

    def after(self, point: int) -> Window:
        """The part from a point on."""
        return replace(self, **{name: column[point:] for name, column in vars(self).items()})

    @classmethod
    def at_rest(cls, points: int, axes: int) -> Window:
        """All zero, with room for multipliers at every point."""
        x, u, jerk, duration, dynamics = np.zeros((5, points))
        rows, feed = np.zeros((points, axes, 4)), np.zeros((points, 2))
        return cls(x=x, u=u, jerk=jerk, duration=duration, rows=rows, feed=feed, dynamics=dynamics)

    def put(self, begin: int, found: Window, count: int) -> None:
        """Take over the first intervals of a window that begins at a point, and the state at their end."""
        for name, column in vars(self).items():
            beyond = count + 1 if name in ("x", "u") else count
            column[begin : begin + beyond] = getattr(found, name)[:beyond]


@dataclass(frozen=True, eq=False, kw_only=True)
class ScaledWindow:
    """A window's problem in units of its own: fastest feed 1, largest acceleration 1."""

    # columns and begin: the problem, and where in it the window begins
    columns: ProblemColumns
    begin: int
    blocks: Blocks  # the scaled problem, with room for profile and multipliers, which are worked on in place
    s: FloatArray  # (N+1,) arc length [mm]
    asked: FloatArray  # (N+1,) feed^2 of the envelope (start.py) [mm2/s2]
    jerk: float  # of the slowest axis, scaled
    feed: float  # unit of speed [mm/s]
    time: float  # unit of time [s]
    settings: InteriorPointSettings = SETTINGS

    @classmethod
    def of(
        cls,
        columns: ProblemColumns,
        begin: int,
        end: int,
        room: Room,
        settings: InteriorPointSettings = SETTINGS,
    ) -> ScaledWindow:
        """The points begin..end of a problem, until `room` is used for another window."""
        own = slice(begin, end + 1)
        feed = float(np.sqrt(columns.x_max[own].max()))
        t = feed / columns.unit
        return cls(
            columns=columns,
            begin=begin,
            blocks=room.blocks(columns, begin, end, feed, t),
            s=columns.s[own],
            asked=envelope(columns, begin, end),
            jerk=float(columns.jerk[own].min()) * t * t / feed,
            feed=feed,
            time=t,
            settings=settings,
        )

    def solve(self, behind: Way | None, tol: float, iterations: int) -> tuple[Window | None, int, int]:
        """The fastest profile to rest, from rest or behind the way ahead of the window before; None if that
        does not converge. Also the iterations of the longest try, and from how many starts it was tried."""
        most = starts = 0
        for starts, (x, u) in enumerate(self._starts(behind), start=1):
            put(self.blocks, x, u)
            found = minimise_time(self.blocks, tol, iterations, self.settings)
            most = max(most, found.iterations)
            if found.status == SOLVED:
                self._track(0.0, POLISHING_ROUNDS, POLISHED)
                return self._window(), most, starts
        return None, most, starts

    def plain(self) -> Window:
        """The plain start as a profile from rest: feasible, and slow."""
        put(self.blocks, *self._slowed(*self._plain(1.0)))
        return self._without_multipliers()

    def near(self, x: FloatArray, u: FloatArray) -> Window | None:
        """The motion with exact kinematics near a profile x, u (N+1,) in the problem's units, from rest to
        rest; None where there is none. It may exceed its limits a little, and has no multipliers."""
        put(self.blocks, x / self.feed**2, u * self.time / self.feed)
        if self._track(0.0, TRACKING_ROUNDS, POLISHED) > self.settings.defect:
            return None
        return self._without_multipliers()

    def _starts(self, behind: Way | None) -> Iterator[Way]:
        """Profiles to start from, scaled, the best first; from rest, or on the way to rest that is known, `behind`."""
        for x, u in self._from_rest():
            if behind is None:
                yield Way(x, u)
            else:
                joined = self._joined(behind, x, u)
                yield self._tracked(*joined) or joined

    def _from_rest(self) -> Iterator[Way]:
        """The same from rest."""
        x, u = envelope_profile(self.asked, self.s)
        near = x / self.feed**2, u * self.time / self.feed
        tracked = self._tracked(*near)
        if tracked is not None:
            yield self._slowed(*tracked, SLOWER_MAX)
        yield self._slowed(*near, SLOWER_MAX)
        yield self._slowed(*self._plain(near[0].max()), SLOWER_MAX)

    def _joined(self, way: Way, x: FloatArray, u: FloatArray) -> Way:
        """A profile from rest put behind a way in the problem's units, up to where that is last slower."""
        ahead, rate = way.x[: len(x)] / self.feed**2, way.u * self.time / self.feed
        beyond = 1 + int(np.flatnonzero(ahead > x[: len(ahead)])[-1])  # the first at least
        return Way(np.append(ahead[:beyond], x[beyond:]), np.append(rate[:beyond], u[beyond:]))

    def _track(self, smoothing: float, rounds: int, defect_max: float) -> float:
        """`track` with the jerk of the slowest axis as the machine's."""
        return float(track(self.blocks, self.jerk, smoothing, rounds, defect_max, self.settings))

    def _tracked(self, x: FloatArray, u: FloatArray) -> Way | None:
        """A profile near to the given one with exact kinematics; None where that is not found."""
        put(self.blocks, x, u)
        defect = self._track(1.0, TRACKING_ROUNDS, self.settings.defect)
        return Way(*profile(self.blocks)) if defect <= self.settings.defect else None

    def _plain(self, fastest: float) -> Way:
        """The plain start with a largest feed^2, whatever its limits."""
        x, u = plain_start(self.s / (self.feed * self.time))
        return Way(fastest * x, fastest * u)

    def _slowed(self, x: FloatArray, u: FloatArray, most: float = np.inf) -> Way:
        """A profile that keeps its limits with `START_ROOM` to spare, at most so many times slower."""
        feed_sq, rate = x * self.feed**2, u * self.feed / self.time
        jerk = jerk_of(self.s, feed_sq, rate)
        slower = min(float(slower_by(self.columns, self.begin, feed_sq, rate, jerk, START_ROOM)), most)
        return Way(x / slower**2, u / slower**2)

    def _without_multipliers(self) -> Window:
        self.blocks.rows[:] = 0.0
        self.blocks.work[:, PI : PI + LANES] = 0.0
        return self._window()

    def _window(self) -> Window:
        """Profile and multipliers in the problem's units."""
        x, u = profile(self.blocks)
        feed, t = self.feed, self.time
        jerk, times, rows, of_feed, dynamics = _found(self.blocks)
        return Window(
            x=x * feed**2,
            u=u * feed / t,
            jerk=jerk * feed / t**2,
            duration=times * t,
            rows=rows * t,
            feed=of_feed * t,
            dynamics=dynamics * t / feed**2,
        )


@njit(cache=True, error_model="numpy", nogil=True)
def _found(blocks):
    """Jerk and duration (N,) of the intervals, and the multipliers of rows (N, A, 4), feed (N, 2) and
    dynamics (N,), scaled."""
    n, of_axis = blocks.n, 3 + blocks.jumps
    count = rows_of(blocks.axes, blocks.jumps)
    jerk, times, dynamics = np.empty(n), np.empty(n), np.empty(n)
    rows, feed = np.zeros((n, blocks.axes, 4)), np.zeros((n, 2))
    for i in range(n):
        b, o = i // LANES, i % LANES
        w, row = blocks.work[b], blocks.rows[b]
        h = duration(np.sqrt(w[X + o]), np.sqrt(w[X_END + o]), w[P + o], blocks.grid[b, DS + o])
        jerk[i], times[i], dynamics[i] = w[P + o] / h, h, w[PI + o]
        for r in range(count - 2):
            rows[i, r // of_axis, r % of_axis] = row[r * ROW + LAM_UP + o] - row[r * ROW + LAM_LOW + o]
        feed[i, 0] = row[(count - 2) * ROW + LAM_UP + o]
        if 0 < i < n - 1:  # these limit the kinematics, not the feed
            feed[i, 1] = row[(count - 1) * ROW + LAM_UP + o]
    return jerk, times, rows, feed, dynamics


@njit(cache=True, error_model="numpy", nogil=True)
def slower_by(columns, begin, x, u, jerk, room):
    """The smallest factor >= 1 by which a profile over points from `begin` on has to be slower to keep every
    limit times `room` at the points, the feed, and both ends of the intervals, acceleration and jerk.

    x, u : (N+1,)
    jerk : (N,)
    """
    n, axes = len(x) - 1, columns.d1.shape[1]
    second, third = room, room
    for i in range(n + 1):
        a, v = begin + i, np.sqrt(x[i])
        second = max(second, x[i] / columns.x_max[a])
        for k in range(axes):
            d1, per_a, per_j = columns.d1[a, k], 1.0 / columns.acceleration[a, k], 1.0 / columns.jerk[a, k]
            if i > 0:
                d2, d3 = columns.d2_left[a, k], columns.d3_left[a, k]
                second = max(second, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i - 1] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
            if i < n:
                d2, d3 = columns.d2_right[a, k], columns.d3_right[a, k]
                second = max(second, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
    return max(np.sqrt(second / room), np.cbrt(third / room))


@njit(cache=True, error_model="numpy", nogil=True)
def jerk_of(s, x, u):
    """(N,) jerk of a profile x, u (N+1,) over the points s."""
    n = len(x) - 1
    jerk = np.empty(n)
    for i in range(n):
        p = u[i + 1] - u[i]
        jerk[i] = p / duration(np.sqrt(x[i]), np.sqrt(x[i + 1]), p, s[i + 1] - s[i])
    return jerk


@njit(cache=True, error_model="numpy", nogil=True)
def track(blocks, jerk, smoothing, rounds, defect_max, settings):
    """A motion on exact kinematics, not far from the x of the profile in `blocks`, in its place: Gauss-Newton
    on the time integral of (dx/x)^2 J + j^2/J, with the jerk j of the result and a jerk J of the machine's
    size; without smoothing, j is the change of the jerk. Both ends stay.

    rounds     : at most
    defect_max : that it ends with, if it gets there

    Returns the defect that is left.
    """
    n, work = blocks.n, blocks.work
    passing = np.empty(PASSING)
    asked = work[:, X : X + LANES].copy()
    work[:, CONVEX:COSTATE] = 0.0
    worst, defect = np.inf, np.empty(LANES)
    for _ in range(rounds):
        defect[:] = 0.0
        for b in range(len(work)):
            w, m = work[b], min(LANES, n - b * LANES)
            kinematics(blocks.grid[b], w, passing, defect, m)
            for i in range(m):
                span = w[H + i] * jerk
                weight = span / (asked[b, i] * asked[b, i]) if b + i > 0 else 0.0
                w[CONVEX + i], w[CONVEX + 5 * LANES + i] = weight, 1.0 / span
                w[GRADIENT + i], w[GRADIENT + LANES + i] = weight * (w[X + i] - asked[b, i]), 0.0
                w[GRADIENT + 2 * LANES + i] = smoothing * w[P + i] / span
        worst = defect.max()
        if worst <= defect_max or not riccati(blocks, 0.0):
            break
        offsets(blocks, 0.0)
        primal = within_domain(blocks, forward(blocks, settings.feed_sq_shrink), settings)
        for b in range(len(work)):
            w = work[b]
            for i in range(min(LANES, n - b * LANES)):
                w[X + i] += primal * w[STEP + i]
                w[X_END + i] += primal * w[STEP_END + i]
                w[U + i] += primal * w[STEP + LANES + i]
                w[P + i] += primal * w[STEP + 2 * LANES + i]
    return worst
