"""Rounds of reshaping: splines and feed improved in turns, every run as far as its last round came true
(reshape.py has one round)."""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.corners.smooth import SmoothPath
from planner.planning.job.job import Job
from planner.planning.optimal.effort import Settings
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.reshape import chosen, reshape, run_times, times_on_chords
from planner.smoothing.spline_path import SplineShape, with_spline

# A run is not reshaped again after so many rounds in a row that gained less than the first share of its time,
# where they promised less than the second [-], or with a pull above the last: there no step is short enough
# for what it promises to come true.
QUIET_ROUNDS, QUIET_GAIN, QUIET_PROMISE, MOST_PULL = 2, 3e-5, 3e-4, 10.0
# A run that a round made slower is not pulled more, but done, where the chord error bounds the feed for more
# than this share of its time [-]: a step does not know that the farther the curve is from the path, the less
# is left to chords.
ON_CHORDS = 0.1
# Pull of a round, at first and at least (smoothing/combined.py).
FIRST_PULL, LEAST_PULL = 0.5, 1e-3
# Factors on a run's pull after a round that gained more than GOOD of what it promised, and less than POOR of
# it [-].
GOOD, POOR, LESS, MORE = 0.5, 0.1, 0.3, 4.0
# Gap of the first convex problem, that of the others as a share of what the round before promised, and the
# least [-].
FIRST_GAP, GAP_SHARE, LAST_GAP = 1e-3, 0.1, 1e-5


def reshaped(rounded: SmoothPath, best: OnPath, job: Job, settings: Settings, resolution: float) -> OnPath:
    """The motion on splines after the best of some rounds of reshaping (reshape.py).

    rounded    : the path with the corners that the splines replace
    best       : the motion on the first splines
    resolution : of the grid
    """

    def solve(shape: SplineShape, *known: OnPath) -> OnPath:
        planned = settings.order.solve(with_spline(rounded, shape), job, resolution, known)
        return dataclasses.replace(planned, shape=shape)

    shape = best.shape
    assert shape is not None
    if not best.solution.solved or best.solution.multipliers is None or not len(best.path.spline):
        return best
    rounds = settings.rounds
    if rounds is None:
        rounds = min(settings.effort.work // len(best.samples), settings.effort.rounds)
    pull, gap = np.full(len(shape.splines.fits), FIRST_PULL), FIRST_GAP
    quiet, done = np.zeros(len(pull)), ~shape.splines.fits
    on_chords = times_on_chords(best) > ON_CHORDS * run_times(best)
    for n in range(1, rounds + 1):
        with job.stage("geometry"):
            shape, promised = reshape(best, np.where(done, np.inf, pull), gap)
        before, tried = best, solve(shape, best)
        tell_of(job, f"reshape {n}", tried, best, of=int((~done).sum()))
        if not tried.solution.solved:
            break
        time = run_times(before)
        gained = time - run_times(tried)
        faster = gained > 0.0
        if tried.faster_than(best):
            best = tried
        if faster.any() and not (faster | done).all():
            mixed = solve(chosen(before, shape, faster), before, tried)
            tell_of(job, f"reshape {n}, mixed", mixed, best, faster=int(faster.sum()), of=int((~done).sum()))
            if mixed.faster_than(best):
                best = mixed
        # a promise of nothing or less is none: the convex problem was not solved to the end, and the run is
        # pulled more
        sound = promised > 0.0
        little = (gained < QUIET_GAIN * time) & (promised < QUIET_PROMISE * time)
        quiet = np.where(sound & little, quiet + 1.0, 0.0)
        change = np.where(gained > GOOD * promised, LESS, np.where(gained > POOR * promised, 1.0, MORE))
        pull = np.maximum(np.where(sound, change, MORE) * pull, LEAST_PULL)
        left = float(promised[sound].sum()) / best.solution.cycle_time
        if left < settings.effort.left and (sound | done).all():
            break
        done |= (quiet >= QUIET_ROUNDS) | (pull > MOST_PULL) | (on_chords & ~faster)
        if done.all():
            break
        gap = min(FIRST_GAP, max(GAP_SHARE * left, LAST_GAP))
    return best


def tell_of(job: Job, name: str, tried: OnPath, best: OnPath, **facts: int) -> None:
    """Tell of a motion that was tried, and competes with the best."""
    before = best.solution.cycle_time
    job.tell(name, found=tried.solution.cycle_time, before=before, kept=tried.faster_than(best), **facts)
