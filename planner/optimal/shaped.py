"""Setpoints that leave the machine's vibration modes at rest: planned for a shaper, and delivered behind it.

The delivered motion D is the mean of delayed copies of a planned motion p (planner/motion/shaping.py). D has to keep the limits and the
tolerance; p does not. It follows that:

* The copies of one mode are half a period apart. Where p accelerates for less than that, D has half of its acceleration and jerk, so p
  may be planned with up to twice the limits.
* D cuts corners on which p moves. A sharp corner costs least time if p stops there for a moment, shorter than the shaper, so that D
  passes it within the tolerance (paper 000's overlap of two moves). Therefore p stops at every corner that turns by more than an angle,
  with the shortest rest that is enough. At full stops of the program p rests for the whole length of the shaper, so that D stands
  still.
* Where D exceeds a limit or leaves the tolerance nevertheless, p gets smaller limits in those places, at the times of all copies, and
  is solved again. What remains after `ROUNDS` is removed by slowing down runs of p.

Of the `CANDIDATES` the fastest D is delivered, or the one with the limits as they are, stops at all corners and rests of the whole
length, which along straight blocks keeps every limit and the tolerance. Its least time is known beforehand; it is planned when another
one takes longer than that, and no candidate is pursued that takes longer than what is there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError, NotSolvedError
from planner.constraints.normal_limit import slowest
from planner.delivery.filters import WIDER, Behind
from planner.delivery.pacing import runs_of, slower_runs, standing_longer
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint, Toolpath
from planner.job.job import Job
from planner.job.plan import Plan
from planner.machine import Machine
from planner.motion.shaping import ShapedMotion, Shaper, shaper_of
from planner.motion.timing import Motion, in_chunks, inside_pieces
from planner.optimal.loop import Settings, judged, time_optimal
from planner.optimal.on_path import OnPath
from planner.optimal.order import solve_again
from planner.optimal.result import plan_of_solution
from planner.optimal.tighten import beside_axes, fastest_inside, tightened

# Corners that turn by more than the first of these are stops of p [rad], and p is planned with so many times the accelerations and
# jerks [-].
SHARP = float(np.deg2rad(20.0))
CANDIDATES = ((SHARP, 1.0), (SHARP, 1.5), (SHARP, 1.75), (SHARP, 2.0), (np.inf, 1.75))
# Share of the tolerance that the path of p may use; the rest is for the shaper [-]. A pentagon, a zig-zag and a spiral take the same
# time with 0.3; with 0.7 the spiral takes 6 % longer: there the corners that are no stops leave too little.
OF_PATH = 0.5
ROUNDS = 12  # of a candidate, at most; what is left then is not delivered
# D may exceed a limit by this share [-] before something is done about it, and is slowed down by this much more.
EXCESS, SPARE = 2e-7, 1e-5
# What the verdict may see more of a limit than that, between the places where D was looked at [-]: 9e-3 of a jerk on a random job.
SEEN_MOST = 0.05
# Of the tolerance, what looking at other times may find more [-].
SPARE_ERROR = 2e-3
# What path and samples leave of the tolerance counts as this share at least [-]: in one step the speed falls by at most
# sqrt(1/ROOM_LEAST) times the square root of the excess.
ROOM_LEAST = 0.1
# Steps of the shaper's length in which rests are sought: with one mode each is less than 4 degrees of it, and straight lines
# between them miss 1e-3 of the amplitude. Rests are found to 2^-HALVINGS of the length: 10 us of 40 ms.
STEPS, HALVINGS = 96, 12


@dataclass(frozen=True, eq=False, kw_only=True)
class Shaped:
    """A planned motion p, what it comes from, and the delivered motion D."""

    planned: OnPath
    motion: Motion
    delivered: ShapedMotion
    sentence: str


def shaped(
    job: Job, settings: Settings, candidates: tuple[tuple[float, float], ...] = CANDIDATES
) -> Shaped | None:
    """The fastest shaped motion of the candidates, which are time-optimal with larger limits, a smaller tolerance and more stops, or
    the one with stops at all corners where that is faster; None if none of them takes less than `job.most`."""
    search = _Search(job, settings)
    seen: set[tuple[int, float]] = set()
    for sharp, more in candidates:
        toolpath = _stopping(job.toolpath, sharp)
        stops = int((toolpath.joint == Joint.STOP).sum())
        if (stops, more) not in seen:  # a corner is between the angles
            search.best = search.tried(job, toolpath, more, search.useless) or search.best
        seen.add((stops, more))
    return search.fastest()


class _Search:
    """The fastest of the candidates so far, and the one with stops at all corners, made when it is asked for."""

    def __init__(self, job: Job, settings: Settings):
        self.job, self.settings, self.shaper = job, settings, shaper_of(job.machine.modes)
        self.best: Shaped | None = None
        self._stopping = dataclasses.replace(job, toolpath=_stopping(job.toolpath, 0.0, 1.0))
        stops = int((self._stopping.toolpath.joint[1:] == Joint.STOP).sum())
        self._least = job.stop_time + self.shaper.length * stops

    @cached_property
    def _stopped(self) -> Shaped | None:
        return self.tried(
            self._stopping, _stopping(self.job.toolpath, 0.0), 1.0, lambda time: time >= self.job.most
        )

    def _stopped_before(self, time: float) -> bool:
        """Whether the motion with stops at all corners takes less time [s]; it is not made where it cannot."""
        return self._least < time and self._stopped is not None and self._stopped.delivered.end < time

    def useless(self, time: float) -> bool:
        """Whether a motion that takes so long [s] is no faster than what is there."""
        most = self.best.delivered.end if self.best else np.inf
        return time >= min(most, self.job.most) or self._stopped_before(time)

    def fastest(self) -> Shaped | None:
        """The best of the candidates, or the motion with stops at all corners if it is faster."""
        return (
            self._stopped
            if self._stopped_before(self.best.delivered.end if self.best else np.inf)
            else self.best
        )

    def tried(
        self, job: Job, toolpath: Toolpath, more: float, useless: Callable[[float], bool]
    ) -> Shaped | None:
        """The shaped motion of a job on a path with stops, planned with `more` times the accelerations; None if it is useless."""
        candidate = dataclasses.replace(job, machine=_faster(job.machine, more), toolpath=toolpath)
        try:
            planned = time_optimal(candidate, self.settings)
        except NotSolvedError:  # no grid follows the path
            return None
        if not planned.solution.solved:
            return None
        made = _Settling(job, self.shaper, self.settings).settled(planned, useless)
        stops = int((toolpath.joint == Joint.STOP).sum())
        job.tell(
            "shaped",
            found=made[2].end if made else np.nan,
            before=self.best.delivered.end if self.best else np.inf,
            kept=made is not None,
            stops=stops,
            limits=more,
        )
        said = (
            f"shaped for {len(job.machine.modes)} vibration modes, {1e3 * self.shaper.length:.4g} ms longer than what was planned with "
            f"{more:g} times the accelerations and {stops - 2} stops"
        )
        return Shaped(planned=made[0], motion=made[1], delivered=made[2], sentence=said) if made else None


def _stopping(toolpath: Toolpath, sharp: float, share: float = OF_PATH) -> Toolpath:
    """The path with a share of its tolerance, and stops at sharp corners."""
    stop = np.flatnonzero(toolpath.theta > sharp)
    return dataclasses.replace(toolpath.with_joints(stop, Joint.STOP), tolerance=share * toolpath.tolerance)


def _faster(machine: Machine, by: float) -> Machine:
    axes = {
        letter: axis.model_copy(update={"acceleration": by * axis.acceleration, "jerk": by * axis.jerk})
        for letter, axis in machine.axes.items()
    }
    return machine.model_copy(update={"axes": axes})


class _Settling:
    """Makes p gentler, or rest longer, until D keeps everything."""

    def __init__(self, job: Job, shaper: Shaper, settings: Settings):
        self.job, self.shaper, self.order = job, shaper, settings.order
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


def shaped_plan(job: Job, settings: Settings) -> Plan:
    """The plan of a job with shaped setpoints. Raises InputError for a machine without vibration modes; else as `shaped`."""
    if not job.machine.modes:
        raise InputError(
            f"machine '{job.machine.name}' has no vibration modes to shape setpoints for; give it tables [[modes]] with frequency "
            "and damping"
        )
    # reshaping makes paths for the motion as it is planned, not for the one behind the shaper
    settings = dataclasses.replace(settings, rounds=settings.rounds or 0)
    plan = _plan_of(job, settings, shaped(job, settings))
    if plan.verdict is None or plan.verdict.passed:
        return plan
    # what is slower is not gentler everywhere behind a shaper, whose copies then meet elsewhere; with the limits as they are D is
    again = job.afresh()
    gentle = _plan_of(again, settings, shaped(again, settings, CANDIDATES[:1]))
    kept = gentle.verdict is not None and gentle.verdict.passed
    job.tell(
        "shaped, limits as they are",
        found=gentle.cycle_time if gentle.solved else np.nan,
        before=plan.cycle_time,
        kept=kept,
    )
    return gentle if kept else plan


def _plan_of(job: Job, settings: Settings, found: Shaped | None) -> Plan:
    """What was found, delivered and judged."""
    if found is None:
        return job.plan(
            None, method=settings.method, corner=None, solver="", status=Status.NUMERICAL_ERROR, grid_points=0,
            sentence="no motion was found that keeps limits and tolerance behind the shaper; plan without --shaped",
        )  # fmt: skip
    not_limited = () if settings.order.jerk_limited else ("jerk",)
    shaper = found.delivered.shaper
    made = judged(job, found.motion, not_limited, lambda planned: ShapedMotion(planned, shaper), SEEN_MOST)
    plan = plan_of_solution(job, found.planned, made, method=settings.method, corner=settings.corner)
    return dataclasses.replace(plan, sentence=f"{plan.sentence}; {found.sentence}")
