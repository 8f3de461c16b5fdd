"""A planned motion p made gentler until what is delivered of it behind a shaper keeps everything.

The delivered motion D and what p may do that D must not are in shaped.py.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.delivery.filters import FLOOR_STEP, Behind, runs_within, stops_between
from planner.delivery.pacing import runs_of, slower_runs, standing_longer
from planner.delivery.path_errors import SPARE as SPARE_ERROR
from planner.delivery.rests import mean_of_copies
from planner.feedrate.constraints.limits import Limits
from planner.geometry.toolpath import Joint
from planner.motion.limits_used import ratios, slowest
from planner.motion.shaping import ShapedMotion, Shaper
from planner.motion.timing import Motion, in_chunks, inside_pieces
from planner.planning.job.job import Job
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import Order, solve_again
from planner.planning.optimal.tighten import fastest_inside, tightened

ROUNDS = 12  # of a candidate, at most; what is left then is not delivered
# D may exceed a limit by this share [-] before it is slowed down, and by this much more then.
EXCESS, SPARE = 2e-7, 1e-5
# What the path and the shaper may use of the tolerance, and what errors are brought to [-].
ROOM, AIM = 1.0 - SPARE_ERROR, 1.0 - 2.0 * SPARE_ERROR
MOST_SLOWER = 2.0  # of a run, in one round [-] ...
SHORT_RUN = 0.25  # ... but of one to which that was no help, which takes so much of what D is made of [-]


class Over(NamedTuple):
    """The excesses of D, put down to the L pieces of p's law and its G runs."""

    factor: FloatArray  # (L,) by what p has to be slower there [-]
    limit: FloatArray  # (G,) by what runs have to be slower to keep their limits [-]
    error: FloatArray  # (G,) error over tolerance where D is made of one run; 0 where the tolerance is kept
    short: Array  # (G,) True for runs behind which D leaves the tolerance where it is made of two: there a longer rest helps

    @property
    def kept(self) -> bool:
        """Whether D keeps everything."""
        return bool(self.limit.max() <= 1.0 + EXCESS and not self.error.any() and not self.short.any())


class Settling:
    """Makes p gentler, or rest longer, until D keeps everything."""

    def __init__(self, job: Job, shaper: Shaper, order: Order, share: float):
        """share : of the tolerance, for the path of p [-]"""
        self.job, self.shaper, self.order, self.share = job, shaper, order, share
        machine = job.real[0]
        self.behind, self._mean = Behind(job.toolpath, machine), mean_of_copies(shaper)
        self.filters = machine.fir.time_constants if machine.fir else ()
        self.seen = self.shaper.length + sum(self.filters)  # what D is made of, back from a time [s]
        self.limits = Limits.of(job.machine, job.toolpath.axes)
        self.quantities = ("velocity", "acceleration", *(("jerk",) if self.order.jerk_limited else ()))
        self.feed = np.full(int(job.toolpath.block[-1]) + 1, np.inf)
        self.feed[job.toolpath.block] = job.toolpath.feed

    def settled(
        self, planned: OnPath, useless: Callable[[float], bool]
    ) -> tuple[OnPath, Motion, ShapedMotion] | None:
        """The fastest D found on the path of `planned`, with its p; None if none is of use.

        useless : whether a D that takes so long [s] is no faster than what is there
        """
        best: tuple[OnPath, Motion, ShapedMotion] | None = None

        def late(time: float) -> bool:
            return (best is not None and time >= best[2].end) or useless(time)

        for _ in range(ROUNDS):
            if late(planned.solution.cycle_time + self.shaper.length):
                break  # gentler problems take longer
            made, factor = self._kept(planned, late)
            best = made or best
            if factor.max() <= 1.0 + EXCESS:
                break
            planned = solve_again(planned, tightened(planned.problem, factor), self.order.solver)
            if not planned.solution.solved:
                break
        return best

    def _kept(
        self, planned: OnPath, late: Callable[[float], bool]
    ) -> tuple[tuple[OnPath, Motion, ShapedMotion] | None, FloatArray]:
        """`planned`, its p with rests, slowed down until D keeps everything, and D; None if it never does, or
        not before it is late; and what p as planned exceeds (P,)."""
        plain = planned.motion()
        runs = runs_of(plain)
        first = np.ones(len(planned.problem))
        slower, least = np.ones(len(runs)), np.zeros(len(runs))
        longer, before = np.full(len(runs), FLOOR_STEP * self.seen), (slower, np.zeros(len(runs)))
        for n in range(ROUNDS):
            motion = slower_runs(plain, runs, slower)
            timed = runs_of(motion)
            rest = np.maximum(self._rests(motion, planned), least)
            motion = standing_longer(motion, timed, rest)
            delivered = ShapedMotion(motion, self.shaper)
            if n and late(delivered.end):
                break
            over = self._over(motion, delivered, *timed.behind(rest))
            if n == 0:
                first = over.factor
            if over.kept:
                return None if late(delivered.end) else (planned, motion, delivered), first
            least[over.short] = np.minimum(rest + longer, self.seen)[over.short]
            longer[over.short] *= 2.0
            now = (slower, over.error)
            slower = np.maximum(
                np.where(over.limit > 1.0 + EXCESS, slower * over.limit * (1.0 + SPARE), slower),
                slower_by_errors(now, before, self.share, SHORT_RUN * self.seen / (runs.end - runs.begin)),
            )
            before = now
        return None, first

    def _over(self, motion: Motion, delivered: ShapedMotion, begin: FloatArray, end: FloatArray) -> Over:
        """The changes for D to keep everything; p's runs begin and end at these times (G,) [s]."""
        factor = np.ones(len(motion.law.t))
        peaks = np.add.outer(fastest_inside(motion.law), self.shaper.delay)
        times = np.append(inside_pieces(delivered)[1], peaks)
        times = times[times < delivered.end]
        dt = self.job.machine.dt
        if np.isfinite(self.limits.normal):
            times = np.concatenate([times, *(slowest(chunk) for chunk in in_chunks(delivered, dt, times))])
        for chunk in in_chunks(delivered, dt, times):
            worst = np.ones(len(chunk))
            for order, name in enumerate(self.quantities, start=1):
                ratio = np.abs(getattr(chunk, name)) / getattr(self.limits, name)
                worst = np.maximum(worst, ratio.max(axis=1) ** (1.0 / order))
            for order, ratio in ratios(self.limits, chunk):
                if order <= len(self.quantities):
                    worst = np.maximum(worst, ratio ** (1.0 / order))
            # D is on the block at the mean delay, as near as the shaper leaves it to the path
            worst = np.maximum(worst, chunk.feed / self.feed[chunk.block])
            self._put(factor, motion, chunk.t, worst)
        off = self.behind.errors(delivered)
        missed = off.near > ROOM
        ratio = np.append(off.ratio, off.near[missed])
        t = np.append(off.time, off.near_time[missed])
        slower = np.sqrt(np.maximum(ratio - self.share, 0.0) / (ROOM - self.share))
        limit = np.maximum.reduceat(factor, np.searchsorted(motion.law.run, np.arange(len(begin))))
        first, last = self._piece(motion, t - self.seen), self._piece(motion, t)
        for a, b, by in zip(first, last, slower, strict=True):
            factor[a : b + 1] = np.maximum(factor[a : b + 1], by)
        early, late = runs_within(begin, end, t, self.seen)
        own, error = early == late, np.zeros(len(begin))
        np.maximum.at(error, late[own], ratio[own])
        return Over(factor, limit, error, stops_between(early, late, len(begin)))

    def _put(self, factor: FloatArray, motion: Motion, time: FloatArray, worst: FloatArray) -> None:
        """Put down to pieces of p's law, in `factor` (L,), by what D is too fast at times (n,) [s]."""
        over = worst > 1.0 + EXCESS
        for delay in self.shaper.delay:
            np.maximum.at(factor, self._piece(motion, time[over] - delay), worst[over])

    def _piece(self, motion: Motion, times: FloatArray) -> Array:
        return np.clip(np.searchsorted(motion.law.t, times, side="right") - 1, 0, len(motion.law.t) - 1)

    def _rests(self, motion: Motion, planned: OnPath) -> FloatArray:
        """(G,) rest behind each run [s]: at full stops of the job the shaper's length, elsewhere the shortest
        with which D comes near enough to the corner, behind the last run none."""
        samples, toolpath = planned.samples, self.job.toolpath
        runs = runs_of(motion)
        rest = np.zeros(len(runs))
        if len(runs) < 2:
            return rest
        joint = samples.path.legs.first[samples.stop][1:-1]
        rest[:-1] = self.shaper.length
        free = np.flatnonzero(toolpath.joint[joint] != Joint.STOP)
        inside, stop = self._mean.inside, toolpath.start[joint[free], None]
        into = self._seen(motion, runs.end[free, None] - inside) - stop
        out = self._seen(motion, runs.begin[free + 1, None] + inside) - stop
        rest[free] = self._mean.shortest_rests(into, out, toolpath.tolerance[joint[free]] * ROOM)
        return rest

    def _seen(self, motion: Motion, times: FloatArray) -> FloatArray:
        place, of = np.unique(np.clip(times, 0.0, motion.end), return_inverse=True)
        return (
            motion.at(place, self.job.machine.dt)
            .position[of]
            .reshape(*times.shape, len(self.job.toolpath.axes))
        )


def slower_by_errors(
    now: tuple[FloatArray, FloatArray], before: tuple[FloatArray, FloatArray], share: float, least: FloatArray
) -> FloatArray:
    """(G,) how much slower than planned runs have to be for their errors to come to `AIM` [-].

    now, before : how much slower they were (G,) [-], and error over tolerance then (G,), 0 without one
    share       : of the tolerance, that the path may use [-]
    least       : (G,) how much slower they are at least when that was in vain [-]

    The error is e = path + dynamic/slower^2. Two rounds tell both; before that the path is taken to use what
    it may. A run that takes less time than the shaper is long is as far off however fast it is: D is then
    between its ends. Where the second round was no better, or not even a standing run would be near enough, a
    run is made `MOST_SLOWER` times as slow.
    """
    (s, e), (s0, e0) = now, before
    known = (e0 > 0.0) & (s > s0)
    dynamic = np.where(known, e0 - e, e - share) / np.where(known, s0**-2.0 - s**-2.0, s**-2.0)
    left = AIM - e + dynamic / s**2
    vain = (dynamic <= 0.0) | (left <= 0.0)
    to = np.sqrt(np.where(vain, 1.0, dynamic) / np.where(vain, 1.0, left))
    to = np.where(vain, np.maximum(MOST_SLOWER * s, least), np.clip(to, s, MOST_SLOWER * s))
    return np.where(e > 0.0, to, s)
