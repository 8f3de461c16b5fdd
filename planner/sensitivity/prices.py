"""From slopes to what more of every limit saves, for the prices of a path and those of a search.

**Finite changes.** A corner that jerk j lets through within eps takes a time that goes with (eps/j)^(1/3),
one that acceleration lets through with (eps/a)^(1/2), a range at full speed with 1/v. So a price p = dT/d(ln
limit) foretells for r times the limit

    T(r) - T(1)  =  p/n (1 - r^-n),     n = 1/3 for jerk and tolerance, 1/2 for accelerations, 1 for
    velocities and the feed,

and the range is by `WITHIN` of it narrower and wider, and by what a motion made again ends elsewhere for no
other reason. Where only a part of ten per cent more feed can be used, that part is what counts, and the least
is twice as far below it: accelerations behind it hold the motion back, too. Slower by 1.1, a motion with 1.1
of any one limit keeps all the old ones: nothing saves more than T (1 - 1/1.1). Where least and most are so
far apart that their middle may be off by more than `HINT` of itself and more than `HINT_LEAST` of the time,
the saving is a hint only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limits import ACCELERATION, FEED, JERK, LIMITS, VELOCITY
from planner.feedrate.constraints.limits import POWER as DRIVE_POWER
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.machine.user_limit import ScaledLimit
from planner.sensitivity.records import SAVED_MIN, DearCorners, PlacePrices, PriceList

MORE_LIMIT = 0.1  # what is saved is told for so much more of a limit [-] ...
MORE_TOLERANCE = 0.01  # ... and of the tolerance [mm]
STEP = 1e-6  # relative steps of differences: far above rounding, and so small that no leg is opened or closed
DEAREST = 10  # corners that are listed
TOLERANCE = "tolerance"
# T goes with limit^-n where a limit holds all of it, n [-]: lengths with speed, acceleration, jerk.
POWER = {
    **dict.fromkeys((JERK.name, TOLERANCE, DRIVE_POWER.name), 1.0 / 3.0),
    **{ACCELERATION.name: 0.5, VELOCITY.name: 1.0, FEED.name: 1.0},
}
WITHIN = 0.1  # how far a change foretold to 10 % more of a limit may be off [-] (benchmarks/solvers/found_prices.py)
ROUNDING = 1e-9  # of sums over steps [-]
# How far a saving may be off and still be told as a number [-, share of the time].
HINT, HINT_LEAST = 0.15, 1e-4


class Saving(NamedTuple):
    """Time saved, between a least and a most [s]."""

    least: float
    most: float

    @property
    def middle(self) -> float:
        """The middle of the range [s]."""
        return 0.5 * (self.least + self.most)

    def vague(self, cycle_time: float) -> bool:
        """True if the middle may be off by too much to be told as a number."""
        return 0.5 * (self.most - self.least) > max(HINT * abs(self.middle), HINT_LEAST * cycle_time)


class Priced(NamedTuple):
    """dT/d(ln) of a limit or of the tolerance [s], and the share of it that what is saved is told for."""

    kind: str
    slope: float
    ratio: float

    def saved(self) -> float:
        """The saving by the power law of its kind [s]."""
        n = POWER[self.kind]
        return -self.slope / n * (1.0 - self.ratio**-n)

    def saving(self, bound: float, less: float) -> Saving:
        """The least and the most of it, where it is at most `bound` [s]; `less` as in `price_list`."""
        saved = min(self.saved(), bound)
        partly = bound < (1.0 - ROUNDING) * self.saved()
        sure = not partly and self.kind in (FEED.name, TOLERANCE)
        least = 1.0 - max(WITHIN if sure else less, 2.0 * WITHIN if partly else WITHIN)
        return Saving(*sorted((least * saved, (1.0 + WITHIN) * saved)))


def price_list(
    limit: Mapping[str, float],
    slope: Mapping[str, float],
    tolerance: float | None,
    toolpath: Toolpath,
    cycle_time: float,
    *,
    bounds: Mapping[str, float],
    unrest: float,
    less: float = WITHIN,
    unsure: bool = False,
    corners: DearCorners | None,
    places: PlacePrices,
) -> PriceList:
    """The prices of a motion of `cycle_time` [s].

    limit     : limits of axes by name
    slope     : dT/d(ln limit) of these and of the feed [s]
    tolerance : dT/d(tolerance) [s/mm]; None where it is not known
    bounds    : what more of a limit saves at most, by name [s]
    unrest    : by how much a motion made again is faster or slower for no other reason [share of the time]
    less      : by how much more of a limit may save less than foretold [-]; of a steady feed `WITHIN`
    unsure    : whether more of anything may save nothing
    """
    inner = toolpath.tolerance[toolpath.joint != Joint.STOP]  # of most joints between blocks [mm]
    present = float(np.median(inner if len(inner) else toolpath.tolerance))
    more = {name: Priced(name.partition(".")[0], slope[name], 1.0 + MORE_LIMIT) for name in slope}
    if tolerance is not None:
        more[TOLERANCE] = Priced(TOLERANCE, tolerance * present, 1.0 + MORE_TOLERANCE / present)
    saved, ranges = {}, {}
    for name, priced in more.items():
        least, longest = priced.saving(bounds.get(name, np.inf), less)
        if unsure:
            least = min(least, 0.0)
        most = cycle_time if name == TOLERANCE else cycle_time * (1.0 - 1.0 / (1.0 + MORE_LIMIT))
        saving = Saving(least - unrest * cycle_time, longest + unrest * cycle_time)
        saved[name], ranges[name] = min(saving.middle, most), Saving(*(min(one, most) for one in saving))
    return PriceList(
        limits={name: slope[name] / limit[name] for name in limit},
        feed=slope[FEED.name],
        tolerance=tolerance,
        saved=saved,
        corners=corners,
        ranges={name: (saving.least, saving.most) for name, saving in ranges.items()},
        hints=tuple(name for name, saving in ranges.items() if saving.vague(cycle_time)),
        places=places,
    )


def dearest(toolpath: Toolpath, price: FloatArray) -> DearCorners:
    """The joints where more tolerance saves most, by the `price` (M+1,) of each [s/mm]."""
    tolerance, n = toolpath.tolerance, POWER[TOLERANCE]
    saved = -price * tolerance / n * (1.0 - (1.0 + MORE_TOLERANCE / tolerance) ** -n)
    best = np.argsort(-saved, kind="stable")[:DEAREST]
    best = best[saved[best] >= SAVED_MIN]
    return DearCorners(
        line=toolpath.line[best - 1],
        position=toolpath.end[best - 1],
        theta=toolpath.theta[best],
        price=price[best],
        saved=saved[best],
    )


def more_of(machine: Machine, name: str, share: float) -> Machine:
    """The machine with a share more of a limit: "velocity.x" of an axis, one with a key of its own in the
    machine file, or "velocity.NAME" of a limit of one's own, whose bound of that quantity is then so much
    larger everywhere."""
    quantity, _, of = name.partition(".")
    key = {limit.name: limit.key for limit in LIMITS if limit.key}.get(name)
    if key is not None:
        return machine.model_copy(update={key: getattr(machine, key) * (1.0 + share)})
    if of in machine.axes:
        limits = machine.axes[of]
        larger = limits.model_copy(update={quantity: getattr(limits, quantity) * (1.0 + share)})
        return machine.model_copy(update={"axes": machine.axes | {of: larger}})
    own = [ScaledLimit(limit, quantity, 1.0 + share) if limit.name == of else limit for limit in machine.own]
    return machine.with_own(own)
