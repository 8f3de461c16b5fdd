"""A piece between two full stops, window by window: where they end, what is kept, and if one fails.

See solver.py.
"""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.jerk.layout import ProblemColumns, Room
from planner.feedrate.jerk.settings import WindowSettings
from planner.feedrate.jerk.start import envelope
from planner.feedrate.jerk.window import ScaledWindow, Way, Window, slower_by

# Joining windows. How far a window's stop must be from what is kept, in braking distances [-].
BRAKING_WAYS = 3.0
# Share of a^3/j^2 that counts as a way to brake [-]: with less joined windows end slower, more is more work.
BUILDING = 0.7
# At most this fraction of a window is kept [-]: the rest is the way ahead that the next window starts with.
KEPT_SHARE_MAX = 0.95
# ... and at least this fraction of what can be [-]; in between, the point where more speed would help most.
JOIN_SHARE = 0.92
# A window is kept up to a point between so many usual windows [-]: where least is solved for what is kept.
NEAREST, FARTHEST = 0.4, 1.25
# An interval in a window twice as large costs so much more [-]: iterations grow, and memory leaves the cache.
LARGER_COSTS = 0.2
# The start keeps shares of the limits (start.py): the motion's feed^2 is so many times that of the start [-].
FASTER = 1.6
# A window ends where the grid is finest on this part of a usual window behind what is needed [-].
END_SHARE = 0.1
# Intervals: a smaller window that does not converge is not divided; from rest the plain start does.
SMALLEST_WINDOW = 100
# Into so many smaller windows one that does not converge is divided.
DIVISION = 5
INTERVALS_MIN = 4  # from rest to rest: the plain start needs as many


class Chain:
    """The profile of the points first..last of a problem, from rest to rest, as it grows, window by window.

    at         : up to which point there is a profile
    rest       : what the last window knows of the way ahead, down to its stop
    stops      : points where the profile rests because nothing better was found
    iterations : of its longest window
    slower     : by what factor all of it was slowed down to keep every limit at the grid points
    """

    def __init__(
        self,
        first: int,
        last: int,
        *,
        solver: WindowSettings,
        columns: ProblemColumns,
        profile: Window,
        tell: Callable[[int], None],
    ):
        """profile : of all points of the problem; these points are written
        tell       : called with the number of points that are new; may end the work by an exception
        """
        self.solver, self.columns, self.profile = solver, columns, profile
        self.at, self.first, self.last = first, first, last
        self.rest: Window | None = None
        self.stops: list[int] = []
        self.iterations, self.slower = 0, 1.0
        # windows solved; how often not from the first start, and divided into smaller ones
        self.windows = self.other_starts = self.divided = 0
        self._tell = tell
        self._room = Room()

    @property
    def effort(self) -> dict[str, int]:
        """Counts by their names."""
        return {
            "windows": self.windows,
            "other starts": self.other_starts,
            "divided": self.divided,
            "standstills": len(self.stops),
        }

    def run(self, room: Room) -> None:
        """Solve in windows up to the last point, and slow the whole down until it keeps every limit."""
        self._room = room
        size, divided = self.solver.window, False
        while self.at < self.last:
            begin = self.at
            end = self._smaller_end(begin, size) if divided else self._window_end(begin, size)
            found = self._solve_window(begin, end)
            if found is None:
                if end - begin > SMALLEST_WINDOW + INTERVALS_MIN and self.profile.x[begin] == 0.0:
                    size, divided = max((end - begin) // DIVISION, SMALLEST_WINDOW), True
                    self.divided += 1
                else:
                    self.at = self._stop(begin, end)
                    size, divided = self.solver.window, False
                continue
            keep = end if end == self.last else self._unfelt(begin, end, found)
            if keep == begin and not divided:
                size *= 2  # beside this window the way to brake is long
                continue
            if keep == begin:
                keep = end
                self.stops.append(end)
            self._keep(begin, keep, found)
            self.at = keep
            size, divided = self.solver.window, False
        self.rest = None  # which nobody asks for any more
        self._slow_down()

    def _slow_down(self) -> None:
        profile, own, intervals = self.profile, slice(self.first, self.last + 1), slice(self.first, self.last)
        x, u, jerk = profile.x[own], profile.u[own], profile.jerk[intervals]
        self.slower = by = float(slower_by(self.columns, self.first, x, u, jerk, 1.0))
        x /= by**2
        u /= by**2
        jerk /= by**3
        profile.duration[own] *= by

    def _window_end(self, begin: int, size: int) -> int:
        """The last point of a window: behind the way to brake from the point up to which it is likely to be
        kept, where the grid is finest; no sooner than the stop that the way ahead knows."""
        if self.last - begin <= size + INTERVALS_MIN:
            return self.last
        s = self.columns.s
        keep = np.arange(begin + int(NEAREST * size), min(begin + int(FARTHEST * size), self.last))
        needed = np.minimum(
            np.searchsorted(s, s[keep] + BRAKING_WAYS * self._braking[keep - self.first]), self.last
        )
        count = needed - begin
        of_each = count / (keep - begin) * (1.0 + LARGER_COSTS * count / size)
        earliest = int(needed[np.argmin(of_each)])
        if self.rest is not None and self.profile.x[begin] > 0.0:
            earliest = max(earliest, begin + len(self.rest.x) - 1)
        return self._finest(earliest, earliest + int(END_SHARE * size))

    def _smaller_end(self, begin: int, size: int) -> int:
        """The last point of a window of no more than so many intervals."""
        if self.last - begin <= size + INTERVALS_MIN:
            return self.last
        return self._finest(begin + size - int(END_SHARE * size), begin + size)

    def _finest(self, first: int, last: int) -> int:
        """The point among these where the grid is finest, or the last one of all."""
        if last + 1 >= self.last:
            return self.last
        s = self.columns.s
        return first + int(np.argmin(s[first + 1 : last + 2] - s[first - 1 : last]))

    @cached_property
    def _braking(self) -> FloatArray:
        """The way to brake from each point of the chain, about: at the speed from which windows start."""
        slow = envelope(self.columns, self.first, self.last)
        own = slice(self.first, self.last + 1)
        a, j = self.columns.acceleration[own].min(), self.columns.jerk[own].min()
        return way_felt(FASTER * slow, a, j)

    def _stop(self, begin: int, end: int) -> int:
        """Where no window converges: to its last stop, or from rest by the plain start; where it ends."""
        if self.rest is not None and self.profile.x[begin] > 0.0:
            end = begin + len(self.rest.x) - 1
            self._keep(begin, end, self.rest)
        else:
            self._keep(begin, end, self._scaled(begin, end).plain())
        self.stops.append(end)
        return end

    def _scaled(self, begin: int, end: int) -> ScaledWindow:
        return ScaledWindow.of(self.columns, begin, end, self._room, self.solver.settings)

    def _solve_window(self, begin: int, end: int) -> Window | None:
        """Solve the points begin..end, from the state at `begin` to rest; None if that does not converge."""
        behind = None
        if self.profile.x[begin] > 0.0 and self.rest is not None:
            behind = Way(self.rest.x, self.rest.u)
        found, done, starts = self._scaled(begin, end).solve(behind, self.solver.tol, self.solver.iterations)
        self.iterations = max(self.iterations, done)
        self.windows += 1
        self.other_starts += starts - 1
        return found

    def _unfelt(self, begin: int, end: int, found: Window) -> int:
        """Where to go on from: one of the last points with the window's end far beyond the way to brake.

        Of these the one where more speed would help most (costate times feed^2). Where less would help, while
        the motion brakes into a bend with all its jerk, its state is at the edge of what can still be
        continued: a problem that starts there has hardly any room, and its multipliers say nothing.
        """
        own = slice(begin, end + 1)
        a, j = self.columns.acceleration[own].min(), self.columns.jerk[own].min()
        brake = way_felt(found.x, a, j)
        free = np.flatnonzero(self.columns.s[end] - self.columns.s[begin : end + 1] >= BRAKING_WAYS * brake)
        free = free[free <= KEPT_SHARE_MAX * (end - begin)]
        if not len(free):
            return begin
        last = free[free >= JOIN_SHARE * free[-1]]
        return begin + int(last[np.argmin(found.dynamics[last] * found.x[last])])

    def _keep(self, begin: int, end: int, found: Window) -> None:
        """Take over the intervals begin..end of a window and the state at `end`."""
        self.profile.put(begin, found, end - begin)
        self._tell(end - begin)
        self.rest = found.after(end - begin)


def way_felt(x: FloatArray, acceleration: float, jerk: float) -> FloatArray:
    """(n,) distances to come to rest from feeds^2 x (n,) at no acceleration, about, and much of the way a^3/j^2 on
    which a motion builds up acceleration."""
    brake = x / (2.0 * acceleration) + np.sqrt(x) * acceleration / (2.0 * jerk)
    return brake + BUILDING * acceleration**3 / jerk**2
