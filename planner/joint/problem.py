"""The problem of a window of steps in numbers: units in which the mean step has length 1 and duration 1, and
what every step keeps."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint import row_kinds as rows
from planner.joint.guess import CutMotion, Guess
from planner.joint.law_window import Units, Window, law_rows, near
from planner.joint.laws import LawRows
from planner.joint.legs import LegFormulas
from planner.joint.nlp import LONGER
from planner.joint.normal_rows import turns_far
from planner.joint.numbers import CENTRE, jerk_weights, narrowed, pace
from planner.joint.row_kinds import StepLimits
from planner.joint.run import TubeRun
from planner.joint.switches import Beside, no_rows_beside

# Limits are narrowed by so many times what a row may be missed by [-], so that this and the closing jerks
# stay inside them.
NARROWED = 2.0
# Of the largest length of a step on an arc [-]: h (v + a h/2) stands for it, which leaves out h3 j/6.
STEP_SHARE = 0.95
# Of the sag of chords that rows know, where they are told the rest [-]: the middle of a chord sees cos(w tau) of a wave
# exp(i w t), tau = dt/2, and rows 1 - SEEN (w tau)^2/2. With this both are 0 at w tau = pi/2, their ratio is between 0 and 1 up to
# 3 pi/2, and what is told comes to rest; with 1 it does not between 1.33 and 1.57.
SEEN = 8.0 / np.pi**2
# The rest is of the durations at which it was found: instead of `LONGER` [-]. With that windows go on to the last iteration, or
# end where chords are farther off than before.
LONGER_TOLD = 2.0
# What chords leave of the room of a node at a vertex at least [-].
LEAST_ROOM = 0.2


class StepWindow(NamedTuple):
    """The steps of a window, and where its search begins; S = 3 A, C = A + 1."""

    legs: LegFormulas
    limits: StepLimits
    x: FloatArray  # (N+1, S) position from the first node, velocity, acceleration of the nodes; the first and the last one stay
    u: FloatArray  # (N, C) jerk and duration
    place: FloatArray  # (N, 6) of the node and the inner control points along the leg, of both sets
    second: float  # unit of time [s]
    length: float  # unit of length [mm]
    origin: FloatArray  # (A,) [mm]
    which: Array  # of the run's laws, those that have rows

    def nodes(self) -> FloatArray:
        """(N+1, 3, A) position, velocity and acceleration [mm, s]."""
        state = self.x.reshape(len(self.x), 3, -1) * (self.length / self.second ** np.arange(3)[:, None])
        state[:, 0] += self.origin
        return state


def window_of(
    run: TubeRun,
    guess: CutMotion | Guess,
    lo: int,
    hi: int,
    missed: float,
    tight: FloatArray | None = None,
    smooth: float = 0.0,
    which: Array | None = None,
    beside: Beside | None = None,
    rest: FloatArray | None = None,
) -> StepWindow:
    """The steps lo .. hi - 1 of a guess, in the units of their mean.

    missed : by how much rows may be missed at the end [-]
    tight  : (hi - lo, 1 + M) by what the room of control points and the laws are divided [-], >= 1; None for 1
    smooth : weight of the jerk against the time at least [-] (numbers.py)
    which  : of the laws, those that have rows; None for those that the guess is near to
    beside : nodes beside a vertex where the feed changes, and places that stand for one
    rest   : of `Window`; None for 0
    """
    cut = Window(guess, lo, hi)
    part, leg = slice(cut.lo, cut.hi), cut.leg[cut.lo : cut.hi]
    second = float(cut.h[part].mean())
    length = float(np.abs(np.diff(cut.state[cut.lo : cut.hi + 1, 0], axis=0)).sum() / len(leg))
    speed, acc, jerk = length / second, length / second**2, length / second**3
    # far from it, gaps of the kinematics would not get below the rounding of positions
    units = Units(second, length, cut.state[cut.lo, 0].copy())
    of = slice(int(leg[0]), int(leg[-1]) + 1)
    inside = 1.0 - NARROWED * missed
    tight = np.ones((len(leg), 1 + len(run.laws))) if tight is None else tight
    which = np.flatnonzero(near(run.laws, cut)) if which is None else which
    laws = law_rows(run.laws, cut, which, inside / tight[:, 1 + which], units)
    state, h = cut.state[cut.lo : cut.hi + 1], cut.h[part]
    x = np.concatenate(
        [(state[:, 0] - units.origin) / length, state[:, 1] / speed, state[:, 2] / acc], axis=1
    )
    jerks = np.diff(state[:, 2], axis=0) / h[:, None]
    place = np.tile((cut.place[part, :3] - run.offset[leg][:, None]) / length, rows.SETS)
    beside = no_rows_beside(len(leg), len(run.axis)) if beside is None else beside
    sag, longer = (run.sag, LONGER) if rest is None else (SEEN * run.sag, LONGER_TOLD)
    rest = np.zeros((len(leg) + 1, len(run.axis) + 1)) if rest is None else rest / length
    rest, less = rest[:, :-1], rest[:-1, -1]
    limits = _limits(run, cut, units, (missed, tight), laws, smooth, beside)
    return StepWindow(
        legs=_legs(run, of, units),
        limits=limits._replace(
            leg=leg - of.start,
            sag=np.array([0.0, sag / second**2]),
            rest=np.stack([rest[:-1], rest[1:]], axis=1),
            room_node=np.maximum(limits.room_node - less, LEAST_ROOM * limits.room_node),
            h_max=limits.h * longer,
            h_min=limits.h / longer,
        ),
        x=x,
        u=np.column_stack([jerks / jerk, h / second]),
        place=np.ascontiguousarray(place),
        second=second,
        length=length,
        origin=units.origin,
        which=which,
    )


def _legs(run: TubeRun, of: slice, units: Units) -> LegFormulas:
    """The legs `of` a run alone: what a window takes does not depend on the length of its run."""
    length, curve = units.length, run.curve[of]
    curves = curve[curve >= 0]
    first, end = (int(curves.min()), int(curves.max()) + 1) if len(curves) else (0, 0)
    return LegFormulas(
        length=run.length[of] / length,
        base=(run.base[of] - units.origin) / length,
        drift=run.drift[of],
        e1=run.e1[of],
        e2=run.e2[of],
        radius=run.radius[of] / length,
        rate=run.rate[of] * length,
        curve=np.where(curve >= 0, curve - first, -1),
        points=(run.curves.points[first:end] - units.origin) / length,
        weight=run.curves.weight[first:end],
    )


def _limits(
    run: TubeRun,
    cut: Window,
    units: Units,
    narrow: tuple[float, FloatArray],
    laws: tuple[LawRows, Array],
    smooth: float,
    beside: Beside,
) -> StepLimits:
    """The limits of the steps of a window, narrowed, smooth and beside as in `window_of`; `laws`: their rows, and which there
    are."""
    second, length = units.second, units.length
    speed, acc, jerk = length / second, length / second**2, length / second**3
    lo, hi = cut.lo, cut.hi
    leg = cut.leg[lo:hi]
    before = cut.leg[lo - 1] if lo else -1
    at_vertex = np.diff(leg, prepend=before) > 0
    room = narrowed(run, run.room[leg])
    room_node = room.copy()
    vertex = leg[at_vertex & (leg > 0)]
    at_both = np.minimum(run.room[vertex - 1], run.room[vertex])
    room_node[at_vertex & (leg > 0)] = narrowed(run, np.minimum(run.vertex_budget[vertex], at_both))
    fastest, strongest = np.linalg.norm(run.velocity), np.linalg.norm(run.acceleration)
    feed = np.minimum(run.feed[leg], fastest)
    inside = 1.0 - NARROWED * narrow[0]
    normal = np.minimum(run.across_max[leg], strongest)
    room, room_node = room / narrow[1][:, 0], room_node / narrow[1][:, 0]
    axes = np.stack(
        [run.jerk_scale / jerk, run.acceleration / acc, run.velocity / speed, run.velocity / speed]
    )
    h = cut.h[lo:hi] / second
    curved = run.curvature[leg] > 0
    on = _present(run, leg, at_vertex)
    for step, node in (
        (0, lo),
        (-1, hi),
    ):  # where a run is at rest, the middle ordinates of the velocity and of a x v are 0 for every motion
        if node in (0, len(cut)) and not cut.state[node, 1].any():
            more = on[step, 8 * len(run.axis) :]
            more[rows.ORDER_MID] = more[rows.NORMAL_ROWS : rows.LAW_ROWS] = False
    passed = run.passed[leg]
    on[np.ix_(passed, 8 * len(run.axis) + np.array([rows.ORDER_NODE, rows.ORDER_MID, rows.ARC]))] = False
    turns = turns_far(cut.state[lo : hi + 1, 1]) & np.isfinite(run.across_max[leg])
    at_both = np.minimum(np.append(normal[0], normal[:-1]), np.append(normal[1:], normal[-1]))
    normal[turns] = np.minimum(normal, at_both)[turns]  # of both its nodes
    turns[[0, -1]] &= np.linalg.norm(cut.state[[lo, hi], 2], axis=1) <= normal[[0, -1]]  # those nodes stay
    more = on[:, 8 * len(run.axis) :]
    more[turns, rows.NORMAL_ROWS : rows.LAW_ROWS] = True
    more[0, rows.NORMAL_ROWS] &= ~turns[0]
    more[-1, rows.NORMAL_ROWS + 1] &= ~turns[-1]
    more[turns | np.append(False, turns[:-1]), rows.NORMAL_NODE] = False
    near_by = beside.leg >= 0
    of_switch = np.where(near_by, beside.leg, np.where(at_vertex & (run.switch[leg] != 0.0), leg, -1))
    switch_at = np.where(near_by[:, None], beside.at, run.vertex[leg])
    more[:, rows.SWITCH] = of_switch >= 0
    more[0, rows.SWITCH] = False
    own_pace = pace(cut.state[lo : hi + 1, 1])
    side = (
        np.where(beside.again, run.switch[of_switch], 0.0)[:, None] * cut.state[lo:hi, 1] / own_pace[:, None]
    )
    more[:, rows.SIDE] = more[:, rows.SWITCH] & beside.again
    return StepLimits(
        leg=leg,
        passed=passed,
        target=(_targets(run, leg, np.flatnonzero(passed), cut.place[lo:hi]) - units.origin) / length,
        at_vertex=at_vertex,
        on=np.hstack([on, laws[1]]),
        box=axes * inside,
        room=room / length,
        room_node=room_node / length,
        sag=np.empty(0),
        rest=np.empty((0, 2, len(run.axis))),
        feed=feed * inside / speed,
        feed_node=np.minimum(feed, np.append(feed[0], feed[:-1])) * inside / speed,
        normal=normal * inside / acc,
        normal_node=np.minimum(normal, np.append(normal[0], normal[:-1])) * inside / acc,
        turns=turns,
        laws=laws[0],
        step_max=STEP_SHARE * np.where(curved, np.minimum(run.step_max[leg], run.offset[-1]), 1.0) / length,
        pace=own_pace / speed,
        h=h,
        h_max=np.empty(0),
        h_min=np.empty(0),
        switch=np.where(of_switch >= 0, run.switch[of_switch], 0.0),
        switch_at=(switch_at - units.origin) / length,
        side=side,
        smooth=jerk_weights(run, leg, cut.state[lo : hi + 1, 1], smooth),
        centre=np.full(hi - lo, CENTRE),
        aside=NARROWED * narrow[0],
    )


def _targets(run: TubeRun, leg: Array, of: Array, place: FloatArray) -> FloatArray:
    """(N, 3, A) where the nodes and the inner control points of the steps `of` (n,), whose legs are passed, belong
    to: at the places (N, 4) along the run [mm]."""
    targets: FloatArray = np.zeros((len(leg), 3, len(run.axis)))
    if not len(of):
        return targets
    local = place[of] - run.offset[leg[of]][:, None]
    for c, (node, sign) in enumerate(((0, 0.0), (0, 1.0), (3, -1.0))):
        third = sign * (local[:, 3] - local[:, 0])[:, None] / 3.0
        targets[of, c] = run.points(leg[of], local[:, node]) + third * run.tangents(leg[of], local[:, node])
    return targets


def _present(run: TubeRun, leg: Array, at_vertex: Array) -> Array:
    """(N, R) the rows that there are, but for those of the laws; those of the first node are not asked for, it
    stays."""
    axes = len(run.axis)
    on = np.ones((len(leg), rows.count(axes)), dtype=bool)
    more = on[:, 8 * axes :]
    on[:, : 2 * axes] = np.isfinite(run.jerk).all()
    # a feed that is no less than the axes can be together leaves the axes' own limits, which are all there is
    fed = (run.feed[leg] < np.linalg.norm(run.velocity)).any()
    on[:, 4 * axes : 8 * axes] = not fed or (run.feed[leg] > run.velocity.min()).any()
    more[:, rows.FEED_NODE : rows.TUBE_NODE] = fed
    more[at_vertex, rows.ORDER_NODE] = False
    more[run.curvature[leg] == 0, rows.ORDER_NODE : rows.NORMAL_NODE] = False
    limited = np.isfinite(run.across_max[leg])
    more[~limited, rows.NORMAL_NODE] = False
    more[~limited, rows.NORMAL_ROWS : rows.LAW_ROWS] = False
    more[run.curvature[leg] == 0, rows.ARC] = False
    on[0, 2 * axes : 4 * axes] = on[0, 6 * axes : 8 * axes] = False
    at_node = rows.FEED_NODE, rows.TUBE_NODE, rows.TUBE_NODE + 3, rows.ORDER_NODE, rows.NORMAL_NODE
    more[0, at_node] = False
    return on
