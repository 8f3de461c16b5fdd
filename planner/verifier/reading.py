"""One reading of a motion: its delivered samples and, in step with them, what lies between.

A planned motion can be asked at any time. Its pieces, on which everything is smooth, and the periods of the
machine are cut into cells, and every cell is looked at once, at a time drawn at random from a generator with
a fixed seed, which nobody can prepare for:

    every piece    at least `PER_PIECE` cells: more than the three places at which the planner looks at a piece itself
    every period   at least `PER_PERIOD` cells, whatever the pieces are said to be, and as many as keep the chords between
                   the times from cutting corners: with an acceleration a they are off the motion by a h^2/8,
                   which is kept below `BOW` of the tolerance

so that a narrow peak cannot hide from all of them, two looks with one seed are the same, and with another
seed they share no time but the motion's first and last.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator

import numpy as np

from planner.base.sizes import SIZES
from planner.base.threads import side_by_side, threads
from planner.motion.trajectory import AnyMotion, Trajectory
from planner.verifier.excess import Fault, Kind
from planner.verifier.findings import measured
from planner.verifier.given import Given
from planner.verifier.limits import ACCELERATION
from planner.verifier.pieces import PERIOD_ROUNDING, PLACE_ROUNDING, RATIO_ROUNDING, ProgramPieces
from planner.verifier.samples import Delivered
from planner.verifier.stream import Found, Observed, Watch
from planner.verifier.worst import Limits

SIDE_BY_SIDE = SIZES.read_shared

CHORDS = 2, False  # a chord is matched with its middle


class Reader:
    """Reads a trajectory, and the motion it was taken from, from start to end, as often as it is asked to.

    motion     : None to read the samples alone
    dt, cells  : the machine's period [s], and into how many cells it is divided (`motion_between`)
    delivered  : what is kept of the samples of the last reading
    comparison : of samples and motion; None without a motion
    between    : into how many parts the machine's way between samples is divided; whether it is a cubic
    """

    def __init__(
        self,
        trajectory: Trajectory,
        motion: AnyMotion | None,
        limits: Limits,
        given: Given,
        *,
        dt: float,
        cells: int,
        seed: int,
        between: tuple[int, bool] = CHORDS,
    ):
        self.trajectory, self.motion, self.limits, self.given = trajectory, motion, limits, given
        self._times, self._way = (dt, seed, cells), between
        self.delivered = Delivered(trajectory.dt, given)
        self.comparison = None if motion is None else Comparison(trajectory.axes, motion.end)

    def read(
        self, pieces: ProgramPieces, progress: Callable[[float], None] = lambda done: None
    ) -> list[Observed]:
        """The findings of both beside a path; `progress` is called with the fraction done."""
        dt, (parts, cubic) = self.trajectory.dt, self._way
        self.delivered = Delivered(dt, self.given, max(dt, self._times[0]) if self.motion is None else None)
        seen = Watch(pieces, self.limits, parts=parts, cubic=cubic)
        samples = self._samples(seen)
        between = None if self.motion is None else self._between(pieces, seen, samples, progress)
        for _ in samples:
            progress(seen.seen.samples / len(self.trajectory))
        for watch in [seen] if between is None else [seen, between]:
            watch.finish()
        return [seen.seen] if between is None or not between.seen.samples else [seen.seen, between.seen]

    def _samples(self, seen: Watch) -> Iterator[None]:
        """Read the samples, block by block."""
        for chunk in self.trajectory.chunks():
            self.delivered.take(chunk)
            if self.comparison is not None:
                self.comparison.deliver(chunk)
            for block in seen.locate(chunk):
                seen.judge([block])
                yield

    def _between(
        self, pieces: ProgramPieces, seen: Watch, samples: Iterator[None], progress: Callable[[float], None]
    ) -> Watch:
        """Read the motion, and the samples as far as it goes, side by side: a part is held against the limits, which
        takes longest, while the next one is found on the path, the samples beside that are read, and the one after
        it is evaluated. What is seen does not depend on the threads."""
        assert self.motion is not None
        assert self.comparison is not None
        edges = np.asarray(self.motion.t)
        between = Watch(pieces, self.limits, parts=1, edges=edges, note="between the samples")
        self.comparison.begin()
        parts = motion_between(self.motion, *self._times)
        part, found = next(parts, None), list[Found]()
        while part is not None or found:
            coming, more = list[Trajectory](), list[Found]()
            tasks: list[Callable[[], None]] = [functools.partial(between.judge, found)]
            if part is not None:
                tasks.append(functools.partial(more.extend, between.locate(part)))
                tasks.append(functools.partial(self._beside, seen, samples, part))
                tasks.append(functools.partial(coming.extend, itertools.islice(parts, 1)))
            if len(self.trajectory) > SIDE_BY_SIDE and threads() > 1:
                side_by_side(tasks, lambda: None, lambda: None)
            else:
                for task in tasks:
                    task()
            if part is not None:
                progress(min(1.0, float(part.t[-1]) / max(self.motion.end, PERIOD_ROUNDING)))
            part, found = next(iter(coming), None), more
        return between

    def _beside(self, seen: Watch, samples: Iterator[None], part: Trajectory) -> None:
        """Read the samples as far as a part of the motion goes, and compare both."""
        assert self.comparison is not None
        while seen.seen.t_last < part.t[-1] and next(samples, self) is not self:
            pass
        self.comparison.compare(part)


class Comparison:
    """Looks at the asked motion beside the delivered samples; `end` is where it ends [s].

    Between two of its times h apart the motion is within a h^2 / 8 of the chord, where samples must be.
    """

    def __init__(self, axes: tuple[str, ...], end: float):
        self.axes, self.end = axes, end
        self.excess = np.zeros(len(axes))  # per axis: largest deviation from the chord over h^2 / 8
        self.time = np.zeros(len(axes))
        self.begin()

    def begin(self) -> None:
        """From the start of the motion."""
        nothing = np.empty(0), np.empty((0, len(self.axes)))
        self._sample_t, self._sample = nothing  # those that are still to be compared
        self._last_t, self._last = nothing
        self.first = self.last = np.nan  # times of the first and the last sample

    def deliver(self, chunk: Trajectory) -> None:
        """The next delivered samples."""
        self.first = float(chunk.t[0]) if np.isnan(self.first) else self.first
        self.last = float(chunk.t[-1])
        waits = len(self._sample_t) > 0
        self._sample_t = np.concatenate([self._sample_t, chunk.t]) if waits else chunk.t
        self._sample = np.concatenate([self._sample, chunk.position]) if waits else chunk.position

    def compare(self, chunk: Trajectory) -> None:
        """The next part of the motion; the samples until its end are delivered."""
        seen_t = np.concatenate([self._last_t, chunk.t])
        position = np.concatenate([self._last, chunk.position])
        self._last_t, self._last = seen_t[-1:].copy(), position[-1:].copy()
        t, low = self._sample_t, int(np.searchsorted(self._sample_t, seen_t[0]))
        at = slice(low, int(np.searchsorted(t, seen_t[-1], side="right")))
        if at.start < at.stop:
            bow = np.diff(seen_t).max(initial=PERIOD_ROUNDING) ** 2 / 8.0
            for axis in range(len(self.excess)):
                there = np.interp(t[at], seen_t, position[:, axis])
                off = np.maximum(np.abs(there - self._sample[at, axis]) - PLACE_ROUNDING, 0.0) / bow
                k = int(off.argmax())
                if off[k] > self.excess[axis]:
                    self.excess[axis], self.time[axis] = off[k], t[at][k]
        left = slice(int(np.searchsorted(t, seen_t[-1])), None)
        self._sample_t, self._sample = t[left], self._sample[left]

    def faults(self, limits: Limits, readings: list[Observed]) -> list[Fault]:
        """The differences."""
        said = []
        if abs(self.first) > PERIOD_ROUNDING or abs(self.end - self.last) > PERIOD_ROUNDING:
            found = (
                f"it lasts from 0 to {self.end:.9g} s, its samples from {self.first:.9g} to {self.last:.9g} s"
            )
            said.append(Fault(Kind.SAMPLES, "motion", found))
        bound = limits.per_axis[1] * np.maximum(1.0, measured(readings, ACCELERATION)) * (1 + RATIO_ROUNDING)
        for axis in np.flatnonzero(self.excess > bound):
            time = float(self.time[axis])
            found = f"not the delivered one: {self.axes[axis]} differs at t = {time:.6g} s"
            said.append(Fault(Kind.SAMPLES, "motion", found, time=time))
        return said


PER_PIECE = 4  # cells; the planner's own places are three a piece
PER_PERIOD = 2  # cells: chords between neighbouring times last less than a period, and cut no corner more than the machine's do
BOW, MOST_PER_PERIOD = 0.01, 16  # [share of the tolerance]; cells, where axes are strong enough for anything
SHORTEST_PIECE = 1e-9  # [s] shorter ones are not looked at: 1 m/s moves by the rounding of a position in it
CELLS = SIZES.places_at_once


def cells_per_period(dt: float, tolerance: float, acceleration: float) -> int:
    """How many cells a period dt [s] needs for a tolerance [mm] at an acceleration [mm/s2] of all axes."""
    gap = float(np.sqrt(8.0 * BOW * tolerance / acceleration))
    # neighbouring times are up to two cells apart
    return int(min(max(PER_PERIOD, np.ceil(2.0 * dt / gap)), MOST_PER_PERIOD))


def motion_between(
    motion: AnyMotion, dt: float, seed: int, per_period: int = PER_PERIOD
) -> Iterator[Trajectory]:
    """The motion at the judge's own times, in chunks; dt is the machine's period [s]."""
    draw = np.random.default_rng(seed)
    edges = np.concatenate([[0.0], motion.t, [motion.end]])
    begin, lasting = edges[:-1], np.diff(edges)
    cells = np.maximum(PER_PIECE, np.ceil(per_period * lasting / dt)).astype(np.int64)
    cells[lasting <= SHORTEST_PIECE] = 0
    last = np.cumsum(cells)  # the number of cells up to the end of each piece
    width = lasting / np.maximum(cells, 1)
    seen, total = -np.inf, int(last[-1])
    for first in range(0, total, CELLS):
        beyond = min(first + CELLS, total)
        low, high = np.searchsorted(last, [first, beyond - 1], side="right")
        part = slice(low, high + 1)  # the pieces of these cells
        before = last[part] - cells[part]
        here = np.minimum(last[part], beyond) - np.maximum(before, first)  # how many cells of each
        place = np.arange(first, beyond) - np.repeat(before, here) + draw.random(beyond - first)
        times = np.repeat(begin[part], here) + np.repeat(width[part], here) * place
        times = np.concatenate([[0.0] if not first else [], times, [motion.end] if beyond == total else []])
        times = np.maximum.accumulate(np.clip(times, 0.0, motion.end))
        times = times[np.diff(times, prepend=seen) > 0.0]
        if len(times):
            seen = times[-1]
            yield motion.at(times, dt)
