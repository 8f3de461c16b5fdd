"""A motion read in blocks of samples: limits and matching side by side, with little memory.

The limits need to know the block of the path under each sample, so the matching of a block of samples goes first. Three
samples are carried over from block to block, for the third differences.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.motion.trajectory import Trajectory
from planner.verifier.axes_apart import both_apart
from planner.verifier.excess import Spans
from planner.verifier.feed import Feeds
from planner.verifier.limits import FEED, GROUPS, OVER, ROWS_ALONE, Allowed, SampleColumns, Worst, scan
from planner.verifier.matching import Match, match_samples, new_match, nowhere
from planner.verifier.own import OwnSeen
from planner.verifier.pieces import ProgramPieces
from planner.verifier.sample_block import Limits, SampleBlock
from planner.verifier.stops import AtStop
from planner.verifier.switches import Bounds, Chords

BLOCK_SAMPLES = SIZES.judged_at_once
CARRIED = 3  # samples before a block that its third differences need
COLUMNS = ("t", "position", "velocity", "acceleration", "jerk")


@dataclass(eq=False, kw_only=True)
class Observed:
    """What a motion showed: R = GROUPS A + ROWS_ALONE rows as in `limits`, and the state of the matching.

    worst (R, 4); time (R,) [s]; at (R, A) [mm]; piece (R,)
    apart (2,) largest distance of linear and of rotary axes from the path [mm] (axes_apart.py)
    """

    worst: FloatArray
    time: FloatArray
    at: FloatArray
    piece: Array
    match: Match
    own: OwnSeen = field(default_factory=lambda: OwnSeen((), ()))
    over: Spans = field(default_factory=Spans)
    apart: FloatArray = field(default_factory=lambda: np.zeros(2))
    samples: int = 0
    first: FloatArray = field(default_factory=lambda: np.empty(0))  # (A,) first and last position
    last: FloatArray = field(default_factory=lambda: np.empty(0))
    t_first: float = np.nan
    t_last: float = -np.inf
    gap_max: float = 0.0  # longest period [s]


class Watch:
    """What a motion shows, chunk by chunk in order. Samples not later than those already read (overlap) are left out.

    parts   : into how many a period is divided to be matched
    cubic   : between samples the motion runs on cubics, not on chords
    seen    : what it has shown so far
    """

    def __init__(self, pieces: ProgramPieces, limits: Limits, *, parts: int, cubic: bool = False):
        axes = pieces.vertex.shape[1]
        rows = GROUPS * axes + ROWS_ALONE
        self.seen = Observed(
            worst=np.zeros((rows, 4)),
            time=np.zeros(rows),
            at=np.zeros((rows, axes)),
            piece=np.zeros(rows, dtype=np.int64),
            match=new_match(pieces),
            own=OwnSeen(limits.own, limits.axes),
        )
        self._pieces, self._limits, self._parts, self._cubic = pieces, limits, parts, cubic
        self._carried = [np.empty((0, *shape)) for shape in ((), *[(axes,)] * 4)]
        self._travelled = 0.0
        self._feeds = Feeds(
            pieces,
            Bounds(
                velocity=limits.per_axis[0],
                digits=np.append(limits.rounding, limits.time_rounding),
                acceleration=float(np.linalg.norm(limits.acceleration_at_stop)),
            ),
            self.seen.over,
            limits.axes,
        )

    def take(self, chunk: Trajectory) -> None:
        """The next samples."""
        begin = int(np.searchsorted(chunk.t, self.seen.t_last, side="right"))
        for low in range(begin, len(chunk), BLOCK_SAMPLES):
            new = [getattr(chunk, name)[low : low + BLOCK_SAMPLES] for name in COLUMNS]
            data = SampleColumns(*(np.concatenate(pair) for pair in zip(self._carried, new, strict=True)))
            velocity = data.velocity if self._cubic else data.velocity[:0]
            self._travelled = _block(
                self.seen,
                data,
                (self._parts, velocity),
                self._feeds,
                self._pieces,
                self._limits,
                self._travelled,
            )
            # copies: views would keep the whole block
            self._carried = [column[-CARRIED:].copy() for column in data]

    def finish(self) -> None:
        """No more samples: what had to wait for them."""
        feeds, seen = self._feeds, self.seen
        feeds.finish()
        row = GROUPS * self._pieces.vertex.shape[1] + FEED
        seen.worst[row], seen.time[row], seen.at[row], seen.piece[row] = (
            feeds.row,
            feeds.time,
            feeds.at,
            feeds.piece,
        )


def _block(
    seen: Observed,
    data: SampleColumns,
    way: tuple[int, FloatArray],
    feeds: Feeds,
    pieces: ProgramPieces,
    limits: Limits,
    travelled: float,
) -> float:
    """Take in one block, the carried samples first; returns the path length run so far.

    way : into how many parts a period is divided to be matched, and `velocity` as in `match_samples`
    """
    t, position = data.t, data.position
    skip = min(seen.samples, CARRIED)
    if not skip:
        seen.first, seen.t_first = position[0].copy(), float(t[0])
    seen.last, seen.t_last = position[-1].copy(), float(t[-1])
    seen.samples += len(t) - skip
    periods = np.diff(t[max(skip - 1, 0) :])
    seen.gap_max = max(seen.gap_max, float(periods.max(initial=0.0)))
    place = nowhere(len(t))
    piece = place.piece
    jerk = limits.per_axis[2] if limits.jerk_limited else np.full(len(limits.rounding), np.inf)
    at_stop = AtStop(limits.acceleration_at_stop, jerk, limits.rounding)
    match_samples(pieces, seen.match, t, position, skip, *way, at_stop, place)
    speed = np.full(len(t), np.nan)
    if limits.judged[0]:
        speed = np.sqrt(np.einsum("na,na->n", data.velocity, data.velocity))
    feeds.take(
        Chords(t, np.zeros(len(t)), np.zeros(len(t)), speed, piece, position), skip, place.first, place.last
    )
    seen.apart = np.maximum(seen.apart, both_apart(pieces, piece[skip:], position[skip:], limits.axes))
    block = SampleBlock(
        t=t,
        position=position,
        velocity=data.velocity,
        acceleration=data.acceleration,
        jerk=data.jerk,
        piece=piece,
        skip=skip,
        travelled=travelled,
    )
    seen.own.take(block, limits)
    worst = np.zeros_like(seen.worst)
    worst[:, 0] = seen.worst[:, 0]
    sample = np.full(len(worst), -1, dtype=np.int64)
    allowed = Allowed(
        limits=limits.per_axis,
        linear=limits.linear,
        normal=limits.normal,
        judged=limits.judged,
        digits=np.append(limits.rounding, limits.time_rounding),
    )
    work = np.zeros((4, position.shape[1], 4))
    over = np.zeros((len(t), OVER))
    travelled = scan(data, skip, allowed, travelled, Worst(worst, sample, over), work)
    seen.over.take(t, over)
    new = np.flatnonzero(sample >= 0)
    seen.worst[new] = worst[new]
    seen.time[new] = t[sample[new]]
    seen.at[new] = position[sample[new]]
    seen.piece[new] = piece[sample[new]]
    return travelled
