"""Where the search begins: the motion of another method, cut into steps.

A corner is shaped by jerk, within the time in which full jerk moves an axis by the tolerance, (eps/j)^(1/3),
or takes it to its full acceleration, a/j. The shorter of them is the unit, or `PERIODS` if that is longer, as
setpoints do not tell of what is shorter: where the jerk is at its limit it
has `Cut.per_unit` steps, and all of a leg at least `Cut.of_leg` and one in `LONGEST` units. So phases of full
jerk get short steps and cruises a few long ones.

Every step is a cubic in time with the control points

    c0 = p0,   c1 = p0 + h v0/3,   c2 = p1 - h v1/3,   c3 = p1

and each of them has its place on the run, the nearest one, never going back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.sizes import SIZES
from planner.joint.leg_shapes import LegShapes, together
from planner.joint.run import TubeRun
from planner.motion.trajectory import Trajectory

# Longer steps make the rows stiff: a change of jerk moves their end by h^3/6. But a leg has no more than so
# many because of it.
LONGEST, MOST_FOR_LENGTH = 4.0, 60
# Interpolation periods in a unit at least [-]: with less, chords reach over more steps, and much is searched again.
PERIODS = 1.0
# Steps on arcs are at most this fraction of what the problem allows them (run.py) [-], which leaves room to
# move.
ARC_STEP = 0.8
# Where no jerk is limited, units of steps at a jump from no acceleration to the full one [-]: a step becomes
# shorter by no more than a factor (nlp.py), and a long one beside the jump would be the ramp.
# Of a unit, how far samples that are looked at for jumps are apart at least [-].
JUMP, SEEN = 3.0, 0.1
# Gauss-Newton steps to the nearest place on an arc, from the place that the length travelled so far gives.
NEAREST_STEPS = 5
STATE = ("position", "velocity", "acceleration")
PART = SIZES.steps_at_once


class Cut(NamedTuple):
    """How finely a motion is cut into steps."""

    per_unit: float = 4.0  # steps in a unit of time where the jerk is at its limit (module text) [-]
    of_leg: float = 2.0  # steps of a leg at least [-]


DEFAULT_CUT = Cut()


@dataclass(frozen=True, eq=False, kw_only=True)
class Guess:
    """N steps along a run, the N+1 nodes around them, A axes."""

    leg: Array  # (N,) leg of each step
    h: FloatArray  # (N,) duration [s], > 0
    state: FloatArray  # (N+1, 3, A) position, velocity, acceleration at the nodes [mm, s]
    place: FloatArray  # (N, 4) places of the control points along the run [mm], non-decreasing

    def __post_init__(self) -> None:
        steps = len(self.h)
        freeze(self, "leg", np.int64, (steps,))
        freeze(self, "h", np.float64, (steps,))
        freeze(self, "state", np.float64, (steps + 1, 3, None))
        freeze(self, "place", np.float64, (steps, 4))
        if not (self.h > 0).all():
            raise ValueError("Guess.h: every step must last longer than 0 s")

    def __len__(self) -> int:
        return len(self.h)

    def slower(self, by: float) -> Guess:
        """The same path in `by` times the time."""
        return replace(self, h=self.h * by, state=self.state / by ** np.arange(3)[:, None])


class CutMotion:
    """The steps of a guess while they are searched: its arrays, that windows write into, each its own steps."""

    def __init__(self, guess: Guess):
        self.leg, self.h = guess.leg, guess.h.copy()
        self.state, self.place = guess.state.copy(), guess.place.copy()

    def __len__(self) -> int:
        return len(self.h)


class Seen(NamedTuple):
    """Samples (T,) of a motion along runs."""

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    s: FloatArray


def guesses_from(
    runs: Sequence[TubeRun],
    motion: Trajectory,
    vertex_times: Sequence[FloatArray],
    cut: Cut = DEFAULT_CUT,
    exact: Callable[[FloatArray], Trajectory] | None = None,
) -> list[Guess]:
    """Cut a motion along runs that follow one another into steps, each by itself; at their ends the runs' velocities are put in
    its place.

    vertex_times : (R+1,) of each run when it passes the vertices [s], strictly ascending
    exact        : the motion at any times, for the states at the nodes
    """
    seen = _between(motion, vertex_times[0][0], vertex_times[-1][-1])
    cuts = [_steps(run, seen, times, cut) for run, times in zip(runs, vertex_times, strict=True)]
    axes, which = seen.position.shape[1], np.arange(len(runs))
    count, legs = np.array([len(leg) for leg, _ in cuts]), np.array([len(run) for run in runs])
    leg = np.concatenate([leg for leg, _ in cuts]) + np.repeat(np.cumsum(legs) - legs, count)
    nodes = np.concatenate([times for _, times in cuts])
    of_step = np.repeat(which, count)  # runs
    node = np.arange(len(leg)) + of_step  # where each step begins
    h = nodes[node + 1] - nodes[node]
    last = np.cumsum(count + 1) - 1  # of each run
    first = last - count
    columns = (getattr(seen, name) for name in STATE)
    state = np.stack([_interpolated(nodes, seen.t, column) for column in columns], axis=1)
    moves = np.zeros((len(runs), axes))
    for k, run in enumerate(runs):
        moves[k, run.axis] = 1.0
        rest = np.stack([run.vertex[[0, -1]], run.ends, 0.0 * run.ends], axis=1)
        state[first[k] : last[k] + 1 : count[k], :, run.axis] = rest
    passed = np.concatenate([run.passed for run in runs])
    travelled = np.interp(nodes, seen.t, seen.s)
    shapes, place = together(runs, axes), np.empty((len(leg), 4))
    begins = np.flatnonzero(np.diff(leg, prepend=-1))
    part = np.searchsorted(begins, np.arange(0, len(leg), PART))
    edges = begins[np.unique(np.minimum(part, len(begins) - 1))]
    for lo, hi in pairwise([*edges.tolist(), len(leg)]):
        steps = slice(lo, hi)
        moving = moves[of_step[steps]]
        place[steps] = _places(shapes, passed, leg[steps], h[steps], state, moving, travelled, node[steps])
    place += np.concatenate([run.offset[:-1] for run in runs])[leg, None]
    h_of, place_of = (np.split(column, np.cumsum(count)[:-1]) for column in (h, place))
    if exact is not None:
        inner = np.ones(len(nodes), dtype=bool)
        inner[first] = inner[last] = False
        times = [begin[0] + np.cumsum(own[:-1]) for begin, own in zip(vertex_times, h_of, strict=True)]
        at, ends = np.flatnonzero(inner), np.concatenate(times)
        for lo in range(0, len(at), PART):
            exactly = exact(ends[lo : lo + PART])
            for m, name in enumerate(STATE):
                state[at[lo : lo + PART], m] = getattr(exactly, name)
    return [
        Guess(
            leg=cuts[k][0],
            h=h_of[k],
            state=state[first[k] : last[k] + 1][:, :, run.axis],
            place=np.maximum.accumulate(place_of[k].ravel()).reshape(-1, 4),
        )
        for k, run in enumerate(runs)
    ]


def _between(motion: Trajectory | Seen, begin: float, end: float) -> Seen:
    """The samples from one time to another [s]."""
    lo, hi = np.searchsorted(motion.t, [begin, end])
    return Seen(*(getattr(motion, name)[lo : hi + 1] for name in Seen._fields))


def unit_of(run: TubeRun) -> float:
    """The unit of time in which a corner is shaped (module text) [s]."""
    jerk = run.jerk_scale
    shaped = float(min((run.acceleration / jerk).min(), np.cbrt(run.budget.min() / jerk.max())))
    return max(shaped, PERIODS * 2.0 * run.chord)


def least_of_legs(run: TubeRun, lasting: FloatArray, cut: Cut) -> FloatArray:
    """(R,) steps of each leg at least, whatever its jerks are; lasting: (R,) [s]."""
    of_time = cut.of_leg + np.minimum(lasting / (LONGEST * unit_of(run)), MOST_FOR_LENGTH)
    least: FloatArray = np.maximum(of_time, run.length / (ARC_STEP * run.step_max))
    return least


def busy(run: TubeRun, motion: Trajectory | Seen, unit: float) -> FloatArray:
    """(T,) how long the jerk has been at its limit until the samples, or without one, where accelerations jump,
    how long it would have been at its scale [s]."""
    if np.isfinite(run.jerk).all():
        share = np.minimum((np.abs(motion.jerk[:, run.axis]) / run.jerk).max(axis=1), 1.0)
        return np.append(0.0, np.cumsum(np.diff(motion.t) * (share[:-1] + share[1:]) / 2))
    # a jump between two samples at nearly the same time would have steps of no length
    apart = SEEN * unit
    seen = np.unique(np.floor(motion.t / apart), return_index=True)[1]
    seen = seen[np.diff(motion.t[seen], prepend=-np.inf) >= apart / 2]
    seen = np.append(seen[motion.t[seen] <= motion.t[-1] - apart / 2], len(motion.t) - 1)
    acceleration = motion.acceleration[seen][:, run.axis]
    acceleration[[0, -1]] = 0.0
    jumps = (np.abs(np.diff(acceleration, axis=0)) / run.jerk_scale).max(axis=1)
    return np.asarray(np.interp(motion.t, motion.t[seen], np.append(0.0, np.cumsum(JUMP * jumps))))


def _steps(run: TubeRun, motion: Seen, vertex_time: FloatArray, cut: Cut) -> tuple[Array, FloatArray]:
    """(N,) legs and (N+1,) times of the nodes [s]."""
    seen = _between(motion, vertex_time[0], vertex_time[-1])
    unit = unit_of(run)
    spent = busy(run, seen, unit) * cut.per_unit / unit
    least = least_of_legs(run, np.diff(vertex_time), cut)
    # the steps up to the times t, on all legs at once: `done` from the beginning of their leg, `share` from
    # that of the run
    inside = seen.t[(seen.t > vertex_time[0]) & (seen.t < vertex_time[-1])]
    t = np.union1d(inside, vertex_time)
    leg = np.minimum(np.searchsorted(vertex_time, t, side="right") - 1, len(run) - 1)
    spent_at = np.interp(vertex_time, seen.t, spent)
    even = (t - vertex_time[leg]) / np.diff(vertex_time)[leg]
    done = np.interp(t, seen.t, spent) + (least[leg] * even - spent_at[leg])
    whole = spent_at[1:] + (least - spent_at[:-1])
    before = np.append(0.0, np.cumsum(whole))
    share = done + before[leg]
    steps = np.ceil(whole).astype(np.int64)
    of_step = np.repeat(np.arange(len(run)), steps)
    first = np.cumsum(steps) - steps
    number = np.arange(len(of_step)) - first[of_step]
    times = np.interp(before[of_step] + whole[of_step] * number / steps[of_step], share, t)
    times[first] = vertex_time[:-1]
    return of_step, np.append(times, vertex_time[-1])


def _interpolated(at: FloatArray, t: FloatArray, column: FloatArray) -> FloatArray:
    """(n, A) a column (T, A) at times t (T,), interpolated at the times (n,)."""
    return np.stack([np.interp(at, t, values) for values in column.T], axis=1)


def _places(
    legs: LegShapes,
    passed: Array,
    leg: Array,
    h: FloatArray,
    state: FloatArray,
    moves: FloatArray,
    travelled: FloatArray,
    node: Array,
) -> FloatArray:
    """(N, 4) places of the control points on their legs, all steps of each.

    passed    : (R,) of the legs
    state     : (n, 3, A) at all nodes
    moves     : (N, A) 1 for axes that move in the step's run, else 0
    travelled : (n,) length that the motion has travelled there [mm]
    node      : (N,) where each step begins; it ends at the next one
    """
    (p, v), (q, w) = ((state[at, 0] * moves, state[at, 1] * moves) for at in (node, node + 1))
    third = h[:, None] / 3
    controls = np.concatenate([p, p + third * v, q - third * w, q])
    last = np.append(np.flatnonzero(np.diff(leg)), len(leg) - 1)  # step of every leg
    begin = np.append(0, last[:-1] + 1)
    before, behind = travelled[node], travelled[node + 1]
    own = leg - leg[0]  # of these steps
    per_length = legs.length[leg[0] : leg[-1] + 1] / (behind[last] - before[begin])
    number, many = np.arange(len(leg)) - begin[own], last - begin + 1
    fraction = np.array([[0.0], [1 / 3], [2 / 3], [1.0]])
    there = (1 - fraction) * before + fraction * behind
    x, of = ((there - before[begin][own]) * per_length[own]).ravel(), np.tile(leg, 4)
    for _ in range(NEAREST_STEPS):
        miss, along = controls - legs.points(of, x), legs.tangents(of, x)
        x = np.clip(x + (miss * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, legs.length[of])
    even = legs.length[leg] * (number + fraction) / many[own]
    places = np.ascontiguousarray(np.where(passed[leg], even, x.reshape(4, -1)).T)
    places[begin, 0], places[last, 3] = 0.0, legs.length[leg[begin]]
    return places
