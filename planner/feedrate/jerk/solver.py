"""Own kernel for the jerk-limited problem: interior points with a Riccati recursion, linear in the grid.

Minimise the time subject to all second-order limits of `FeedrateProblem` and to the axis jerks

    | r'_k j + 3 r''_k v u + r'''_k v^3 | <= j_k                      at both ends of every interval,

with constant jerk j along the path on every interval, the same transcription as nlp.py, so that both can be
compared on one grid. One window's problem is in window.py, its second-order model in rows.py, the step in
interior_point.py: 15 to 25 iterations, whatever the size.

**Windows.** A long piece is solved in windows of about `window` intervals, or more if the braking distance is
long beside that. Each ends in a full stop, which is only there to end it; what that cannot influence is kept,
and the next window starts from the state reached there (chain.py). What is kept agrees with the solution in
one piece (tested). Pieces between full stops are solved side by side; the solution is the same, byte by byte,
on any number of cores.

**Fall-backs.** A window is tried from three starts (window.py). One that converges from none is divided into
smaller ones if it starts at rest; else, or where even that fails, the profile stops: at the end of the window
before, if the motion comes from there, or after the plain start, which always keeps the limits. The
solution's status is then ACCEPTABLE, and its sentence names the places. Of 16,390 windows of small problems
(benchmarks/solvers/jerk_campaign.py) 19 converged from the plain start only, and 7 from none.

**Feasibility.** At the end a profile may exceed its limits by the solver's tolerance. It is slowed down as a
whole by the smallest lam >= 1 with which every row holds: speeds by lam, accelerations by lam^2, jerks by
lam^3, which keeps the kinematics exact. Its cost, lam - 1, is in the sentence of the solution.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from planner.base.sizes import SIZES
from planner.base.threads import side_by_side, threads
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.chain import INTERVALS_MIN, Chain
from planner.feedrate.jerk.layout import Room, columns_of, with_rows
from planner.feedrate.jerk.settings import WindowSettings
from planner.feedrate.jerk.window import Window
from planner.feedrate.solution import FeedrateSolution, Multipliers, Status

PLACES_NAMED = 3  # in a sentence
POINTS_SHARED = SIZES.points_shared


@dataclass(frozen=True, kw_only=True)
class JerkLimited(WindowSettings):
    """The interior-point solver for third-order problems."""

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces, from rest to rest. Failures are a status.

        progress : called with the share of the points that is done
        """
        began = time.perf_counter()
        short = np.flatnonzero(np.diff(problem.piece) <= INTERVALS_MIN)
        if len(short):
            at = problem.s[problem.piece[short[0]]]
            sentence = f"piece {short[0]} (from s = {at:.6g} mm) has fewer than {INTERVALS_MIN} intervals; refine the grid"
            return FeedrateSolution.failed(problem, Status.INFEASIBLE, sentence, repr(self), 0.0)
        of = with_rows(problem)
        columns, counted = columns_of(problem, of), _Counted(len(problem), progress)
        profile = Window.at_rest(*columns.d1.shape)
        chain = partial(Chain, solver=self, columns=columns, profile=profile, tell=counted.add)
        pieces = [chain(a, b - 1) for a, b in pairwise(problem.piece.tolist())]
        _solve(pieces, counted)
        rows = profile.rows
        if rows.shape[1] < len(problem.axes):
            rows = np.zeros((len(problem), len(problem.axes), rows.shape[2]))
            rows[:, of] = profile.rows
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
        return FeedrateSolution(
            status=Status.ACCEPTABLE if stops else Status.OPTIMAL,
            sentence=sentence,
            solver=repr(self),
            solve_time=time.perf_counter() - began,
            iterations=max(piece.iterations for piece in pieces),
            jerk_limited=True,
            effort={name: sum(piece.effort[name] for piece in pieces) for name in pieces[0].effort},
            feed_sq=profile.x,
            acc_s=profile.u,
            jerk_s=profile.jerk,
            duration=profile.duration,
            multipliers=Multipliers(rows=rows, feed=profile.feed, dynamics=profile.dynamics),
        )


def _solve(pieces: list[Chain], counted: _Counted) -> None:
    """Solve the pieces, on several cores if it is worth it, the longest first."""
    pieces = sorted(pieces, key=lambda piece: piece.first - piece.last)
    rooms = threading.local()

    def run(piece: Chain) -> None:
        if not hasattr(rooms, "room"):
            rooms.room = Room()
        piece.run(rooms.room)

    if threads() == 1 or len(pieces) == 1 or sum(one.last - one.first for one in pieces) < POINTS_SHARED:
        for piece in pieces:
            run(piece)
    else:
        side_by_side([partial(run, piece) for piece in pieces], counted.stop, counted.show)


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
