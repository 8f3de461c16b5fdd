"""Searches of many runs at once, their windows solved in groups.

A search tells sweep by sweep what can be searched side by side, as tasks; a task tells window by window what is
to be solved. Both are generators, resumed with what became of that. Windows that are ready wait until there are
enough of them to find some of about the same length: a group takes as long as its longest. Searches of few steps would
seldom fill one: their windows are solved on single numbers, one at a time. What a search finds
does not depend on its group, nor on the number of threads. Searches are begun when windows are wanted, so that
few of them are on their way at any time.
"""

from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from functools import partial
from itertools import count
from threading import Condition
from typing import Any, NamedTuple, TypeVar

from planner.base.lanes import WIDTH
from planner.base.sizes import SIZES
from planner.base.threads import side_by_side, threads
from planner.joint.window_solver import Asked, Solved, kind_of, solve_windows

# Windows that wait when a group is put together, if there are so many, and of a group: its lanes take one after the other, so
# that lanes whose windows take few iterations do not idle.
WAITING, QUEUE = 8 * WIDTH, 4 * WIDTH
ALIKE = 0.8  # of the longest of a group, how long those are that wait for a lane at least [-]
IN_LANES = SIZES.searched_in_lanes  # steps: windows of searches of fewer together are solved one at a time
QUIET = SIZES.windows_shared  # steps: searches of fewer together are worth no thread
Task = Generator[Asked, Solved, None]
Sweep = list[Task]  # that do not depend on one another
T = TypeVar("T")
Search = Generator[Sweep, None, T]


def searched(searches: Iterable[Search[T]], steps: int, tell: Callable[[], None] = lambda: None) -> list[T]:
    """What the searches return, in their order.

    steps : that they have together, about: whether there are threads, and windows side by side
    tell  : called in this thread now and then
    """
    groups = Groups(searches, WIDTH if steps > IN_LANES else 1)
    if steps > QUIET:
        side_by_side([groups.work] * threads(), groups.stop, tell)
    else:
        groups.work()
    tell()
    return [found for _, found in sorted(groups.found.items())]


class _Running:
    """A search on its way.

    tasks : of its sweep, those that have not been begun
    left  : how many have not ended
    """

    def __init__(self, number: int, search: Search[Any]):
        self.number, self.search = number, search
        self.tasks = deque[Task]()
        self.left = 0


class _Ready(NamedTuple):
    """A task whose window waits."""

    running: _Running
    task: Task
    asked: Asked
    sort: "Sort"


class Sort(NamedTuple):
    """By what windows are put together; the kind is None for one that is solved by itself."""

    steps: int
    kind: Hashable | None


def together(waiting: list[Sort], most: int = QUEUE) -> list[int]:
    """Which windows to solve next: the longest of those that are solved by themselves; where there are none, up to `most` of one
    kind, those that leave least of lanes as long as their longest idle; more than lanes only where they are `ALIKE`."""
    of_kind: dict[Hashable | None, list[int]] = {}
    for at in sorted(range(len(waiting)), key=lambda at: -waiting[at].steps):
        of_kind.setdefault(waiting[at].kind, []).append(at)
    if None in of_kind:
        return of_kind[None][:1]

    def group(of: list[int], k: int) -> list[int]:
        least = ALIKE * waiting[of[k]].steps
        return [at for n, at in enumerate(of[k : k + most]) if n < WIDTH or waiting[at].steps >= least]

    groups = (group(of, k) for of in of_kind.values() for k in range(max(len(of) - WIDTH, 0) + 1))
    return max(groups, key=lambda group: sum(waiting[at].steps for at in group) / waiting[group[0]].steps)


class Groups:
    """Searches, from which any number of threads take windows (`work`), `width` of them at most.

    found : what the searches have returned, by their number
    """

    def __init__(self, searches: Iterable[Search[Any]], width: int):
        self.width = width
        self.found: dict[int, Any] = {}
        self._new: Iterator[_Running] = map(_Running, count(), searches)
        self._going: list[_Running] = []  # with tasks that have not been begun
        self._ready: list[_Ready] = []
        self._busy, self._stopped = 0, False
        self._changed = Condition()

    def stop(self) -> None:
        """Solve no other window."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()

    def work(self) -> None:
        """Solve windows until there is nothing left to do."""
        while (what := self._next()) is not None:
            try:
                what()
            finally:
                with self._changed:
                    self._busy -= 1
                    self._changed.notify_all()

    def _next(self) -> Callable[[], None] | None:
        """What is to be done next; None at the end."""
        with self._changed:
            while True:
                what = None if self._stopped else self._chosen()
                if what is not None:
                    self._busy += 1
                if what is not None or self._stopped or not self._busy:
                    return what
                self._changed.wait()

    def _chosen(self) -> Callable[[], None] | None:
        if len(self._ready) < WAITING:
            if self._going:
                running = self._going[-1]
                task = running.tasks.popleft()
                if not running.tasks:
                    self._going.pop()
                return partial(self._resume, running, task)
            if (new := next(self._new, None)) is not None:
                return partial(self._go_on, new)
        if not self._ready:
            return None
        most = min(QUEUE, max(WIDTH, len(self._ready) // threads()))  # leaves some for the other threads
        group = together([one.sort for one in self._ready], most)
        solve = partial(self._solve, [self._ready[at] for at in group])
        self._ready = [one for at, one in enumerate(self._ready) if at not in group]
        return solve

    def _solve(self, group: list[_Ready]) -> None:
        width = 1 if group[0].sort.kind is None else self.width
        for one, solved in zip(group, solve_windows([one.asked for one in group], width), strict=True):
            self._resume(one.running, one.task, solved)

    def _resume(self, running: _Running, task: Task, solved: Solved | None = None) -> None:
        """Go on with a task to its next window, or its end."""
        try:
            asked = next(task) if solved is None else task.send(solved)
        except StopIteration:
            asked = None
        with self._changed:
            if asked is not None:
                kind = None if self.width == 1 else kind_of(asked)
                sort = Sort(len(asked.window.u), kind)
                self._ready.append(_Ready(running, task, asked, sort))
                return
            running.left -= 1
            over = not running.left
        if over:
            self._go_on(running)

    def _go_on(self, running: _Running) -> None:
        """Go on with a search to its next sweep, or its end."""
        while not running.left:
            try:
                sweep = next(running.search)
            except StopIteration as end:
                self.found[running.number] = end.value
                return
            with self._changed:
                running.tasks.extend(sweep)
                running.left = len(sweep)
                if running.left:
                    self._going.append(running)
