"""The problem of a window of steps in numbers: units in which the mean step has length 1 and duration 1, and
what every step keeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint import rows
from planner.joint.guess import CutMotion
from planner.joint.legs import LegFormulas
from planner.joint.nlp import LONGER, LONGER_WATCHED
from planner.joint.numbers import CENTRE, ROUNDING, jerk_weights, pace
from planner.joint.rows import StepLimits
from planner.joint.run import TubeRun
from planner.joint.state_limits import ROWS, WORD_ROWS

# Limits are narrowed by so many times what a row may be missed by [-], so that this and the closing jerks
# stay inside them.
NARROWED = 2.0
# Of the largest length of a step on an arc [-]: h (v + a h/2) stands for it, which leaves out h3 j/6.
STEP_SHARE = 0.95


class StepWindow(NamedTuple):
    """The steps of a window, and where its search begins; S = 3 A, C = A + 1."""

    legs: LegFormulas
    limits: StepLimits
    x: FloatArray  # (N+1, S) position from the first node, velocity, acceleration of the nodes; the first and the last one stay
    u: FloatArray  # (N, C) jerk and duration
    place: FloatArray  # (N, 3) of the node and the inner control points along the leg
    second: float  # unit of time [s]
    length: float  # unit of length [mm]
    origin: FloatArray  # (A,) [mm]

    def nodes(self) -> FloatArray:
        """(N+1, 3, A) position, velocity and acceleration [mm, s]."""
        state = self.x.reshape(len(self.x), 3, -1) * (self.length / self.second ** np.arange(3)[:, None])
        state[:, 0] += self.origin
        return state


class Tighter(NamedTuple):
    """What is kept on N steps with something to spare, as rows do not see all of them [-], >= 1."""

    limit: FloatArray  # (N,) by what the limits of the normal acceleration and of the state are divided
    room: FloatArray  # (N,) the room of control points

    def any(self) -> bool:
        """Whether something is spared."""
        return bool((self.limit > 1.0).any() or (self.room > 1.0).any())


def window_of(
    run: TubeRun,
    guess: CutMotion,
    lo: int,
    hi: int,
    missed: float,
    tight: Tighter | None = None,
    smooth: float = 0.0,
) -> StepWindow:
    """The steps lo .. hi - 1 of a guess, in the units of their mean.

    missed : by how much rows may be missed at the end [-]
    tight  : what limits and room are divided by; None for 1
    smooth : weight of the jerk against the time at least [-] (numbers.py)
    """
    part, leg = slice(lo, hi), guess.leg[lo:hi]
    state, h = guess.state[lo : hi + 1], guess.h[part]
    second = float(h.mean())
    length = float(np.abs(np.diff(state[:, 0], axis=0)).sum() / len(h))
    speed, acc, jerk = length / second, length / second**2, length / second**3
    origin = state[0, 0]  # far from it, gaps of the kinematics would not get below the rounding of positions
    legs = LegFormulas(
        length=run.length / length,
        base=(run.base - origin) / length,
        drift=run.drift,
        e1=run.e1,
        e2=run.e2,
        radius=run.radius / length,
        rate=run.rate * length,
        curve=run.curve,
        points=(run.curves.points - origin) / length,
        weight=run.curves.weight,
    )
    x = np.concatenate([(state[:, 0] - origin) / length, state[:, 1] / speed, state[:, 2] / acc], axis=1)
    jerks = np.diff(state[:, 2], axis=0) / h[:, None]
    place = (guess.place[part, :3] - run.offset[leg][:, None]) / length
    return StepWindow(
        legs=legs,
        limits=_limits(run, guess, lo, hi, (second, length), (missed, tight), smooth),
        x=x,
        u=np.column_stack([jerks / jerk, h / second]),
        place=np.ascontiguousarray(place),
        second=second,
        length=length,
        origin=origin,
    )


def _limits(
    run: TubeRun,
    guess: CutMotion,
    lo: int,
    hi: int,
    units: tuple[float, float],
    narrow: tuple[float, Tighter | None],
    smooth: float,
) -> StepLimits:
    """The limits of the steps lo .. hi - 1, in the units of time [s] and length [mm]; narrowed and
    smooth as in `window_of`."""
    second, length = units
    speed, acc, jerk = length / second, length / second**2, length / second**3
    leg = guess.leg[lo:hi]
    before = guess.leg[lo - 1] if lo else -1
    at_vertex = np.diff(guess.leg[lo:hi], prepend=before) > 0
    room = run.room[leg] * (1.0 - ROUNDING)
    room_node = room.copy()
    vertex = leg[at_vertex & (leg > 0)]
    beside = np.minimum(run.room[vertex - 1], run.room[vertex])
    room_node[at_vertex & (leg > 0)] = np.minimum(run.vertex_budget[vertex], beside) * (1.0 - ROUNDING)
    fastest, strongest = np.linalg.norm(run.velocity), np.linalg.norm(run.acceleration)
    feed = np.minimum(run.feed[leg], fastest)
    normal = np.minimum(run.across_max[leg], strongest)
    inside = 1.0 - NARROWED * narrow[0]
    state = np.broadcast_to(run.state, (hi - lo, len(run.state))) * inside / acc
    if narrow[1] is not None:
        normal, state = normal / narrow[1].limit, state / narrow[1].limit[:, None]
        room, room_node = room / narrow[1].room, room_node / narrow[1].room
    axes = np.stack(
        [run.jerk_scale / jerk, run.acceleration / acc, run.velocity / speed, run.velocity / speed]
    )
    h = guess.h[lo:hi] / second
    longer = LONGER_WATCHED if np.isfinite(run.across_max[leg]).any() else LONGER
    curved = run.curvature[leg] > 0
    on = _present(run, leg, at_vertex)
    for step, node in (
        (0, lo),
        (-1, hi),
    ):  # where a run begins or ends, the middle ordinate of the velocity is 0 for every motion
        if node in (0, len(guess)):
            on[step, 8 * len(run.axis) + rows.ORDER_MID] = False
            first = 8 * len(run.axis) + rows.STATE_ROWS
            for row in range(first, first + ROWS * len(run.state)):
                on[step, row] &= step == -1 and (row - first) % 3 == 0
    return StepLimits(
        leg=leg,
        at_vertex=at_vertex,
        on=on,
        box=axes * inside,
        room=room / length,
        room_node=room_node / length,
        feed=feed * inside / speed,
        feed_node=np.minimum(feed, np.append(feed[0], feed[:-1])) * inside / speed,
        normal=normal * inside / acc,
        normal_node=np.minimum(normal, np.append(normal[0], normal[:-1])) * inside / acc,
        state=state,
        state_node=np.minimum(state, np.concatenate([state[:1], state[:-1]])),
        word=run.word[leg] * inside / speed,
        counts=run.counts,
        linear=run.linear,
        step_max=STEP_SHARE * np.where(curved, np.minimum(run.step_max[leg], run.offset[-1]), 1.0) / length,
        pace=pace(guess.state[lo : hi + 1, 1]) / speed,
        h=h,
        h_max=h * longer,
        h_min=h / LONGER,
        switch=np.where(at_vertex, run.switch[leg], 0.0),
        smooth=jerk_weights(run, leg, guess.state[lo : hi + 1, 1], smooth),
        centre=np.full(hi - lo, CENTRE),
        aside=NARROWED * narrow[0],
    )


def _present(run: TubeRun, leg: np.ndarray, at_vertex: np.ndarray) -> np.ndarray:
    """(N, R) the rows that there are; those of the first node are not asked for, it stays."""
    axes = len(run.axis)
    words = run.word.shape[1]
    on = np.ones((len(leg), rows.count(axes) + ROWS * len(run.state) + WORD_ROWS * words), dtype=bool)
    more = on[:, 8 * axes :]
    on[:, : 2 * axes] = np.isfinite(run.jerk).all()
    # a feed that is no less than the axes can be together leaves the axes' own limits, which are all there is
    fed = (run.feed[leg] < np.linalg.norm(run.velocity)).any()
    on[:, 4 * axes : 8 * axes] = not fed or (run.feed[leg] > run.velocity.min()).any()
    more[:, rows.FEED_NODE : rows.TUBE_NODE] = fed
    more[at_vertex, rows.ORDER_NODE] = False
    limited = np.isfinite(run.across_max[leg])
    more[~limited, rows.NORMAL_NODE] = more[~limited, rows.NORMAL_MID] = False
    last = more.shape[1] - WORD_ROWS * words
    more[:, rows.STATE_ROWS : last] = np.repeat(np.isfinite(run.state), ROWS)
    if words:
        more[:, last:] = np.isfinite(run.word[leg])
        more[~at_vertex, last] = more[0, last] = more[-1, -1] = False
    more[run.curvature[leg] == 0, rows.ARC] = False
    more[:, rows.SWITCH] = at_vertex & (run.switch[leg] != 0.0)
    on[0, 2 * axes : 4 * axes] = on[0, 6 * axes : 8 * axes] = False
    more[0, [rows.FEED_NODE, rows.TUBE_NODE, rows.ORDER_NODE, rows.NORMAL_NODE, rows.SWITCH]] = False
    more[0, rows.STATE_ROWS : last : 3] = False
    return on
