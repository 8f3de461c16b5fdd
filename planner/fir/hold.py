"""Leading the filters along a guide, and slowing down until the motion that leaves them keeps tolerance and limits.

The command runs the guide's chords one after another at a constant speed each; two moving averages make the motion of it, exactly
(fir/superpose.py). The length along the guide, filtered like the axes, tells which point of it the motion belongs to; it never goes
back, so that the largest distance to that point bounds the deviation both ways and in order.

What is exceeded is mended where it comes from:

* error          the chords that turn, around the one that was commanded Td/2 before, get slower; a corner's then last as long as the
                 gap that paper 000 leaves between two pulses;
* acceleration   T1 gets longer, up to 2 V/A: whatever the command, |a| <= 2 V/T1 (docs/papers.md, universal identity);
* jerk           T1 T2 gets larger, up to 4 V/J: |j| <= 4 V/(T1 T2);
* feed           a lower programmed feed holds on beside its block, for as long as the filters see it (`feeds_held`).

Should that not come to an end, everything gets slower with the filters at twice their lengths. With filters that are given, all speeds
are lowered instead of making the filters longer. Both end: slower motions have smaller errors, accelerations and jerks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.fir.audit import slowest
from planner.fir.command import Command
from planner.fir.guide import STRAIGHT, Guide, feeds_held
from planner.fir.spline_speeds import filter_lengths, first_speeds, guide_point
from planner.fir.superpose import Pieces, superpose
from planner.machine import LINEAR_AXES, Machine

# Rounds until the filters are no longer shortened again, until everything gets slower, and at most.
RATCHET, PATIENCE, ROUNDS = 10, 40, 120
# One round makes the chords slower by the root of what is exceeded and a little more, but not to less than half [-].
BEYOND, SLOWEST = 0.995, 0.5
# Chords that are commanded within this share of Td of the one to blame get slower with it; in every round a little more [-].
AROUND, WIDER = 0.1, 0.01
# The motion is measured this often in Td, and at the start of every piece.
MEASURED = 64
# Below this square of a speed its direction is rounding [mm2/s2].
SPEED_SQ_MIN = 1e-12
BISECTIONS = 30  # of a piece, for when a place is passed
# An acceleration below this is rounding [mm/s2]: nothing happens on a piece without.
ACCELERATION_ROUNDING = 1e-6
# What rounding may add to a ratio [-]; the verifier allows twice as much.
RATIO_ROUNDING = 5e-7
# T1, and the product T1 T2, get longer at most by these factors, beyond which no command exceeds the limits [-].
MARGINS_MAX = np.array([[2.0], [4.0]])
# So many largest speeds are tried, from the feed down to this share of it, or to what legs of the mean length reach from rest to rest.
SPEEDS, LOWEST = 18, 0.17
# So many of them, the most promising, are held.
HELD_MAX = 4


@dataclass(frozen=True, eq=False, kw_only=True)
class Held:
    """Speeds v on the chords (P,) [mm/s], and the filters T1, T2 of the runs (G,) [s]."""

    v: FloatArray
    T1: FloatArray
    T2: FloatArray

    def time(self, guide: Guide) -> FloatArray:
        """(G,) how long each run takes [s]."""
        return np.add.reduceat(_durations(guide, self.v), guide.first[:-1]) + self.T1 + self.T2


@dataclass(frozen=True, eq=False, kw_only=True)
class Seen:
    """What a motion does: its error over the tolerance at times t (n,) [s], and its largest accelerations and jerks over the limits in
    each run (G,)."""

    t: FloatArray
    error: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def _limits(guide: Guide, machine: Machine) -> tuple[FloatArray, FloatArray]:
    return machine.limits("acceleration", guide.axes), machine.limits("jerk", guide.axes)


def _durations(guide: Guide, v: FloatArray) -> FloatArray:
    return np.divide(guide.length, v, out=np.zeros(len(guide)), where=guide.length > 0)


def command_of(guide: Guide, held: Held) -> Command:
    """The command that runs all chords at their speeds, each run followed by a rest until the filters are empty."""
    v = np.where(guide.length > 0, held.v, 0.0)
    duration = _durations(guide, v)
    begun = np.cumsum(duration) - duration
    t = begun - np.repeat(begun[guide.first[:-1]], np.diff(guide.first))
    lasting = t[guide.first[1:] - 1] + held.T1 + held.T2 + guide.dwell[1:]
    return Command(
        first=guide.first,
        t=t,
        velocity=v[:, None] * np.column_stack([guide.direction, np.ones(len(guide))]),
        position=np.column_stack([guide.point, guide.s]),
        leg=np.arange(len(guide)),
        T1=held.T1,
        T2=held.T2,
        begin=guide.dwell[0] + np.concatenate([[0.0], np.cumsum(lasting)[:-1]]),
        dwell=guide.dwell[1:],
    )


def see(guide: Guide, command: Command, pieces: Pieces, machine: Machine) -> Seen:
    """Measure a motion without dwells."""
    first = pieces.first[:-1]
    acceleration, jerk = (
        np.maximum.reduceat((np.abs(values[:, :-1]) / limit).max(axis=1), first)
        for values, limit in zip((pieces.acceleration, pieces.jerk), _limits(guide, machine), strict=True)
    )
    m, tau, step = _places(guide, command, pieces)
    p, v, a, j = (getattr(pieces, name)[m] for name in ("position", "velocity", "acceleration", "jerk"))
    h = tau[:, None]
    p, v, a = p + h * (v + h * (a / 2 + h * j / 6)), (v + h * (a + h * j / 2))[:, :-1], (a + h * j)[:, :-1]
    sigma = p[:, -1]
    chord = np.clip(np.searchsorted(guide.s, sigma, side="right") - 1, 0, len(guide) - 1)
    along = (a * guide.direction[chord]).sum(axis=1) * (guide.kappa[chord] <= STRAIGHT)
    across = np.sqrt(np.maximum((a**2).sum(axis=1) - along**2, 0.0))
    # between two samples, and between two places where it is measured, the motion bows by its acceleration times h^2/8
    bow = (machine.dt**2 + step**2) / 8.0 * across
    error = (np.linalg.norm(p[:, :-1] - guide_point(guide, sigma), axis=1) + bow) / guide.tol[chord]
    if machine.normal_acceleration is not None:
        more = step / 2.0 * np.sqrt((j[:, :-1] ** 2).sum(axis=1))
        error = np.maximum(error, (_normal(guide.axes, v, a) + more) / machine.normal_acceleration)
    return Seen(t=pieces.t[m] + tau, error=error, acceleration=acceleration, jerk=jerk)


def _places(guide: Guide, command: Command, pieces: Pieces) -> tuple[Array, FloatArray, FloatArray]:
    """Where a motion is measured: pieces (n,), times since their starts [s] and to the next place [s], in the order of time.

    Every piece in equal parts, and where the motion passes the points of the guide that bends: beside sharp corners the error has a
    peak like a roof.
    """
    lasting = np.append(pieces.t[1:], pieces.end[-1]) - pieces.t
    delay = np.repeat(command.T1 + command.T2, np.diff(pieces.first))
    even = (pieces.jerk == 0.0).all(axis=1) & (
        np.abs(pieces.acceleration).max(axis=1) <= ACCELERATION_ROUNDING
    )
    parts = np.where(even, 1, np.maximum(np.ceil(MEASURED * lasting / delay), 1)).astype(np.int64)
    m = np.repeat(np.arange(len(lasting)), parts)
    step = (lasting / parts)[m]
    tau = step * (np.arange(len(m)) - np.repeat(np.cumsum(parts) - parts, parts))
    bent = np.flatnonzero(guide.kappa > STRAIGHT)
    columns = (
        getattr(pieces, name)[:, -1].copy() for name in ("position", "velocity", "acceleration", "jerk")
    )
    passed, after = _passing_times(guide.s[bent], lasting, *columns)
    m, tau, step = np.append(m, passed), np.append(tau, after), np.append(step, np.zeros(len(bent)))
    order = np.lexsort((tau, m))
    return m[order], tau[order], step[order]


@njit(cache=True, error_model="numpy")
def _passing_times(s, lasting, position, velocity, acceleration, jerk):
    """Pieces (n,) and times since their starts (n,) at which a length that never goes back passes the ascending lengths s (n,)."""
    piece, tau = np.empty(len(s), np.int64), np.empty(len(s))
    m = 0
    for k in range(len(s)):
        while m + 1 < len(position) and position[m + 1] <= s[k]:
            m += 1
        low, high = 0.0, lasting[m]
        for _ in range(BISECTIONS):
            h = 0.5 * (low + high)
            if position[m] + h * (velocity[m] + h * (acceleration[m] / 2.0 + h * jerk[m] / 6.0)) < s[k]:
                low = h
            else:
                high = h
        piece[k], tau[k] = m, 0.5 * (low + high)
    return piece, tau


def _normal(axes: tuple[str, ...], v: FloatArray, a: FloatArray) -> FloatArray:
    """Normal acceleration (n,) [mm/s2], of the linear axes."""
    linear = np.array([axis in LINEAR_AXES for axis in axes])
    v, a = v[:, linear], a[:, linear]
    along = (v * a).sum(axis=1) ** 2 / np.maximum((v**2).sum(axis=1), SPEED_SQ_MIN)
    return np.sqrt(np.maximum((a**2).sum(axis=1) - along, 0.0))


def hold(guide: Guide, machine: Machine, start: Held, *, given: bool) -> Held:
    """Slow a command down until its motion keeps tolerance and limits.

    guide : without dwells
    given : the filters stay as they are
    """
    acceleration, jerk = _limits(guide, machine)
    v, T1, T2 = start.v.copy(), start.T1.copy(), start.T2.copy()
    margins, open_ = np.ones((2, guide.runs)), np.ones(guide.runs, bool)
    for n in range(ROUNDS):
        part = guide.pick(open_)
        command = command_of(part, Held(v=v[open_[guide.run]], T1=T1[open_], T2=T2[open_]))
        seen = see(part, command, superpose(command), machine)
        error = np.maximum.reduceat(seen.error, np.searchsorted(seen.t, command.begin))
        over = np.array([seen.acceleration, seen.jerk])
        worst = np.maximum(error, over.max(axis=0))
        wrong: Array = worst > 1.0 + RATIO_ROUNDING
        if not wrong.any():
            break
        by = _slower_chords(part, command, seen, n)
        everything = np.asarray((over > 1.0).any(axis=0)) if given else np.full(len(wrong), n >= PATIENCE)
        by = np.where(everything[part.run], np.minimum(by, BEYOND / np.sqrt(worst)[part.run]), by)
        open_[open_] = wrong
        v[open_[guide.run]] *= by[wrong[part.run]]
        if not given:
            new = np.clip(margins[:, open_] * over[:, wrong] / BEYOND, 1.0, MARGINS_MAX)
            if n >= RATCHET:
                new = np.maximum(new, margins[:, open_])
            margins[:, open_] = new if n < PATIENCE else MARGINS_MAX
            T1[open_], T2[open_] = filter_lengths(
                guide.pick(open_), v[open_[guide.run]], acceleration, jerk, margins[:, open_]
            )
            v = np.minimum(v, feeds_held(guide, T1, T2))
    return Held(v=v, T1=T1, T2=T2)


def _slower_chords(guide: Guide, command: Command, seen: Seen, n: int) -> FloatArray:
    """(P,) by how much to slow down each chord for the error [-]."""
    factor = np.clip(BEYOND / np.sqrt(np.maximum(seen.error, 1.0)), SLOWEST, BEYOND)
    delay = (command.T1 + command.T2)[guide.run]
    around = np.minimum(AROUND + WIDER * n, 0.5) * delay
    begin = command.begin[guide.run] + command.t + delay / 2
    end = begin + np.where(guide.length > 0, np.append(command.t[1:], 0.0) - command.t, 0.0)
    by = slowest(seen.t, np.where(seen.error > 1.0, factor, 1.0), begin - around, end + around)
    return np.where(guide.kappa > STRAIGHT, by, 1.0)


def promised(
    guide: Guide, machine: Machine, own: tuple[float, float] | None
) -> tuple[list[Held], FloatArray]:
    """Commands with lower and lower largest speeds, not yet held, and the times (n, G) [s] that they promise."""
    high = guide.largest(np.where(guide.length > 0, guide.feed, 0.0))
    corners = np.add.reduceat(np.diff(guide.corner, prepend=-1) > 0, guide.first[:-1])
    leg = np.add.reduceat(guide.length, guide.first[:-1]) / (1 + corners)
    low = np.minimum(LOWEST * high, np.cbrt(machine.limits("jerk", guide.axes).min() * leg**2 / 4.0))
    starts = [_start(guide, machine, own, high * (low / high) ** (k / (SPEEDS - 1))) for k in range(SPEEDS)]
    return starts, np.array([start.time(guide) for start in starts])


def fastest(guide: Guide, machine: Machine, own: tuple[float, float] | None) -> Held:
    """The fastest of a few commands that keep tolerance and limits, for each run by itself. `guide` has no dwells.

    own : lengths of the two filters [s]; None to choose them
    """
    starts, times = promised(guide, machine, own)
    best, best_time = starts[0], np.full(guide.runs, np.inf)
    for rank in np.argsort(times, axis=0)[:HELD_MAX]:
        chosen = Held(
            v=np.choose(rank[guide.run], [s.v for s in starts]),
            T1=np.choose(rank, [s.T1 for s in starts]),
            T2=np.choose(rank, [s.T2 for s in starts]),
        )
        held = hold(guide, machine, chosen, given=own is not None)
        time = held.time(guide)
        better = time < best_time
        best_time = np.where(better, time, best_time)
        best = Held(
            v=np.where(better[guide.run], held.v, best.v),
            T1=np.where(better, held.T1, best.T1),
            T2=np.where(better, held.T2, best.T2),
        )
    return best


def _start(guide: Guide, machine: Machine, own: tuple[float, float] | None, top: FloatArray) -> Held:
    """First speeds up to `top` (G,) and the filters for them."""
    acceleration, jerk = _limits(guide, machine)
    most, ones = np.minimum(guide.feed, top[guide.run]), np.ones((2, guide.runs))
    if own is not None:
        long, short = sorted(own, reverse=True)
        T1, T2 = long * ones[0], short * ones[0]
        v = first_speeds(guide, most, acceleration, T1, T2)
    else:
        T1, T2 = filter_lengths(guide, most, acceleration, jerk, ones)
        v = first_speeds(guide, most, acceleration, T1, T2)
        T1, T2 = filter_lengths(guide, v, acceleration, jerk, ones)
    return Held(v=np.minimum(v, feeds_held(guide, T1, T2)), T1=T1, T2=T2)
