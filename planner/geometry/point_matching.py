"""Which block each point of a motion is at: a sequence of points matched with the programmed path, in order.

The path is a chain of straight links (arcs and curves as chords within `CHORD_FRACTION` of the tolerance)
between vertices. Wanted is for every point n a link i(n) that never goes back, within the link's budget, such
that every vertex between i(n-1) and i(n) is within `MISSED` of its budgets from the chord from point n-1 to
point n. Of all such assignments the one with the least

    sum of |point - link|^2  +  sum of |vertex - chord|^2  +  budget^2 for every block that gets no point
                              +  budget^2 for every point that is faster than its block's feed allows
                              +  `TOO_FAR` budget^2 for every vertex that is missed by more than its budget

is found by dynamic programming over the links that can be reached from the point before, a window of about
two budgets, so that time and memory are linear in points and links. Distances below `SAME_PLACE` count as
none; of equal assignments that which passes the vertices last is taken: a motion that stands on a vertex is
still at the block before.

A motion within the tolerance has one. Where nothing can be reached budgets are widened, up to `WIDEST`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.geometry.chords import arc_sagitta, points_on
from planner.geometry.toolpath import Toolpath

CHORD_FRACTION = 1e-3  # sagitta of an arc's chords over its tolerance [-]
SAME_PLACE = 1e-6  # [mm] the least digit that NC programs carry
SAME_FEED = 1e-6  # [-] a feed above another by less is the same: rounding
# Vertices may be missed by so many budgets [-]: a vertex passed at 1.01 must not hold up what follows.
MISSED = 2.0
# Price of a vertex missed by more than its budget [budget^2]: more than of all points around it, or small
# moves inside the tolerance would be entered before their first vertex, at their higher feed.
TOO_FAR = 1e6
FIRST_WIDER, WIDEST = 1.05, 100.0  # budgets are widened by the first, then doubled, up to the second [-]
ANYWHERE = 1e12  # the same where no point is to be lost
# Bits of a mark: best entered on the chord before its point; best entered when left on the same chord.
ENTERED, THROUGH = 1, 2


class PathChain(NamedTuple):
    """K straight links and the K+1 vertices around them."""

    vertex: FloatArray  # (K+1, A) [mm]
    at_vertex: FloatArray  # (K+1,) budget there [mm]
    budget: FloatArray  # (K,) of each link, the larger one of its block's two joints [mm]
    skipped: FloatArray  # (K,) price of leaving a link without a point [mm2], 0 for the parts of an arc
    feed: FloatArray  # (K,) programmed [mm/s]
    segment: Array  # (K,) of the toolpath; first (M+1,) link of each segment
    first: Array


def chain_of(toolpath: Toolpath) -> PathChain:
    """The links of a toolpath."""
    count, _ = arc_sagitta(toolpath, CHORD_FRACTION)
    first = np.concatenate([[0], np.cumsum(count)])
    segment = np.repeat(np.arange(len(toolpath)), count)
    vertex = np.vstack([toolpath.start[segment], toolpath.end[-1:]])
    part = np.arange(len(segment)) - first[segment]
    inner = np.flatnonzero(part)
    at = segment[inner]
    vertex[inner] = points_on(toolpath, at, toolpath.length[at] * part[inner] / count[at])
    budget = np.maximum(toolpath.tolerance[:-1], toolpath.tolerance[1:])[segment]
    at_vertex = np.append(budget, toolpath.tolerance[-1])
    at_vertex[first] = toolpath.tolerance
    skipped = np.where(count[segment] == 1, budget**2, 0.0)
    return PathChain(vertex, at_vertex, budget, skipped, toolpath.feed[segment], segment, first)


class SegmentsInOrder:
    """Which segment of the toolpath each point of a motion is at, for points that come chunk by chunk.

    A point's link is settled when all possible assignments agree on it; its chunk is kept until then.
    """

    def __init__(self, toolpath: Toolpath):
        self._chain = chain_of(toolpath)
        links = len(self._chain.budget)
        self._cost, self._low, self._high = np.empty(links), 0, 0
        self._before: FloatArray | None = None
        self._open: list[_Marks] = []  # chunks that are not settled
        self._begin: list[Array] = []  # where a segment begins, and which
        self._segment: list[Array] = []
        self._count, self._lost = 0, False

    def take(self, point: FloatArray, feed: FloatArray) -> None:
        """The next points: point (n, A) [mm], and feed (n,) there [mm/s]."""
        if self._lost or not len(point):
            return
        point = np.ascontiguousarray(point, dtype=np.float64)
        fresh = self._before is None
        before = point[0] if self._before is None else self._before
        found, marks, self._low, self._high = _forward(
            self._chain, before, point, feed, fresh, self._low, self._high, self._cost, WIDEST
        )
        self._lost, self._before = not found, point[-1].copy()
        self._open.append(_Marks(*marks))
        if found and len(self._open) > 1:
            at = np.flatnonzero(np.isfinite(self._cost[self._low : self._high + 1])) + self._low
            self._settle_before(at)

    def runs(self) -> tuple[Array, Array] | None:
        """(R,) at which point each run of points at one segment begins, (R,) the segment; None if unknown."""
        last = len(self._chain.budget) - 1
        if self._lost or (not self._count and not self._open) or self._high != last:
            return None
        self._settle(self._open, last)
        self._open = []
        begin, segment = np.concatenate(self._begin), np.concatenate(self._segment)
        new = np.append(True, segment[1:] != segment[:-1])
        return begin[new], segment[new]

    def _settle_before(self, at: Array) -> None:
        """Settle what is common to all assignments that end at one of the links `at`."""
        for k in range(len(self._open) - 1, 0, -1):
            marks = self._open[k]
            at = np.unique([_trace(*marks, i, np.empty(len(marks.first), np.int64)) for i in at])
            if len(at) == 1:
                self._settle(self._open[:k], int(at[0]))
                self._open = self._open[k:]
                return

    def _settle(self, chunks: list[_Marks], last: int) -> None:
        links = []
        for marks in reversed(chunks):
            link = np.empty(len(marks.first), np.int64)
            last = _trace(*marks, last, link)
            links.append(link)
        segment = self._chain.segment[np.concatenate(links[::-1])]
        new = np.flatnonzero(np.append(True, segment[1:] != segment[:-1]))
        self._begin.append(self._count + new)
        self._segment.append(segment[new])
        self._count += len(segment)


class _Marks(NamedTuple):
    """For n points the first link (n,) each can be at, where its marks begin (n,), and the marks."""

    first: Array
    begin: Array
    marks: Array


@njit(cache=True, error_model="numpy")
def from_chord(begin, end, point):
    """Squared distance of a point (A,) from a chord, and the share of the chord at its foot."""
    along, length_sq = 0.0, 0.0
    for k in range(len(point)):
        u = end[k] - begin[k]
        along += (point[k] - begin[k]) * u
        length_sq += u * u
    share = min(max(along / length_sq, 0.0), 1.0) if length_sq > 0.0 else 0.0
    off_sq = 0.0
    for k in range(len(point)):
        off_sq += (point[k] - begin[k] - share * (end[k] - begin[k])) ** 2
    return (off_sq if off_sq > SAME_PLACE * SAME_PLACE else 0.0), share


@njit(cache=True, error_model="numpy")
def in_order(chain, point, feed):
    """Match points (n, A) with feeds (n,) with a chain.

    Returns whether that succeeds; (n,) the link of each point; (K+1,) where each vertex is passed, the point
    before plus the share of the chord behind it.
    """
    count, links = len(point), len(chain.budget)
    cost, link, crossed = np.empty(links), np.empty(count, np.int64), np.empty(links + 1)
    found, marks, _, high = _forward(chain, point[0], point, feed, True, 0, 0, cost, WIDEST)
    if not found or high != links - 1:
        return False, link, crossed
    _trace(marks[0], marks[1], marks[2], high, link)
    crossed[0], crossed[links] = 0.0, count - 1.0
    at = 0
    for n in range(count):
        for i in range(at + 1, link[n] + 1):
            _, share = from_chord(point[max(n - 1, 0)], point[n], chain.vertex[i])
            crossed[i] = max(n - 1, 0) + share * min(n, 1)
        at = link[n]
    for i in range(links):
        crossed[i + 1] = max(crossed[i + 1], crossed[i])
    return True, link, crossed


@njit(cache=True, error_model="numpy", nogil=True)
def links_anywhere(chain, point):
    """(n,) the link of each of n points (n, A), however far from the chain they are; feeds do not count."""
    count, links = len(point), len(chain.budget)
    cost, link, feed = np.empty(links), np.empty(count, np.int64), np.zeros(count)
    _, marks, _, high = _forward(chain, point[0], point, feed, True, 0, 0, cost, ANYWHERE)
    _trace(marks[0], marks[1], marks[2], high, link)
    return link


@njit(cache=True, error_model="numpy", nogil=True)
def _forward(chain, before, point, feed, fresh, low, high, cost, widest):
    """Go on with points (n, A) behind the point `before`, which can be at the links `low` to `high`; `fresh`
    if there is none before. The best assignment that ends at each link has the `cost` (K,), overwritten with that of
    the last point; budgets are widened `widest` times at most. Returns whether there is any, the fields of `_Marks`,
    and the links of the last point."""
    vertex, at_vertex, budget = chain.vertex, chain.at_vertex, chain.budget
    skipped, cap = chain.skipped, chain.feed
    count, links = len(point), len(budget)
    new = np.empty(links)
    first, begin = np.empty(count, np.int64), np.empty(count, np.int64)
    marks, used = np.empty(4 * count + 64, np.uint8), 0
    for n in range(count):
        wide = 1.0
        begins = fresh and n == 0
        while True:
            lowest, highest, mark = links, -1, used
            stay, enter = np.inf, 0.0 if begins else np.inf
            for i in range(low, links):
                if i > low:
                    off_sq, _ = from_chord(before, point[n], vertex[i])
                    within = off_sq <= (wide * MISSED * at_vertex[i] + SAME_PLACE) ** 2
                    if off_sq > (wide * at_vertex[i] + SAME_PLACE) ** 2:
                        off_sq += TOO_FAR * at_vertex[i] * at_vertex[i]
                    enter = off_sq + min(stay, enter + skipped[i - 1]) if within else np.inf
                stay = cost[i] if not begins and i <= high else np.inf
                if i > high and enter == np.inf:
                    break
                if mark == len(marks):
                    more = np.empty(2 * mark, np.uint8)
                    for k in range(mark):
                        more[k] = marks[k]
                    marks = more
                through = THROUGH if i + 1 < links and enter + skipped[i] < stay else 0
                marks[mark] = through | (ENTERED if enter < np.inf and enter <= stay else 0)
                mark += 1
                off_sq, _ = from_chord(vertex[i], vertex[i + 1], point[n])
                new[i] = np.inf
                if off_sq <= (wide * budget[i] + SAME_PLACE) ** 2:
                    new[i] = min(stay, enter) + off_sq
                    if feed[n] > cap[i] * (1.0 + SAME_FEED):
                        new[i] += budget[i] * budget[i]
                if new[i] < np.inf:
                    lowest, highest = min(lowest, i), i
            if highest >= 0:
                break
            wide = 2.0 * wide if wide > 1.0 else FIRST_WIDER
            if wide > widest:
                return False, (first, begin, marks), low, high
        first[n], begin[n], used = low, used, mark
        low, high = lowest, highest
        for i in range(low, high + 1):
            cost[i] = new[i]
        before = point[n]
    return True, (first, begin, marks), low, high


@njit(cache=True, error_model="numpy")
def _trace(first, begin, marks, last, link):
    """The best assignment of the points of `_Marks` that ends at the link `last`, into link (n,); returns the
    link of the point before them."""
    i = last
    for n in range(len(first) - 1, -1, -1):
        link[n] = i
        bit = ENTERED
        while i > first[n] and marks[begin[n] + i - first[n]] & bit:
            i -= 1
            bit = THROUGH
    return i
