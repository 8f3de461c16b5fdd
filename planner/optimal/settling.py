"""A planned motion p made gentler, or with longer rests, until what is delivered of it behind a shaper keeps limits and tolerance.

The delivered motion D and what p may do that D must not are in shaped.py.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.constraints.normal_limit import slowest
from planner.delivery.filters import WIDER, Behind
from planner.delivery.pacing import runs_of, slower_runs, standing_longer
from planner.geometry.toolpath import Joint
from planner.job.job import Job
from planner.motion.shaping import ShapedMotion, Shaper
from planner.motion.timing import Motion, in_chunks, inside_pieces
from planner.optimal.on_path import OnPath
from planner.optimal.order import Order, solve_again
from planner.optimal.tighten import beside_axes, fastest_inside, tightened

# Share of the tolerance that the path of p may use; the rest is for the shaper [-]. A pentagon, a zig-zag and a spiral take the same
# time with 0.3; with 0.7 the spiral takes 6 % longer: there the corners that are no stops leave too little.
OF_PATH = 0.5
ROUNDS = 12  # of a candidate, at most; what is left then is not delivered
# D may exceed a limit by this share [-] before something is done about it, and is slowed down by this much more.
EXCESS, SPARE = 2e-7, 1e-5
# Of the tolerance, what looking at other times may find more [-].
SPARE_ERROR = 2e-3
# What path and samples leave of the tolerance counts as this share at least [-]: in one step the speed falls by at most
# sqrt(1/ROOM_LEAST) times the square root of the excess.
ROOM_LEAST = 0.1
# Steps of the shaper's length in which rests are sought: with one mode each is less than 4 degrees of it, and straight lines
# between them miss 1e-3 of the amplitude. Rests are found to 2^-HALVINGS of the length: 10 us of 40 ms.
STEPS, HALVINGS = 96, 12


class Settling:
    """Makes p gentler, or rest longer, until D keeps everything."""

    def __init__(self, job: Job, shaper: Shaper, order: Order):
        self.job, self.shaper, self.order = job, shaper, order
        machine = job.real[0]
        self.behind = Behind(job.toolpath, machine)
        self.filters = machine.fir.time_constants if machine.fir else ()
        # Between two samples D bows by up to this [mm], which the path between the samples does not have.
        self.bow = (
            job.machine.dt**2 / 8.0 * np.linalg.norm(job.machine.limits("acceleration", job.toolpath.axes))
        )
        self.limits = {
            "velocity": job.machine.limits("velocity", job.toolpath.axes),
            "acceleration": job.machine.limits("acceleration", job.toolpath.axes),
        }
        if self.order.jerk_limited:
            self.limits["jerk"] = job.machine.limits("jerk", job.toolpath.axes)
        self.feed = np.full(int(job.toolpath.block[-1]) + 1, np.inf)
        self.feed[job.toolpath.block] = job.toolpath.feed

    def settled(
        self, planned: OnPath, useless: Callable[[float], bool]
    ) -> tuple[OnPath, Motion, ShapedMotion] | None:
        """The fastest D found on the path of `planned`, with the p that it is made of; None if none is of use.

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
        """`planned`, its p with rests, slowed down until D keeps everything, and D; None if it never does, or not before it is late;
        and what p as planned exceeds (P,)."""
        plain = planned.motion()
        runs = runs_of(plain)
        slower, first = np.ones(len(runs)), np.ones(len(planned.problem))
        for n in range(ROUNDS):
            motion = slower_runs(plain, runs, slower)
            motion = standing_longer(motion, runs_of(motion), self._rests(motion, planned))
            delivered = ShapedMotion(motion, self.shaper)
            if n and late(delivered.end):
                break
            factor = self._factor(motion, delivered)
            if n == 0:
                first = factor
            if factor.max() <= 1.0 + EXCESS:
                return None if late(delivered.end) else (planned, motion, delivered), first
            worst = np.maximum.reduceat(factor, np.searchsorted(motion.law.run, np.arange(len(runs))))
            slower = slower * np.where(worst > 1.0 + EXCESS, worst * (1.0 + SPARE), 1.0)
        return None, first

    def _factor(self, motion: Motion, delivered: ShapedMotion) -> FloatArray:
        """(L,) by what factor p has to be slower on each piece of its law for D to keep everything."""
        factor = np.ones(len(motion.law.t))
        peaks = np.add.outer(fastest_inside(motion.law), self.shaper.delay)
        times = np.append(inside_pieces(delivered)[1], peaks)
        times = times[times < delivered.end]
        dt = self.job.machine.dt
        if self.job.machine.normal_acceleration is not None:
            times = np.concatenate([times, *(slowest(chunk) for chunk in in_chunks(delivered, dt, times))])
        for chunk in in_chunks(delivered, dt, times):
            worst = np.maximum(1.0, chunk.feed / self.feed[chunk.block])
            for order, (name, limit) in enumerate(self.limits.items(), start=1):
                worst = np.maximum(worst, (np.abs(getattr(chunk, name)) / limit).max(axis=1) ** (1.0 / order))
            for order, ratio in beside_axes(self.job.machine, chunk):
                if order <= len(self.limits):
                    worst = np.maximum(worst, ratio ** (1.0 / order))
            over = worst > 1.0 + EXCESS
            for delay in self.shaper.delay:
                np.maximum.at(factor, self._piece(motion, chunk.t[over] - delay), worst[over])
        off = self.behind.errors(delivered, self.filters)
        room = 1.0 - SPARE_ERROR - self.bow / self.job.toolpath.tolerance.min()
        missed = off.near > room
        # a contour error above WIDER is the distance from a piece that D is not on: the match was lost before
        ratio = np.append(np.minimum(off.ratio, WIDER), off.near[missed])
        t = np.append(off.time, off.near_time[missed])
        # at long periods the bow leaves less room than the path may use: nothing is gained there by going slower
        slower = np.sqrt(np.maximum(ratio - OF_PATH, 0.0) / max(room - OF_PATH, ROOM_LEAST))
        seen = self.shaper.length + sum(self.filters)  # what D is made of, back from t
        first, last = self._piece(motion, t - seen), self._piece(motion, t)
        for begin, end, by in zip(first, last, slower, strict=True):
            factor[begin : end + 1] = np.maximum(factor[begin : end + 1], by)
        return factor

    def _piece(self, motion: Motion, times: FloatArray) -> Array:
        return np.clip(np.searchsorted(motion.law.t, times, side="right") - 1, 0, len(motion.law.t) - 1)

    def _rests(self, motion: Motion, planned: OnPath) -> FloatArray:
        """(G,) rest behind each run [s]: at full stops of the job the shaper's length, elsewhere the shortest with which D comes near
        enough to the corner, behind the last run none."""
        samples, toolpath = planned.samples, self.job.toolpath
        runs = runs_of(motion)
        rest = np.zeros(len(runs))
        if len(runs) < 2:
            return rest
        joint = samples.path.legs.first[samples.stop][1:-1]
        end, begin = runs.end[:-1], runs.begin[1:]
        budget = toolpath.tolerance[joint] * (1.0 - SPARE_ERROR) - self.bow
        at = np.linspace(0.0, self.shaper.length, STEPS + 1)
        into = self._seen(motion, end[:, None] - at) - toolpath.start[joint][:, None]
        out = self._seen(motion, begin[:, None] + at) - toolpath.start[joint][:, None]
        delay = self.shaper.length
        rest[:-1] = delay
        free = np.flatnonzero(toolpath.joint[joint] != Joint.STOP)
        near = _miss(into[free], out[free], np.zeros(len(free)), self.shaper) <= budget[free]
        rest[free[near]] = 0.0
        free = free[~near]
        low, high = np.zeros(len(free)), np.full(len(free), delay)
        for _ in range(HALVINGS if len(free) else 0):
            middle = (low + high) / 2.0
            enough = _miss(into[free], out[free], middle, self.shaper) <= budget[free]
            low, high = np.where(enough, low, middle), np.where(enough, middle, high)
        rest[free] = high
        return rest

    def _seen(self, motion: Motion, times: FloatArray) -> FloatArray:
        place, of = np.unique(np.clip(times, 0.0, motion.end), return_inverse=True)
        return motion.at(place, self.job.machine.dt).position[of].reshape(*times.shape, -1)


def _miss(into: FloatArray, out: FloatArray, rest: FloatArray, shaper: Shaper) -> FloatArray:
    """(g,) how near D comes to stops at which p rests so long (g,) [mm]; into, out (g, STEPS + 1, A) [mm]: where p is, seen from the
    stop, at equal steps of the shaper's length before and after it."""
    steps = into.shape[1] - 1
    rows = np.arange(len(rest))[:, None]
    after = np.linspace(0.0, 1.0, 2 * steps + 1)[None, :] * (
        shaper.length + rest[:, None]
    )  # since p came to rest
    total = np.zeros((*after.shape, into.shape[2]))
    for delay, weight in zip(shaper.delay, shaper.weight, strict=True):
        since = after - delay
        for table, place in ((into, -since), (out, since - rest[:, None])):
            x = np.clip(place / shaper.length * steps, 0.0, steps)
            k = np.minimum(x.astype(np.int64), steps - 1)
            share = (x - k)[:, :, None]
            total += weight * ((1.0 - share) * table[rows, k] + share * table[rows, k + 1])
    return np.linalg.norm(total, axis=2).min(axis=1)
