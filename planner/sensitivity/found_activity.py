"""The active limits where path and feed were found together, by the search's steps (joint/shares.py).

A limit, or the tolerance, is active in a step that comes within `HELD` of it; several count in full each.
Shown is the one that has the largest price there. Where the motion of the start stays, it is what held that.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.feedrate.constraints.limits import ACCELERATION, CHORD_ERROR, FEED, JERK, VELOCITY
from planner.geometry.toolpath import Toolpath
from planner.joint import price
from planner.joint.motion import Steps
from planner.joint.parts import FoundRun, Spliced, SplicedRun
from planner.joint.shares import shares
from planner.motion.slowed import Slowed
from planner.motion.timing import MotionInTime
from planner.sensitivity.activity import HELD, NONE, REST, times_of
from planner.sensitivity.records import GridHistory

TOLERANCE = "tolerance"
STANDS = 1e-9  # shorter standstills are rounding of times [s]
PART = SIZES.steps_at_once
SEEN = 1e-3  # period of a trajectory that is looked at at given times only [s]
PRICE_OF = (price.FEED, price.NORMAL, price.ROOM)  # of the shares behind those of the axes


@dataclass
class _Rows:
    """Rows of a history, as they are gathered."""

    names: tuple[str, ...]
    t: list[FloatArray] = field(default_factory=list)
    active: list[Array] = field(default_factory=list)
    reached: list[Array] = field(default_factory=list)

    def add(self, t: FloatArray, active: Array, reached: Array) -> None:
        """Rows that begin at these times, and what is shown and active in them."""
        self.t.append(t)
        self.active.append(active)
        self.reached.append(reached)

    def stand(self, begin: float, lasting: float) -> None:
        """A standstill."""
        if lasting > STANDS:
            rest = np.arange(len(self.names)) == len(self.names) - 1
            self.add(np.array([begin]), np.flatnonzero(rest), rest[None])


def found_history(
    toolpath: Toolpath,
    motion: MotionInTime,
    found: list[FoundRun],
    kept: list[int],
    start: GridHistory | None,
    alone: Mapping[int, GridHistory | None] = MappingProxyType({}),
) -> GridHistory | None:
    """The active limits of a motion of runs `found` along a toolpath, delivered as `motion`; None where the
    start's part in it does not tell. The `start`'s history stays on the runs in `kept`, but for those planned
    by themselves (`alone`)."""
    slowed = motion if isinstance(motion, Slowed) else Slowed(motion=motion, places=())
    motion = slowed.motion
    if not isinstance(motion, Spliced):
        return None
    axes = toolpath.axes
    of_axes = (kind.called(axis) for kind in (JERK, ACCELERATION, VELOCITY) for axis in axes)
    of_laws = (one.run.laws.laws[m].name for one in found for m in one.run.laws.named)
    own = (*of_axes, FEED.name, CHORD_ERROR.name, TOLERANCE, *dict.fromkeys(of_laws))
    known = [each.active_names[:-2] for each in (start, *alone.values()) if each is not None]
    others = tuple(dict.fromkeys(name for each in known for name in each if name not in own))
    names = (*own, *others, NONE, REST)
    rows = _Rows(names)
    parts, whole = zip(motion.runs, motion.begin[:-1].tolist(), strict=True), set(kept)
    for k, one in enumerate(found):
        for lo, hi, stays in [(0, 0, True)] if k in whole else one.ranges():
            part, begin = next(parts)
            if not stays:
                _of_steps(rows, toolpath, one, (lo, hi), (part, begin))
            elif (held := alone.get(k, start)) is None:
                return None
            else:
                _of_start(rows, held, part, begin)
            rows.stand(begin + part.end - part.begin, part.hold)
    t = np.minimum(np.maximum.accumulate(np.concatenate(rows.t)), motion.end)
    t = slowed.run_at(t)
    single, which = np.unique(np.minimum(t, slowed.end), return_inverse=True)
    s, feed = np.empty(len(single)), np.empty(len(single))
    for lo in range(0, len(single), PART):
        these = slice(lo, lo + PART)
        seen = slowed.at(single[these], SEEN)
        s[these], feed[these] = seen.s, seen.feed
    reached = np.concatenate(rows.reached)
    return GridHistory(
        t=t,
        s=s[which],
        feed=feed[which],
        active=np.concatenate(rows.active),
        reached=reached,
        active_names=names,
        share=times_of(reached, np.diff(t, append=slowed.end)) / slowed.end,
    )


def _of_start(rows: _Rows, start: GridHistory, part: SplicedRun, begin: float) -> None:
    """Rows of the start's motion, as far as it is the part that begins at `begin` [s]."""
    index = np.array([rows.names.index(name) for name in start.active_names])
    lo, hi = np.searchsorted(start.t, [part.begin, part.end])
    lo = max(lo - 1, 0)
    t = np.append(np.clip(start.t[lo:hi], part.begin, part.end), part.end)
    reached = np.zeros((hi - lo, len(rows.names)), dtype=bool)
    reached[:, index] = start.reached[lo:hi]
    rows.add(begin + t[:-1] - part.begin, index[start.active[lo:hi]], reached)


def _of_steps(
    rows: _Rows, toolpath: Toolpath, found: FoundRun, which: tuple[int, int], at: tuple[SplicedRun, float]
) -> None:
    """Rows of the steps lo .. hi - 1 of a run, with the standstills around them."""
    (lo, hi), (part, begin) = which, at
    steps, run = found.steps, found.run
    assert steps is not None
    before = toolpath.dwell[run.first[0]] if lo == 0 else 0.0
    rows.stand(begin, before)
    many, named = len(toolpath.axes), run.laws.named
    of_laws = [rows.names.index(run.laws.laws[m].name) for m in named]
    column = np.concatenate(
        [*(quantity * many + run.axis for quantity in range(3)), 3 * many + np.arange(len(PRICE_OF)), of_laws]
    ).astype(np.int64)
    active, reached = np.empty(hi - lo, np.int64), np.zeros((hi - lo, len(rows.names)), dtype=bool)
    for first in range(lo, hi, PART):
        beyond = min(first + PART, hi)
        at_limit, shown = _active(found, max(first - 1, lo), beyond)
        own, to = slice(min(first - lo, 1), None), slice(first - lo, beyond - lo)
        reached[to, column] = at_limit[own]
        active[to] = column[shown[own]]
    reached[:, -2] = ~reached.any(axis=1)
    active = np.where(reached[:, -2], len(rows.names) - 2, active)
    t = begin + before + np.append(0.0, np.cumsum(steps.h[lo:hi]))
    rows.add(t[:-1], active, reached)
    rows.stand(t[-1], part.end - part.begin - (t[-1] - begin))


def _active(found: FoundRun, lo: int, hi: int) -> tuple[Array, Array]:
    """(hi - lo, 3 A + 3 + M) which limits of a run the steps lo .. hi - 1 come near to (joint/shares.py), and which of them
    (hi - lo,) has the largest price."""
    steps, place, run, moving = found.steps, found.place, found.run, len(found.run.axis)
    assert steps is not None
    assert place is not None
    names = ("h", "position", "velocity", "acceleration", "jerk")
    own = Steps(**{name: getattr(steps, name)[lo:hi] for name in names})
    leg = run.leg_at((place[lo:hi] + place[lo + 1 : hi + 1]) / 2.0)
    used = shares(run, own, leg, place[lo : hi + 1]) >= 1.0 - HELD
    paid = np.zeros(used.shape)
    if found.price is not None:
        behind = (*PRICE_OF, *(price.LAWS + m for m in run.laws.named))
        of = [*range(3 * moving), *(3 * moving + column for column in behind)]
        paid = -found.price[lo:hi, of]
        paid[:, 3 * moving + PRICE_OF.index(price.ROOM)] -= found.price[lo:hi, 3 * moving + price.VERTEX]
    return used, np.argmax(np.where(used, 1.0 + paid / own.h[:, None], 0.0), axis=1)
