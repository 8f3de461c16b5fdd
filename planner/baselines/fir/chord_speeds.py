"""What paper 001 commands: a speed on every chord of a guide; and how it gets slower.

The command runs the guide's chords one after another at a constant speed each.

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

from planner.base.arrays import FloatArray
from planner.baselines.fir.chord_guide import STRAIGHT, ChordGuide, feeds_held
from planner.baselines.fir.columns import per_leg, per_run
from planner.baselines.fir.command import Command, VelocityPulses, command_of
from planner.baselines.fir.measure import slowest
from planner.baselines.fir.slow_down import BEYOND, Made, SpeedPlan, settled_fastest, slowing
from planner.baselines.fir.spline_speeds import filter_lengths, first_speeds
from planner.machine import Machine

# Rounds until everything gets slower with the filters at their longest, so that it ends.
PATIENCE = 40
# Chords that are commanded within this fraction of Td of the one to blame get slower with it [-]: 0.03 saves 0.4 % of the time of ten
# jobs in 1.2 times the planning time, 0.3 costs 0.8 %.
AROUND = 0.1
# T1, and the product T1 T2, get longer at most by these factors, beyond which no command exceeds the limits [-].
MARGINS_MAX = np.array([2.0, 4.0])
# So many largest speeds are tried, from the feed down to this fraction of it [-], or to what legs of the mean length reach from rest to
# rest: half as many are 1.4 % slower on one of ten jobs, 0.4 and 0.08 cost 0.2 and 0.1 % in mean.
SPEEDS, LOWEST = 18, 0.17


@dataclass(frozen=True, eq=False, kw_only=True)
class ChordSpeeds(SpeedPlan):
    """Speeds on the R chords of a guide in S runs.

    v      : (R,) constant speed of each chord [mm/s]
    margin : (S, 2) how much longer than for an isolated step T1 and T1 T2 are [-]
    """

    guide: ChordGuide
    v: FloatArray = per_leg()
    margin: FloatArray = per_run(2)

    def time(self) -> FloatArray:
        """(S,) durations of the runs [s], dwells not counted."""
        return self.guide.total(self.guide.length / self.v) + self.T1 + self.T2

    def command(self) -> Command:
        """All chords at their speeds, one after another, no gaps between them."""
        guide = self.guide
        pulses = VelocityPulses(leg=np.arange(len(guide)), length=guide.length, speed=self.v)
        return command_of(guide, pulses, np.zeros(len(guide) + 1), self.T1, self.T2)

    def slower(self, made: Made, machine: Machine, n: int) -> ChordSpeeds:
        """Slower speeds and longer filters for what the motion exceeds (module text).

        made : the motion of this plan
        n    : rounds before this one; from `PATIENCE` on everything gets slower
        """
        guide, given = self.guide, self.guide.own is not None
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
        return ChordSpeeds(
            guide=guide, v=np.minimum(v, feeds_held(guide, T1, T2)), T1=T1, T2=T2, margin=margin
        )

    def _by_error(self, made: Made) -> FloatArray:
        """(R,) by how much to slow down each chord for the error, or the normal acceleration [-]."""
        guide, command, seen = self.guide, made.command, made.seen
        delay = (self.T1 + self.T2)[guide.run]
        around = AROUND * delay
        duration = guide.length / self.v
        standstills = guide.run  # in the command one follows each run
        begin = command.begin[guide.run] + command.t[np.arange(len(guide)) + standstills] + delay / 2
        factor = slowing(np.maximum(seen.error, seen.normal))
        by = slowest(seen.t, factor, begin - around, begin + duration + around)
        return np.where(guide.kappa > STRAIGHT, by, 1.0)


def promised(guide: ChordGuide, machine: Machine) -> tuple[list[ChordSpeeds], FloatArray]:
    """`SPEEDS` plans with lower and lower largest speeds, not yet slowed down, and the times (n, S) [s] that they promise the S runs.

    guide : its dwells are not looked at
    """
    high = guide.largest(guide.feed)
    corners = np.add.reduceat(np.diff(guide.corner, prepend=-1) > 0, guide.first[:-1])
    leg = guide.total(guide.length) / (1 + corners)
    low = np.minimum(LOWEST * high, np.cbrt(machine.limits("jerk", guide.axes).min() * leg**2 / 4.0))
    plans = [_first_plan(guide, machine, high * (low / high) ** (k / (SPEEDS - 1))) for k in range(SPEEDS)]
    return plans, np.array([plan.time() for plan in plans])


def fastest_speeds(guide: ChordGuide, machine: Machine) -> ChordSpeeds:
    """The fastest of a few plans that keep tolerance and limits, each run by itself.

    guide : without dwells, from `Guide.pick`
    """
    return settled_fastest(*promised(guide, machine), machine)


def _first_plan(guide: ChordGuide, machine: Machine, top: FloatArray) -> ChordSpeeds:
    """First speeds up to `top` (S,) and the filters for them."""
    acceleration = machine.limits("acceleration", guide.axes)
    most, margin = np.minimum(guide.feed, top[guide.run]), np.ones((guide.runs, 2))
    if guide.own is not None:
        T1, T2 = guide.given_filters()
        v = first_speeds(guide, most, acceleration, T1, T2)
    else:
        T1, T2 = filter_lengths(guide, most, machine, margin)
        v = first_speeds(guide, most, acceleration, T1, T2)
        T1, T2 = filter_lengths(guide, v, machine, margin)
    return ChordSpeeds(guide=guide, v=np.minimum(v, feeds_held(guide, T1, T2)), T1=T1, T2=T2, margin=margin)
