"""A motion read in blocks of samples: limits and matching side by side, with little memory.

The limits need to know the block of the path under each sample, so the matching of a block of samples goes
first, which does not depend on them: a block can be judged while the next ones are matched. Three samples are
carried over from block to block, for the third differences.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.sizes import SIZES
from planner.motion.trajectory import Trajectory, joined
from planner.verifier.between import UNKNOWN, Between, look_between
from planner.verifier.feed import Feeds
from planner.verifier.given import DERIVATIVES
from planner.verifier.kernel import kernel
from planner.verifier.limits import FEED, GROUPS, look_at_axes, rows_of
from planner.verifier.matching import (
    SEARCH_MAX,
    SEARCHED,
    AtStop,
    Located,
    Match,
    match_samples,
    new_match,
    nowhere,
)
from planner.verifier.other_limits import look_at_power, look_at_tangential, look_at_user_limits
from planner.verifier.passing import Bounds, Chords
from planner.verifier.pieces import ProgramPieces, both_apart, reach_piece
from planner.verifier.worst import BACK, COLUMN, Limits, SampleBlock, Worst, state_of

BLOCK_SAMPLES = SIZES.judged_at_once
Found = tuple[SampleBlock, FloatArray, Located]  # samples, their positions (n, A) [mm] and where they lie


@dataclass(eq=False, kw_only=True)
class Observed:
    """The findings on a motion."""

    match: Match  # the state of the matching
    worst: Worst  # of the limits, rows as in limits.py
    note: str = ""  # of which reading: "" for the delivered samples
    # (2,) largest distance of linear and of rotary axes from the path [mm]
    apart: FloatArray = field(default_factory=lambda: np.zeros(2))
    samples: int = 0
    # first and last: (A,) first and last position [mm]
    first: FloatArray = field(default_factory=lambda: np.empty(0))
    last: FloatArray = field(default_factory=lambda: np.empty(0))
    t_first: float = np.nan
    t_last: float = -np.inf
    gap_max: float = 0.0  # longest period [s]
    # (3,) what is left open between the times (between.py)
    known: FloatArray = field(default_factory=lambda: np.zeros(3))

    def noted(self, text: str) -> str:
        """A text with the note of this reading behind it."""
        return ", ".join(filter(None, (text, self.note)))

    def take(self, t: FloatArray, position: FloatArray, skip: int) -> None:
        """Note ends and periods of samples t (n,) [s], position (n, A) [mm]; `skip` were there before."""
        if not self.samples:
            self.first, self.t_first = position[0].copy(), float(t[0])
        self.last, self.t_last = position[-1].copy(), float(t[-1])
        self.samples += len(t) - skip
        self.gap_max = max(self.gap_max, float(np.diff(t[max(skip - 1, 0) :]).max(initial=0.0)))


class Watch:
    """The findings on a motion, chunk by chunk in order; samples already read (overlap) are left out.

    parts : into how many a period is divided to be matched
    cubic : between samples the motion runs on cubics, not on chords
    edges : (L,) where the pieces of a motion begin that is looked at between its samples [s]; None for samples
    seen  : what it has shown so far
    """

    def __init__(
        self,
        pieces: ProgramPieces,
        limits: Limits,
        *,
        parts: int,
        cubic: bool = False,
        edges: FloatArray | None = None,
        note: str = "",
    ):
        axes = pieces.vertex.shape[1]
        self.seen = Observed(match=new_match(pieces), worst=Worst(rows_of(limits), axes), note=note)
        self._pieces, self._limits, self._parts, self._cubic = pieces, limits, parts, cubic
        self._carried = np.empty(0), np.empty((0, 1 + len(DERIVATIVES), axes))
        self._travelled = 0.0
        self._edges, self._feed_before = edges, 0.0
        jerk = limits.per_axis[2] if limits.jerk_limited else np.full(axes, np.inf)
        self._at_stop = AtStop(limits.acceleration_at_stop, jerk, limits.rounding)
        bounds = Bounds(
            velocity=limits.per_axis[0],
            digits=np.append(limits.rounding, limits.time_rounding),
            acceleration=float(np.linalg.norm(limits.acceleration_at_stop)),
        )
        self._feeds = Feeds(pieces, bounds, self.seen.worst, GROUPS * axes + FEED, limits.axes)

    def locate(self, chunk: Trajectory) -> Iterator[Found]:
        """Find the next samples on the path, block by block; each is then to be judged, here or in another thread."""
        pieces, limits, seen = self._pieces, self._limits, self.seen
        begin = int(np.searchsorted(chunk.t, seen.t_last, side="right"))
        for low in range(begin, len(chunk), BLOCK_SAMPLES):
            part, before, skip = slice(low, low + BLOCK_SAMPLES), self._carried, len(self._carried[0])
            t, state = state_of(chunk, part, before)
            position = np.concatenate([before[1][:, 0], chunk.position[part]])
            # copies: views would keep the whole block
            self._carried = t[-BACK:].copy(), state[-BACK:].copy()
            seen.take(t, position, skip)
            place = nowhere(len(t))
            cubic = np.ascontiguousarray(state[:, 1]) if self._cubic else position[:0]
            match_samples(pieces, seen.match, t, position, skip, self._parts, cubic, self._at_stop, place)
            both = both_apart(pieces, place.piece[skip:], position[skip:], limits.axes)
            seen.apart = np.maximum(seen.apart, both)
            yield SampleBlock(t=t, state=state, piece=place.piece, skip=skip), position, place

    def judge(self, blocks: Iterable[Found]) -> None:
        """Hold the next blocks against the limits."""
        limits, worst = self._limits, self.seen.worst
        for found, position, place in blocks:
            block, t = dataclasses.replace(found, travelled=self._travelled), found.t
            speed, none = np.full(len(t), np.nan), np.zeros_like(t)
            if limits.judged[0]:
                _speeds(block.state, speed)
            if self._edges is None:
                self._travelled = look_at_axes(block, limits, worst)
                known, cut = position[:, None], np.full(len(t), np.nan)
            else:
                known, cut = block.state, self._take_between(block, self._edges, place)
            piece, _, first, last = place
            chords = Chords(t, none, none.copy(), speed, piece, first, last, cut, known)
            self._feeds.take(chords, block.skip, position)
            for look in (look_at_tangential, look_at_power, look_at_user_limits):
                look(block, limits, worst)

    def _take_between(self, block: SampleBlock, edges: FloatArray, place: Located) -> FloatArray:
        """Take in a block of a motion and what lies between its times. -> (n,) as `Between.cut`"""
        limits, worst, skip = self._limits, self.seen.worst, block.skip
        axes = len(limits.axes)
        n = len(block.t)
        found = Between(np.zeros((n, axes)), np.zeros((n, axes)), np.zeros(n), np.full(n, np.nan))
        edge = int(np.searchsorted(edges, block.t[max(skip - 1, 0)], "right"))
        unknown = self.seen.known[UNKNOWN]
        bounds = limits.per_axis + np.array([[0.0], [0.0], [0.0 if limits.jerk_limited else np.inf]])
        look_between(
            block.t, block.state, edges, edge, bounds, skip, self._pieces, place.piece,
            np.empty((3, axes)), found, self.seen.known,
        )  # fmt: skip
        sure = limits.jerk_limited and self.seen.known[UNKNOWN] == unknown
        self._travelled = look_at_axes(block, limits, worst, found, sure=bool(sure))
        # where the block changes the larger F counts, and where the motion is lost none
        feed = np.where(place.last >= 0, place.feed_max, np.inf)
        before, self._feed_before = self._feed_before, float(feed[-1])
        feed[:skip] = np.inf
        feed[skip:] = np.maximum(feed[skip:], np.append(before, feed[skip:-1]))
        worst.take(GROUPS * axes + FEED, found.speed[:, None], feed[:, None], COLUMN, block)
        return found.cut

    def finish(self) -> None:
        """No more samples: judge what had to wait for them."""
        self._feeds.finish()


def overlapping(trajectory: Trajectory, carried: int) -> Iterator[Trajectory]:
    """The samples chunk by chunk, each after the first with the last `carried` ones before it."""
    before: Trajectory | None = None
    for chunk in trajectory.chunks():
        whole = chunk if before is None else joined([before, chunk])
        yield whole
        before = whole.rows(np.arange(max(len(whole) - carried, 0), len(whole)))


def follow(
    parts: Iterable[tuple[FloatArray, FloatArray]],
    pieces: ProgramPieces,
    note: str = "",
    *,
    each: Callable[[FloatArray, FloatArray, Located], None] | None = None,
    search: bool = True,
) -> Observed:
    """Match a motion with a path.

    parts  : of its samples, in order: times (T,) [s], positions (T, A) [mm]
    each   : called with times (T,) [s], distance over budget (T,) and places of every part
    search : whether a motion that was lost is looked for on the pieces ahead; if not, it is lost for good
    """
    axes = pieces.vertex.shape[1]
    seen = Observed(match=new_match(pieces), worst=Worst((), axes), note=note)
    if not search:
        seen.match.tally[SEARCHED] = SEARCH_MAX
    free = np.full(axes, np.inf)
    anywhere = AtStop(free, free, np.zeros(axes))  # the motion need not rest
    carried_t, carried = np.empty(0), np.empty((0, axes))
    for new_t, new in parts:
        t, position = np.concatenate([carried_t, new_t]), np.concatenate([carried, new])
        skip = len(carried_t)
        seen.take(t, position, skip)
        place = nowhere(len(t))
        match_samples(pieces, seen.match, t, position, skip, 1, position[:0], anywhere, place)
        if each is not None:
            ratio = np.empty(len(t))
            _ratios(pieces, place.piece, position, ratio)
            each(t[skip:], ratio[skip:], Located(*(column[skip:] for column in place)))
        carried_t, carried = t[-1:], position[-1:]
    return seen


@kernel()
def _speeds(state, speed):
    """|v| of each state, as in `SampleBlock`, into `speed` (n,)."""
    for k in range(len(speed)):
        square = 0.0
        for i in range(state.shape[2]):
            square += state[k, 1, i] * state[k, 1, i]
        speed[k] = math.sqrt(square)


@kernel()
def _ratios(pieces, piece, position, ratio):
    """Distance of each position from its piece over the piece's budget, into `ratio` (n,)."""
    for k in range(len(piece)):
        _, _, distance = reach_piece(pieces, piece[k], position[k], 0.0)
        ratio[k] = distance / pieces.piece[piece[k]]["budget"]
