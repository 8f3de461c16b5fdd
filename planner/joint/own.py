"""The free optimum by an own solver: window by window along a run, each by the interior-point method of
interior_point.py.

A window's first and last node stay as they are, in position, velocity and acceleration, so that windows join
exactly. The first windows lie end to end; those of the second sweep each reach over one join, from inside one
window to inside the next, where these have found their optimum. Windows of a sweep have no step in common:
they are searched side by side, together with those of other runs (groups.py), and what they find does not
depend on the others. A window that does not converge, that breaks something when its steps are integrated and
looked at exactly (checks.py) is divided; what is left of that keeps the motion that the search began with, and
is said.
"""

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.feedrate.solution import Status
from planner.joint.checks import chord_means, worst_shares
from planner.joint.groups import Search, Sweep, Task, searched
from planner.joint.guess import CutMotion, Guess, unit_of
from planner.joint.interior_point import Tuning
from planner.joint.law_window import NEAR, Window, near
from planner.joint.motion import Steps, closed_at_nodes
from planner.joint.nlp import PULL
from planner.joint.outcome import TubeSolution
from planner.joint.own_laws import watched
from planner.joint.price import columns, step_prices
from planner.joint.problem import NARROWED, SEEN, StepWindow, window_of
from planner.joint.row_kinds import H_MIN
from planner.joint.run import TubeRun
from planner.joint.shares import PULL_AGAIN, SLID, TOLD, law_shares, strain, tightened
from planner.joint.switches import Beside, no_rows_beside, switches_missed
from planner.joint.window_solver import Asked, Solved

# Steps of a run that is one window, of a window of others at most, on each side of a join that is searched once more, and
# of the smallest part that a window which fails is divided into.
WHOLE, WINDOW = SIZES.searched_whole, SIZES.searched_window
OVERLAP, LEAST = SIZES.searched_overlap, SIZES.searched_least
# A window of steps far shorter than what shapes a corner (`unit_of`) is longer than `WINDOW`: it lasts so many units on
# the mean [-], or has `WHOLE` steps (`python -m benchmarks.net.ablation ROWS --net NET --without LASTS`).
LASTS = 50.0
# A join is where the motion uses least of its limits and of the tolerance, at most so many steps from where
# it would be.
JOIN_WITHIN = SIZES.searched_join
# What a change of a step's duration costs in one iteration (interior_point.py), and by how much rows may be missed at
# the end [-].
PROX, MISSED = 0.1, 1e-6
# Complementarity of the start, share of the time, and its slacks at least [-].
START = (0.3, 0.05)
# Laws of the position are about a place, of the tolerance along a curve the rows know the tangents at nodes. Where one is
# exceeded it is lowered by what it was above, and a little more [-]; the tolerance by that power of it. Of chords the rows
# know the acceleration: where they leave the tolerance they are told what chords were off beside it, and the search goes on
# from there with that pull, as that is of the durations found.
TIGHTER, MORE, PULL_OF_CHORDS = 1.002, 2.0, 0.01
# Where steps want to be shorter than they may become (problem.py) a window is searched once more from what was found,
# if that is worth this share of the time [-]
# (`python -m benchmarks.net.ablation ROWS --net NET --without SHORTENED`).
SHORTENED = 1e-3
# A window that fails is divided, and searched once more from around: else one of thousands ends the search of its run
# (`python -m benchmarks.cost.long_jobs stellabee1`: 1,614 s on its path, 1,284 s). Nodes that stay are made slower before, so
# that fewer windows fail.
# Rounding of limits, as a share of them [-].
ROUNDING = 1e-9
KEPT = "no faster motion was found there"
FOUND = "path and feed optimised together"


@dataclass(frozen=True)
class TubeOwn:
    """Settings of the search.

    gap      : complementarity at its end, share of the time [-]
    stays    : the guess keeps all limits, and stays where nothing faster is found. Otherwise it need not, and no part
               of it is kept: windows may end slower than it, and the search ends where nothing is found on a part
    progress : called with the share of the steps that are done [-], in any thread
    smooth   : weight of the jerk against the time at least [-] (step_limits.py); above 0 what is found may be
               slower than the guess
    least    : to which the price on changes of durations falls at the end [-]; 0.01 instead of the default,
               where it does not fall, ends a little faster in more iterations
    """

    gap: float = 1e-5
    stays: bool = True
    progress: Callable[[float], None] | None = None
    smooth: float = 0.0
    least: float = 1.0
    legs_max: ClassVar[float] = np.inf

    def solve(self, run: TubeRun, guess: Guess) -> TubeSolution:
        """The best motion near the guess, never slower than it. Where no faster one is found its steps are
        `kept`."""
        return searched([self.search(run, guess)], len(guess))[0]

    def search(self, run: TubeRun, guess: Guess) -> Search[TubeSolution]:
        """The same beside other searches; `solve_time` is from its beginning to its end."""
        began, search = time.perf_counter(), _Search(self, run, guess)
        whole = yield from search.sweeps()
        took = time.perf_counter() - began
        if not whole or search.kept.all():
            return TubeSolution(
                status=Status.ITERATION_LIMIT,
                sentence="the search did not end faster than its start",
                iterations=sum(search.iterations),
                solve_time=took,
                windows=search.windows,
                solved=sum(search.undivided),
            )
        share = float(guess.h[search.kept].sum() / guess.h.sum())
        sentence = FOUND if not share else f"{FOUND}; on {share:.2g} of the time {KEPT}"
        return TubeSolution(
            status=Status.ACCEPTABLE if share else Status.OPTIMAL,
            sentence=sentence,
            iterations=sum(search.iterations),
            solve_time=took,
            windows=search.windows,
            solved=sum(search.undivided),
            steps=search.steps(),
            place=search.places(),
            kept=search.kept,
            price=search.price,
        )


class _Search:
    """A run on its way from a guess to the optimum near it."""

    def __init__(self, settings: TubeOwn, run: TubeRun, guess: Guess):
        self.settings, self.run, self.guess = settings, run, CutMotion(guess)
        self.jerk = np.diff(guess.state[:, 2], axis=0) / guess.h[:, None]
        self.kept = np.ones(len(guess), dtype=bool)
        self.price = np.zeros((len(guess), columns(run)))
        self.iterations, self.windows, self.undivided = list[int](), 0, list[bool]()
        self._keeps = run.keeps
        self._begun = guess
        self._done, self._all = list[int](), len(guess)  # steps of all windows

    @cached_property
    def _strain(self) -> FloatArray:
        return strain(self.run, self._begun)

    def sweeps(self) -> Generator[Sweep, None, bool]:
        """All windows, then all joins, then what is still kept; whether that may be."""
        steps = len(self.guess)
        parts = 1
        if steps > WHOLE:
            wanted = min(np.ceil(steps / WINDOW), self.guess.h.sum() / (LASTS * unit_of(self.run)))
            parts = int(max(wanted, np.ceil(steps / WHOLE)))
        even = np.linspace(0, steps, parts + 1).astype(int)
        joins = [self._join(int(near)) for near in even[1:-1]]
        self._slow(joins)
        self._all = steps + 2 * OVERLAP * len(joins)
        yield from self._sweep([0, *joins], [*joins, steps])
        yield from self._sweep(
            [self._join(join - OVERLAP) for join in joins], [self._join(join + OVERLAP) for join in joins]
        )
        if self.kept.any():
            yield from self._sweep(*self._around_kept())
        return self.settings.stays or not self.kept.any()

    def _around_kept(self) -> tuple[list[int], list[int]]:
        """Where the windows begin and end that reach from what was found before steps that are kept to what was found
        behind them."""
        steps, before = np.arange(len(self.kept)), np.append(0, np.cumsum(self.kept))
        behind = np.minimum(steps + OVERLAP, len(steps) - 1) + 1
        around = before[behind] > before[np.maximum(steps - OVERLAP, 0)]
        begin, end = np.flatnonzero(np.diff(around, prepend=False, append=False)).reshape(-1, 2).T
        some = [0 < self.kept[lo:hi].sum() < hi - lo <= WHOLE for lo, hi in zip(begin, end, strict=True)]
        return begin[some].tolist(), end[some].tolist()

    def _slow(self, nodes: list[int]) -> None:
        """Make a guess that need not keep its limits slower at nodes that will stay, where the steps beside them would
        exceed limits as narrowed as they may be: no motion keeps them there."""
        if not nodes or self.settings.stays:
            return
        run, at = self.run, np.array(nodes, dtype=int)
        state, leg, h = self.guess.state, self.guess.leg, self.guess.h
        v, a = state[at, 1], state[at, 2]
        feed = np.minimum(run.feed[leg[at]], run.feed[leg[at - 1]])
        beside = np.stack([v, v - a * h[at - 1, None] / 2, v + a * h[at, None] / 2])  # of the Bezier velocity
        shares = (
            (np.abs(beside) / run.velocity).max(axis=(0, 2)),
            np.linalg.norm(beside, axis=2).max(axis=0) / feed,
            *(np.maximum(run.word_share(leg[at], one), run.word_share(leg[at - 1], one)) for one in beside),
            np.sqrt((np.abs(a) / run.acceleration).max(axis=1)),
            *(law_shares(run, self.guess, at) ** (1.0 / run.laws.orders)).T,
        )
        by = np.maximum(np.max(shares, axis=0) / (1.0 - NARROWED * MISSED), 1.0)[:, None]
        state[at, 1] /= by
        state[at, 2] /= by**2

    def steps(self) -> Steps:
        """The steps; those that are kept as they were guessed."""
        p, v, a = (self.guess.state[:-1, k] for k in range(3))
        return Steps(h=self.guess.h, position=p, velocity=v, acceleration=a, jerk=self.jerk)

    def places(self) -> FloatArray:
        """(N+1,) of the nodes along the run [mm]; those at vertices are there."""
        begins = np.diff(self.guess.leg, prepend=-1) > 0
        place = np.where(begins, self.run.offset[self.guess.leg], self.guess.place[:, 0])
        return np.append(place, self.run.offset[-1])

    def _sweep(self, begin: list[int], end: list[int]) -> Generator[Sweep, None, None]:
        """The windows from `begin` to `end`, no two of which have a step in common."""
        if begin:
            yield [self._window(lo, hi) for lo, hi in zip(begin, end, strict=True)]
            self.windows += len(begin)

    def _window(self, lo: int, hi: int) -> Task:
        """Improve the steps lo .. hi - 1, and tell so."""
        found = yield from self._improved(lo, hi)
        self.undivided.append(found)
        if not found:
            yield from self._in_halves(lo, hi)
        self._done.append(hi - lo)
        if self.settings.progress is not None:
            self.settings.progress(min(sum(self._done) / self._all, 1.0))

    def _join(self, near: int) -> int:
        """A node to join windows at."""
        begin = max(near - JOIN_WITHIN, 0)
        return begin + int(np.argmin(self._strain[begin : near + JOIN_WITHIN]))

    def _in_halves(self, lo: int, hi: int) -> Task:
        """Improve both halves of the steps lo .. hi - 1, and then all of them once more from what these have found."""
        if hi - lo < 2 * LEAST:
            return
        middle = (lo + hi) // 2
        reach = min(JOIN_WITHIN, (hi - lo) // 4)
        middle += int(np.argmin(self._strain[middle - reach : middle + reach])) - reach
        self._slow([middle])
        before = float(self.guess.h[lo:hi].sum())
        for begin, end in ((lo, middle), (middle, hi)):
            if not (yield from self._improved(begin, end)):
                yield from self._in_halves(begin, end)
        if not self.settings.stays or self.guess.h[lo:hi].sum() < before:
            yield from self._improved(lo, hi)

    def _improved(self, lo: int, hi: int) -> Generator[Asked, Solved, bool]:
        """Whether an optimum of the steps lo .. hi - 1 was found; if it is faster it takes their place."""
        run, smooth = self.run, self.settings.smooth
        tuning = Tuning(PULL, PROX, self.settings.gap, MISSED, self.settings.least, *START)
        tight, begun = np.ones((hi - lo, 1 + len(run.laws))), Window(self.guess, lo, hi)
        needed, beside, taken = near(run.laws, begun), no_rows_beside(hi - lo, len(run.axis)), False
        for number in range(TOLD):
            which = np.flatnonzero(needed)
            window = window_of(
                run, begun, begun.lo, begun.hi, MISSED, tight, smooth, which, beside, begun.rest
            )
            done, iterations, z = yield Asked(window, tuning)
            self.iterations.append(iterations)
            if not done:
                break
            over = self._taken(lo, hi, window, begun, beside, last=number == TOLD - 1)
            if over is None:
                self.price[lo:hi] = step_prices(run, window, z)
                taken, shorter = True, z[:, 8 * len(run.axis) + H_MIN].sum()
                if shorter <= SHORTENED * window.u[:, -1].sum():
                    break
                begun = Window(self.guess, lo, hi, begun.rest)
                continue
            if not over.any():
                continue
            if not (over > 1.0).any():
                break
            of_chords = PULL if begun.rest is None else PULL_OF_CHORDS
            tuning = tuning._replace(pull=PULL_AGAIN if run.laws.moved else of_chords)
            of_laws = over[:, 1:]
            # rows that are far off are asked for about other places first
            near_enough = (of_laws.max(axis=0, initial=0.0) < 1.0 + SLID) | (number > 0)
            tight[:, 0] *= np.where(over[:, 0] > 1.0, over[:, 0] ** MORE * TIGHTER, 1.0)
            tight[:, 1:] *= np.where(near_enough, tightened(of_laws, number), 1.0)
            needed |= (of_laws > NEAR).any(axis=0)
        return taken

    def _taken(
        self, lo: int, hi: int, window: StepWindow, begun: Window, beside: Beside, *, last: bool
    ) -> FloatArray | None:
        """None where the steps lo .. hi - 1 of a window that has been solved keep everything; if they are
        faster they take their place. Else the shares (hi - lo, 1 + M) that they use of what rows watch in places, or
        about other places, only: the tolerance along curves, the laws; then `begun` becomes what was found. In `beside`
        comes where rows of a change of feed are missing; the shares are 0 then. Of chords the verdict is the `last` to tell:
        the motion may pass slower in places."""
        run, axes, guess = self.run, len(self.run.axis), self.guess
        h = window.u[:, axes] * window.second
        state, leg = guess.state[lo : hi + 1], guess.leg[lo:hi]
        nodes = window.nodes()
        nodes[[0, -1]] = state[[0, -1]]
        found, jerk = closed_at_nodes(nodes, h, window.u[:, :axes] * (window.length / window.second**3))
        place = window.place[:, :3] * window.length
        along = place + run.offset[leg][:, None]
        limit, (tube, chords) = worst_shares(self._keeps, leg, h, found, jerk, place)
        of_chords = not last and tube.max() <= 1.0 < chords.max()
        if of_chords:  # what they are off beside their rows says by how much
            tube = np.minimum(chords, 1.0 + ROUNDING)
        ends = np.append(along[:, 0], guess.place[hi - 1, 3])
        of_laws = watched(run.laws, leg, h, found, jerk, ends)
        inside = limit <= 1.0 + ROUNDING and of_laws.max(initial=0.0) <= 1.0 + ROUNDING
        if not (inside and tube.max() <= 1.0):
            if of_chords or (run.laws.moved and tube.max() <= 1.0):
                begun.put(h, found, along)
            if of_chords:
                begun.tell(self._rest(leg, h, found, jerk))
            # what passes a short leg at its distance is nearest to one of its ends, and too far in its middle:
            # no step of such a leg alone is the cause
            of_leg = np.where(run.radius > 0.0, 1.0, 0.0)
            np.maximum.at(of_leg, leg, np.where((run.radius[leg] > 0.0) | (tube > 1.0), tube, 0.0))
            return np.column_stack([of_leg[leg], of_laws])
        missed = self._switches_missed(lo, hi, h, found, jerk) if run.switch.any() else None
        if missed is not None:
            beside.add(missed)
            return np.zeros((hi - lo, 1 + len(run.laws)))
        needed = not self.settings.stays and self.kept[lo:hi].any()
        if needed or self.settings.smooth or h.sum() < guess.h[lo:hi].sum():
            guess.place[lo:hi, :3] = along
            guess.h[lo:hi], guess.state[lo + 1 : hi], self.jerk[lo:hi] = h, found[1:-1], jerk
            self.kept[lo:hi] = False
        return None

    def _rest(self, leg: Array, h: FloatArray, state: FloatArray, jerk: FloatArray) -> FloatArray:
        """`Window.rest` of a motion."""
        means, wider = chord_means(self._keeps, leg, h, state, jerk)
        return np.column_stack([means - state[:, 0] - SEEN * self.run.sag * state[:, 2], wider])

    def _switches_missed(
        self, lo: int, hi: int, h: FloatArray, state: FloatArray, jerk: FloatArray
    ) -> Beside | None:
        """As the function, of the steps lo .. hi - 1 and those beside them: a vertex there may be nearest in these."""
        guess, first = self.guess, max(lo - JOIN_WITHIN, 0)
        before, behind = slice(first, lo), slice(hi, hi + JOIN_WITHIN)
        leg = guess.leg[first : hi + JOIN_WITHIN]
        h = np.concatenate([guess.h[before], h, guess.h[behind]])
        state = np.concatenate([guess.state[before], state, guess.state[hi + 1 : hi + 1 + JOIN_WITHIN]])
        jerk = np.concatenate([self.jerk[before], jerk, self.jerk[behind]])
        return switches_missed(self.run, leg, h, state, jerk, slice(lo - first, hi - first))
