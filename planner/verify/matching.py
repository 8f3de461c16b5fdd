"""Matching the motion with the programmed path, in order: contour, vertices, completeness, stops and dwells.

The motion is the polyline of the samples q_0 .. q_T (delivered: with the middle of every chord as a sample of its own; dense:
the positions between the samples). It fits the program within the budget eps if and only if both can be run through from start
to end, neither ever going back, at most eps apart all the time: the Frechet distance, decided by the free-space sweep of Alt
and Godau (Int. J. Comput. Geom. Appl. 5, 1995, doi 10.1142/S0218195995000064) restricted to the window of pieces that can be
reached, which makes it linear in time:

    low[i]   the lowest point (fraction) of piece i that can belong to q_k, given everything before; inf if none can
    sample   piece i stays possible for the next sample if the part of it within eps of that sample reaches up to low[i]
    vertex   piece i+1 is entered where the chord from q_k to q_k+1 comes within eps of vertex i+1, not before the place on
             that chord where vertex i was passed

On lines this is exact, since there every cell (chord, piece) of the free space is convex. On arcs the distances are exact, the
vertices every 22.5 degrees must be passed in order, and between them going back is seen to second order in eps / radius. The
nearest point plays no part: dense spirals whose turns are closer than eps, reversals and thousands of pieces within eps are
told apart by order alone.

The error reported for a sample is its distance from the nearest of the pieces that it can belong to; the error of a vertex is
its distance from the chords run while the piece before it was possible.

Where nothing within eps is possible any more, the matching goes on as follows, so that a fault is measured, not only found:
  1. a vertex passed at up to twice its budget is taken as passed (a corner cut too deep; the motion itself is near the path);
  2. the budget is widened, up to twice, to the least that lets the motion go on (a contour error);
  3. the first piece ahead within eps is taken, what lies between is lost (a block left out);
  4. the place on the path is held until one of these works.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from planner.arrays import Array, FloatArray
from planner.verify.pieces import (
    CONTOUR_ROUNDING,
    PLACE_ROUNDING,
    RATIO_ROUNDING,
    Pieces,
    distance_from,
    reach,
    reach_line,
)

NEAR_MISS = (
    2.0  # errors up to this multiple of the budget are matched in place, beyond it a block counts as left out
)
BISECTIONS = 12  # of the widened budget: 1/4096 of it
PIECES_AHEAD = 5_000  # looked through for the block at which a lost motion comes back
SEARCH_MAX = (
    100_000_000  # pieces looked through in total; then a lost motion stays lost (bounds the time on garbage)
)
STILL = 1e-9  # [mm] displacement over one period that is a standstill: rounding of coordinates up to 1e6 mm


class Match(NamedTuple):
    """State of the matching after some samples, and what it has found; all arrays are written in place.

    low, new    (N,) lowest possible fraction of each piece, now and next
    near        (N+1,) smallest distance of each vertex from the motion [mm], near_time when [s]
    rest        (N+1,) standstill at a vertex where the motion must stop [s]
    stop_ratio  (N+1,) how well the motion stops there: <= 1 if within what samples can show
    lost        (N,) pieces left out
    window      (6,) first and last possible piece; failures; jumps; pieces looked through; samples held
    last        (A,) the sample before
    worst       (6,) of the worst sample: ratio, distance [mm], budget [mm], time [s], piece, largest distance [mm]
    worst_at    (A,) where
    """

    low: FloatArray
    new: FloatArray
    near: FloatArray
    near_time: FloatArray
    rest: FloatArray
    stop_ratio: FloatArray
    lost: Array
    window: Array
    last: FloatArray
    worst: FloatArray
    worst_at: FloatArray


def new_match(pieces: Pieces) -> Match:
    """The state before the first sample."""
    vertices, axes = pieces.vertex.shape
    return Match(
        low=np.full(vertices - 1, np.inf),
        new=np.empty(vertices - 1),
        near=np.full(vertices, np.inf),
        near_time=np.zeros(vertices),
        rest=np.zeros(vertices),
        stop_ratio=np.full(vertices, np.inf),
        lost=np.zeros(vertices - 1, dtype=np.bool_),
        window=np.zeros(6, dtype=np.int64),
        last=np.empty(axes),
        worst=np.zeros(6),
        worst_at=np.zeros(axes),
    )


@njit(cache=True)
def follow(
    pieces: Pieces,
    match: Match,
    t: FloatArray,
    position: FloatArray,
    skip: int,
    middles: bool,
    acceleration_max: FloatArray,
    piece: Array,
    feed_max: FloatArray,
) -> None:
    """Match samples `skip` to the last; those before belong to the previous call. The first call has skip = 0.

    middles          : the middle of every chord is a sample too
    acceleration_max : (A,) [mm/s2]; how far and how fast a sample can be next to a stop
    piece, feed_max  : (n,) written: the piece each sample lies on, and the largest feed of those it can lie on [mm/s]
    """
    n, axes = position.shape
    point = np.empty(axes)
    parts = 2 if middles else 1
    for k in range(skip, n):
        if k == 0:
            match.last[:] = position[0]
            match.low[0] = 0.0
            match.near[0] = _distance(position[0], pieces.vertex[0])
            match.near_time[0] = t[0]
            piece[0], feed_max[0] = _step(pieces, match, position[0], t[0])
            continue
        period = t[k] - t[k - 1]
        for part in range(1, parts + 1):
            weight = part / parts
            for axis in range(axes):
                point[axis] = position[k - 1, axis] + weight * (position[k, axis] - position[k - 1, axis])
            if part == parts:
                point[:] = position[k]
            first = match.window[0]
            piece[k], feed_max[k] = _step(pieces, match, point, t[k - 1] + weight * period)
            for i in range(first, match.window[1] + 2):
                if pieces.stop[i]:
                    _watch_stop(pieces, match, i, point, period, parts, acceleration_max)
            match.last[:] = point


@njit(cache=True)
def _step(pieces: Pieces, match: Match, point: FloatArray, time: float) -> tuple[int, float]:
    """Go on to `point`; return the piece it lies on and the largest feed of those it can lie on."""
    first, last, distance, i, feed = _column(pieces, match, point, time, 1.0, 1.0, False)
    if first > last:
        return _recover(pieces, match, point, time)
    _commit(match, first, last)
    _note(pieces, match, point, time, distance, i)
    return i, feed


@njit(cache=True)
def _column(
    pieces: Pieces,
    match: Match,
    point: FloatArray,
    time: float,
    widen: float,
    widen_vertex: float,
    late: bool,
) -> tuple[int, int, float, int, float]:
    """Which pieces `point` can lie on, into match.new. The one step of the sweep.

    widen, widen_vertex : factors on the budgets of samples and vertices
    late                : a vertex counts as passed if any earlier chord came near enough

    -> first and last possible piece (first > last: none), distance from the nearest of them, that piece, largest feed
    """
    pieces_count = len(match.low)
    i, last_before = match.window[0], match.window[1]
    entry = np.inf  # where on the chord vertex i was passed
    first, last, nearest, best, feed = pieces_count, -1, np.inf, i, 0.0
    while i < pieces_count:
        before = match.low[i] if i <= last_before else np.inf
        possible = before < np.inf or entry < np.inf
        if not possible and i > last_before:
            break
        match.new[i] = np.inf
        leave = np.inf
        if possible:
            a, b, distance = reach(pieces, i, point, _allowed(pieces.budget[i] * widen))
            low = a if entry < np.inf else max(a, before)
            if low <= b:
                match.new[i] = low
                first, last = min(first, i), i
                feed = max(feed, pieces.feed[i])
                if distance < nearest:
                    nearest, best = distance, i
            allowed = _allowed(pieces.vertex_budget[i + 1] * widen_vertex)
            c, d, apart = reach_line(match.last, point, pieces.vertex[i + 1], allowed)
            if apart < match.near[i + 1]:
                match.near[i + 1], match.near_time[i + 1] = apart, time
            earliest = 0.0 if before < np.inf else entry
            if max(c, earliest) <= d:
                leave = max(c, earliest)
            elif late and match.near[i + 1] <= allowed:
                leave = earliest
        entry = leave
        i += 1
    return first, last, nearest, best, feed


@njit(cache=True)
def _recover(pieces: Pieces, match: Match, point: FloatArray, time: float) -> tuple[int, float]:
    """Go on where nothing within the budget is possible (the module's text says how); as `_step`."""
    match.window[2] += 1
    first, last, distance, i, feed = _column(pieces, match, point, time, 1.0, NEAR_MISS, True)
    if first > last:
        first, last, distance, i, feed = _column(pieces, match, point, time, NEAR_MISS, NEAR_MISS, True)
        if first <= last:
            enough, little = NEAR_MISS, 1.0
            for _ in range(BISECTIONS):
                widen = 0.5 * (enough + little)
                first, last, distance, i, feed = _column(pieces, match, point, time, widen, widen, True)
                if first <= last:
                    enough = widen
                else:
                    little = widen
            first, last, distance, i, feed = _column(pieces, match, point, time, enough, enough, True)
    if first <= last:
        _commit(match, first, last)
        _note(pieces, match, point, time, distance, i)
        return i, feed

    end = match.window[1]
    ahead = _first_ahead(pieces, match, point)
    if ahead >= 0:
        match.window[3] += 1
        for j in range(end + 1, ahead + 1):
            _, _, apart = reach_line(match.last, point, pieces.vertex[j], 0.0)
            if apart < match.near[j]:
                match.near[j], match.near_time[j] = apart, time
            if j < ahead:
                match.lost[j] = True
        match.new[ahead] = 0.0
        _commit(match, ahead, ahead)
        _, _, distance = reach(pieces, ahead, point, 0.0)
        _note(pieces, match, point, time, distance, ahead)
        return ahead, pieces.feed[ahead]

    match.window[5] += 1
    nearest, best, feed = np.inf, match.window[0], 0.0
    for j in range(match.window[0], end + 1):
        if match.low[j] < np.inf:
            distance = distance_from(pieces, j, match.low[j], point)
            feed = max(feed, pieces.feed[j])
            if distance < nearest:
                nearest, best = distance, j
    _note(pieces, match, point, time, nearest, best)
    return best, feed


@njit(cache=True)
def _first_ahead(pieces: Pieces, match: Match, point: FloatArray) -> int:
    """The first piece after the window within the budget of `point`, or -1."""
    begin = match.window[1] + 1
    end = min(begin + PIECES_AHEAD, len(match.low))
    for j in range(begin, end):
        if match.window[4] >= SEARCH_MAX:
            return -1
        match.window[4] += 1
        a, b, _ = reach(pieces, j, point, _allowed(pieces.budget[j]))
        if a <= b:
            return j
    return -1


@njit(cache=True)
def _commit(match: Match, first: int, last: int) -> None:
    for i in range(match.window[0], match.window[1] + 1):
        match.low[i] = np.inf
    match.low[first : last + 1] = match.new[first : last + 1]
    match.window[0], match.window[1] = first, last


@njit(cache=True)
def _note(pieces: Pieces, match: Match, point: FloatArray, time: float, distance: float, i: int) -> None:
    match.worst[5] = max(match.worst[5], distance)
    if distance > match.worst[0] * pieces.budget[i]:
        match.worst[0], match.worst[1], match.worst[2] = (
            distance / pieces.budget[i],
            distance,
            pieces.budget[i],
        )
        match.worst[3], match.worst[4] = time, i
        match.worst_at[:] = point


@njit(cache=True)
def _watch_stop(
    pieces: Pieces,
    match: Match,
    i: int,
    point: FloatArray,
    period: float,
    parts: int,
    acceleration_max: FloatArray,
) -> None:
    """What the chord to `point` shows of the stop at vertex i.

    If the motion rests at the vertex at some time within a period h, then with |acceleration| <= a its chord over the period
    is at most a h^2 / 2 long, and the nearer end of the period is at most a (h/2)^2 / 2 away. Per axis, each.
    """
    slow, away_sq, still = 0.0, 0.0, True
    for axis in range(len(point)):
        move = abs(point[axis] - match.last[axis])
        bow = acceleration_max[axis] * period * period / 8.0
        slow = max(slow, max(move * parts - STILL, 0.0) / (4.0 * bow))
        away_sq += bow * bow
        still = still and move <= STILL
    away = math.sqrt(away_sq) + PLACE_ROUNDING
    _, _, apart = reach_line(match.last, point, pieces.vertex[i], 0.0)
    match.stop_ratio[i] = min(match.stop_ratio[i], max(slow, apart / away))
    if still and apart <= away:
        match.rest[i] += period / parts


@njit(cache=True)
def _allowed(budget: float) -> float:
    return budget * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING


@njit(cache=True)
def _distance(p: FloatArray, q: FloatArray) -> float:
    total = 0.0
    for n in range(len(p)):
        total += (p[n] - q[n]) ** 2
    return math.sqrt(total)
