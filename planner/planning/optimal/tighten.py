"""Limits that a motion exceeds between grid points, kept by tighter limits there, or less speed.

A solver keeps the limits at the grid points. Between them the motion may exceed a limit, usually by less than
0.5 %. Slowing down by lam divides speeds by lam, accelerations by lam^2 and jerks by lam^3, so an excess says
by which lam the motion has to be slower there.

`tightened` scales the limits around every excess (`limit_scale` of the problem) and solves again: the new
motion is slower in these places only. Each run between full stops is then slowed down uniformly by the excess
that remains, which always ends.
"""

import dataclasses
import functools

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.sizes import SIZES
from planner.base.threads import side_by_side
from planner.delivery.pacing import runs_of, slower_runs
from planner.feedrate.constraints.limits import Limits
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.limits_used import ratios
from planner.motion.timing import CHUNK, WATCHED, Motion, TimeLaw, in_chunks, inside_pieces
from planner.planning.job.trace import Tell, tell_nobody
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import Order, solve_again

# The excess of a parabola through these counts so many times [-]: jerks are parabolas to about 10 %.
PEAK_MORE = 1.2
# Tightening pays while a run is slowed down by more than this [-], and not for long.
TIGHTENED_EXCESS = 1e-5
TIGHTENING_ROUNDS = 2
# What is slowed down is slowed down by this much more [-]; less is rounding.
SLOWING_MORE = 1e-5
EXCESS_ROUNDING = 1e-9
# Jobs of more points are slowed down by this factor before the verdict, which would find a little more.
MANY_POINTS, SEEN_BEFORE = SIZES.slowed_before, 1.0 + 2e-5


def excess(motion: Motion, toolpath: Toolpath, machine: Machine) -> FloatArray:
    """(L,) by what factor the motion has to be slower to keep its limits on each piece of its time law, seen
    near its ends, in its middle, where it is fastest and, if it lies on one grid interval, at the peaks of
    parabolas through these; <= 1 where it keeps them."""
    every = Limits.of(machine, toolpath.axes)
    limits = every.of_axes
    programmed = np.full(int(toolpath.block[-1]) + 1, np.inf)
    programmed[toolpath.block] = toolpath.feed
    factor = np.zeros(len(motion.law.t))
    pieces, inside = inside_pieces(motion)
    smooth = _on_one_interval(motion)

    def look(first: int) -> None:
        part = slice(first, first + CHUNK // len(WATCHED))
        shown, times = pieces[part], inside[part]
        seen = motion.at(times.ravel(), machine.dt)
        worst = np.empty(len(shown))
        motions = (seen.velocity, seen.acceleration, seen.jerk)
        _worst(seen.feed / programmed[seen.block], motions, limits, smooth[shown], worst)
        for order, ratio in ratios(every, seen):
            most = _with_peaks(ratio.reshape(times.shape), smooth[shown])
            worst = np.maximum(worst, most ** (1.0 / order))
        factor[shown] = worst

    tasks = [functools.partial(look, first) for first in range(0, len(pieces), CHUNK // len(WATCHED))]
    if len(tasks) > 1:
        motion.at(motion.t[:1], machine.dt)  # makes what all looks share
        side_by_side(tasks, lambda: None, lambda: None)
    else:
        for task in tasks:
            task()
    for chunk in in_chunks(motion, machine.dt, fastest_inside(motion.law)):
        worst = np.maximum(
            chunk.feed / programmed[chunk.block], (np.abs(chunk.velocity) / limits[0]).max(axis=1)
        )
        for order, ratio in ratios(every, chunk):
            worst = np.maximum(worst, ratio ** (1.0 / order))
        at = np.searchsorted(motion.law.t, chunk.t, side="right") - 1
        np.maximum.at(factor, np.maximum(at, 0), worst)
    return factor


def _on_one_interval(motion: Motion) -> Array:
    """(L,) True for pieces of the law on one interval of the grid, where no derivative jumps."""
    s, grid = motion.law.s, motion.samples.s
    interval = np.searchsorted(grid, s, side="right") - 1
    beyond = np.append(s[1:], s[-1])
    return np.asarray(beyond <= grid[np.minimum(interval + 1, len(grid) - 1)])


@njit(cache=True, error_model="numpy", nogil=True)
def _worst(feed, motions, limits, smooth, out):
    """The factor of each of n pieces, into out (n,), from what is seen of it at the shares `WATCHED`: feed (3
    n,) over the programmed one, and velocities, accelerations and jerks (3 n, A) with their limits (3, A); on
    smooth pieces (n,) of the parabolas through them too."""
    apart = WATCHED[2] - WATCHED[0]
    for n in range(len(out)):
        worst = max(feed[3 * n], feed[3 * n + 1], feed[3 * n + 2])
        for order in range(3):
            values, most = motions[order], 0.0
            for k in range(values.shape[1]):
                limit = limits[order, k]
                y0, y1, y2 = (
                    values[3 * n, k] / limit,
                    values[3 * n + 1, k] / limit,
                    values[3 * n + 2, k] / limit,
                )
                seen = max(abs(y0), abs(y1), abs(y2))
                slope = (y2 - y0) / apart
                bend = (y2 - 2.0 * y1 + y0) / (2.0 * (WATCHED[1] - WATCHED[0]) ** 2)
                peak = abs(y1)
                if smooth[n] and abs(slope) < abs(bend):  # less than half of the piece from its middle
                    peak = abs(y1 - slope * slope / (4.0 * bend))
                known = max(seen, 1.0)
                most = max(most, known + PEAK_MORE * (peak - known) if peak > known else max(seen, peak))
            worst = max(worst, most ** (1.0 / (order + 1)))
        out[n] = worst


def _with_peaks(ratio: FloatArray, smooth: Array) -> FloatArray:
    """(n,) the largest of the ratios of n pieces (n, 3) at `WATCHED`, and on smooth pieces (n,) the peak of
    the parabola through them, counted as in `_worst`."""
    y0, y1, y2 = ratio.T
    slope = (y2 - y0) / (WATCHED[2] - WATCHED[0])
    bend = (y2 - 2.0 * y1 + y0) / (2.0 * (WATCHED[1] - WATCHED[0]) ** 2)
    inside = smooth & (np.abs(slope) < np.abs(bend))
    peak = np.where(inside, np.abs(y1 - slope**2 / (4.0 * np.where(inside, bend, 1.0))), y1)
    seen = ratio.max(axis=1)
    known = np.maximum(seen, 1.0)
    return np.where(peak > known, known + PEAK_MORE * (peak - known), np.maximum(seen, peak))


def fastest_inside(law: TimeLaw) -> FloatArray:
    """(n,) times of peaks of the feed inside pieces of the law [s]: a solver sees ends and middle."""
    lasting = np.diff(np.append(law.t, law.end))
    braking = np.flatnonzero(law.jerk_s < 0.0)
    tau = -law.acc_s[braking] / law.jerk_s[braking]
    inside = (tau > 0.0) & (tau < lasting[braking])
    return law.t[braking[inside]] + tau[inside]


def tightened(problem: FeedrateProblem, factor: FloatArray) -> FeedrateProblem:
    """The problem with room for motions too fast by `factor` (P,) to the right of each point."""
    lam = np.maximum(factor, 1.0)
    lam[1:] = np.maximum(lam[1:], lam[:-1])  # at both ends of an interval
    return dataclasses.replace(problem, limit_scale=problem.limit_scale * lam)


def within_limits(
    planned: OnPath, order: Order, toolpath: Toolpath, machine: Machine, tell: Tell = tell_nobody
) -> tuple[OnPath, Motion]:
    """The fastest motion found that keeps all limits between grid points too, with the problem and solution
    that it comes from; `planned` has a solution. Without jerk limits the motion is taken as it is:
    accelerations step at grid points, between which they are close to straight lines."""
    motion = planned.motion()
    if not order.jerk_limited:
        return planned, motion
    factor = excess(motion, toolpath, machine)
    best, least = (planned, factor), slowed(motion, toolpath, machine, factor).end
    tell("between points", found=least, excess=float(factor.max() - 1.0))
    tighter = planned
    del planned, motion  # half a kilobyte a point, which long jobs need for the next one
    for _ in range(TIGHTENING_ROUNDS):
        if factor.max() <= 1.0 + TIGHTENED_EXCESS:
            break
        problem = tightened(tighter.problem, np.where(factor > 1.0 + TIGHTENED_EXCESS, factor, 1.0))
        tighter = solve_again(tighter, problem, order.solver)
        if not tighter.solution.solved:
            break
        motion = tighter.motion()
        factor = excess(motion, toolpath, machine)
        end = slowed(motion, toolpath, machine, factor).end
        tell("tighten", found=end, before=least, kept=end < least, excess=float(factor.max() - 1.0))
        if end < least:
            best, least = (tighter, factor), end
        del motion
    planned, factor = best
    motion = slowed(planned.motion(), toolpath, machine, factor)
    if len(planned.samples) > MANY_POINTS:
        runs = runs_of(motion)
        motion = slower_runs(motion, runs, np.full(len(runs), SEEN_BEFORE))
    return planned, motion


def slowed(motion: Motion, toolpath: Toolpath, machine: Machine, factor: FloatArray | None = None) -> Motion:
    """The same motion with every run slower by its `excess` (L,) and a little more, where that is needed.

    factor : the excess, if it is known
    """
    factor, runs = excess(motion, toolpath, machine) if factor is None else factor, runs_of(motion)
    of_run = np.maximum.reduceat(factor, runs.first)
    slow = of_run > 1.0 + EXCESS_ROUNDING
    by = np.where(slow, of_run * (1.0 + SLOWING_MORE), 1.0)
    return slower_runs(motion, runs, by) if slow.any() else motion
