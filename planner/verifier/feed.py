"""Feed: never above the F word of the block on which the motion is (switches.py).

Every chord c over a period h is cut at these places; its parts c_i, of feed F_i, take at least

    sum c_i / F_i  <=  h,        the ratio of the check is  sum c_i / (F_i h).

So a slow block is not hidden in a period in which others are run through too: what is run of it, c_i, takes
c_i / F_i. Where the tolerance lets a motion cut a block off, nothing is run of it. Where speeds were
delivered they are compared with the F at their places too.

F is the speed in x, y and z alone where these move, in u, v and w where only those do, else in the rotary
axes. Beside a corner the parts of a motion in these axes differ from those of its block, so the chord in them
alone is compared with F, too.

Where a block begins and ends to within `reach` (nearest.py), both are meant, and the larger F counts.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.verifier.excess import NAMES
from planner.verifier.kernel import kernel
from planner.verifier.passing import JUDGED, OPEN, SURE, Bounds, Chords
from planner.verifier.pieces import RATIO_ROUNDING, ProgramPieces, axis_groups
from planner.verifier.switches import Switches
from planner.verifier.worst import COLUMN, DIFFERENCE, Worst


class Feeds:
    """Judges the feed of a motion, block of samples by block of samples, into a row of `Worst`."""

    def __init__(self, pieces: ProgramPieces, bounds: Bounds, worst: Worst, row: int, axes: tuple[str, ...]):
        groups = axis_groups(axes)
        self._groups = groups if (groups > 0).any() else groups[:0]
        self._pieces, self._bounds, self._switches = pieces, bounds, Switches(pieces, bounds)
        self._worst, self._row = worst, row
        self._block = np.zeros(1, dtype=np.int64)  # the first one that chords can still be on
        self._left = list[Chords]()  # blocks, each with the last sample of the one before as its first
        self._gap = 0.0  # between their samples at most [s]
        self._end = np.zeros(2)  # place and error of the last sample

    def take(self, new: Chords, skip: int, position: FloatArray) -> None:
        """The next samples, as `Switches.take`; position (n, A) [mm]."""
        self._switches.take(new, skip)
        begin = max(skip - 1, 0)
        if skip:
            new.place[begin], new.error[begin] = self._end
        self._end = np.array([new.place[-1], new.error[-1]])
        new = Chords(*(column[begin:] for column in new._replace(state=position[:, None])))
        self._left.append(new)
        gap = self._gap = float(np.diff(new.t).max(initial=self._gap))
        pace = float(np.linalg.norm(self._bounds.velocity))
        push = self._bounds.acceleration * gap
        room = 2.0 * gap * (pace + (push if np.isfinite(push) else pace))  # the longest reach of a vertex
        self._judge(float(self._switches.found.along[SURE]) - room)

    def finish(self) -> None:
        """No more samples: judge what is left."""
        self._switches.finish()
        self._judge(np.inf)

    def _judge(self, until: float) -> None:
        if not self._left or (self._left[0].place[1:2] > until).any():
            return
        worst, sample = self._worst.row[self._row].copy(), np.full(1, -1, dtype=np.int64)
        found, spans = self._switches.found, list[tuple[FloatArray, FloatArray]]()
        known = int(found.state[OPEN])
        while self._left:
            chords = self._left.pop(0)
            over = np.zeros(len(chords.t))
            done = _judged(
                self._pieces, self._groups, found.switch, known, self._block, chords, until, worst, sample, over
            )  # fmt: skip
            spans.append((chords.t[1:], over[1:]))
            k = int(sample[0])
            if k >= 0:
                seen, at = tuple(worst.tolist()), chords.state[k, 0]
                self._worst.keep(self._row, seen, float(chords.t[k]), at, int(chords.piece[k]))
                sample[0] = -1
            found.along[JUDGED] = float(chords.place[done - 1])
            if done < len(chords.t):
                self._left.insert(0, Chords(*(column[done - 1 :] for column in chords)))
                break
        if any(over.any() for _, over in spans):
            t, over = (np.concatenate(columns) for columns in zip(*spans, strict=True))
            self._worst.over.add(NAMES.index("feed"), t, over)
        self._gap = max((float(np.diff(chords.t).max()) for chords in self._left), default=0.0)


@kernel()
def _judged(pieces, groups, switch, known, block, chords, until, worst, sample, over):
    """Judge the chords that end at the place `until` at the latest, into `worst` (4,), `sample` (1,) and
    `over` (n,); vertices before `known` are settled. -> the first one that is left

    groups : (A,) of the axes (`axis_groups`), (0,) where F counts all of them
    """
    n = len(chords.t)
    for k in range(1, n):
        begin, end = chords.place[k - 1], chords.place[k]
        if end > until:
            return k
        while block[0] + 1 < known and switch[block[0] + 1]["end"] < begin:
            block[0] += 1
        lasts, at = 0.0, begin
        feed = 0.0
        while True:
            feed, next_at = 0.0, end
            for i in range(block[0], known):
                if switch[i]["begin"] > at:
                    next_at = min(next_at, switch[i]["begin"])
                    break
                to = switch[i + 1]["end"] if i + 1 < known else np.inf
                if at < to or (at == end and at == to):
                    feed, next_at = max(feed, pieces.piece[i]["feed"]), min(next_at, to)
            if at >= end:
                break
            lasts += (next_at - at) / feed
            at = next_at
        step, h = end - begin, chords.t[k] - chords.t[k - 1]
        if len(groups) and h > 0.0:
            least, value, word = np.inf, 0.0, np.inf
            for i in range(block[0], known):
                if switch[i]["begin"] > end:
                    break
                square = 0.0
                for a in range(len(groups)):
                    if groups[a] == pieces.piece[i]["by"]:
                        square += (chords.state[k, 0, a] - chords.state[k - 1, 0, a]) ** 2
                part = max(np.sqrt(square) - chords.error[k] - chords.error[k - 1], 0.0) / h
                if part < least * pieces.piece[i]["word"]:
                    least, value, word = part / pieces.piece[i]["word"], part, pieces.piece[i]["word"]
            if least > 1.0 + RATIO_ROUNDING and least < np.inf:
                over[k] = least
            if least > worst[0] and least < np.inf:
                worst[0], worst[1], worst[2], worst[3] = least, value, word, DIFFERENCE
                sample[0] = k
        if step > 0.0 and lasts > 0.0:
            value = max(step - chords.error[k] - chords.error[k - 1], 0.0) / h
            if value * lasts > (1.0 + RATIO_ROUNDING) * step:
                over[k] = max(over[k], value * lasts / step)
            if value * lasts > worst[0] * step:
                worst[0], worst[1], worst[2], worst[3] = value * lasts / step, value, step / lasts, DIFFERENCE
                sample[0] = k
        if chords.speed[k] > (1.0 + RATIO_ROUNDING) * feed:
            over[k] = max(over[k], chords.speed[k] / feed)
        if chords.speed[k] > worst[0] * feed:  # false where it is NaN
            worst[0], worst[1], worst[2], worst[3] = chords.speed[k] / feed, chords.speed[k], feed, COLUMN
            sample[0] = k
    return n
