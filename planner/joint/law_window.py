"""What a search is told of the laws of a run (own_laws.py): the rows of its kernels (laws.py), for the steps of
a window.

Along the path the rows are exact, and the bounds are functions of the place; of a function q of the position
rows have the first and the second derivative at the nodes of a motion, and the third one along it, exact too
(base/series.py). Before a window is searched both are asked for along the motion that it begins with; bounds
go on straight between the ends of a step, and along it. Where what is found exceeds the functions themselves,
the window is searched once more from there, told of its places; that is seldom more than once, as the motion
hardly slides along itself any more. To let the kernel call the functions would take an evaluation in every
iteration, some 25 of them, where the result needs two.

Rows are there in windows in which a law is used by `NEAR` of it or more: one that is never near costs one look
at the beginning and one at the end.

Where a bound jumps from one place to the next, a node is laid there, and a row keeps it on its side (`PIN`).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint import laws as rows
from planner.joint.guess import CutMotion, Guess
from planner.joint.laws import LawRows
from planner.joint.own_laws import JOINT, RunLaws, Where, motion_at

NEAR = 0.8  # share of a limit from which a window gets its rows [-]
# Of a step, how far inside its ends their bounds are asked for: beside a place where they jump [-].
INSIDE = 1e-3
# Change of a bound from one end of a step to the other that is a jump, share of the larger; between two places
# it is found by so many halvings of the step [-].
JUMP, HALVINGS = 0.3, 30
THERE = 0.01  # of a step: a jump so near to a node is at it [-]
FAR = 1e6  # of a mean step's speed, acceleration and so on: instead of no bound [-]
TOLD_LEAST = 0.3  # share of the way by which what is told of chords changes at least [-]
SMALLEST = np.finfo(np.float64).tiny


class Window(CutMotion):
    """The steps of a window, and those beside it, of a cut motion (guess.py), as a copy.

    leg, h, state, place : as of that; of the steps beside it, which may be found meanwhile, only the legs are
                           read, and their h is 0
    lo, hi               : the steps of the window are lo .. hi - 1 of these
    rest                 : (hi - lo + 1, A + 1) what chords are off at its nodes beside their sag (problem.py), and how much less
                           room they have at vertices [mm]; None where nothing is known
    """

    def __init__(self, cut: CutMotion | Guess, lo: int, hi: int, rest: FloatArray | None = None):
        self.rest, self._off, self._share = rest, np.zeros(0), 1.0
        begin, end = max(lo - 1, 0), min(hi + 1, len(cut))
        self.leg, self.h = cut.leg[begin:end], cut.h[begin:end].copy()
        self.state, self.place = cut.state[begin : end + 1].copy(), cut.place[begin:end].copy()
        self.lo, self.hi = lo - begin, hi - begin
        self.h[: self.lo] = self.h[self.hi :] = 0.0

    def tell(self, rest: FloatArray) -> None:
        """Take in what chords of the motion found are off, `rest` (N+1, A + 1) of the class text: by a share of the way there
        from what was told before, as what is found with it may overshoot again and again (Aitken 1926; Irons and Tuck 1969)."""
        if self.rest is None:
            self.rest = rest
            return
        off = rest - self.rest
        if len(self._off) and (change := off - self._off).any():
            share = -self._share * (self._off * change).sum() / (change**2).sum()
            self._share = min(max(float(share), TOLD_LEAST), 1.0)
        self._off, self.rest = off, self.rest + self._share * off

    def seen(self, step: Array, t: FloatArray) -> tuple[Where, FloatArray]:
        """Where steps `step` (n,) are at the times t (n,) after their beginning, and their motion (n, 4, A)."""
        h = self.h[step]
        jerk = (self.state[step + 1, 2] - self.state[step, 2]) / h[:, None]
        along = self.place[step, 0] + (self.place[step, 3] - self.place[step, 0]) * t / h
        return Where(self.leg[step], along), motion_at(self.state[step], jerk, t)

    def put(self, h: FloatArray, state: FloatArray, place: FloatArray) -> None:
        """Another motion in the window: h (N,), state (N+1, 3, A), place (N, 3) along the run [mm]."""
        lo, hi = self.lo, self.hi
        self.h[lo:hi], self.state[lo : hi + 1], self.place[lo:hi, :3] = h, state, place
        self.place[lo : hi - 1, 3] = self.place[lo + 1 : hi, 0]

    def moved(self, node: int, t: float, state: FloatArray, along: float) -> None:
        """Put a node elsewhere: to a time after the first node, its state (3, A) and place there."""
        end = self.h[: node + 1].sum()
        self.h[node - 1] = t - self.h[: node - 1].sum()
        self.h[node] = end - t
        self.state[node] = state
        self.place[node - 1] = np.linspace(self.place[node - 1, 0], along, 4)
        self.place[node] = np.linspace(along, self.place[node, 3], 4)


def near(laws: RunLaws, window: Window) -> Array:
    """(M,) which laws a window needs: those that its motion is near to, and the feed."""
    if not len(laws):
        return np.zeros(0, dtype=bool)
    steps = np.arange(window.lo, window.hi)
    most = np.zeros(len(laws))
    for part in (INSIDE, 0.5, 1.0 - INSIDE):
        most = np.maximum(most, laws.shares(*window.seen(steps, part * window.h[steps])).max(axis=0))
    words = [law.limit is None and law.kind == rows.SPEED for law in laws.laws]
    return (most > NEAR) | np.array(words, dtype=bool)


class Units(NamedTuple):
    """Of the problem: time [s], length [mm], and where positions are counted from (A,) [mm]."""

    second: float
    length: float
    origin: FloatArray


def law_rows(
    laws: RunLaws, window: Window, which: Array, narrow: FloatArray, units: Units
) -> tuple[LawRows, Array]:
    """What the search is told of the laws `which` (M,), and (N, rows) which rows there are.

    narrow : (N, M) by what their bounds are multiplied [-]
    """
    lo, hi, axes, many = window.lo, window.hi, window.state.shape[2], window.hi - window.lo
    if not len(which):
        return _no_laws(many, axes), np.empty((many, 0), dtype=bool)
    kind = laws.kinds(which, window.state[lo])
    pin, pinned = _pin(laws, window, which, units)
    steps = np.arange(lo, hi)
    ends = [
        laws.bounds(*window.seen(steps, part * window.h[steps]), which)
        for part in (INSIDE, 0.5, 1.0 - INSIDE)
    ]
    state = window.state[lo : hi + 1]
    of_limit = {
        id(laws.laws[m].limit): laws.laws[m].limit for m, k in zip(which, kind, strict=True) if k in JOINT
    }
    models = [laws.model(limit, state) for limit in of_limit.values() if limit is not None]
    second, length = units.second, units.length
    joint = np.zeros(len(which), dtype=np.int64)
    scale, far = np.empty(len(which)), np.full(len(which), FAR)
    for column, (m, one) in enumerate(zip(which, kind, strict=True)):
        law = laws.laws[m]
        if one == rows.POWER:
            scale[column] = second**3 / length**2
        elif one in JOINT:
            joint[column] = list(of_limit).index(id(law.limit))
            scale[column] = second**law.order
            far[column] *= max(float(np.abs(models[joint[column]][0]).max()) * length, SMALLEST)
        else:
            scale[column] = second**law.order / length
    free = np.isinf(ends).all(axis=0)
    begin, middle, end = (np.minimum(bound * scale, far) for bound in ends)
    chord = np.diff(state[:, 0], axis=0)
    square = np.maximum((chord**2).sum(axis=1), SMALLEST)
    rises = np.log(end / begin)
    jumps = np.abs(np.minimum(begin, end) / np.maximum(begin, end) - 1.0) > JUMP
    least, dips = np.minimum(np.minimum(begin, end), middle), np.minimum(2.0 * middle / (begin + end), 1.0)
    begin, end = np.where(jumps, least, dips * begin), np.where(jumps, least, dips * end)
    tilt = np.where(jumps, 0.0, rises)[:, :, None] * (chord * length / square[:, None])[:, None, :]
    begin, end = begin * narrow, end * narrow
    speed = (state[:, 1] ** 2).sum(axis=1)[:, None]
    heading = np.divide(
        state[:, 1] * length / second, speed, out=np.zeros_like(state[:, 1]), where=speed > 0.0
    )
    one = np.ones((many, 1))  # the column of `PIN`
    kind = np.append(kind, rows.PIN)
    counts = np.array([*(laws.laws[m].counts for m in which), np.zeros(axes)])
    begin, end = np.hstack([begin, one]), np.hstack([end, one])
    first = np.append(0, np.cumsum(np.array(rows.ROWS_OF)[kind]))
    found = LawRows(
        kind=kind,
        first=first,
        counts=counts,
        node=np.minimum(begin, np.vstack([begin[:1], end[:-1]])),
        begin=begin,
        end=end,
        tilt=np.concatenate([tilt, np.zeros((*one.shape, axes))], axis=1),
        at=(state[:, 0] - units.origin) / length,
        joint=np.append(joint, 0),
        gradient=_stacked([model[0] for model in models], (many + 1, axes)) * length,
        bend=_stacked([model[1] for model in models], (many + 1, axes, axes)) * length**2,
        convex=_stacked([_convex(model[1]) for model in models], (many + 1, 2, axes, axes), 2) * length**2,
        third=_stacked([model[2] for model in models], (many + 1,)) * second**3,
        heading=heading,
        pin=pin,
        pinned=pinned,
    )
    return found, _present(found, window, np.hstack([free, ~one.astype(bool)]))


def _no_laws(many: int, axes: int) -> LawRows:
    """Of `many` steps."""
    none, nodes = np.empty((many, 0)), many + 1
    return LawRows(
        kind=np.empty(0, dtype=np.int64),
        first=np.zeros(1, dtype=np.int64),
        counts=np.empty((0, axes)),
        node=none,
        begin=none,
        end=none,
        tilt=np.empty((many, 0, axes)),
        at=np.zeros((nodes, axes)),
        joint=np.zeros(1, dtype=np.int64),
        gradient=np.empty((nodes, 0, axes)),
        bend=np.empty((nodes, 0, axes, axes)),
        convex=np.empty((nodes, 2, 0, axes, axes)),
        third=np.empty((nodes, 0)),
        heading=np.zeros((nodes, axes)),
        pin=np.zeros((many, axes)),
        pinned=np.zeros(many),
    )


def _stacked(models: list[FloatArray], shape: tuple[int, ...], at: int = 1) -> FloatArray:
    """(n, Q, ..) of Q models (n, ..); Q as the axis `at`."""
    return np.stack(models, axis=at) if models else np.empty((*shape[:at], 0, *shape[at:]))


def _convex(bend: FloatArray) -> FloatArray:
    """(n, 2, A, A) what is positive of symmetric matrices (n, A, A), and of these times -1."""
    values, vectors = np.linalg.eigh(bend)
    parts = np.stack([np.maximum(values, 0.0), np.maximum(-values, 0.0)], axis=1)
    return np.einsum("nka,nsa,nca->nskc", vectors, parts, vectors)


def _present(laws: LawRows, window: Window, free: Array) -> Array:
    """(N, rows) which rows there are, not where laws are `free` (N, M). The first node stays: of it nothing
    is asked. From rest and to rest those of `PUSH` are 0 for every motion, and of `JOLT` there is no
    direction."""
    on = np.ones((window.hi - window.lo, laws.first[-1]), dtype=bool)
    lo, hi, steps = window.lo, window.hi, len(window)
    begins, ends = (node in (0, steps) and not window.state[node, 1].any() for node in (lo, hi))
    vertex = np.diff(window.leg[lo:hi], prepend=window.leg[max(lo - 1, 0)]) > 0
    for m, kind in enumerate(laws.kind):
        own = on[:, laws.first[m] : laws.first[m + 1]]
        if kind == rows.PIN:
            own[:, 0] = laws.pin.any(axis=1)
        elif kind == rows.SPEED:
            before = np.append(np.inf, laws.end[:-1, m])
            own[:, 0] = vertex | (laws.begin[:, m] < before)
            own[-1, 4] = False
        elif kind in (rows.PUSH, rows.POWER):
            own[0, ::3] = False
            if begins and kind == rows.PUSH:
                own[0] = False
            if ends and kind == rows.PUSH:
                own[-1] &= np.arange(6) % 3 == 0
        elif kind == rows.JOLT:
            if begins:
                own[0, :2] = False
            if ends:
                own[-1, -2:] = False
        elif kind != rows.JOINT_JOLT:
            own[0, :2] = False
        own[free[:, m]] = False
    on[0, laws.first[:-1][laws.kind == rows.SPEED]] = False
    return on


def _pin(laws: RunLaws, window: Window, which: Array, units: Units) -> tuple[FloatArray, FloatArray]:
    """Put nodes of the window where bounds jump. Their rows n.p <= n.P: n (N, A), n.P (N,); 0 elsewhere."""
    lo, hi = window.lo, window.hi
    pin, pinned = np.zeros((hi - lo, len(laws.axis))), np.zeros(hi - lo)
    ends = np.cumsum(window.h)
    begins = ends - window.h

    def of(t: FloatArray) -> tuple[Array, FloatArray]:
        step = np.minimum(np.searchsorted(ends, t, side="right"), len(ends) - 1)
        return step, np.clip(t - begins[step], 0.0, None)

    def values(t: FloatArray) -> FloatArray:
        return laws.bounds(*window.seen(*of(t)), which)

    steps = np.repeat(np.arange(lo, hi), 2)
    times = begins[steps] + np.tile([INSIDE, 1.0 - INSIDE], hi - lo) * window.h[steps]
    bound = values(times)
    jumps = _jumps(bound[:-1], bound[1:])
    at = np.flatnonzero(jumps.any(axis=1))
    if not len(at):
        return pin, pinned
    column = np.argmax(jumps[at], axis=1)
    low, high, many = times[at], times[at + 1], np.arange(len(at))
    before, behind = bound[at, column], bound[at + 1, column]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        here = values(middle)[many, column]
        with np.errstate(divide="ignore", invalid="ignore"):  # on one side nothing may be limited
            nearer = np.abs(np.log(here / before)) <= np.abs(np.log(here / behind))
        first = nearer | (here == before)
        low, high = np.where(first, middle, low), np.where(first, high, middle)
    # what only rises or falls fast has no jump between two places so near to each other
    jumped = _jumps(values(low)[many, column], values(high)[many, column])
    rises = behind > before
    step, since = of(np.where(rises, high, low))
    where, motion = window.seen(step, since)
    for k in np.flatnonzero(jumped):
        node, way = _node_for(window, int(step[k]), float(since[k]), pin), motion[k, 1]
        if node < 0 or not way.any():
            continue
        window.moved(node, float(begins[step[k]] + since[k]), motion[k, :3], float(where.along[k]))
        way = way / np.linalg.norm(way) * (-1.0 if rises[k] else 1.0)
        pin[node - lo], pinned[node - lo] = way, way @ (motion[k, 0] - units.origin) / units.length
    return pin, pinned


def _node_for(window: Window, step: int, since: float, pin: FloatArray) -> int:
    """The node next to a time in a step that may be laid there; -1 for none, as where there is one that stays."""

    def off(node: int) -> float:
        return abs((node - step) - since / float(window.h[step]))

    free = [
        node
        for node in (step, step + 1)
        if window.lo < node < window.hi
        and window.leg[node] == window.leg[node - 1]
        and not pin[node - window.lo].any()
    ]
    nearest = min((step, step + 1), key=off)
    if nearest not in free and off(nearest) < THERE:
        return -1
    return min(free, key=off, default=-1)


def _jumps(one: FloatArray, other: FloatArray) -> Array:
    """Where bounds are so far apart that they jump."""
    with np.errstate(invalid="ignore"):
        apart = np.minimum(one, other) < (1.0 - JUMP) * np.maximum(one, other)
    return np.asarray(apart)
