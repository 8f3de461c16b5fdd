"""A piece between two full stops: ranges on which the feed is held, known beforehand (held.py), and the parts
between them.

The parts are solved side by side, each by itself. If one of them has no solution from feed to feed the piece
is solved as one part.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from planner.feedrate.jerk.chain import Task
from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.held import Held, held_ranges, hold
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.part import Part
from planner.feedrate.jerk.profile import Profile
from planner.feedrate.jerk.slowing import slower_by


class Solved(NamedTuple):
    """The counts of a piece that was solved."""

    slower: float  # by what factor it was slowed down to keep every limit
    stops: list[int]  # points where the profile rests because nothing better was found
    iterations: int  # of its longest window
    effort: dict[str, int]  # what else was counted, by name (solver.py)


class Piece:
    """A task from rest to rest."""

    def __init__(self, task: Task):
        self._task = task
        self._held = held_ranges(task.columns, task.first, task.last)
        ends = [Held(task.first, task.first, 0.0), *self._held, Held(task.last, task.last, 0.0)]
        self._parts = [
            Part(replace(task, first=a.last, last=b.first, start=a.x, end=b.x)) for a, b in pairwise(ends)
        ]

    @property
    def work(self) -> list[tuple[int, Callable[[Room], None]]]:
        """The work that can be done in parallel, before `finish`, and of how many intervals it is."""
        return [(part.last - part.first, task) for part in self._parts for task in part.work]

    def finish(self, room: Room) -> Solved:
        """Join what was found, and slow it down until it keeps every limit at the grid points."""
        task = self._task
        if not all(part.finish(room) for part in self._parts):
            self._parts, self._held = [Part(task)], []
            for work in self._parts[0].work:
                work(room)
            self._parts[0].finish(room)
        for held in self._held:
            hold(task.profile, task.columns, held)
        slower = slowed_piece(task.profile, task.columns, task.first, task.last)
        chains = [chain for part in self._parts for chain in part.chains]
        joined = [done for part in self._parts for done in part.joined]
        stops = [stop for part in self._parts for stop in part.stops]
        effort = {
            "windows": sum(chain.windows for chain in chains) + len(joined),
            "other starts": sum(chain.other_starts for chain in chains),
            "joined": sum(part.met for part in self._parts),
            "held": sum(held.last - held.first for held in self._held),
            "divided": sum(chain.divided for chain in chains),
            "standstills": len(stops),
        }
        return Solved(slower, stops, max([*joined, *(chain.iterations for chain in chains)]), effort)


def slowed_piece(profile: Profile, columns: ProblemColumns, first: int, last: int) -> float:
    """Slow a profile down between two full stops, at the points first and last, until it keeps every limit at
    the grid points; returns by what factor."""
    own, intervals = slice(first, last + 1), slice(first, last)
    x, u, jerk = profile.x[own], profile.u[own], profile.jerk[intervals]
    by = float(slower_by(columns, first, x, u, jerk, 1.0))
    profile.x[own] /= by**2
    profile.u[own] /= by**2
    profile.jerk[own] /= by**3
    profile.duration[own] *= by
    return by
