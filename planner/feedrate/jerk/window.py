"""One window of a jerk-limited problem: in units of its own, from a start that suits the interior-point kernel, to its result.

A window goes from rest, or from the way ahead that the window before knew, to rest. It is tried from the envelope tracked by a motion,
where that is found, then from the envelope itself, whose kinematics are not exact, and then from the plain start as fast as the
envelope (start.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.jerk import interior_point as kernel
from planner.feedrate.jerk.rows import Grid, Profile, at_profile, empty_model, linearise
from planner.feedrate.jerk.settings import SETTINGS, InteriorPointSettings
from planner.feedrate.jerk.start import envelope, envelope_profile, plain_start

# A start keeps every limit times this [-]: without room its slacks block the first steps (0.6 is too slow: 6 % more iterations) ...
START_ROOM = 0.9
# ... if it takes no more than this slowing down [-]; from too slow a profile the way is as long as from outside the limits.
SLOWER_MAX = 2.0
TRACKING_ROUNDS = (
    20  # at most, of a start; 2 to 6 are the rule. A start that is not tracked takes 17 % more iterations
)
POLISHING_ROUNDS = 3  # of the result, onto exact kinematics: a defect of 1e-9 in feed would be a jerk of its own between samples
POLISHED = 1e-14  # defect, share of the largest feed [-]
GAP_ACCEPTED = 3e-3  # a window that ends with no larger gap than this is still a good profile [-]
RESIDUAL_ACCEPTED = 1e-3  # ... and with no larger residual: slowing down by as much makes it feasible [-]
DEFECT_ACCEPTED = 1e-8  # ... and no larger defect, for which nothing makes up [-]
JUMP_ROUNDING = 1e-6  # jumps of r'' below this share of it are rounding [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class Window:
    """The profile of a window in the problem's units; rows (N, A, 4), feed (N, 2) and dynamics (N,) as in `Multipliers`."""

    x: FloatArray
    u: FloatArray
    jerk: FloatArray
    duration: FloatArray
    rows: FloatArray
    feed: FloatArray
    dynamics: FloatArray

    def after(self, point: int) -> Window:
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
class ScaledWindow:
    """A window's problem in units of its own: fastest feed 1, largest acceleration 1.

    jumps : 1 if r'' jumps at an inner point, else 0
    asked : (N+1,) its envelope (start.py)
    feed  : unit of speed [mm/s]
    time  : unit of time [s]
    """

    grid: Grid
    jumps: int
    asked: FloatArray
    feed: float
    time: float
    settings: InteriorPointSettings = SETTINGS

    @classmethod
    def of(
        cls,
        problem: FeedrateProblem,
        acceleration: FloatArray,
        begin: int,
        end: int,
        settings: InteriorPointSettings = SETTINGS,
    ) -> ScaledWindow:
        """The points begin..end of a problem with the acceleration limits (P, A) [mm/s2]."""
        own = slice(begin, end + 1)
        feed = float(np.sqrt(problem.feed_sq_limit[own].max()))
        t = float(feed / problem.acceleration[: problem.machine_axes].max())
        length = feed * t
        grid = Grid(
            ds=np.diff(problem.s[own]) / length,
            x_max=problem.feed_sq_limit[own] / feed**2,
            d1=problem.d1[own],
            d2_left=problem.d2_left[own] * length,
            d2_right=problem.d2_right[own] * length,
            d3_left=problem.d3_left[own] * length**2,
            d3_right=problem.d3_right[own] * length**2,
            per_acceleration=feed / t / acceleration[own],
            per_jerk=feed / (t * t) / problem.jerk_limit[own],
        )
        return cls(
            grid=grid,
            jumps=_jumps(grid),
            asked=envelope(problem, begin, end) / feed**2,
            feed=feed,
            time=t,
            settings=settings,
        )

    def solve(self, behind: Window | None, tol: float, iterations: int) -> tuple[Window | None, int, int]:
        """The fastest profile to rest, from rest or behind the way ahead of the window before; None if that does not converge.
        Also the iterations of the longest try, and from how many starts it was tried."""
        most = starts = 0
        for starts, start in enumerate(self._starts(behind), start=1):
            found = kernel.minimise_time(self.grid, start, self.jumps, tol, iterations, self.settings)
            most = max(most, found.iterations)
            if _accepted(found):
                profile, _ = self._track(found.profile, 0.0, POLISHING_ROUNDS, POLISHED)
                return self._window(profile, found.lam, found.pi), most, starts
        return None, most, starts

    def plain(self) -> Window:
        """The plain start as a profile from rest: feasible, and slow."""
        profile = self._slowed(self._plain(1.0))
        n = len(profile.p)
        return self._window(profile, np.zeros((n, 2 * self._rows - 2)), np.zeros(n))

    def near(self, x: FloatArray, u: FloatArray) -> Window | None:
        """The motion with exact kinematics near a profile x, u (N+1,) in the problem's units, from rest to rest; None where there is
        none. It may exceed its limits a little, and has no multipliers."""
        rate = u * self.time / self.feed
        profile, defect = self._track(
            Profile(x / self.feed**2, rate, np.diff(rate)), 0.0, TRACKING_ROUNDS, POLISHED
        )
        if defect > self.settings.defect:
            return None
        n = len(profile.p)
        return self._window(profile, np.zeros((n, 2 * self._rows - 2)), np.zeros(n))

    def _starts(self, behind: Window | None) -> Iterator[Profile]:
        """Profiles to start from, the best first."""
        for start in self._from_rest():
            if behind is None:
                yield start
            else:
                joined = self._joined(behind, start)
                yield self._tracked(joined) or joined

    def _from_rest(self) -> Iterator[Profile]:
        """The same from rest."""
        asked, rate = envelope_profile(self.asked, self.grid.ds)
        near = Profile(asked, rate, np.diff(rate))
        tracked = self._tracked(near)
        if tracked is not None:
            yield self._slowed(tracked, SLOWER_MAX)
        yield self._slowed(near, SLOWER_MAX)
        yield self._slowed(self._plain(asked.max()), SLOWER_MAX)

    def _joined(self, behind: Window, start: Profile) -> Profile:
        """A profile from rest put behind the window before: its way ahead, to the last point where that is faster."""
        ahead, rate = behind.x / self.feed**2, behind.u * self.time / self.feed
        beyond = 1 + int(np.flatnonzero(ahead > start.x[: len(ahead)])[-1])  # the first at least
        x, u = np.append(ahead[:beyond], start.x[beyond:]), np.append(rate[:beyond], start.u[beyond:])
        return Profile(x, u, np.diff(u))

    def _track(
        self, profile: Profile, smoothing: float, rounds: int, defect_max: float
    ) -> tuple[Profile, float]:
        """`interior_point.track` with the jerk of the slowest axis as the machine's."""
        jerk = float(1.0 / self.grid.per_jerk.max())
        tracked: tuple[Profile, float] = kernel.track(
            self.grid, jerk, profile, smoothing, rounds, defect_max, self.settings
        )
        return tracked

    def _tracked(self, profile: Profile) -> Profile | None:
        """A profile near to the given one with exact kinematics; None where that is not found."""
        tracked, defect = self._track(profile, 1.0, TRACKING_ROUNDS, self.settings.defect)
        return tracked if defect <= self.settings.defect else None

    def _plain(self, fastest: float) -> Profile:
        """The plain start with a largest feed^2, whatever its limits."""
        x, u = plain_start(np.concatenate([[0.0], np.cumsum(self.grid.ds)]))
        return Profile(fastest * x, fastest * u, fastest * np.diff(u))

    @property
    def _rows(self) -> int:
        """Rows per interval."""
        return (3 + self.jumps) * self.grid.d1.shape[1] + 2

    def _slowed(self, profile: Profile, most: float = np.inf) -> Profile:
        """A profile slow enough to keep its limits with `START_ROOM` to spare, but at most so many times slower."""
        axes = self.grid.d1.shape[1]
        model = empty_model(len(profile.p), self._rows)
        linearise(self.grid, at_profile(profile, 2 * self._rows - 2), model, self.jumps)
        worst = np.abs(model.values).max(axis=0)
        jerk = worst[:-2].reshape(axes, -1)[:, 1:3].copy()
        worst[:-2].reshape(axes, -1)[:, 1:3] = 0.0
        slower = min(max(1.0, np.sqrt(worst.max() / START_ROOM), np.cbrt(jerk.max() / START_ROOM)), most)
        return profile.slower(slower)

    def _window(self, profile: Profile, lam: FloatArray, pi: FloatArray) -> Window:
        """A profile in the problem's units, with the multipliers of its rows and dynamics."""
        x, u, p = profile
        vm = 0.5 * (np.sqrt(x[1:]) + np.sqrt(x[:-1]))
        h = 2.0 * self.grid.ds / (vm + np.sqrt(np.maximum(vm * vm - p * self.grid.ds / 3.0, 0.0)))
        feed, t, lower = self.feed, self.time, self._rows - 2
        rows = np.zeros((len(p), self.grid.d1.shape[1], 4))
        rows[:, :, : 3 + self.jumps] = (lam[:, :lower] - lam[:, self._rows :]).reshape(
            len(p), -1, 3 + self.jumps
        )
        of_feed = lam[:, lower : self._rows].copy()
        of_feed[[0, -1], 1] = 0.0  # these limit the kinematics, not the feed
        return Window(
            x=x * feed**2,
            u=u * feed / t,
            jerk=p / h * feed / t**2,
            duration=h * t,
            rows=rows * t,
            feed=of_feed * t,
            dynamics=pi * t / feed**2,
        )


def _accepted(found: kernel.Minimum) -> bool:
    """Whether a window's profile is good enough; one that used up its iterations may be."""
    return (
        found.status in (kernel.SOLVED, kernel.OUT_OF_ITERATIONS)
        and found.gap <= GAP_ACCEPTED
        and found.residual <= RESIDUAL_ACCEPTED
        and found.defect <= DEFECT_ACCEPTED
    )


def _jumps(grid: Grid) -> int:
    """1 if r'' jumps by more than rounding at an inner point."""
    left, right = grid.d2_left[1:-1], grid.d2_right[1:-1]
    return int((np.abs(left - right).max(axis=1) > JUMP_ROUNDING * np.abs(right).max(axis=1)).any())
