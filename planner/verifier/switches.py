"""On which block the motion is: where it goes over from one to the next.

The motion is on the blocks in their order, and goes over from one to the next where it is nearest to the
vertex between them; on a straight line that is the vertex. Of several vertices that are within reach of each
other those places T_i, in order, count that are together nearest to them:

    least  sum_i |x(T_i) - V_i|^2,    T_1 <= T_2 <= ...,    |x(T_i) - V_i| <= eps_i

(as far as there are such places) over the chords of the motion, by dynamic programming over the vertices that each chord can be at
(matching.py). A vertex is settled once the motion cannot be on the block before it any more. A full stop is
passed where the motion rests.

Where the motion runs on cubics that is the place on them, known to rounding; where only its samples are known it is the place of
the chord, and known to a `reach` (nearest.py). So far from the switch a place belongs to both blocks, and the larger F counts. Of
vertices that are nearest out of order within one chord the place together counts.
"""

import math

import numpy as np

from planner.verifier.kernel import kernel
from planner.verifier.nearest import nearest, reach_with_rounding
from planner.verifier.passing import (
    CHORD,
    HEAD,
    JUDGED,
    OPEN,
    OUTSIDE,
    PASSED,
    PATIENCE,
    RUN_THROUGH,
    SURE,
    SWITCH,
    TAIL,
    TRAVELLED,
    USED,
    Bounds,
    Chords,
    Passing,
    nearer_soon,
    rounding_of,
)
from planner.verifier.pieces import PLACE_ROUNDING, ProgramPieces, out_of_reach, reach_chord

# How much more firmly the place of a full stop is held than others passed together with it [-].
FIRM = 1e9
ROOM = 4096  # chords and marks there is room for at first


class Switches:
    """Where a motion passes the vertices: `found`."""

    def __init__(self, pieces: ProgramPieces, bounds: Bounds):
        vertices, axes = pieces.vertex.shape
        switch = np.zeros(vertices, dtype=SWITCH)
        switch["cost"][1:] = np.inf
        whole = switch, np.array([1, 0, 0, 0, 0, 0], dtype=np.int64), np.zeros(3), np.zeros(axes)
        kept = np.zeros(ROOM, CHORD), np.zeros((ROOM, 2, 4, axes)), np.zeros(ROOM, np.bool_)
        self._pieces, self._bounds, self.found = pieces, bounds, Passing(*whole, *kept)

    def take(self, new: Chords, skip: int) -> None:
        """The next samples, from `skip` on; those before were given already. place and error of `new` are written here."""
        k = skip
        while k < len(new.t):
            k = _passed(self._pieces, self.found, new, k, self._bounds)
            if k < len(new.t):
                self._make_room()

    def finish(self) -> None:
        """No more samples: settle what was looked at."""
        seen = np.flatnonzero(np.isfinite(self.found.switch["cost"][:-1]))
        if len(seen) and seen[-1] >= self.found.state[OPEN]:
            self.found.state[PASSED] = seen[-1]
            _settle(self._pieces, self.found, self._bounds)

    def _make_room(self) -> None:
        """Leave out chords and marks not needed any more; twice the room where they are not half of them."""
        old, state = self.found, self.found.state
        head, tail = int(state[HEAD]), int(state[TAIL])
        begin = int(old.chord["offset"][head]) if tail > head else int(state[USED])
        used = int(state[USED]) - begin
        full = not (head or begin) or 2 * (tail - head) > len(old.chord) or 2 * used > len(old.mark)
        chord, ends, mark = (np.zeros(((1 + full) * len(c), *c.shape[1:]), c.dtype) for c in old[-3:])
        chord[: tail - head], ends[: tail - head] = old.chord[head:tail], old.ends[head:tail]
        mark[:used] = old.mark[begin : begin + used]
        chord["offset"][: tail - head] -= begin
        self.found = old._replace(chord=chord, ends=ends, mark=mark)
        state[HEAD], state[TAIL], state[USED] = 0, tail - head, used


@kernel()
def _passed(pieces, found, new, skip, bounds):
    """Take in the chords to the samples from `skip` on, and settle the vertices that they leave behind;
    places and errors into `new`. -> the first sample there was no room for, or their number"""
    switch, state, along = found.switch, found.state, found.along
    n, _, axes = new.state.shape
    look = ask = max(skip, 1)  # the chords before are not the nearest ones, or known to be looked at
    for k in range(skip, n):
        h = new.t[k] - new.t[k - 1] if k else 0.0
        step_sq, begin = 0.0, along[TRAVELLED]
        for axis in range(axes):
            step_sq += (new.state[k, 0, axis] - new.state[k - 1, 0, axis]) ** 2 if k else 0.0
        step, rounding = math.sqrt(step_sq), rounding_of(new, k, begin, bounds)
        last, gone = min(new.last[k] + 1, len(switch) - 2), min(new.first[k], len(switch) - 2)
        first = max(state[OPEN], state[PASSED] + 1)
        if k >= ask and first == state[OPEN] == last and gone < first:
            look, ask = nearer_soon(pieces, found, new, k, bounds)
        if state[TAIL] == len(found.chord) or state[USED] + max(last + 1 - first, 0) > len(found.mark):
            return k
        along[TRAVELLED] += step
        new.place[k], new.error[k] = along[TRAVELLED], rounding
        if step > 0.0 and k >= look:
            _look(pieces, found, new, k, last, (begin, step, h, new.cut[k], rounding), bounds)
        if (
            k
            and gone >= state[OPEN]
            and (gone > state[PASSED] or state[TAIL] - state[HEAD] > state[PATIENCE])
        ):
            state[PASSED] = max(gone, state[PASSED])
            _settle(pieces, found, bounds)
            state[PATIENCE] = 2 * (state[TAIL] - state[HEAD])
    return n


@kernel(inline=True)
def _put_ends(ends, new, k):
    """What is known of the samples k - 1 and k into `ends` (2, 4, A)."""
    for side in range(2):
        for order in range(new.state.shape[1]):
            for axis in range(new.state.shape[2]):
                ends[side, order, axis] = new.state[k - 1 + side, order, axis]


@kernel(inline=True)
def _look(pieces, found, new, k, last, chord, bounds):
    """Which vertices, from the open one to `last`, the chord to sample k is a better place for."""
    switch, state, along = found.switch, found.state, found.along
    first, at = max(state[OPEN], state[PASSED] + 1), state[TAIL]
    if last < first:
        return
    before = switch[first - 1]["cost"] if first > state[OPEN] else 0.0
    _, step, h, cut, rounding = chord
    bow = bounds.acceleration * h * h / 8.0
    for i in range(first, last + 1):
        _, _, apart = reach_chord(new.state[k - 1, 0], new.state[k, 0], pieces, i, 0.0)
        if cut >= 0.0 and before + max(apart - bow, 0.0) ** 2 < switch[i]["cost"]:
            apart, _, _, _ = nearest(pieces.vertex[i], new.state[k - 1 : k + 1], cut, h)
        outside = max(apart - bow, 0.0) ** 2 - pieces.joint[i]["budget"] ** 2
        cost = before + apart * apart + OUTSIDE * max(outside, 0.0)
        if pieces.joint[i]["stop"] and (
            step > 4.0 * bow + 2.0 * rounding or apart > bow + rounding + PLACE_ROUNDING
        ):
            cost += (RUN_THROUGH * pieces.joint[i]["budget"]) ** 2
        better = cost < switch[i]["cost"]
        if better:
            switch[i]["cost"] = cost
        found.mark[state[USED] + i - first] = better
        before = switch[i]["cost"]
    # nearer than ever, and no other vertex: what was before does not matter
    if last == state[OPEN] and found.mark[state[USED]]:
        at = state[HEAD] = 0
        found.mark[0], state[USED], along[SURE] = True, 0, chord[0]
    _put_ends(found.ends[at], new, k)
    row = found.chord[at]
    row["first"], row["count"], row["offset"] = first, last + 1 - first, state[USED]
    row["begin"], row["step"], row["h"], row["cut"], row["error"] = chord
    state[TAIL] = at + 1
    state[USED] += last + 1 - first


@kernel(inline=True)
def _latest(found, i, at):
    """The last chord up to `at` that is a better place for vertex i than all before it, -1 where there is none."""
    while at >= found.state[HEAD]:
        row = found.chord[at]
        behind = i - row["first"]
        if 0 <= behind < row["count"] and found.mark[row["offset"] + behind]:
            return at
        at -= 1
    return -1


@kernel()
def _settle(pieces, found, bounds):
    """Settle the vertices that are passed, up to the first one of which the place still depends on how the motion goes on; what has
    been judged stays.

    However that is, it is on a piece after the last vertex that is passed or on a later one: the place is the same whichever it is
    where it is the same for the first and for the last of these pieces that there can be, since the more vertices are passed
    until now, the earlier all of them are. Vertices whose places are not in order are settled together.
    """
    switch, state, along = found.switch, found.state, found.along
    first, last, at = state[OPEN], state[PASSED], state[TAIL] - 1
    top = last
    while top + 1 < len(switch) - 1 and switch[top + 1]["cost"] < np.inf:
        top += 1
    for i in range(top, first - 1, -1):
        here = _latest(found, i, at)
        switch[i]["chord"], at = here, here if here >= 0 else at
    at = state[TAIL] - 1
    while last >= first:
        here = _latest(found, last, at)
        if here == switch[last]["chord"]:
            break
        last, at = last - 1, here if here >= 0 else at
    i = first
    while i <= last or (first <= last and i <= top and _begin(found, i) <= switch[i - 1]["place"]):
        here = switch[i]["chord"]
        switch[i]["place"], switch[i]["end"], switch[i]["group"] = along[SURE], 0.0, 1  # where it is not seen
        if here >= 0:
            row = found.chord[here]
            near = nearest(pieces.vertex[i], found.ends[here], row["cut"], row["h"])
            switch[i]["place"] = max(row["begin"] + near[1] * row["step"], along[SURE])
            if pieces.piece[i - 1]["feed"] != pieces.piece[i]["feed"]:
                switch[i]["end"] = reach_with_rounding(near, found.ends[here], row, bounds.acceleration)
            _pool(pieces, found, first, i, bounds)
        i += 1
    seen = i
    while last >= first and last + 1 < seen and switch[last]["place"] >= switch[last + 1]["place"]:
        last -= 1
    if last >= first:
        _keep(found, first, last, top)


@kernel(inline=True)
def _begin(found, i):
    """Where the chord begins on which vertex i is."""
    return found.chord[found.switch[i]["chord"]]["begin"] if found.switch[i]["chord"] >= 0 else np.inf


@kernel()
def _keep(found, first, last, top):
    """The vertices from `first` to `last` are settled, those up to `top` not yet."""
    switch, state, along = found.switch, found.state, found.along
    for i in range(first, last + 1):
        place, reach = switch[i]["place"], switch[i]["end"]
        switch[i]["end"] = place + reach
        switch[i]["begin"] = max(place - reach, along[JUDGED])
        before = i - 1
        while before > 0 and switch[before]["begin"] > switch[i]["begin"]:
            switch[before]["begin"] = switch[i]["begin"]
            before -= 1
    along[SURE] = max(along[SURE], switch[last]["place"])
    spent = switch[last]["cost"]
    for i in range(last + 1, top + 1):
        switch[i]["cost"] -= spent
    state[OPEN], state[HEAD] = last + 1, max(state[HEAD], switch[last]["chord"])


@kernel()
def _pool(pieces, found, first, i, bounds):
    """Vertices from `first` on whose nearest places are not in order, i the last of them, are passed together,
    where the motion is nearest to the mean of them, within reach of all; of chords that is known to two of them.
    How well single places are known does not matter on cubics: they are ends of chords where they are out of order."""
    switch, state, work, n = found.switch, found.state, found.work, i
    while n > first and switch[n - 1]["chord"] >= 0 and switch[n]["place"] <= switch[n - 1]["place"]:
        n -= switch[n - 1]["group"]
        weight, reach, here = 0.0, 0.0, switch[i]["chord"]
        for m in range(n, i + 1):
            firm = FIRM if pieces.joint[m]["stop"] else 1.0
            weight, reach = weight + firm, max(reach, switch[m]["end"])
            for axis in range(len(work)):
                before = work[axis] if m > n else 0.0
                work[axis] = before + (pieces.vertex[m, axis] - before) * firm / weight
        near = nearest(work, found.ends[here], found.chord[here]["cut"], found.chord[here]["h"])
        edge = 0.0
        for way in (-1, 1):
            while state[HEAD] <= here + way < state[TAIL]:
                row = found.chord[here + way]
                other = nearest(work, found.ends[here + way], row["cut"], row["h"])
                if other[0] >= near[0]:
                    break
                if out_of_reach(pieces, n, i, found.ends[here + way, :, 0]):
                    edge = row["step"]
                    break
                here, near = here + way, other
        row = found.chord[here]
        own = reach_with_rounding(near, found.ends[here], row, bounds.acceleration) + edge
        if math.isnan(row["cut"]):
            own = max(reach, 2.0 * row["step"])
        for m in range(n, i + 1):
            switch[m]["place"] = max(row["begin"] + near[1] * row["step"], found.along[SURE])
            switch[m]["chord"], switch[m]["group"], switch[m]["end"] = here, i + 1 - n, own
