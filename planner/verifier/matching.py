"""Matching the motion with the programmed path, in order: contour, vertices, completeness, stops and dwells.

The motion is the polyline of the samples q_0 .. q_T (delivered: with the middle of every chord as a sample of
its own, or with places on the cubics where the machine runs these; dense: the positions between the samples).
It fits the program within the budget eps if and only if both can be run through from start to end, neither
ever going back, at most eps apart all the time: the Frechet distance, decided by the free-space sweep of Alt
and Godau (Int. J. Comput. Geom. Appl. 5, 1995, doi 10.1142/S0218195995000064) restricted to the window of
pieces that can be reached, which makes it linear in time:

    low[i]   the lowest point (fraction) of piece i that can belong to q_k, given everything before; inf if none can
    sample   piece i stays possible for the next sample if the part of it within eps of that sample reaches up to low[i]
    vertex   piece i+1 is entered where the chord from q_k to q_k+1 comes within eps of vertex i+1, not before the place on
             that chord where vertex i was passed

On lines this is exact, since there every cell (chord, piece) of the free space is convex. On arcs the
distances are exact, the vertices every 22.5 degrees must be passed in order, and between them going back is
seen to second order in eps / radius. Dense spirals whose turns are closer than eps, reversals and thousands of
pieces within eps are told apart by order alone.

The error of a sample is its distance from the nearest of the pieces that it can belong to; that of a vertex is
its distance from the chords run while the piece before it was possible.

Where nothing within eps is possible any more, it goes on as follows, so that a fault is measured:
  1. a vertex passed at up to twice its budget is taken as passed (a corner cut too deep; the motion itself is
  near the path); 2. the budget is widened, up to twice, to the least that lets the motion go on (a contour
  error); 3. the first piece ahead within eps is taken, what lies between is lost (a block left out); 4. the
  place on the path is held until one of these works: the motion is lost. Its samples enter no contour error, and
  a vertex on lost pieces that no chord was compared with keeps the distance inf.

A full stop. A motion that rests at the vertex at some time within a period h has, with |acceleration| <= a, over the
period a chord of at most a h^2 / 2, and the nearer end of the period is at most a (h/2)^2 / 2 away; where
jerk is limited to j, at rest the acceleration is zero too, and it is j h^3 / 6 and j (h/2)^3 / 6. Per axis, each.
Who is d away from where he rests left it, or has still to go, for

    tau(d) = the larger of  (6 d / j)^(1/3),  (2 d / a)^(1/2)

at least, the largest of the axes: of a period between samples d0 and d1 away he can rest h - tau(d0) -
tau(d1), and no longer. Of a motion that leaves with the whole jerk, that is how long it rests, wherever the
samples fall.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.pieces import (
    CONTOUR_ROUNDING,
    PLACE_ROUNDING,
    RATIO_ROUNDING,
    ProgramPieces,
    kernel,
    reach_chord,
    reach_piece,
)

STILL = 1e-9  # [mm] displacement over one period that is a standstill: rounding of coordinates up to 1e6 mm
NEAR_MISS = 2.0  # errors up to this multiple of the budget are matched in place; beyond, a block is left out
BISECTIONS = 12  # of the widened budget: 1/4096 of it
PIECES_AHEAD = 5_000  # looked through for the block at which a lost motion comes back
SEARCH_MAX = 100_000_000  # pieces looked through in total; then a lost motion stays lost: bounds the time


TRACK = np.dtype([("low", "f8"), ("new", "f8"), ("lost", "?")])
PASSED = np.dtype([("near", "f8"), ("near_time", "f8"), ("rest", "f8"), ("stop_ratio", "f8")])
FIRST, LAST, JUMPS, SEARCHED, HELD, LOST_AFTER, ASTRAY, STUCK_AT = range(8)  # in Match.tally
NOT_LOST = -1  # in tally[LOST_AFTER] and tally[STUCK_AT]
BEFORE, POINT, WORST_AT = range(3)  # in Match.place


class Match(NamedTuple):
    """State of the matching after some samples, and what it has found; all arrays are written in place."""

    track: Array  # (N,) per piece: low, new = its lowest possible fraction, now and next; lost, if it was left out
    # (N+1,) per vertex: near = smallest distance from the motion [mm], near_time = when [s]; where the motion has to stop: rest =
    # the longest that it can have rested there [s], stop_ratio = how well it stops, <= 1 if within what samples can show
    passed: Array
    # (8,) first and last possible piece; jumps over lost pieces; pieces searched; samples held; the last piece that was possible
    # when the motion was lost first, or NOT_LOST; 1 while it is lost; the vertex at which it did not fit into the budgets first, or
    # NOT_LOST
    tally: Array
    place: FloatArray  # (3, A) the sample before, the present one, the worst one [mm]
    # (6,) of the worst sample that is not lost: ratio, distance [mm], budget [mm], time [s], piece; largest distance of any [mm]
    worst: FloatArray


def new_match(pieces: ProgramPieces) -> Match:
    """The state before the first sample."""
    vertices, axes = pieces.vertex.shape
    track, passed = np.zeros(vertices - 1, dtype=TRACK), np.zeros(vertices, dtype=PASSED)
    track["low"] = passed["near"] = passed["stop_ratio"] = np.inf
    tally = np.zeros(8, dtype=np.int64)
    tally[LOST_AFTER] = tally[STUCK_AT] = NOT_LOST
    return Match(track=track, passed=passed, tally=tally, place=np.zeros((3, axes)), worst=np.zeros(6))


class Located(NamedTuple):
    """Where each of n samples lies: its piece (n,), the largest feed (n,) of those it can lie on [mm/s], and
    the first and the last of these pieces (n,), the last one -2 where the motion is lost."""

    piece: Array
    feed_max: FloatArray
    first: Array
    last: Array


def nowhere(samples: int) -> Located:
    """Of so many samples, to be written."""
    piece, first, last = np.zeros((3, samples), dtype=np.int64)
    return Located(piece, np.zeros(samples), first, last)


class AtStop(NamedTuple):
    """How far and how fast a sample can be next to a stop: (A,) largest accelerations [mm/s2] and jerks
    [mm/s3], inf where they are not limited, and errors of positions by their digits [mm]."""

    acceleration_max: FloatArray
    jerk_max: FloatArray
    rounding: FloatArray


@kernel()
def match_samples(pieces, match, t, position, skip, parts, velocity, at_stop, place):
    """Match samples `skip` to the last, in `match`, and write their places; those before belong to the
    previous call.

    t, position : (n,) [s], (n, A) [mm]
    parts       : into how many a period is divided: the places between are samples too
    velocity    : (n, A) of the cubics between samples on which these lie [mm/s]; (0, A) if they lie on the
                  chords
    """
    n, axes = position.shape
    before, point = match.place[BEFORE], match.place[POINT]
    began = 0  # the first piece that was possible when the period began
    for k in range(skip, n):
        if k == 0:
            match.track[0]["low"] = 0.0
            for axis in range(axes):
                before[axis] = point[axis] = position[0, axis]
            _, _, apart = reach_chord(before, point, pieces, 0, 0.0)
            match.passed[0]["near"], match.passed[0]["near_time"] = apart, t[0]
        period = t[k] - t[k - 1] if k else 0.0
        for part in range(1, parts + 1):
            rest = (parts - part) / parts
            for axis in range(axes):
                back = position[k, axis] - position[k - 1, axis] if k else 0.0
                point[axis] = position[k, axis] - rest * back
                if k and len(velocity):
                    late, early = period * velocity[k, axis] - back, period * velocity[k - 1, axis] - back
                    point[axis] += (1.0 - rest) * rest * (rest * early - (1.0 - rest) * late)
            first = match.tally[FIRST]
            began = first if part == 1 else began
            place.piece[k], place.feed_max[k] = _step(pieces, match, before, point, t[k] - rest * period)
            for i in range(first, match.tally[LAST] + 2):
                if k and pieces.joint[i]["stop"]:
                    _watch_stop(pieces, match.passed, i, before, point, period, parts, at_stop)
            for axis in range(axes):
                before[axis] = point[axis]
        for i in range(began, match.tally[LAST] + 2):
            if k and pieces.joint[i]["stop"]:
                rest = _longest_rest(pieces, i, position[k - 1], position[k], period, at_stop)
                match.passed[i]["rest"] += rest
        place.first[k], place.last[k] = match.tally[FIRST], match.tally[LAST]
        if match.tally[ASTRAY]:
            place.last[k] = -2


@kernel(inline=True)
def _step(pieces, match, before, point, time):
    """Go on from `before` to `point`, where nothing within the budget is possible as the module's text says; return the
    piece it lies on and the largest feed of those it can lie on."""
    little, enough = 1.0, NEAR_MISS  # the bisection of the widened budget
    widen, widen_vertex = 1.0, 1.0
    for attempt in range(BISECTIONS + 4):
        found = _column(pieces, match, before, point, time, widen, widen_vertex, attempt > 0)
        first, last, distance, i, feed, stuck = found
        if attempt == 0 and first > last and match.tally[STUCK_AT] == NOT_LOST:
            match.tally[STUCK_AT] = stuck
        if attempt <= 1:  # 0: as it should be, 1: a vertex missed by little
            if first <= last:
                break
            widen, widen_vertex = (1.0, NEAR_MISS) if attempt == 0 else (NEAR_MISS, NEAR_MISS)
            continue
        if attempt == BISECTIONS + 3 or (attempt == 2 and first > last):
            break
        enough, little = (widen, little) if first <= last else (enough, widen)
        widen = 0.5 * (enough + little) if attempt < BISECTIONS + 2 else enough
        widen_vertex = widen
    if first <= last:
        _commit(match, first, last)
    else:
        distance, i, feed = _stray(pieces, match, before, point, time)
        if match.tally[ASTRAY]:
            return i, feed
    match.worst[5] = max(match.worst[5], distance)
    budget = pieces.piece[i]["budget"]
    if distance > match.worst[0] * budget:
        match.worst[0], match.worst[1], match.worst[2] = distance / budget, distance, budget
        match.worst[3], match.worst[4] = time, i
        for axis in range(len(point)):
            match.place[WORST_AT, axis] = point[axis]
    return i, feed


@kernel(inline=True)
def _column(pieces, match, before, point, time, widen, widen_vertex, late):
    """Which pieces `point` can lie on, into match.track.new. The one step of the sweep.

    widen, widen_vertex : factors on the budgets of samples and vertices
    late                : a vertex counts as passed if any earlier chord came near enough

    -> first and last possible piece (first > last: none), distance from the nearest of them, that piece, largest feed,
    and the vertex that was not passed
    """
    track, passed = match.track, match.passed
    i, last_before = match.tally[FIRST], match.tally[LAST]
    entry = np.inf  # where on the chord vertex i was passed
    first, last, nearest, best, feed = len(track), -1, np.inf, i, 0.0
    while i < len(track):
        low_before = track[i]["low"] if i <= last_before else np.inf
        possible = low_before < np.inf or entry < np.inf
        if not possible and i > last_before:
            break
        track[i]["new"] = np.inf
        leave = np.inf
        if possible:
            a, b, distance = reach_piece(pieces, i, point, _allowed(pieces.piece[i]["budget"] * widen))
            low = a if entry < np.inf else max(a, low_before)
            if low <= b:
                track[i]["new"] = low
                first, last = min(first, i), i
                feed = max(feed, pieces.piece[i]["feed"])
                if distance < nearest:
                    nearest, best = distance, i
            allowed = _allowed(pieces.joint[i + 1]["budget"] * widen_vertex)
            c, d, apart = reach_chord(before, point, pieces, i + 1, allowed)
            if apart < passed[i + 1]["near"]:
                passed[i + 1]["near"], passed[i + 1]["near_time"] = apart, time
            earliest = 0.0 if low_before < np.inf else entry
            if max(c, earliest) <= d:
                leave = max(c, earliest)
            elif late and passed[i + 1]["near"] <= allowed:
                leave = earliest
        entry = leave
        i += 1
    return first, last, nearest, best, feed, i


@kernel()
def _stray(pieces, match, before, point, time):
    """Far from where the program should be: take the first piece ahead that fits, or hold the place on the
    path, lost. -> distance [mm], inf if lost; piece, feed [mm/s]"""
    track, passed, tally = match.track, match.passed, match.tally
    begin = tally[LAST] + 1
    for ahead in range(begin, min(begin + PIECES_AHEAD, len(track))):
        if tally[SEARCHED] >= SEARCH_MAX:
            break
        tally[SEARCHED] += 1
        a, b, distance = reach_piece(pieces, ahead, point, _allowed(pieces.piece[ahead]["budget"]))
        if a > b:
            continue
        tally[JUMPS] += 1
        for j in range(begin, ahead + 1):
            track[j]["lost"] = j < ahead
            if tally[ASTRAY] and j > begin:
                continue  # earlier chords may have been nearer, and were not compared
            _, _, apart = reach_chord(before, point, pieces, j, 0.0)
            if apart < passed[j]["near"]:
                passed[j]["near"], passed[j]["near_time"] = apart, time
        track[ahead]["new"] = 0.0
        _commit(match, ahead, ahead)
        return distance, ahead, pieces.piece[ahead]["feed"]

    if tally[LOST_AFTER] == NOT_LOST:
        tally[LOST_AFTER] = tally[LAST]
    tally[HELD] += 1
    tally[ASTRAY] = 1
    feed = 0.0
    for i in range(tally[FIRST], begin):
        if track[i]["low"] < np.inf:
            feed = max(feed, pieces.piece[i]["feed"])
    return np.inf, tally[LAST], feed


@kernel(inline=True)
def _commit(match, first, last):
    """Make the possible pieces `first` to `last` of match.track.new the present ones."""
    match.tally[ASTRAY] = 0
    for i in range(match.tally[FIRST], match.tally[LAST] + 1):
        match.track[i]["low"] = np.inf
    for i in range(first, last + 1):
        match.track[i]["low"] = match.track[i]["new"]
    match.tally[FIRST], match.tally[LAST] = first, last


@kernel(inline=True)
def _allowed(budget):
    return budget * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING


@kernel()
def _watch_stop(pieces, passed, i, before, point, period, parts, at_stop):
    """The chord from `before` to `point` (A,), one of `parts` of a period [s], shows of the stop at vertex i,
    into `passed`."""
    acceleration_max, rounding = at_stop.acceleration_max, at_stop.rounding
    slow, away_sq = 0.0, 0.0
    for axis in range(len(point)):
        move = abs(point[axis] - before[axis])
        bow = acceleration_max[axis] * period * period / 8.0
        most = 4.0 * bow
        if math.isfinite(at_stop.jerk_max[axis]):
            bow = min(bow, at_stop.jerk_max[axis] * period**3 / 48.0)
            most = min(most, at_stop.jerk_max[axis] * period**3 / 6.0)
        slow = max(slow, max(move * parts - STILL - 2.0 * rounding[axis], 0.0) / most)
        away_sq += (bow + rounding[axis]) ** 2
    away = math.sqrt(away_sq) + PLACE_ROUNDING
    _, _, apart = reach_chord(before, point, pieces, i, 0.0)
    passed[i]["stop_ratio"] = min(passed[i]["stop_ratio"], max(slow, apart / away))


@kernel()
def _longest_rest(pieces, i, before, point, period, at_stop):
    """How long a motion with samples `before` and `point` (A,), a period [s] apart, can rest at vertex i
    between them [s]."""
    early, late = 0.0, 0.0
    for axis in range(len(point)):
        rounding = PLACE_ROUNDING + at_stop.rounding[axis]
        a, j, there = at_stop.acceleration_max[axis], at_stop.jerk_max[axis], pieces.vertex[i, axis]
        was = max(abs(before[axis] - there) - rounding, 0.0)
        will = max(abs(point[axis] - there) - rounding, 0.0)
        if max(was, will) > min(j * period**3 / 6.0, a * period * period / 2.0):
            return 0.0  # most are that far away, and roots take longer than all else
        early = max(early, (6.0 * was / j) ** (1.0 / 3.0), math.sqrt(2.0 * was / a))
        late = max(late, (6.0 * will / j) ** (1.0 / 3.0), math.sqrt(2.0 * will / a))
    return max(period - early - late, 0.0)
