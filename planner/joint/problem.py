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
from planner.joint.row_kinds import StepLimits
from planner.joint.run import TubeRun
from planner.joint.step_limits import step_limits, weights
from planner.joint.switches import Beside, no_rows_beside

# Limits are narrowed by so many times what a row may be missed by [-], so that this and the closing jerks
# stay inside them.
NARROWED = 2.0
# Of the sag of chords that rows know, where they are told the rest [-]: the middle of a chord sees cos(w tau) of a wave
# exp(i w t), tau = dt/2, and rows 1 - SEEN (w tau)^2/2. With this both are 0 at w tau = pi/2, their ratio is between 0 and 1 up to
# 3 pi/2, and what is told comes to rest; with 1 it does not between 1.33 and 1.57.
SEEN = 8.0 / np.pi**2
# The rest is of the durations at which it was found: instead of `LONGER` [-]. With that windows go on to the last iteration, or
# end where chords are farther off than before.
LONGER_TOLD = 2.0


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
    smooth : weight of the jerk against the time at least [-] (step_limits.py)
    which  : of the laws, those that have rows; None for those that the guess is near to
    beside : nodes beside a vertex where the feed changes, and places that stand for one
    rest   : of `Window`; None for 0
    """
    cut = Window(guess, lo, hi, rest)
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
    limits = _limits(run, cut, units, (missed, tight), laws, smooth, beside)
    return StepWindow(
        legs=_legs(run, of, units),
        limits=limits,
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
    lo, hi, told = cut.lo, cut.hi, cut.rest is not None
    leg, state = cut.leg[lo:hi], cut.state[lo : hi + 1]
    axes = np.stack(
        [run.jerk_scale / jerk, run.acceleration / acc, run.velocity / speed, run.velocity / speed]
    )
    inside = 1.0 - NARROWED * narrow[0]
    of_room, of_pace, of_time = step_limits(
        run.of_steps,
        (second, length, speed, acc),
        units.origin,
        (leg, cut.h[lo:hi], state),
        int(cut.leg[lo - 1]) if lo else -1,
        (_rests(cut, lo), _rests(cut, hi)),
        beside,
        np.ascontiguousarray(narrow[1][:, 0]),
        cut.rest if told else np.zeros((0, len(run.axis) + 1)),
        (inside, weights(smooth), LONGER_TOLD if told else LONGER),
    )
    at_vertex, on, passed, room, room_node, rest, turns, step_max, switch, switch_at, side = of_room
    feed, feed_node, normal, normal_node, pace = of_pace
    h, h_max, h_min, smooth_by, centre = of_time
    return StepLimits(
        leg=leg - leg[0],
        passed=passed,
        target=(_targets(run, leg, np.flatnonzero(passed), cut.place[lo:hi]) - units.origin) / length,
        at_vertex=at_vertex,
        on=np.hstack([on, laws[1]]) if laws[1].size else on,
        box=axes * inside,
        room=room,
        room_node=room_node,
        sag=np.array([0.0, (SEEN * run.sag if told else run.sag) / second**2]),
        rest=rest,
        feed=feed,
        feed_node=feed_node,
        normal=normal,
        normal_node=normal_node,
        turns=turns,
        laws=laws[0],
        step_max=step_max,
        pace=pace,
        h=h,
        h_max=h_max,
        h_min=h_min,
        switch=switch,
        switch_at=switch_at,
        side=side,
        smooth=smooth_by,
        centre=centre,
        aside=NARROWED * narrow[0],
    )


def _rests(cut: Window, node: int) -> bool:
    """Whether a run begins or ends at a node of its window, at rest."""
    return node in (0, len(cut)) and not bool(cut.state[node, 1].any())


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
