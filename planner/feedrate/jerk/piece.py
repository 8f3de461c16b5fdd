"""A piece between two full stops: ranges on which the feed is held, known beforehand (held.py), and the parts between them.

The parts are solved side by side, each by itself. If one of them has no solution from feed to feed the piece is solved as one part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from planner.feedrate.jerk.chain import Chain, Task
from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.held import Held, held_ranges, hold
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.part import Part
from planner.feedrate.jerk.profile import Profile
from planner.feedrate.jerk.slowing import slower_by


class Piece:
    """A task from rest to rest.

    parts : what is solved, in their order
    held  : what lies between them
    """

    def __init__(self, task: Task):
        self._task = task
        self.first, self.last = task.first, task.last
        self.held = held_ranges(task.columns, task.first, task.last)
        ends = [Held(task.first, task.first, 0.0), *self.held, Held(task.last, task.last, 0.0)]
        self.parts = [
            Part(replace(task, first=a.last, last=b.first, start=a.x, end=b.x)) for a, b in pairwise(ends)
        ]

    @property
    def work(self) -> list[tuple[int, Callable[[Room], None]]]:
        """What can be done side by side, before `finish`, and of how many intervals it is."""
        return [(part.last - part.first, task) for part in self.parts for task in part.work]

    def finish(self, room: Room) -> float:
        """Join what was found, and slow it down until it keeps every limit at the grid points; returns by what factor."""
        task = self._task
        if not all(part.finish(room) for part in self.parts):
            self.parts, self.held = [Part(task)], []
            for work in self.parts[0].work:
                work(room)
            self.parts[0].finish(room)
        found, columns = task.profile, task.columns
        for held in self.held:
            hold(found, columns, held)
        return slow_down(found, columns, self.first, self.last)

    @property
    def chains(self) -> list[Chain]:
        """The chains of all parts."""
        return [chain for part in self.parts for chain in part.chains]

    @property
    def joined(self) -> list[int]:
        """Iterations of the windows that join the two ways of long parts."""
        return [done for part in self.parts for done in part.joined]

    @property
    def met(self) -> int:
        """How many parts were joined in their middle."""
        return sum(part.met for part in self.parts)

    @property
    def stops(self) -> list[int]:
        """Points where the profile rests because nothing better was found."""
        return [stop for part in self.parts for stop in part.stops]


def slow_down(profile: Profile, columns: ProblemColumns, first: int, last: int) -> float:
    """Slow a profile down between two full stops, at the points first and last, until it keeps every limit at the grid points; returns
    by what factor."""
    own, intervals = slice(first, last + 1), slice(first, last)
    x, u, jerk = profile.x[own], profile.u[own], profile.jerk[intervals]
    by = float(slower_by(columns, first, x, u, jerk, 1.0))
    profile.x[own] /= by**2
    profile.u[own] /= by**2
    profile.jerk[own] /= by**3
    profile.duration[own] *= by
    return by
