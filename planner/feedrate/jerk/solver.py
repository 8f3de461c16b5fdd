"""Own kernel for the jerk-limited problem: an interior-point method with a Riccati recursion, linear in the
grid.

Minimise the time subject to all second-order limits of `FeedrateProblem` and to the axis jerks

    | r'_k j + 3 r''_k v u + r'''_k v^3 | <= j_k                      at both ends of every interval,

with constant jerk j along the path on every interval, the same transcription as nlp.py, so that both can be
compared on one grid. One window's problem is in window.py, its second-order model in rows.py, the step in
interior_point.py. One iteration models the Lagrangian at the current profile, minimises the barrier problem's
linear-quadratic model exactly and goes as far as slacks, multipliers and kinematics stay in their domains. 15
to 25 iterations, whatever the size.

**Windows.** A long piece is solved in windows of about `window` intervals, or more if the braking distance is
long beside that. Each window ends in a full stop, which is only there to end it. The part of the window that
the stop cannot influence is kept, up to three braking distances before it, and the next window starts from
the state reached there, at a point where the costate of the kinematics says that more speed would help
(chain.py). A start during hard braking into a bend would leave a problem with hardly any feasible points, and
multipliers that mean nothing. What is kept agrees with the solution in one piece (tested). The memory is that
of one window per thread.

**Held ranges.** Where nothing but the bound of the feed can hold the motion it is not solved for (held.py).
That divides a piece into parts with given feeds at their ends.

**Threads.** Parts are independent, and a long one is solved from both of its ends (part.py). What can be done
side by side is, on as many cores as planner/base/threads.py says; the kernels let go of Python's lock. The
solution is the same, byte by byte, on any number.

**Fall-backs.** A window is tried from three starts (window.py). One that converges from none is divided into
smaller ones if it starts at rest; else, or where even that fails, the profile stops: at the end of the window
before, if the motion comes from there, or after the plain start, which always keeps the limits. The
solution's status is then ACCEPTABLE, and its sentence names the places. Of 16,390 windows of small problems
(benchmarks/solvers/jerk_campaign.py) 19 converged from the plain start only, and 7 from none.

**Feasibility.** At the end a profile may exceed its limits by the solver's tolerance. Slowing a whole piece
down by lam >= 1 divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and keeps the kinematics
exact; with the smallest lam that satisfies every row the profile is feasible, always. Its cost, lam - 1, is
in the sentence of the solution.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from planner.base.arrays import Array
from planner.base.sizes import SIZES
from planner.base.threads import side_by_side, threads
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.again import WIDER, Range, RangeAgain, ranges_of
from planner.feedrate.jerk.chain import INTERVALS_MIN, Task
from planner.feedrate.jerk.columns import ProblemColumns, columns_of
from planner.feedrate.jerk.layout import Room
from planner.feedrate.jerk.part import LONG
from planner.feedrate.jerk.piece import Piece, Solved, slowed_piece
from planner.feedrate.jerk.profile import Profile
from planner.feedrate.jerk.settings import WindowSettings
from planner.feedrate.lagrangian import lagrangian
from planner.feedrate.solution import FeedrateSolution, Multipliers, Prices, Status

PLACES_NAMED = 3  # in a sentence
# A piece of which more than this share has to be solved again is solved as a whole [-].
SHARE_MAX = 0.8
CHANGE_MAX = 0.05  # limits of speed that change by more than this are felt beyond the ranges [-]
POINTS_SHARED = SIZES.points_shared


@dataclass(frozen=True, kw_only=True)
class JerkLimited(WindowSettings):
    """The interior-point solver for third-order problems."""

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces; ends must be at rest. Failures are a status.

        progress : called with the share of the points that is done
        """
        began = time.perf_counter()
        if problem.feed_sq_start.any() or problem.feed_sq_end.any():
            raise ValueError("JerkLimited: pieces must start and end at rest")
        short = np.flatnonzero(np.diff(problem.piece) <= INTERVALS_MIN)
        if len(short):
            at = problem.s[problem.piece[short[0]]]
            sentence = f"piece {short[0]} (from s = {at:.6g} mm) has fewer than {INTERVALS_MIN} intervals; refine the grid"
            return FeedrateSolution.failed(problem, Status.INFEASIBLE, sentence, repr(self), 0.0)
        profile = Profile.at_rest(*problem.d1.shape)
        columns, counted = columns_of(problem), _Counted(len(problem), progress)
        task = partial(Task, solver=self, columns=columns, profile=profile, tell=counted.add)
        pieces = self._solve_pieces(list(pairwise(problem.piece.tolist())), task, counted)
        stops = [stop for piece in pieces for stop in piece.stops]
        slower = max(piece.slower for piece in pieces)
        sentence = f"slowed by {slower - 1.0:.1e} to keep every limit; " if slower > 1.0 else ""
        sentence += f"time-optimal within {self.tol:g} for the limits with jerk"
        if stops:
            places = ", ".join(f"{problem.s[k]:.6g}" for k in stops[:PLACES_NAMED])
            more = ", ..." if len(stops) > PLACES_NAMED else ""
            sentence += (
                f", except {len(stops)} full stops where the method did not converge, at s = {places}{more} mm: "
                "coarsen the path where points nearly coincide, refine it where the feed changes much between points"
            )
        solution = FeedrateSolution(
            status=Status.ACCEPTABLE if stops else Status.OPTIMAL,
            sentence=sentence,
            solver=repr(self),
            solve_time=0.0,
            iterations=max(piece.iterations for piece in pieces),
            jerk_limited=True,
            effort={name: sum(piece.effort[name] for piece in pieces) for name in pieces[0].effort},
            **_columns_of_solution(profile),
        )
        return _priced(problem, columns, solution, began)

    def _solve_pieces(
        self, ends: list[tuple[int, int]], task: Callable[..., Task], counted: _Counted
    ) -> list[Solved]:
        """Solve the pieces of these first points and points behind the last, on several cores if it is worth
        it. Long ones come first, as many at a time as there are threads for their two ends: each takes a
        third of a kilobyte a point while it is being solved."""
        order = sorted(range(len(ends)), key=lambda g: ends[g][0] - ends[g][1])
        long = sum(beyond - 1 - first > LONG * self.window for first, beyond in ends)
        at_once = max(threads() // 2, 1)
        batches = [order[k : min(k + at_once, long)] for k in range(0, long, at_once)] + [order[long:]]
        solved: dict[int, Solved] = {}
        for batch in batches:
            pieces = [Piece(task(first=ends[g][0], last=ends[g][1] - 1)) for g in batch]
            room = _do([work for piece in pieces for work in piece.work], counted)
            solved |= {g: piece.finish(room) for g, piece in zip(batch, pieces, strict=True)}
        return [solved[g] for g in range(len(ends))]

    def again(
        self, before: FeedrateProblem, known: FeedrateSolution, problem: FeedrateProblem
    ) -> tuple[FeedrateProblem, FeedrateSolution] | None:
        """The solution of a problem that differs from the one `before` in the scales of its limits, a little
        and at few points, from that one's solution `known` (again.py): with the problem itself, whose scales
        are those of before where no solution was found; None where limits changed by so much that all has to
        be solved."""
        began = time.perf_counter()
        change = problem.limit_scale / before.limit_scale
        if known.multipliers is None or np.abs(change - 1.0).max() > CHANGE_MAX:
            return None
        profile, columns, counted = (
            Profile.of_solution(known),
            columns_of(problem),
            _Counted(len(problem), None),
        )
        task = partial(Task, solver=self, columns=columns, profile=profile, tell=counted.add)
        whole, ranges = _whole_pieces(problem, ranges_of(before, known, change != 1.0))
        for first, beyond in whole:
            profile.forget(first, beyond)
        pieces = self._solve_pieces(whole, task, counted)
        work, kept = _ranges_again(before, known, change != 1.0, ranges, task, counted)
        if kept:
            scale = problem.limit_scale.copy()
            for own in kept:
                points = slice(own.first, own.last + 1)
                scale[points] = before.limit_scale[points]
            problem = replace(problem, limit_scale=scale)
            columns = columns_of(problem)
        at = np.unique(np.searchsorted(problem.piece, [own.first for own in ranges], side="right") - 1)
        slower = [slowed_piece(profile, columns, problem.piece[g], problem.piece[g + 1] - 1) for g in at]
        most = max([1.0, *slower, *(piece.slower for piece in pieces)])
        stops = sum(len(piece.stops) for piece in pieces)
        again = {"pieces": len(whole), "ranges": len(ranges), "kept": len(kept)}
        solution = replace(
            known,
            status=Status.ACCEPTABLE if stops else known.status,
            sentence=f"{known.sentence}; {len(whole)} pieces and {len(ranges)} ranges solved again"
            + (f", slowed by {most - 1.0:.1e}" if most > 1.0 else "")
            + (f", with {stops} full stops where the method did not converge" if stops else ""),
            iterations=max(
                [
                    known.iterations,
                    *(one.chain.iterations for one in work),
                    *(one.iterations for one in pieces),
                ]
            ),
            effort=known.effort | {f"{name} again": count for name, count in again.items()},
            **_columns_of_solution(profile),
        )
        return problem, _priced(problem, columns, solution, began)


def _ranges_again(
    before: FeedrateProblem,
    known: FeedrateSolution,
    changed: Array,
    ranges: list[Range],
    task: Callable[..., Task],
    counted: _Counted,
) -> tuple[list[RangeAgain], list[Range]]:
    """Solve ranges again, and wider ones where they have no solution (again.py): what was tried, and the
    ranges that keep their profile."""
    work = [RangeAgain(task(first=own.first, last=own.last)) for own in ranges]
    _do([(one.last - one.first, one) for one in work], counted)
    failed = [own for own, one in zip(ranges, work, strict=True) if not one.solved]
    if not failed:
        return work, []
    inside = np.zeros(len(changed), dtype=bool)
    for own in failed:
        points = slice(own.first, own.last + 1)
        inside[points] = changed[points]
    wider = [
        RangeAgain(task(first=own.first, last=own.last)) for own in ranges_of(before, known, inside, WIDER)
    ]
    _do([(one.last - one.first, one) for one in wider], counted)
    unsolved = [one for one in wider if not one.solved]
    kept = [own for own in failed if any(one.first <= own.first and own.last <= one.last for one in unsolved)]
    return work + wider, kept


def _whole_pieces(problem: FeedrateProblem, ranges: list[Range]) -> tuple[list[tuple[int, int]], list[Range]]:
    """Pieces, first points and points behind the last, of which the ranges are more than `SHARE_MAX`; and the
    ranges of the others."""
    piece = problem.piece
    of = np.searchsorted(piece, [own.first for own in ranges], side="right") - 1
    size = np.bincount(of, [own.last - own.first for own in ranges], len(piece) - 1)
    whole = size > SHARE_MAX * (np.diff(piece) - 1)
    ends = [(int(piece[g]), int(piece[g + 1])) for g in np.flatnonzero(whole)]
    return ends, [own for own, g in zip(ranges, of, strict=True) if not whole[g]]


def _columns_of_solution(profile: Profile) -> dict[str, Any]:
    """The fields of a solution that a profile has."""
    return {
        "feed_sq": profile.x,
        "acc_s": profile.u,
        "jerk_s": profile.jerk,
        "duration": profile.duration,
        "multipliers": Multipliers(rows=profile.rows, feed=profile.feed, dynamics=profile.dynamics),
    }


def _priced(
    problem: FeedrateProblem, columns: ProblemColumns, solution: FeedrateSolution, began: float
) -> FeedrateSolution:
    """The solution with its prices and the time that it took."""
    found = lagrangian(problem, solution, columns)
    prices = Prices.from_relative(problem, found.acceleration, found.jerk, found.feed_sq_max)
    return replace(solution, prices=prices, solve_time=time.perf_counter() - began)


def _do(sized: list[tuple[int, Callable[[Room], None]]], counted: _Counted) -> Room:
    """Do work of so many intervals each, on several cores if it is worth it; returns room for more of it."""
    # The longest first, so that none is left to one core at the end.
    work = [task for _, task in sorted(sized, key=lambda one: -one[0])]
    room = Room()
    if threads() == 1 or len(work) <= 1 or sum(size for size, _ in sized) < POINTS_SHARED:
        for task in work:
            task(room)
        return room
    rooms = threading.local()

    def run(task: Callable[[Room], None]) -> Callable[[], None]:
        def here() -> None:
            if not hasattr(rooms, "room"):
                rooms.room = Room()
            task(rooms.room)

        return here

    side_by_side([run(task) for task in work], counted.stop, counted.show)
    return room


class _Stopped(Exception):
    """Raised where work goes on of which nobody wants the result."""


class _Counted:
    """How many points are done, by any thread."""

    def __init__(self, points: int, progress: Callable[[float], None] | None):
        self._points, self._progress = points, progress
        self._lock, self._done, self._stopped = threading.Lock(), 0, False
        self._here = threading.get_ident()

    def add(self, count: int) -> None:
        if self._stopped:
            raise _Stopped
        with self._lock:
            self._done += count
        if threading.get_ident() == self._here:
            self.show()

    def stop(self) -> None:
        self._stopped = True

    def show(self) -> None:
        if self._progress is not None:
            self._progress(min(self._done / self._points, 1.0))
