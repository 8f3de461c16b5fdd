"""A piece between two full stops, solved window by window: where windows end, what of them is kept, and what is done if one fails.

See solver.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.profile import Profile
from planner.feedrate.jerk.window import ScaledWindow, Window

if TYPE_CHECKING:
    from planner.feedrate.jerk.solver import JerkLimited

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


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
    """The points first..last of a problem, to be solved from rest to rest.

    profile : of all points of the problem; these points are written
    tell    : called with the number of points that are new; may end the work by an exception
    """

    solver: JerkLimited
    columns: ProblemColumns
    profile: Profile
    first: int
    last: int
    tell: Callable[[int], None]


class Chain:
    """The profile of a task as it grows, window by window, from rest at its first point.

    at      : up to which point there is a profile
    rest    : what the last window knows of the way ahead, down to its stop
    stops   : points where the profile rests because nothing better was found
    """

    def __init__(self, task: Task):
        self.solver, self.columns, self.profile = task.solver, task.columns, task.profile
        self.at, self.last = task.first, task.last
        self.rest: Window | None = None
        self.stops: list[int] = []
        self.iterations = 0
        # windows solved; how often not from the first start, and divided into smaller ones
        self.windows = self.other_starts = self.divided = 0
        self._tell = task.tell
        self._room = Room()

    def run(self, room: Room, until: int) -> None:
        """Solve in windows up to the point `until`, or a little beyond."""
        self._room = room
        size, divided = self.solver.window, False
        while self.at < min(until, self.last):
            begin = self.at
            end = self._window_end(begin, size, self.last)
            found = self._solve_window(begin, end)
            if found is None:
                if end - begin > SMALLEST_WINDOW and self.profile.x[begin] == 0.0:
                    size, divided = max((end - begin) // DIVISION, SMALLEST_WINDOW), True
                    self.divided += 1
                else:
                    self.at = self._stop(begin, end)
                    size, divided = self.solver.window, False
                continue
            keep = end if end == self.last else self._unfelt(begin, end, found)
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
            self.at = keep
            if divided:
                size, divided = self.solver.window, False
            elif share > KEPT_SHARE_HIGH and size > self.solver.window:
                size //= 2

    def _window_end(self, begin: int, size: int, last: int) -> int:
        """The last point of a window: where the grid is finest near its end; no sooner than the stop that the way ahead knows."""
        if last - begin <= size + INTERVALS_MIN:
            return last
        earliest = begin + size - int(END_SHARE * size)
        s = self.columns.s
        spread = s[earliest + 1 : begin + size + 2] - s[earliest - 1 : begin + size]
        end = earliest + int(np.argmin(spread))
        if self.rest is not None and self.profile.x[begin] > 0.0:
            end = max(end, begin + len(self.rest.x) - 1)
        return end

    def _stop(self, begin: int, end: int) -> int:
        """Where no window converges: down to the last window's stop, or from rest with the plain start; returns where it ends."""
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
        """Solve the points begin..end, from the state at `begin` to rest at `end`; None if that does not converge."""
        behind = self.rest if self.profile.x[begin] > 0.0 else None
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
        own = slice(begin, end + 1)
        a, j = self.columns.acceleration[own].min(), self.columns.jerk[own].min()
        brake = found.x / (2.0 * a) + np.sqrt(found.x) * a / (2.0 * j)
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
