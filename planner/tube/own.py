"""The free optimum by an own solver: window by window along a run, each by the interior-point method of interior_point.py.

A window's first and last node stay as they are, in position, velocity and acceleration, so that windows join exactly. They overlap:
each begins inside the one before, where that has found its optimum. A window that does not converge, that breaks something when its
steps are integrated and looked at exactly (checks.py) is divided; what is left of that keeps the motion that the search began with, and
is said.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.solution import Status
from planner.tube.checks import Keeps, worst_shares
from planner.tube.guess import Guess
from planner.tube.interior_point import Tuning, solve
from planner.tube.motion import Steps, closed, integrated
from planner.tube.nlp import PULL
from planner.tube.outcome import TubeSolution
from planner.tube.price import columns, step_prices
from planner.tube.problem import Window, window_of
from planner.tube.rows import Legs
from planner.tube.run import TubeRun

# Steps of a window, of its overlap with the next one, and of the smallest part that one which fails is divided into.
WINDOW, OVERLAP, LEAST = 1000, 150, 60
# A join is where the motion uses least of its limits and of the tolerance, at most so many steps from where it would be.
JOIN_WITHIN = 40
# What a change of a step's duration costs in one iteration (interior_point.py), in turn [-]: windows that do not converge with the
# first do with the second (pentagon on mill), and the other way round.
PROX = 0.1, 1.0
# Rounding of limits, as a share of them [-].
ROUNDING = 1e-9
KEPT = "no faster motion was found there"
FOUND = "the best motion near its start, geometry and feed together"


@dataclass(frozen=True)
class TubeOwn:
    """Settings of the search.

    gap : complementarity at its end, share of the time [-]
    """

    gap: float = 1e-5
    legs_max: ClassVar[float] = np.inf

    def solve(self, run: TubeRun, guess: Guess) -> TubeSolution:
        """The best motion near the guess, never slower than it. Where no faster one is found its steps are `kept`."""
        began, search = time.perf_counter(), _Search(self, run, guess)
        search.sweep()
        took = time.perf_counter() - began
        if search.kept.all():
            return TubeSolution(
                status=Status.ITERATION_LIMIT,
                sentence="the search did not end faster than its start",
                iterations=search.iterations,
                solve_time=took,
            )
        share = float(search.guess.h[search.kept].sum() / guess.h.sum())
        sentence = FOUND if not share else f"{FOUND}; on {share:.2g} of the time {KEPT}"
        return TubeSolution(
            status=Status.ACCEPTABLE if share else Status.OPTIMAL,
            sentence=sentence,
            iterations=search.iterations,
            solve_time=took,
            steps=search.steps(),
            place=search.places(),
            kept=search.kept,
            price=search.price,
        )


class _Search:
    """A run on its way from a guess to the optimum near it."""

    def __init__(self, settings: TubeOwn, run: TubeRun, guess: Guess):
        self.settings, self.run, self.guess = settings, run, guess
        self.jerk = np.diff(guess.state[:, 2], axis=0) / guess.h[:, None]
        self.kept = np.ones(len(guess), dtype=bool)
        self.price = np.zeros((len(guess), columns(len(run.axis))))
        self.iterations = 0
        self._keeps = keeps_of(run)
        self._strain = _strain(run, guess)

    def sweep(self) -> None:
        """All windows, one after the other."""
        lo, steps = 0, len(self.guess)
        while True:
            hi = steps if steps - lo <= WINDOW + OVERLAP else self._join(lo + WINDOW)
            self._improve(lo, hi)
            if hi == steps:
                return
            lo = self._join(hi - OVERLAP)

    def steps(self) -> Steps:
        """The steps; those that are kept as they were guessed."""
        p, v, a = (self.guess.state[:-1, k] for k in range(3))
        return Steps(h=self.guess.h, position=p, velocity=v, acceleration=a, jerk=self.jerk)

    def places(self) -> FloatArray:
        """(N+1,) of the nodes along the run [mm]."""
        return np.append(self.guess.place[:, 0], self.run.offset[-1])

    def _join(self, near: int) -> int:
        """A node to join windows at."""
        begin = near - JOIN_WITHIN
        return begin + int(np.argmin(self._strain[begin : near + JOIN_WITHIN]))

    def _improve(self, lo: int, hi: int, costs: tuple[float, ...] = PROX) -> None:
        """The steps lo .. hi - 1; where that fails both halves of them, and then all of them once more from what these have found."""
        if self._improved(lo, hi, costs) or hi - lo < 2 * LEAST:
            return
        middle = (lo + hi) // 2
        reach = min(JOIN_WITHIN, (hi - lo) // 4)
        middle += int(np.argmin(self._strain[middle - reach : middle + reach])) - reach
        before = float(self.guess.h[lo:hi].sum())
        self._improve(lo, middle, PROX[:1])
        self._improve(middle, hi, PROX[:1])
        if self.guess.h[lo:hi].sum() < before:
            self._improved(lo, hi, costs)

    def _improved(self, lo: int, hi: int, costs: tuple[float, ...]) -> bool:
        """Whether an optimum of the steps lo .. hi - 1 was found, with one of the `costs` (PROX); if it is faster it takes their
        place."""
        for prox in costs:
            window = window_of(self.run, self.guess, lo, hi)
            x, u, place = window.x, window.u, window.place
            tuning = Tuning(PULL, prox, self.settings.gap)
            done, iterations, z = solve(window.legs, window.limits, x, u, place, tuning)
            self.iterations += iterations
            if done and self._taken(lo, hi, window):
                self.price[lo:hi] = step_prices(window, z)
                return True
        return False

    def _taken(self, lo: int, hi: int, window: Window) -> bool:
        """Whether the steps lo .. hi - 1 of a window that has been solved keep everything; if they are faster they take their place."""
        run, axes = self.run, len(self.run.axis)
        h = window.u[:, axes] * window.second
        state, leg = self.guess.state[lo : hi + 1], self.guess.leg[lo:hi]
        jerk = closed(state[0], state[-1], h, window.u[:, :axes] * (window.length / window.second**3))
        found = integrated(state[0], h, jerk)
        found[-1] = state[-1]
        place = window.place * window.length
        limit, tube = worst_shares(self._keeps, leg, h, found, jerk, place)
        if not (limit <= 1.0 + ROUNDING and tube <= 1.0):
            return False
        if h.sum() < self.guess.h[lo:hi].sum():
            along, whole_h, whole = (getattr(self.guess, name).copy() for name in ("place", "h", "state"))
            along[lo:hi, :3] = place + run.offset[leg][:, None]
            whole_h[lo:hi], whole[lo : hi + 1], self.jerk[lo:hi] = h, found, jerk
            self.guess = replace(self.guess, h=whole_h, state=whole, place=along)
            self.kept[lo:hi] = False
        return True


def keeps_of(run: TubeRun) -> Keeps:
    """What the run has to keep, for the kernel."""
    names = ("length", "base", "drift", "e1", "e2", "radius", "rate")
    return Keeps(
        legs=Legs(**{name: getattr(run, name) for name in names}),
        velocity=run.velocity,
        acceleration=run.acceleration,
        jerk=run.jerk,
        feed=run.feed,
        normal=run.across_max,
        budget=run.budget,
        curvature=run.curvature,
        vertex_budget=run.vertex_budget,
    )


def _strain(run: TubeRun, guess: Guess) -> FloatArray:
    """(N,) the largest share of a limit or of the tolerance that a motion uses at the beginning of each step."""
    leg: Array = guess.leg
    p, v, a = (guess.state[:-1, k] for k in range(3))
    far = np.linalg.norm(p - run.points(leg, guess.place[:, 0] - run.offset[leg]), axis=1) / run.room[leg]
    shares = (
        far,
        (np.abs(v) / run.velocity).max(axis=1),
        np.linalg.norm(v, axis=1) / run.feed[leg],
        (np.abs(a) / run.acceleration).max(axis=1),
    )
    return np.max(shares, axis=0)
