"""Paper 001's command: a speed on every chord of a guide; and how it gets slower.

The command runs the guide's chords one after another at a constant speed each.

What is exceeded is mended where it comes from:

* error          the chords that turn, around the one that was commanded Td/2 before, get slower; a corner's then last as long as the
                 gap that paper 000 leaves between two pulses;
* acceleration   T1 gets longer, up to 2 V/A: whatever the command, |a| <= 2 V/T1 (docs/papers.md, universal identity);
* jerk           T1 T2 gets larger, up to 4 V/J: |j| <= 4 V/(T1 T2);
* feed           a lower programmed feed holds on beside its block, for as long as the filters see it (`feeds_held`).

Should that not come to an end, everything gets slower with the filters at twice their lengths. With filters
that are given, all speeds are lowered instead of making the filters longer. Both end: slower motions have
smaller errors, accelerations and jerks.

Feed limits on a path of curvature kappa = 1/rho behind two moving averages T1, T2, paper 001's:

    v_acc  = sqrt(a rho)                          normal acceleration                                        (par. 13)
    v_jerk = (j rho^2)^(1/3)                      jerk of a point on a circle                                (par. 17)
    v_eps  = sqrt(24 rho eps / (T1^2 + T2^2))     error of the filters to second order, eps = a_n var(h)/2   (par. 24)
    v_ph   = 2 rho phi / (T1 + T2)                phase lag phi behind the path                              (par. 26)
    v_sc   = min(v_p, v_acc, v_jerk, v_eps, v_ph)                                                            (par. 29)
    T1 = v_p / a,   T2 = a / j                                                                               (par. 19)

On a circle the filtered point runs on another one, exactly rho [1 - sinc(v T1/2rho) sinc(v T2/2rho)] further
inside, sinc x = sin x / x; the second order is larger than that, by 0.9 % at a phase lag of 30 degrees.

Where the curvature varies within the length that the filters cover, none of this is a bound (docs/papers.md,
paper 001), nor is it needed: what the filters see at the constant speed v is the mean of the path with their
kernel as weight. By a rule with two nodes that has the kernel's second and fourth moment mu2, mu4,

    D = p(s - v x) + p(s + v x) - 2 p(s),   error w |D|,   acceleration D/x^2,      x^2 = mu4/mu2,   w = mu2^2/(2 mu4).

A corner that turns by theta is missed by no more than eps if the command takes as long as the gap Td - Tk
that paper 000's eq. 15 puts between the pulses of two legs, with V in its legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.fir.chord_guide import STRAIGHT, ChordGuide, feeds_held
from planner.baselines.fir.command import Command, VelocityPulses, command_of
from planner.baselines.fir.guide import per
from planner.baselines.fir.measure import slowest
from planner.baselines.fir.slow_down import BEYOND, Made, SpeedPlan, settled_fastest, slowing
from planner.corners.fir import overlap_time
from planner.feedrate.constraints.built_in import feed_sq_of_filters, feed_sq_of_lag
from planner.machine import Machine

# Rounds until everything gets slower with the filters at their longest, so that it ends.
PATIENCE = 40
# Chords commanded within this fraction of Td of the one to blame get slower with it [-].
AROUND = 0.1
# T1, and T1 T2, get longer at most by these factors, beyond which no command exceeds the limits [-].
MARGINS_MAX = np.array([2.0, 4.0])
# So many largest speeds are tried, down to this fraction of the feed, or what legs reach from rest to rest.
SPEEDS, LOWEST = 18, 0.17
# Steps in which a speed is lowered until the mean of the path allows it, and what one may leave of it [-].
MEAN_STEPS, MEAN_STEP_MIN = 12, 0.3
# A mean's speed is good enough when it exceeds nothing by more [-]: the motion is measured afterwards.
MEAN_OVER = 0.02


@dataclass(frozen=True, eq=False, kw_only=True)
class ChordSpeeds(SpeedPlan):
    """Speeds on the R chords of a guide in S runs."""

    guide: ChordGuide
    v: FloatArray = per("leg")  # (R,) constant speed of each chord [mm/s]
    margin: FloatArray = per(
        "run", width=(2,)
    )  # (S, 2) how much longer than for an isolated step T1 and T1 T2 are [-]

    def time(self) -> FloatArray:
        """(S,) durations of the runs [s], dwells not counted."""
        return self.guide.total(self.guide.length / self.v) + self.T1 + self.T2

    def command(self) -> Command:
        """All chords at their speeds, one after another, no gaps between them."""
        legs = len(self.guide)
        pulses = VelocityPulses(leg=np.arange(legs), length=self.guide.length, speed=self.v)
        return command_of(self.guide, pulses, np.zeros(legs + 1), self.T1, self.T2)

    def slower(self, made: Made, machine: Machine, n: int) -> ChordSpeeds:
        """Slower speeds and longer filters for what the motion exceeds (module text); from `PATIENCE` on everything
        gets slower."""
        guide, given = self.guide, self.guide.profile_filters is not None
        over = np.stack([made.largest(made.seen.acceleration), made.largest(made.seen.jerk)], axis=1)
        everything = (over > 1.0).any(axis=1) if given else np.full(guide.runs, n >= PATIENCE)
        as_a_whole = np.where(everything, BEYOND / np.sqrt(made.largest(made.seen.worst)), 1.0)
        v = self.v * np.minimum(self._by_error(made), as_a_whole[guide.run])
        if given:
            return ChordSpeeds(guide=guide, v=v, T1=self.T1, T2=self.T2, margin=self.margin)
        margin = np.clip(self.margin * over / BEYOND, 1.0, MARGINS_MAX)
        if n >= PATIENCE:
            margin = np.broadcast_to(MARGINS_MAX, margin.shape)
        T1, T2 = filter_lengths(guide, v, machine, margin)
        v = np.minimum(v, feeds_held(guide, T1, T2))
        return ChordSpeeds(guide=guide, v=v, T1=T1, T2=T2, margin=margin)

    def _by_error(self, made: Made) -> FloatArray:
        """(R,) by how much to slow down each chord for the error, or the normal acceleration [-]."""
        guide, command, seen = self.guide, made.command, made.seen
        delay = (self.T1 + self.T2)[guide.run]
        around, duration = AROUND * delay, guide.length / self.v
        step = np.arange(len(guide)) + guide.run  # in the command a standstill follows each run
        begin = command.begin[guide.run] + command.t[step] + delay / 2
        factor = slowing(np.maximum(seen.error, seen.normal))
        by = slowest(seen.t, factor, begin - around, begin + duration + around)
        return np.where(guide.kappa > STRAIGHT, by, 1.0)


def promised(guide: ChordGuide, machine: Machine) -> tuple[list[ChordSpeeds], FloatArray]:
    """`SPEEDS` plans with lower and lower largest speeds, and the times (n, S) [s] they promise S runs, without dwells."""
    high = guide.largest(guide.feed)
    corners = np.add.reduceat(np.diff(guide.corner, prepend=-1) > 0, guide.first[:-1])
    leg = guide.total(guide.length) / (1 + corners)
    low = np.minimum(LOWEST * high, np.cbrt(machine.limits("jerk", guide.axes).min() * leg**2 / 4.0))
    plans = [_first_plan(guide, machine, high * (low / high) ** (k / (SPEEDS - 1))) for k in range(SPEEDS)]
    return plans, np.array([plan.time() for plan in plans])


def fastest_speeds(guide: ChordGuide, machine: Machine) -> ChordSpeeds:
    """The fastest of a few plans that keep tolerance and limits, each run of a guide without dwells by itself."""
    return settled_fastest(*promised(guide, machine), machine)


def _first_plan(guide: ChordGuide, machine: Machine, top: FloatArray) -> ChordSpeeds:
    """First speeds up to `top` (S,) and the filters for them."""
    acceleration = machine.limits("acceleration", guide.axes)
    most, margin = np.minimum(guide.feed, top[guide.run]), np.ones((guide.runs, 2))
    given = guide.given_filters() if guide.profile_filters is not None else None
    T1, T2 = given or filter_lengths(guide, most, machine, margin)
    v = first_speeds(guide, most, acceleration, T1, T2)
    T1, T2 = given or filter_lengths(guide, v, machine, margin)
    return ChordSpeeds(guide=guide, v=np.minimum(v, feeds_held(guide, T1, T2)), T1=T1, T2=T2, margin=margin)


def circle_error(rho: FloatArray, v: FloatArray, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """(n,) how far inside circles of radius `rho` (n,) [mm] the point runs at v (n,) [mm/s] behind filters T1, T2 (n,)
    [s]: exact (module text) [mm]."""
    lag = v / (2.0 * np.pi * rho)  # np.sinc(x) is sin(pi x)/(pi x)
    return rho * (1.0 - np.sinc(lag * T1) * np.sinc(lag * T2))


def v_eps(kappa: FloatArray, tol: FloatArray, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """(n,) speed [mm/s] at which the error of filters T1, T2 (n,) [s] is `tol` (n,) [mm] at the curvature `kappa` (n,)
    [1/mm] (par. 24); inf if straight."""
    return np.sqrt(feed_sq_of_filters(kappa, tol, (T1, T2)))


def v_ph(kappa: FloatArray, phi: float, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """The same at which the filtered point lags by phi [rad] (par. 26): (n,), with `kappa`, T1, T2 (n,)."""
    return np.sqrt(feed_sq_of_lag(kappa, phi, (T1, T2)))


def filter_lengths(
    guide: ChordGuide, speed: FloatArray, machine: Machine, margin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """T1 >= T2 (S,) [s] for a `speed` (R,) [mm/s] on the chords (par. 19): T1 = V/A, T1 T2 = V/J with the limits along
    them, or equal where A is not reached; each times its `margin` (S, 2) [-]."""
    along = speed[:, None] * np.abs(guide.direction)
    by_a, by_j = (
        guide.largest((along / machine.limits(q, guide.axes)).max(axis=1)) for q in ("acceleration", "jerk")
    )
    by_a, by_j = by_a * margin[:, 0], by_j * margin[:, 1]
    T1 = np.maximum(by_a, np.sqrt(by_j))
    return T1, by_j / T1


def v_sc(guide: ChordGuide, T1: FloatArray, T2: FloatArray, phi: float) -> FloatArray:
    """(R,) the paper's speed on each chord [mm/s] (par. 29), with the filters T1, T2 (S,) [s] of runs and phi [rad]."""
    T1, T2 = T1[guide.run], T2[guide.run]
    by_filters = v_eps(guide.kappa, guide.tol, T1, T2), v_ph(guide.kappa, phi, T1, T2)
    return np.min([guide.feed, guide.v_acc, guide.v_jerk, *by_filters], axis=0)


def first_speeds(
    guide: ChordGuide, most: FloatArray, acceleration: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """(R,) speeds to begin with [mm/s], too fast rather than too slow: what the curvature beside a chord or the mean of
    the path allows, and corners for their gap (module text).

    most         : (R,) largest speeds [mm/s]
    acceleration : (A,) limits of the axes [mm/s2]
    T1, T2       : (S,) filters of the runs [s]
    """
    local = np.minimum(guide.v_acc, v_eps(guide.kappa, guide.tol, T1[guide.run], T2[guide.run]))
    v = np.minimum(most, local)
    bent = np.flatnonzero(local < most)
    v[bent] = np.maximum(v[bent], _v_mean(guide, bent, most[bent], acceleration, T1, T2))
    return v * _slower_corners(guide, v, most, T1, T2)


def two_nodes(T1: FloatArray, T2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) x [s] and (n,) w [-] of the rule of the module's text, for filters T1, T2 (n,) [s]."""
    second, fourth = (T1**2 + T2**2) / 12.0, (T1**4 + T2**4) / 80.0 + T1**2 * T2**2 / 24.0
    return np.sqrt(fourth / second), second**2 / (2.0 * fourth)


def _v_mean(
    guide: ChordGuide, at: Array, most: FloatArray, acceleration: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """Largest constant speeds up to `most` (n,) at chords `at` (n,) by the mean of the path (module text)."""
    run = guide.run[at]
    T1, T2 = T1[run], T2[run]
    x, w = two_nodes(T1, T2)
    begin, end = guide.s[guide.first[run]], guide.s[guide.first[run + 1]]
    half = 0.5 * guide.length[at]
    here, middle = guide.s[at] + half, guide.point[at] + half[:, None] * guide.direction[at]
    v, open_ = most.copy(), np.arange(len(at))
    for _ in range(MEAN_STEPS):
        k = open_
        # the path ends at a run's ends
        reach = np.minimum(v[k] * x[k], np.minimum(here[k] - begin[k], end[k] - here[k]))
        D = guide_point(guide, here[k] - reach) + guide_point(guide, here[k] + reach) - 2.0 * middle[k]
        by_error = w[k] * np.linalg.norm(D, axis=1) / guide.tol[at[k]]
        over = np.maximum(by_error, (np.abs(D) / acceleration).max(axis=1) / x[k] ** 2)
        v[k] *= np.maximum(MEAN_STEP_MIN, 1.0 / np.sqrt(np.maximum(over, 1.0)))
        open_ = k[over > 1.0 + MEAN_OVER]
        if not len(open_):
            break
    return v


def _slower_corners(
    guide: ChordGuide, v: FloatArray, most: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """(R,) how much slower the chords of corners have to be to last as long as the gap [-]; else 1."""
    chord = np.flatnonzero(guide.corner >= 0)
    by = np.ones(len(guide))
    if not len(chord):
        return by
    first = np.flatnonzero(np.diff(guide.corner[chord], prepend=-2))
    at, run = chord[first], guide.run[chord[first]]
    last = np.append(chord[first[1:] - 1], chord[-1])
    V = np.sqrt(most[at] * most[last])
    gap = T1[run] + T2[run] - overlap_time(guide.whole[at], V, guide.sin_half[at], T1[run], T2[run])
    lasting = np.add.reduceat(guide.length[chord] / v[chord], first)
    share = np.minimum(lasting / np.maximum(gap, 1e-300), 1.0)
    by[chord] = np.repeat(share, np.diff(np.append(first, len(chord))))
    return by


def guide_point(guide: ChordGuide, s: FloatArray) -> FloatArray:
    """(n, A) points of the chords [mm] at the lengths s (n,) from the start [mm]."""
    return np.stack([np.interp(s, guide.s, axis) for axis in guide.point.T], axis=1)
