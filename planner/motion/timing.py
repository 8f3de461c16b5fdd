"""From a speed profile along the path to a time law, and to samples: the solution, integrated exactly.

The time law s(t) is pieces of constant jerk, dwells included. Of a solution there is one piece per grid
interval (of no jerk for second-order profiles, whose acceleration u along the path is constant there):

    t_{i+1} = t_i + duration_i,      s(t) = s_i + feed_i tau + u tau^2/2 + jerk tau^3/6,    tau = t - t_i.

With feed, u and jerk, per axis, with r', r'', r''' at s(t):

    velocity      r' feed
    acceleration  r' u + r'' feed^2
    jerk          r' jerk + 3 r'' feed u + r''' feed^3            (inside a piece of the law; at its ends u may jump)

Samples lie at k dt and at the end of the program; the last period is usually shorter.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, Self
from weakref import WeakKeyDictionary

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze, read_only
from planner.base.errors import InputError, NotSolvedError
from planner.base.search import nearest
from planner.base.sizes import SIZES
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.solution import FeedrateSolution
from planner.motion.on_demand import TrajectoryOnDemand
from planner.motion.sampling import Grid, inverses, sample
from planner.motion.trajectory import COLUMNS, AnyMotion, Trajectory


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeLaw:
    """s(t) in L pieces of constant jerk along the path; dwells are pieces without motion."""

    t: FloatArray  # (L,) start of each piece [s], non-decreasing
    s: FloatArray  # (L,) arc length there [mm]
    feed: FloatArray  # (L,) ds/dt there
    acc_s: FloatArray  # (L,) d2s/dt2 just after t
    jerk_s: FloatArray  # (L,) d3s/dt3 on the piece
    run: Array  # (L,) which piece of the path, between full stops, it belongs to
    end: float  # end of the last piece [s]

    def __post_init__(self) -> None:
        pieces = len(self.t)
        freeze(self, "t s feed acc_s jerk_s", np.float64, (pieces,))
        freeze(self, "run", np.int64, (pieces,))

    @property
    def columns(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, Array, float]:
        """The fields in their order, arrays (L,), for compiled functions."""
        return self.t, self.s, self.feed, self.acc_s, self.jerk_s, self.run, float(self.end)


def law_of_solution(samples: PathSamples, solution: FeedrateSolution) -> TimeLaw:
    """The time law of a solution of any order, dwells included. Raises NotSolvedError without a solution, and where one
    interval leads from stop to stop, on which no point of the grid moves."""
    duration = solution.require().duration.copy()
    if not np.isfinite(duration).all():
        line = samples.path.toolpath.line[samples.segment[int(np.argmax(duration))]]
        raise NotSolvedError(
            f"line {line}: one interval of the grid leads from stop to stop; split it (planner.feedrate.grid.add_switching_points)"
        )
    dwell = _dwells(samples)
    duration[samples.piece[1:] - 1] += dwell[1:]  # the last point of a piece stands still
    return TimeLaw(
        t=dwell[0] + np.concatenate([[0.0], np.cumsum(duration)[:-1]]),
        s=samples.s,
        feed=np.sqrt(solution.feed_sq),
        acc_s=solution.acc_s,
        jerk_s=solution.jerk_s,
        run=np.repeat(np.arange(len(samples.piece) - 1), np.diff(samples.piece)),
        end=float(dwell[0] + duration.sum()),
    )


def law_of_moves(
    samples: PathSamples,
    run: Array,
    s: FloatArray,
    feed: FloatArray,
    duration: FloatArray,
    jerk_s: FloatArray,
) -> TimeLaw:
    """The time law of M moves that meet without acceleration along the path, dwells included.

    run      : (M,) piece of the path that each move belongs to, non-decreasing; every piece has one
    s, feed  : (M,) where each move begins [mm], and its speed there [mm/s]
    duration : (M, F) durations of its F phases [s]
    jerk_s   : (M, F) jerk along the path in each phase [mm/s3]
    """
    moves, phases = duration.shape
    state = np.zeros((3, moves, phases))  # s, feed, acc_s at the start of each phase
    state[0, :, 0], state[1, :, 0] = s, feed
    for f in range(phases - 1):
        dt, j = duration[:, f], jerk_s[:, f]
        now_s, now_feed, now_acc = state[:, :, f]
        state[0, :, f + 1] = now_s + dt * (now_feed + dt * (now_acc / 2 + dt * j / 6))
        state[1, :, f + 1] = np.maximum(now_feed + dt * (now_acc + dt * j / 2), 0.0)
        state[2, :, f + 1] = now_acc + dt * j
    lasting = duration > 0.0
    of_run = np.repeat(run, lasting.sum(axis=1))
    # Behind the last move of every piece its standstill, exactly where the piece ends.
    dwell = _dwells(samples)
    close = np.searchsorted(of_run, np.arange(len(samples.piece) - 1), side="right")
    times = np.insert(duration[lasting], close, dwell[1:])
    return TimeLaw(
        t=dwell[0] + np.concatenate([[0.0], np.cumsum(times)[:-1]]),
        s=np.insert(state[0][lasting], close, samples.s[samples.piece[1:] - 1]),
        feed=np.insert(state[1][lasting], close, 0.0),
        acc_s=np.insert(state[2][lasting], close, 0.0),
        jerk_s=np.insert(jerk_s[lasting], close, 0.0),
        run=np.insert(of_run, close, np.arange(len(close))),
        end=float(dwell[0] + times.sum()),
    )


def _dwells(samples: PathSamples) -> FloatArray:
    """(G+1,) standstill before each piece and after the last [s]."""
    return samples.path.toolpath.dwell[samples.path.legs.first[samples.stop]]


# Where a piece of the law is looked at [share of the piece].
WATCHED = np.array([0.05, 0.5, 0.95])
# Shorter pieces get no samples [s]: rounding puts them into their neighbours, and nothing moves there.
SHORTEST_PIECE = 1e-9
# More samples than this are refused: a day at 1 ms, and with three axes 14 GB of files.
SAMPLES_MAX = 1e8
SAMPLES_KEPT = SIZES.samples_kept
CHUNK = SIZES.times_at_once


# `inverses` of the grids in use: motions on one grid differ in their time laws only.
_inverses: WeakKeyDictionary[PathSamples, FloatArray] = WeakKeyDictionary()


class MotionInTime(AnyMotion, Protocol):
    """A motion that can stand longer."""

    def waiting(self, at: FloatArray, by: FloatArray) -> Self:
        """The motion standing longer by `by` (n,) [s] where it rests, at the ends `at` (n,) of pieces [s]."""
        ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """A planned motion along a path: where the path goes, and when."""

    samples: PathSamples
    law: TimeLaw

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece of the law [s]."""
        return self.law.t

    @property
    def end(self) -> float:
        """End of the motion [s]."""
        return self.law.end

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]."""
        samples, law = self.samples, self.law
        toolpath, axes = samples.path.toolpath, samples.position.shape[1]
        fields: dict[str, Array] = {name: getattr(samples, name) for name in Grid._fields[:-1]}
        grid = Grid(**fields, passed=samples.path.passed)
        if samples not in _inverses:
            _inverses[samples] = inverses(samples.table, grid, axes)
        found = sample(samples.table, law.columns, grid, _inverses[samples], read_only(times), axes)
        columns = dict(zip(COLUMNS[1:7], found[:-1], strict=True))
        columns |= {"block": toolpath.block[found[-1]], "line": toolpath.line[found[-1]]}
        return Trajectory(axes=toolpath.axes, radius=toolpath.radius, dt=dt, t=times, **columns)

    def waiting(self, at: FloatArray, by: FloatArray) -> Motion:
        """The motion standing longer by `by` (n,) [s] behind the runs that end nearest to `at` (n,) [s]."""
        law = self.law
        # a run's last piece is its standstill
        still = np.flatnonzero(np.append(law.run[1:] != law.run[:-1], True))
        more = np.zeros(len(law.t))
        np.add.at(more, still[nearest(law.t[still], at)], by)
        later = np.cumsum(more)
        new = dataclasses.replace(law, t=law.t + (later - more), end=float(law.end + later[-1]))
        return dataclasses.replace(self, law=new)


def sample_motion(motion: MotionInTime, dt: float) -> Trajectory:
    """The motion at the interpolation period dt [s], last partial period included; of more samples than
    `SAMPLES_KEPT` they are evaluated when they are asked for."""
    require_samples(motion.end, dt)
    count = int(np.floor(motion.end / dt * (1 + 1e-12)))
    # a remainder below a millionth of dt is rounding and joins the period before
    if not count or motion.end - count * dt > 1e-6 * dt:
        count += 1
    if count + 1 > SAMPLES_KEPT:
        return TrajectoryOnDemand(motion, dt, count + 1)
    times: FloatArray = np.arange(count + 1, dtype=np.float64) * dt
    times[-1] = motion.end
    return motion.at(times, dt)


def inside_pieces(motion: MotionInTime) -> tuple[Array, FloatArray]:
    """Pieces (n,) that last, and times (n, 3) near both ends and in the middle of each [s], at its shares
    `WATCHED`: all speeds, accelerations and jerks are smooth there, and peaks in between close to those of
    parabolas."""
    edges = np.append(motion.t, motion.end)
    pieces = np.flatnonzero(np.diff(edges) > SHORTEST_PIECE)
    return pieces, edges[pieces, None] * (1.0 - WATCHED) + edges[pieces + 1, None] * WATCHED


def in_chunks(motion: MotionInTime, dt: float, times: FloatArray) -> Iterator[Trajectory]:
    """The motion at the times (T,) [s], in order, in chunks that share their ends; dt [s]: the period."""
    times = np.unique(times)
    for first in range(0, len(times), CHUNK):
        yield motion.at(times[first : first + CHUNK + 1], dt)


def require_samples(end: float, dt: float) -> None:
    """Raise InputError if a motion of `end` seconds has more samples than are made."""
    if not end / dt <= SAMPLES_MAX:
        raise InputError(
            f"the motion takes {end:.6g} s, {end / dt:.3g} periods of {dt:g} s; at most {SAMPLES_MAX:.0e} samples are made: "
            "raise the feed or the machine's dt, or split the program"
        )
