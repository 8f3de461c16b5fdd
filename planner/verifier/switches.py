"""On which block the motion is: where it goes over from one to the next.

The motion is on the blocks in their order, and goes over from one to the next where it is nearest to the
vertex between them; on a straight line that is the vertex. Of several vertices that are within reach of each
other those places T_i, in order, count that are together nearest to them:

    least  sum_i |x(T_i) - V_i|^2,    T_1 <= T_2 <= ...

over the chords of the motion, by dynamic programming over the vertices that each chord can be at
(matching.py). A vertex is settled once the motion cannot be on the block before it any more. A full stop is
passed where the motion rests.

Where the motion runs on cubics that is the place on them, known to rounding; where only its samples are known it is the place of
the chord, and known to a `reach` (nearest.py). So far from the switch a place belongs to both blocks, and the larger F counts. On a
straight line at 100 mm/s, 4,000 mm/s2 and 1 ms the reach of a chord is 3e-5 mm; where bends are slow, and the tolerance is wide, it
is micrometres. Of vertices that are nearest out of order within one chord the place together counts.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.kernel import kernel
from planner.verifier.nearest import nearest, reach_of
from planner.verifier.pieces import PLACE_ROUNDING, ProgramPieces, reach_chord
from planner.verifier.worst import ROUNDING_ULPS

# cost: least sum of squared distances up to this vertex, from the first open one on, inf before it is looked
# at [mm2]; place: where it is passed along the chords from the start [mm]; begin, end: from where the block
# after it may have begun, and to where the one before it may last; group: number of vertices
# passed together; chord: on which, of those kept
SWITCH = np.dtype(
    [(name, "f8") for name in ("cost", "place", "begin", "end")] + [("group", "i8"), ("chord", "i8")]
)
# first, count, offset: the vertices that were looked at, and where the marks of those that came nearer begin;
# begin: place of the chord's start [mm]; step, h, cut, error: its length [mm], duration, end of the cubic that it begins with
# (NaN where it is not known) [s], rounding [mm]
CHORD = np.dtype(
    [(name, "i8") for name in ("first", "count", "offset")]
    + [(name, "f8") for name in ("begin", "step", "h", "cut", "error")]
)
# In `state`: the first vertex not settled; first and behind the last of the chords kept; marks used.
OPEN, HEAD, TAIL, USED = range(4)
SURE, TRAVELLED, JUDGED = range(3)  # in `along`: the open vertex is not passed, length run, judged to [mm]
# Price of a full stop passed where the motion does not rest [budgets]: more than of all vertices around.
RUN_THROUGH = 1e3
# How much more firmly the place of a full stop is held than others passed together with it [-].
FIRM = 1e9
ROOM = 4096  # chords and marks there is room for at first


class Bounds(NamedTuple):
    """velocity (A,), digits (A+1,) as in limits.py; norm of the largest accelerations, inf if not judged."""

    velocity: FloatArray
    digits: FloatArray
    acceleration: float


class Chords(NamedTuple):
    """Samples whose feed is still to be judged, the first one as the beginning of a chord.

    t, place, error : (n,) [s]; length of chords from the start [mm]; largest rounding error [mm]
    speed           : (n,) as delivered [mm/s], NaN where it was not
    piece, position : (n,), (n, A) where each is, to be told
    """

    t: FloatArray
    place: FloatArray
    error: FloatArray
    speed: FloatArray
    piece: Array
    position: FloatArray


class Cubics(NamedTuple):
    """Between n samples: columns (4, n, A), position and its derivatives at each; cut (n,) how long the cubic of the sample before
    lasts, from the end of which on it is that of the sample itself [s], NaN where that is not known."""

    columns: FloatArray
    cut: FloatArray


class Kept(NamedTuple):
    """Chords since the last vertex that was settled: `CHORD` (C,), their ends (C, 2, 4, A) as in `Cubics`, and marks; a place that
    is worked with (A,)."""

    chord: Array
    ends: FloatArray
    mark: Array
    work: FloatArray


class Switches:
    """Where a motion passes the vertices, as far as its samples tell.

    switch  : (N+1,) `SWITCH`
    state   : (4,) as named above
    along   : (3,) likewise; its last number is for who judges, and what is judged stays
    """

    def __init__(self, pieces: ProgramPieces, bounds: Bounds):
        vertices, axes = pieces.vertex.shape
        self.switch = np.zeros(vertices, dtype=SWITCH)
        self.switch["cost"][1:] = np.inf
        self.state, self.along = np.array([1, 0, 0, 0], dtype=np.int64), np.zeros(3)
        self._pieces, self._bounds = pieces, bounds
        room = np.zeros(ROOM, CHORD), np.zeros((ROOM, 2, 4, axes)), np.zeros(ROOM, np.bool_)
        self._kept = Kept(*room, np.zeros(axes))

    def take(self, new: Chords, skip: int, first: Array, last: Array, cubics: Cubics) -> None:
        """The next samples, from `skip` on; those before were given already. first, last: (n,) the pieces
        each can be on (matching.py). place and error of `new` are written here."""
        k = skip
        while k < len(new.t):
            k = _passed(
                self._pieces,
                self.switch,
                self.state,
                self.along,
                self._kept,
                new,
                k,
                (first, last),
                cubics,
                self._bounds,
            )
            if k < len(new.t):
                self._make_room()

    def finish(self) -> None:
        """No more samples: settle what was looked at."""
        seen = np.flatnonzero(np.isfinite(self.switch["cost"][:-1]))
        if len(seen) and seen[-1] >= self.state[OPEN]:
            last = int(seen[-1])
            _settle(self._pieces, self.switch, self.state, self.along, self._kept, last, self._bounds)

    def _make_room(self) -> None:
        """Leave out chords and marks not needed any more; twice the room where they are not half of them."""
        head, tail = int(self.state[HEAD]), int(self.state[TAIL])
        begin = int(self._kept.chord["offset"][head]) if tail > head else int(self.state[USED])
        used = int(self.state[USED]) - begin
        full = (
            not (head or begin)
            or 2 * (tail - head) > len(self._kept.chord)
            or 2 * used > len(self._kept.mark)
        )
        chord, ends, mark = (np.zeros(((1 + full) * len(c), *c.shape[1:]), c.dtype) for c in self._kept[:3])
        chord[: tail - head], ends[: tail - head] = self._kept.chord[head:tail], self._kept.ends[head:tail]
        mark[:used] = self._kept.mark[begin : begin + used]
        chord["offset"][: tail - head] -= begin
        self._kept = Kept(chord, ends, mark, self._kept.work)
        self.state[HEAD], self.state[TAIL], self.state[USED] = 0, tail - head, used


@kernel()
def _passed(
    pieces: ProgramPieces,
    switch: Array,
    state: Array,
    along: FloatArray,
    kept: Kept,
    new: Chords,
    skip: int,
    can: tuple[Array, Array],
    cubics: Cubics,
    bounds: Bounds,
) -> int:
    """Take in the chords to the samples from `skip` on, and settle the vertices that they leave behind;
    places and errors into `new`. -> the first sample there was no room for, or their number"""
    n, axes = new.position.shape
    ulp = ROUNDING_ULPS * 2.0**-52
    for k in range(skip, n):
        h = new.t[k] - new.t[k - 1] if k else 0.0
        push = bounds.acceleration * h if math.isfinite(bounds.acceleration) else 0.0
        step_sq, error_sq, begin = 0.0, 0.0, along[TRAVELLED]
        for axis in range(axes):
            move = abs(new.position[k, axis] - new.position[k - 1, axis]) if k else 0.0
            step_sq += move * move
            error = ulp * (abs(new.position[k, axis]) + begin + bounds.velocity[axis] * new.t[k])
            error += bounds.digits[axis] + (bounds.digits[axes] * (move / h + push) if k else 0.0)
            error_sq += error * error
        step, rounding = math.sqrt(step_sq), math.sqrt(error_sq)
        last = min(can[1][k] + 1, len(switch) - 2)
        if state[TAIL] == len(kept.chord) or state[USED] + max(last + 1 - state[OPEN], 0) > len(kept.mark):
            return k
        along[TRAVELLED] += step
        new.place[k], new.error[k] = along[TRAVELLED], rounding
        if step > 0.0:
            chord = begin, step, h, cubics.cut[k], rounding
            _look(pieces, switch, state, along, kept, new, k, last, chord, cubics.columns, bounds)
        if k and can[0][k] >= state[OPEN]:
            _settle(pieces, switch, state, along, kept, min(can[0][k], len(switch) - 2), bounds)
    return n


@kernel(inline=True)
def _put_ends(ends, position, columns, k):
    """The samples k - 1 and k, with the derivatives that there are, into `ends` (2, 4, A)."""
    for side in range(2):
        for axis in range(position.shape[1]):
            ends[side, 0, axis] = position[k - 1 + side, axis]
            for order in range(1, columns.shape[0]):
                ends[side, order, axis] = columns[order, k - 1 + side, axis]


@kernel()
def _look(
    pieces: ProgramPieces,
    switch: Array,
    state: Array,
    along: FloatArray,
    kept: Kept,
    new: Chords,
    k: int,
    last: int,
    chord: tuple[float, float, float, float, float],
    columns: FloatArray,
    bounds: Bounds,
) -> None:
    """Which vertices, from the open one to `last`, the chord to sample k is a better place for."""
    first, at, before = state[OPEN], state[TAIL], 0.0
    if last < first:
        return
    _, step, h, cut, rounding = chord
    bow = bounds.acceleration * h * h / 8.0
    _put_ends(kept.ends[at], new.position, columns, k)
    for i in range(first, last + 1):
        _, _, apart = reach_chord(new.position[k - 1], new.position[k], pieces, i, 0.0)
        if cut >= 0.0 and before + max(apart - bow, 0.0) ** 2 < switch[i]["cost"]:
            apart, _, _, _ = nearest(pieces.vertex[i], kept.ends[at], cut, h)
        cost = before + apart * apart
        if pieces.joint[i]["stop"] and (
            step > 4.0 * bow + 2.0 * rounding or apart > bow + rounding + PLACE_ROUNDING
        ):
            cost += (RUN_THROUGH * pieces.joint[i]["budget"]) ** 2
        better = cost < switch[i]["cost"]
        if better:
            switch[i]["cost"] = cost
        kept.mark[state[USED] + i - first] = better
        before = switch[i]["cost"]
    # nearer than ever, and no other vertex: what was before does not matter
    if last == first and kept.mark[state[USED]]:
        at = state[HEAD] = 0
        _put_ends(kept.ends[at], new.position, columns, k)
        kept.mark[0], state[USED], along[SURE] = True, 0, chord[0]
    row = kept.chord[at]
    row["first"], row["count"], row["offset"] = first, last + 1 - first, state[USED]
    row["begin"], row["step"], row["h"], row["cut"], row["error"] = chord
    state[TAIL] = at + 1
    state[USED] += last + 1 - first


@kernel()
def _settle(
    pieces: ProgramPieces,
    switch: Array,
    state: Array,
    along: FloatArray,
    kept: Kept,
    last: int,
    bounds: Bounds,
) -> None:
    """The vertices up to `last` are passed where the chords so far have them, with those behind that were
    looked at; what has been judged stays."""
    first, at, head = state[OPEN], state[TAIL] - 1, state[HEAD]
    top = last
    while top + 1 < len(switch) - 1 and switch[top + 1]["cost"] < np.inf:
        top += 1
    for i in range(top, first - 1, -1):
        here = at
        while here >= state[HEAD]:
            row = kept.chord[here]
            behind = i - row["first"]
            if 0 <= behind < row["count"] and kept.mark[row["offset"] + behind]:
                break
            here -= 1
        if i <= last:
            switch[i]["place"], switch[i]["end"], switch[i]["begin"] = -1.0, 0.0, 0.0  # not seen
        if here < state[HEAD]:
            continue
        at = here
        if i > last:
            continue
        head = here if i == last else head
        row = kept.chord[here]
        found = nearest(pieces.vertex[i], kept.ends[here], row["cut"], row["h"])
        switch[i]["place"], switch[i]["chord"] = row["begin"] + found[1] * row["step"], here
        if pieces.piece[i - 1]["feed"] != pieces.piece[i]["feed"]:
            reach = reach_of(found, kept.ends[here], row["cut"], row["h"], bounds.acceleration, row["error"])
            switch[i]["end"] = reach + row["error"] + PLACE_ROUNDING
    spent = switch[last]["cost"]
    for i in range(first, last + 1):
        switch[i]["place"] = max(switch[i]["place"], along[SURE])
        switch[i]["group"] = 1
        _pool(pieces, switch, state, along[SURE], kept, first, i, bounds)
    for i in range(first, last + 1):
        place, reach = switch[i]["place"], switch[i]["end"]
        switch[i]["end"] = place + reach
        switch[i]["begin"] = max(place - reach, along[JUDGED])
        before = i - 1
        while before > 0 and switch[before]["begin"] > switch[i]["begin"]:
            switch[before]["begin"] = switch[i]["begin"]
            before -= 1
    along[SURE] = max(along[SURE], switch[last]["place"])
    i = last + 1
    while i < len(switch) and switch[i]["cost"] < np.inf and spent < np.inf:
        switch[i]["cost"] -= spent
        i += 1
    state[OPEN], state[HEAD] = last + 1, head


@kernel()
def _pool(
    pieces: ProgramPieces,
    switch: Array,
    state: Array,
    least: float,
    kept: Kept,
    first: int,
    i: int,
    bounds: Bounds,
) -> None:
    """Vertices from `first` on whose nearest places are not in order, i the last of them, are passed together, at `least` or
    further on, where the motion is nearest to the mean of them; of chords that is known to two of them."""
    n = i
    while n > first and switch[n]["place"] < switch[n - 1]["place"]:
        n -= switch[n - 1]["group"]
        weight, reach, here = 0.0, 0.0, switch[i]["chord"]
        for m in range(n, i + 1):
            firm = FIRM if pieces.joint[m]["stop"] else 1.0
            weight, reach = weight + firm, max(reach, switch[m]["end"])
            for axis in range(len(kept.work)):
                before = kept.work[axis] if m > n else 0.0
                kept.work[axis] = before + (pieces.vertex[m, axis] - before) * firm / weight
        found = _nearest_to_work(kept, here)
        for way in (-1, 1):
            while state[HEAD] <= here + way < state[TAIL]:
                other = _nearest_to_work(kept, here + way)
                if other[0] >= found[0]:
                    break
                here, found = here + way, other
        row = kept.chord[here]
        own = 2.0 * row["step"]
        if not math.isnan(row["cut"]):
            own = reach_of(found, kept.ends[here], row["cut"], row["h"], bounds.acceleration, row["error"])
        for m in range(n, i + 1):
            switch[m]["place"], switch[m]["chord"] = max(row["begin"] + found[1] * row["step"], least), here
            switch[m]["group"] = i + 1 - n
            switch[m]["end"] = max(reach, own + row["error"] + PLACE_ROUNDING)


@kernel(inline=True)
def _nearest_to_work(kept, at):
    """As `nearest` finds on the chord `at` the place that is worked with."""
    return nearest(kept.work, kept.ends[at], kept.chord[at]["cut"], kept.chord[at]["h"])
