"""From a speed profile along the path to a time law: s(t) in pieces of constant jerk, dwells included.

Of a solution there is one piece per grid interval (of no jerk for second-order profiles, whose acceleration u along the path is
constant there):

    t_{i+1} = t_i + duration_i,      s(t) = s_i + feed_i tau + u tau^2/2 + jerk tau^3/6,    tau = t - t_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.solution import FeedrateSolution


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeLaw:
    """s(t) in L pieces of constant jerk along the path; dwells are pieces without motion.

    t       : (L,) start of each piece [s], non-decreasing
    s       : (L,) arc length there [mm]
    feed    : (L,) ds/dt there
    acc_s   : (L,) d2s/dt2 just after t
    jerk_s  : (L,) d3s/dt3 on the piece
    run     : (L,) which piece of the path, between full stops, it belongs to
    end     : end of the last piece [s]
    """

    t: FloatArray
    s: FloatArray
    feed: FloatArray
    acc_s: FloatArray
    jerk_s: FloatArray
    run: Array
    end: float

    def __post_init__(self) -> None:
        pieces = len(self.t)
        freeze(self, "t s feed acc_s jerk_s", np.float64, (pieces,))
        freeze(self, "run", np.int64, (pieces,))

    @property
    def columns(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, Array, float]:
        """The fields in their order, arrays (L,), for compiled functions."""
        return self.t, self.s, self.feed, self.acc_s, self.jerk_s, self.run, float(self.end)


def law_of_solution(samples: PathSamples, solution: FeedrateSolution) -> TimeLaw:
    """The time law of a solution of any order, dwells included. Raises NotSolvedError without a solution."""
    duration = solution.require().duration.copy()
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
