"""The solution along a run as parts of a motion: steps of constant jerk, and between them the start's motion
where it stays. Each goes from rest to rest, or the next one goes on as it ends, so that nothing jumps where
they meet.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.joint.motion import Steps
from planner.joint.run import TubeRun
from planner.motion.axis_motion import AxisMotion
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory

# Times closer than this are the same [s]: rounding of sums of durations.
SAME_TIME = 1e-9
RATES = ("velocity", "acceleration", "jerk", "feed")  # 0 at standstill


@dataclass(frozen=True, eq=False, kw_only=True)
class SplicedRun:
    """A motion from `begin` to `end` [s], at rest at both times, and a standstill of `hold` [s] behind it. If
    it is `moving` at its end, the next one begins with the same position, velocity and acceleration."""

    motion: MotionInTime
    begin: float
    end: float
    hold: float = 0.0
    moving: bool = False

    @property
    def lasting(self) -> float:
        """How long it takes, with the standstill [s]."""
        return self.end - self.begin + self.hold


def _columns(motion: MotionInTime, times: FloatArray) -> dict[str, Array]:
    """Those of the motion at ascending times (T,). A trajectory of each of thousands of runs would take longer to be
    checked than to be evaluated."""
    if isinstance(motion, AxisMotion):
        return motion.columns(times)
    seen = motion.at(times, 1.0)
    return {name: getattr(seen, name) for name in ("position", "block", "line", *RATES)}


def _length(motion: MotionInTime, times: FloatArray) -> FloatArray:
    """(T,) arc length of the motion at ascending times (T,) [mm]."""
    return motion.length(times) if isinstance(motion, AxisMotion) else motion.at(times, 1.0).s


@dataclass(frozen=True, eq=False, kw_only=True)
class Spliced:
    """n runs of motions, one after the other."""

    runs: tuple[SplicedRun, ...]

    @cached_property
    def begin(self) -> FloatArray:
        """(n+1,) when the runs begin, and when the last one ends [s]."""
        return np.append(0.0, np.cumsum([run.lasting for run in self.runs]))

    @property
    def end(self) -> float:
        """End of the last run [s]."""
        return float(self.begin[-1])

    @cached_property
    def t(self) -> FloatArray:
        """(L,) start of each piece [s]."""
        edges = []
        for run, begin in zip(self.runs, self.begin, strict=False):
            inner = run.motion.t[(run.motion.t > run.begin) & (run.motion.t < run.end)]
            stands = [begin + run.end - run.begin] if run.hold > 0 else []
            edges.append(np.concatenate([[begin], begin + inner - run.begin, stands]))
        return np.maximum.accumulate(np.concatenate(edges))

    @cached_property
    def length(self) -> FloatArray:
        """(n+1,) arc length at the start of each run, and at the end [mm]."""
        return np.append(0.0, np.cumsum(np.diff(self._own_length, axis=1)))

    @cached_property
    def _own_length(self) -> FloatArray:
        """(n, 2) arc length in the motion of each run where that begins and ends [mm]."""
        return np.array([_length(run.motion, np.array([run.begin, run.end])) for run in self.runs])

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) within [0, end]; `dt` [s] is the trajectory's interpolation
        period."""
        seen = [self._seen(*part) for part in self._parts(times)]
        columns: dict[str, Any] = {name: np.concatenate([one[name] for one in seen]) for name in seen[0]}
        one = self.runs[0].motion.at(np.array([self.runs[0].begin]), dt)
        columns["s"] = partial(self._lengths, times)
        return dataclasses.replace(one, t=times, **columns)

    def _parts(self, times: FloatArray) -> Iterator[tuple[int, FloatArray, FloatArray, Array | slice]]:
        """The runs at ascending times (T,): number of the run, times in its motion, which may be behind its end, those of
        them that differ, ascending and not behind it, and which of these each is."""
        of = np.clip(np.searchsorted(self.begin, times, side="right") - 1, 0, len(self.runs) - 1)
        edges = np.append(np.flatnonzero(np.diff(of, prepend=-1)), len(of))
        # Without times there are the columns of the first run, without rows.
        for lo, hi in list(pairwise(edges.tolist())) or [(0, 0)]:
            k = int(of[lo]) if hi else 0
            run = self.runs[k]
            local = run.begin + (times[lo:hi] - self.begin[k])
            if run.moving:  # rounding of times: its end belongs to the next one
                local = np.minimum(local, np.nextafter(run.end, run.begin))
            single = np.minimum(local, run.end)
            which: Array | slice = slice(None)
            if not (np.diff(single) > 0.0).all():
                single, which = np.unique(single, return_inverse=True)
            yield k, local, single, which

    def _lengths(self, times: FloatArray) -> FloatArray:
        """(T,) arc length at ascending times (T,) [mm]."""
        return np.concatenate(
            [
                self.length[k] + _length(self.runs[k].motion, single)[which] - self._own_length[k, 0]
                for k, _, single, which in self._parts(times)
            ]
        )

    def _seen(self, k: int, local: FloatArray, single: FloatArray, which: Array | slice) -> dict[str, Array]:
        """The columns of the motion of run k, as `_parts` has them."""
        run = self.runs[k]
        columns = {name: column[which] for name, column in _columns(run.motion, single).items()}
        over = local >= run.end  # there another motion may begin
        if over.any():
            for name in RATES:
                columns[name] = columns[name].copy()
                columns[name][over] = 0.0
        return columns

    def whole(self) -> AxisMotion:
        """As one motion; every run has to be all of a motion that is given axis by axis."""
        motions = [run.motion for run in self.runs if isinstance(run.motion, AxisMotion)]
        assert len(motions) == len(self.runs)
        names = ("position", "velocity", "acceleration", "jerk", "block", "line")
        return AxisMotion(
            axes=motions[0].axes,
            radius=motions[0].radius,
            t=np.concatenate([begin + m.t for m, begin in zip(motions, self.begin, strict=False)]),
            end=self.end,
            **{name: np.concatenate([getattr(m, name) for m in motions]) for name in names},
        )

    def waiting(self, at: FloatArray, by: FloatArray) -> Spliced:
        """The motion standing longer by `by` (n,) [s] where it comes to rest, at the times `at` (n,) [s]."""
        runs = []
        for k, run in enumerate(self.runs):
            stand = self.begin[k] + run.end - run.begin
            behind = np.abs(at - stand) <= SAME_TIME
            inside = (at > self.begin[k] + SAME_TIME) & (at < stand - SAME_TIME)
            motion, more = run.motion, float(by[inside].sum())
            if more > 0:
                motion = motion.waiting(at[inside] - self.begin[k] + run.begin, by[inside])
            hold = run.hold + float(by[behind].sum())
            runs.append(replace(run, motion=motion, end=run.end + more, hold=hold))
        return Spliced(runs=tuple(runs))


@dataclass(frozen=True, eq=False)
class FoundRun:
    """How the search along a run ended."""

    run: TubeRun
    status: Status
    sentence: str
    steps: Steps | None = None  # None where the start stays
    place: FloatArray | None = None  # (N+1,) of the nodes along the run [mm]
    times: FloatArray | None = None  # (N+1,) of the nodes in the motion of the start [s]
    kept: Array | None = None  # (N,) steps that stand for the motion of the start; None for none
    # (N, 3 A + 5) what the limits of each step cost (price.py) [s]; None where the solver does not tell
    price: FloatArray | None = None
    coarser: FoundRun | None = None  # what the search in longer steps had found, which this began with

    @property
    def whole(self) -> bool:
        """Whether nothing of the start's motion is left."""
        return self.steps is not None and (self.kept is None or not self.kept.any())

    def priced_time(self) -> float:
        """How long the steps that have prices last [s]."""
        if self.steps is None or self.price is None:
            return 0.0
        return float(self.steps.h[self.price.any(axis=1)].sum())

    def ranges(self) -> list[tuple[int, int, bool]]:
        """First step, the one behind the last, and whether the start stays, of what goes out in one part."""
        assert self.steps is not None
        kept = np.zeros(len(self.steps.h), dtype=bool) if self.kept is None else self.kept
        edges = np.concatenate([[0], np.flatnonzero(np.diff(kept)) + 1, [len(kept)]])
        return [(lo, hi, bool(kept[lo])) for lo, hi in pairwise(edges.tolist())]


def parts_of(toolpath: Toolpath, found: FoundRun, start: SplicedRun) -> list[SplicedRun]:
    """The parts of the motion along a run, with the dwell before it, and the one at the end of the job.

    start : the motion of the start along the run
    """
    assert found.steps is not None
    assert found.times is not None
    steps = len(found.steps.h)
    parts = []
    for lo, hi, stays in found.ranges():
        goes_on = hi < steps or bool(found.run.ends[1].any())
        if stays:
            begin = start.begin if lo == 0 else float(found.times[lo])
            end = start.end if hi == steps else float(found.times[hi])
            parts.append(SplicedRun(motion=start.motion, begin=begin, end=end, moving=goes_on))
        else:
            motion = _motion(toolpath, found, lo, hi)
            parts.append(SplicedRun(motion=motion, begin=0.0, end=motion.end, moving=goes_on))
    return parts


def _motion(toolpath: Toolpath, found: FoundRun, lo: int, hi: int) -> AxisMotion:
    """The steps lo .. hi - 1; before the first one of the run its dwell, and after the last one that at the
    end of the job."""
    run, steps, place = found.run, found.steps, found.place
    assert steps is not None
    assert place is not None
    first, last = run.first[0], run.first[-1]
    before = toolpath.dwell[first] if lo == 0 else 0.0
    behind = toolpath.dwell[last] if last == len(toolpath) and hi == len(steps.h) else 0.0
    standing, still = int(before > 0), int(behind > 0)  # steps without motion before and after the others
    along = np.append(0.0, np.cumsum(toolpath.length[first:last]))
    inside = np.searchsorted(along[1:-1], (place[lo:hi] + place[lo + 1 : hi + 1]) / 2, side="right")
    segment: Array = np.concatenate([[first] * standing, first + inside, [last - 1] * still]).astype(np.int64)
    columns = {}
    for name in ("position", "velocity", "acceleration", "jerk"):
        whole = np.zeros((standing + hi - lo + still, len(toolpath.axes)))
        if name == "position":
            whole += toolpath.start[first]
            whole[len(whole) - still :] = toolpath.end[last - 1]
        whole[standing : len(whole) - still, run.axis] = getattr(steps, name)[lo:hi]
        columns[name] = whole
    t = np.append(0.0, np.cumsum(np.concatenate([[before] * standing, steps.h[lo:hi], [behind] * still])))
    return AxisMotion(
        axes=toolpath.axes,
        radius=toolpath.radius,
        t=t[:-1],
        block=toolpath.block[segment],
        line=toolpath.line[segment],
        end=float(t[-1]),
        **columns,
    )
