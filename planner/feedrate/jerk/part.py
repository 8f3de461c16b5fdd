"""A part of a piece, from rest or a given feed to rest or a given feed; a long one from both ends at a time.

The problem is the same forward and backward in time. So a long part is solved from its first point forward
and from its last point backward, on two cores if there are two, and a window in the middle joins the two
profiles: both of its ends are given. Where that does not converge the profile that came forward goes on to
the end. Where the two meet depends on the problem alone, so that a problem has the same solution on any
number of cores.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.base.sizes import SIZES
from planner.feedrate.jerk.chain import BRAKING_WAYS, Chain, Task, way_to_brake
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.profile import Profile, backward
from planner.feedrate.jerk.window import ScaledWindow, Way

LONG = SIZES.solved_windows
# The joining window starts and ends at points so far from the middle, in windows [-]; of these, where most
# speed would help.
NEAR, FAR = 0.25, 0.5
# What is passed backward reaches so far beyond the middle [windows]: its windows end in a stop of their own
# before that.
BEYOND = 3.0


class Part:
    """A task that is solved from one end or from both."""

    def __init__(self, task: Task):
        self.solver, self.columns, self.profile = task.solver, task.columns, task.profile
        self.first, self.last = task.first, task.last
        self.forward = Chain(task)
        self.backward: Chain | None = None
        self.joined: list[int] = []  # iterations of the joining window, if there is one
        self.met = False  # whether the two ways were joined
        n, middle = self.last - self.first, (self.first + self.last) // 2
        self._until = self.last
        if n > LONG * self.solver.window:
            cut = middle - int(BEYOND * self.solver.window)
            turned = backward(self.columns, cut, self.last)
            found = Profile.at_rest(self.last - cut + 1, turned.d1.shape[1])
            turned_task = replace(task, columns=turned, profile=found, first=0, last=self.last - cut)
            self.backward = Chain(replace(turned_task, start=task.end, end=0.0))
            self._until = middle - int(NEAR * self.solver.window)
        self._middle = middle

    @property
    def work(self) -> list[Callable[[Room], None]]:
        """The work that can be done in parallel, before `finish`."""
        if self.backward is None:
            return [lambda room: self.forward.run(room, self._until)]
        until = self.last - self._middle - int(NEAR * self.solver.window)
        other = self.backward
        return [lambda room: self.forward.run(room, self._until), lambda room: other.run(room, until)]

    def finish(self, room: Room) -> bool:
        """Join what was found; False if there is no solution between the given feeds."""
        if self.backward is not None and not self._join(room, self.backward):
            self.forward.run(room, self.last)
        return not self.forward.failed

    def _join(self, room: Room, other: Chain) -> bool:
        """Solve the window between the two profiles; False if there is none."""
        window = self.solver.window
        if self.forward.failed or other.failed:
            return False
        begin, own = (
            _open_point(self.forward, self._middle, window),
            _open_point(other, self.last - self._middle, window),
        )
        end = self.last - own
        s, reach = self.columns.s, BRAKING_WAYS * (_braking(self.forward, begin) + _braking(other, own))
        if begin >= self.forward.at or own >= other.at or s[end] - s[begin] < reach:
            return False
        scaled = ScaledWindow.of(self.columns, begin, end, room, self.solver.settings)
        left, right = _way(self.forward, begin), _way(other, own)
        found, done, _ = scaled.between(left, right, self.solver.tol, self.solver.iterations)
        self.joined.append(done)
        if found is None:
            return False
        self.profile.put_backward(self.last, other.profile, own)
        self.profile.put(begin, found, end - begin)
        self.met = True
        return True

    @property
    def chains(self) -> list[Chain]:
        """The way forward and, of a long piece, the way backward."""
        return [self.forward] if self.backward is None else [self.forward, self.backward]

    @property
    def stops(self) -> list[int]:
        """Points where the profile rests because nothing better was found."""
        if self.backward is None or not self.met:
            return self.forward.stops
        back = [self.last - stop for stop in reversed(self.backward.stops)]
        at_rest = [stop for stop in self.forward.stops + back if self.profile.x[stop] == 0.0]
        return sorted(set(at_rest))


def _open_point(chain: Chain, middle: int, window: int) -> int:
    """The point near the middle, but before it, where more speed would help most."""
    near = np.arange(middle - int(FAR * window), middle - int(NEAR * window))
    return int(near[np.argmin(chain.profile.dynamics[near] * chain.profile.x[near])])


def _way(chain: Chain, point: int) -> Way:
    """x and u from a point on, down to the stop of the chain's last window."""
    if chain.rest is None:
        raise RuntimeError("a chain that is asked for the way ahead has solved no window")
    own = slice(point, chain.at)
    return Way(np.append(chain.profile.x[own], chain.rest.x), np.append(chain.profile.u[own], chain.rest.u))


def _braking(chain: Chain, point: int) -> float:
    """The way to brake from the state at a point, about."""
    x = chain.profile.x[point]
    own = slice(point, chain.at + 1)
    a, j = chain.columns.acceleration[own].min(), chain.columns.jerk[own].min()
    return float(way_to_brake(x, a, j))
