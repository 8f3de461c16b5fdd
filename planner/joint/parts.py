"""The solution along a run as parts of a motion: steps of constant jerk, and between them the start's motion
where it stays. Each goes from rest to rest, or the next one goes on as it ends, so that nothing jumps where
they meet.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.joint.motion import Steps
from planner.joint.run import TubeRun
from planner.motion.axis_motion import AxisMotion, Pieces
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Lengths, Trajectory

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
        begin, end, _ = self._times
        k = np.repeat(np.arange(len(self.runs)), 2)
        return self._own_lengths(k, np.stack([begin, end], axis=1).ravel()).reshape(-1, 2)

    @cached_property
    def _times(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n,) when the runs begin and end in their motions, and the last time that they are asked for [s]: of one that is
        moving there rounding of times must not reach its end, which belongs to the next one."""
        begin, end = np.array([(run.begin, run.end) for run in self.runs]).T
        moving = np.array([run.moving for run in self.runs])
        return begin, end, np.where(moving, np.nextafter(end, begin), np.inf)

    @cached_property
    def _pieces(self) -> tuple[Array, Pieces | None]:
        """(n,) which runs are given axis by axis, and their pieces, None where there is none."""
        motions = [run.motion if isinstance(run.motion, AxisMotion) else None for run in self.runs]
        by_axes = np.array([one is not None for one in motions])
        return by_axes, Pieces.of(motions) if by_axes.any() else None

    @cached_property
    def _s(self) -> FloatArray:
        """Arc lengths of `_pieces` (`Pieces.length`) [mm]; of a run without pieces one, as of all ends."""
        motions = [run.motion for run in self.runs]
        return np.concatenate([one.s if isinstance(one, AxisMotion) else np.zeros(1) for one in motions])

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) within [0, end]; `dt` [s] is the trajectory's interpolation
        period."""
        of = np.clip(np.searchsorted(self.begin, times, side="right") - 1, 0, len(self.runs) - 1)
        begin, end, last = self._times
        local = np.minimum(begin[of] + (times - self.begin[of]), last[of])
        within = np.minimum(local, end[of])
        columns = self._seen(of, within) | {"s": Lengths(self._lengths, (of, within))}
        over = local >= end[of]  # there another motion may begin
        for name in RATES:
            columns[name][over] = 0.0
        one = self.runs[0].motion.at(np.array([self.runs[0].begin]), dt)
        return dataclasses.replace(one, t=times, **columns)

    def _lengths(self, of: Array, times: FloatArray) -> FloatArray:
        """(T,) arc length [mm], as `_seen`."""
        return self.length[of] + self._own_lengths(of, times) - self._own_length[of, 0]

    def _own_lengths(self, of: Array, times: FloatArray) -> FloatArray:
        """(T,) arc length in the motion of each run [mm], as `_seen`."""
        by_axes, pieces = self._pieces
        here, found = by_axes[of], np.empty(len(of))
        if pieces is not None:
            found[here] = pieces.length(self._s, of[here], times[here])
        for part, seen, which in self._alone(np.unique(of[~here]), of, times):
            found[part] = seen.s[which]
        return found

    def _alone(self, runs: Array, of: Array, times: FloatArray) -> Iterator[tuple[slice, Trajectory, Array]]:
        """Of each of the `runs` (k,) where its times are, its motion at those that differ, and which of them each is."""
        for k in runs.tolist():
            part = slice(*np.searchsorted(of, [k, k + 1]).tolist())
            single, which = np.unique(times[part], return_inverse=True)
            yield part, self.runs[k].motion.at(single, 1.0), which

    def _seen(self, of: Array, times: FloatArray) -> dict[str, Any]:
        """The columns of the motions of the runs `of` (T,), ascending, at their times (T,), ascending too."""
        by_axes, pieces = self._pieces
        here = by_axes[of]
        parts: list[tuple[Array | slice, dict[str, Any]]] = []
        if pieces is not None:
            parts.append((here, pieces.at(of[here], times[here])))
        others = np.unique(of[~here])
        if not (len(others) or parts):  # without times there are the columns of the first run, without rows
            others = np.zeros(1, np.int64)
        for part, seen, which in self._alone(others, of, times):
            names = ("position", "block", "line", *RATES)
            parts.append((part, {name: getattr(seen, name)[which] for name in names}))
        if len(parts) == 1:  # most motions are found as a whole, or kept
            return parts[0][1]
        columns: dict[str, Any] = {}
        for at, found in parts:
            for name, column in found.items():
                if name not in columns:
                    columns[name] = np.zeros((len(of), *column.shape[1:]), column.dtype)
                columns[name][at] = column
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


def parts_of(toolpath: Toolpath, found: FoundRun, start: SplicedRun | None) -> list[SplicedRun]:
    """The parts of the motion along a run, with the dwell before it, and the one at the end of the job.

    start : the motion of the start along the run; None where nothing of it stays
    """
    assert found.steps is not None
    assert found.times is not None
    steps = len(found.steps.h)
    parts = []
    for lo, hi, stays in found.ranges():
        goes_on = hi < steps or bool(found.run.ends[1].any())
        if stays:
            assert start is not None
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
