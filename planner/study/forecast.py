"""What the prices of a plan (sensitivity/prices.py) say of other values of its settings, without planning again.

Of a limit L the price p = dT/d(ln L) is known, and what 10 % more saves, between a least and a most. The cycle time is convex in one
over a limit, so that a straight line there foretells a change to r L as

    T(r L) - T(L)  =  p (1 - 1/r),

for r < 1 at least that much. For r > 1 the line is led through what 10 % more saves instead: saved (1 - 1/r) / (1 - 1/1.1).

Of the tolerance the price is dT/d(tolerance) = s, and what d = 10 um more save is known. More of it saves ever less, for which the
simplest curve through both is taken,

    saved(x)  =  x saved(d)/d (1 + c d) / (1 + c x),      c >= 0 such that its slope at 0 is -s where that is the larger one,

and less of it costs s times the change. Settings without a price have no forecast, and changes at once are added up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from planner.job.records import PriceList
from planner.machine import Machine
from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE
from planner.study.settings import FEED, TOLERANCE, Setting, value_of


class Forecast(NamedTuple):
    """A change of the cycle time, between a least and a most [s]; negative where time is saved."""

    least: float
    most: float

    def __add__(self, other: object) -> Forecast:
        assert isinstance(other, Forecast)
        return Forecast(self.least + other.least, self.most + other.most)


def forecast(
    prices: PriceList | None, settings: Sequence[Setting], machine: Machine, tolerance: float
) -> Forecast | None:
    """What a change of all `settings` at once does to the cycle time; None where one of them has no price.

    tolerance : the present one [mm], NaN if there are several
    """
    total = Forecast(0.0, 0.0)
    for setting in settings:
        found = None if prices is None else _of_one(prices, setting, machine, tolerance)
        if found is None:
            return None
        total = total + found
    return total


def _of_one(prices: PriceList, setting: Setting, machine: Machine, tolerance: float) -> Forecast | None:
    if setting.name == TOLERANCE:
        return _of_tolerance(prices, setting.value - tolerance)
    axis, _, quantity = setting.name.removeprefix("axes.").partition(".")
    name = FEED if setting.name == FEED else f"{quantity}.{axis}"
    present = value_of(setting.name, machine, tolerance)
    if present is None or name not in (FEED, *prices.limits):
        return None
    price = prices.feed if name == FEED else prices.limits[name] * _planned_limit(name, machine)
    ratio = setting.value / present
    share = 1.0 - 1.0 / ratio
    if ratio <= 1.0 or name not in prices.ranges:
        return Forecast(price * share, price * share)
    part = share / (1.0 - 1.0 / (1.0 + MORE_LIMIT))
    least, most = prices.ranges[name]
    return Forecast(-most * part, -least * part)


def _planned_limit(name: str, machine: Machine) -> float:
    """A limit in the unit of its price: mm or rad, and s."""
    quantity, _, axis = name.partition(".")
    return float(machine.limits(quantity, (axis,))[0])  # type: ignore[arg-type]


def _of_tolerance(prices: PriceList, more: float) -> Forecast | None:
    """Of so much more tolerance [mm]."""
    if prices.tolerance is None or not math.isfinite(more):
        return None
    straight = prices.tolerance * more
    if more <= 0.0 or TOLERANCE not in prices.ranges:
        return Forecast(straight, straight)
    saved = prices.saved[TOLERANCE]
    bend = max(-prices.tolerance * MORE_TOLERANCE / saved - 1.0, 0.0) if saved > 0.0 else 0.0  # c d
    part = more / MORE_TOLERANCE
    part *= (1.0 + bend) / (1.0 + bend * part)
    least, most = prices.ranges[TOLERANCE]
    return Forecast(-most * part, -least * part)
