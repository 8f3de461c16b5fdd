"""A part of a piece, solved window by window: where windows end, what of them is kept, and what is done if
one fails.

See solver.py.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.profile import Profile, backward
from planner.feedrate.jerk.settings import WindowSettings
from planner.feedrate.jerk.start import envelope
from planner.feedrate.jerk.window import ScaledWindow, Way, Window

# Joining windows. How far a window's stop must be from what is kept, in braking distances [-]: 2 costs 1e-4
# of some profiles' time, 5 gains nothing.
BRAKING_WAYS = 3.0
# Share of a^3/j^2 that counts as a way to brake [-]: with less, windows that are joined at slow points end
# slower; with more, more has to be solved.
BUILDING = 0.7
# At most this fraction of a window is kept [-]: the rest is the way ahead that the next window starts with.
KEPT_SHARE_MAX = 0.95
# ... and at least this fraction of what can be [-]. In between, the point where more speed would help most: to keep all, whatever
# the state there, costs up to 0.8 % of a profile's time.
JOIN_SHARE = 0.92
# A window is meant to be kept up to a point between these numbers of usual windows from its beginning [-]:
# there where the least has to be solved for each interval that is kept.
NEAREST, FARTHEST = 0.4, 1.25
# An interval in a window twice as large costs so much more [-]: iterations grow, and memory leaves the cache.
LARGER_COSTS = 0.2
# The start keeps shares of the limits (start.py), the motion keeps them in full: its feed^2 is so many times
# that of the start [-].
FASTER = 1.6
# A window ends where the grid is finest on this part of a usual window behind what is needed [-]: a stop
# needs points.
END_SHARE = 0.1
# Intervals: a smaller window that does not converge is not divided any further: from rest the plain start
# does for so few. (The last one may have `INTERVALS_MIN` more.)
SMALLEST_WINDOW = 100
# Into so many smaller windows one that does not converge is divided.
DIVISION = 5
INTERVALS_MIN = 4  # from rest to rest: the plain start needs as many


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
    """The points first..last of a problem, to be solved from rest, or from a given feed, to rest, or to a
    given feed.

    profile    : of all points of the problem; these points are written
    tell       : called with the number of points that are new; may end the work by an exception
    start, end : feed^2 at both ends, where the acceleration is 0; 0 at rest [mm2/s2]
    """

    solver: WindowSettings
    columns: ProblemColumns
    profile: Profile
    first: int
    last: int
    tell: Callable[[int], None]
    start: float = 0.0
    end: float = 0.0


class Chain:
    """The profile of a task as it grows, window by window, from its first point.

    at      : up to which point there is a profile
    rest    : what the last window knows of the way ahead, down to its stop
    stops   : points where the profile rests because nothing better was found
    failed  : whether there is no solution between given states; from rest to rest there always is one
    """

    def __init__(self, task: Task, ahead: Way | None = None, back: Way | None = None):
        """The task, or one with other states at its ends: ways to rest from the first point on, and from the
        last point on, backward, None from rest; the profile has these states already."""
        self.solver, self.columns, self.profile = task.solver, task.columns, task.profile
        self.at, self.first, self.last = task.first, task.first, task.last
        self.rest: Window | None = None
        self.failed = False
        self._start, self._end = task.start, task.end
        self._ahead, self._back = ahead, back
        self._given = task.start > 0.0 or task.end > 0.0 or ahead is not None or back is not None
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
        while self.at < min(until, self.last) and not self.failed:
            begin = self.at
            end = self._smaller_end(begin, size) if divided else self._window_end(begin, size)
            found = self._solve_window(begin, end)
            if found is None and self._given:
                self.failed = True
                continue
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
        """Where no window converges: down to the last window's stop, or from rest with the plain start;
        returns where it ends."""
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
        """Solve the points begin..end, from the state at `begin` to rest at `end`, or to the end of the task;
        None if that does not converge."""
        behind, scaled = None, self._scaled(begin, end)
        if begin == self.first and self._ahead is not None:
            behind = self._ahead
        elif begin == self.first and self._start > 0.0:
            behind = way_to_rest(self.columns, begin, end, self._start)
        elif self.profile.x[begin] > 0.0 and self.rest is not None:
            behind = Way(self.rest.x, self.rest.u)
        tol, iterations = self.solver.tol, self.solver.iterations
        turned = self._back if end == self.last else None
        if end == self.last and self._end > 0.0:
            turned = way_to_rest(backward(self.columns, begin, end), 0, end - begin, self._end)
        if turned is not None:
            found, done, starts = scaled.between(behind, turned, tol, iterations)
        else:
            found, done, starts = scaled.solve(behind, tol, iterations)
        self.iterations = max(self.iterations, done)
        self.windows += 1
        self.other_starts += starts - 1
        return found

    def _unfelt(self, begin: int, end: int, found: Window) -> int:
        """Where to go on from: a point from which the window's end is far beyond the way to brake, one of the
        last such points.

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


def way_to_rest(columns: ProblemColumns, first: int, last: int, x: float) -> Way:
    """A way that brakes from feed^2 x and no acceleration at the point `first`, as far as it is not beyond
    the point `last`, for the solver to start from: X (1 - q^2)^2 over the share q of some ways to brake."""
    own = slice(first, last + 1)
    reach = reach_of_end(x, columns.acceleration[own].min(), columns.jerk[own].min())
    s = columns.s[own] - columns.s[first]
    q = s[: max(int(np.searchsorted(s, reach)), 1)] / reach
    return Way(x * (1.0 - q * q) ** 2, -2.0 * q * (1.0 - q * q) * x / reach)


def reach_of_end(x: float, acceleration: float, jerk: float) -> float:
    """How far the end of a window, or of a part, is felt at feed^2 x."""
    return BRAKING_WAYS * float(way_felt(np.array([x]), acceleration, jerk)[0])


def way_to_brake(x: FloatArray, acceleration: float, jerk: float) -> FloatArray:
    """(n,) distances to come to rest from feeds^2 x (n,) at no acceleration, about."""
    return x / (2.0 * acceleration) + np.sqrt(x) * acceleration / (2.0 * jerk)


def way_felt(x: FloatArray, acceleration: float, jerk: float) -> FloatArray:
    """(n,) the same, x (n,), and much of the way a^3/j^2 on which a motion from rest builds up its
    acceleration and takes it back."""
    return way_to_brake(x, acceleration, jerk) + BUILDING * acceleration**3 / jerk**2
