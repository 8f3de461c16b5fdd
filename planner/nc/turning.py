"""Roughing cycles of lathes, G71, G72 and G73: from the profile of a part to its passes, as Fanuc and Haas
have them.

Points are complex numbers, z + i x in radii [mm]. The profile leads from A, where the tool stands, to its
first point and along lines and arcs. Moved by the finishing allowance w + i u / 2 it is the last pass of
every cycle; all cycles end at A.

    G71    passes along z at the levels x = C - n d, n = 1, 2 ..., while they lie outside of the profile's first point; C is A moved
           by the allowance. Each runs to where the moved profile crosses its level, leaves by (e, e) at 45
           degrees and goes back fast
    G72    the same with x and z exchanged
    G73    the profile itself, n times, moved by the allowance + (i, k) (n - pass) / (n - 1): from the full (i, k) to nothing

Sources: the formats as Haas describes them (haascnc.com, G71, G73) and Hurco's and Fanuc's programmers'
manuals (G71 U R, G71 P Q U W).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise
from typing import Any

PASSES_MAX = 10_000  # of a cycle: more are a mistake in its depth
SAME = 1e-9  # lengths below this are none [mm]: the rounding of coordinates around 1e3 mm


@dataclass(frozen=True)
class Leg:
    """A move to `end`: a line (turning 0), or an arc about `centre`, counter-clockwise (1) or not (-1); fast,
    at the feed, or in step with the spindle, `pitch` along it in each turn [mm]."""

    end: complex
    turning: int = 0
    centre: complex = 0j
    fast: bool = False
    pitch: float = 0.0

    def moved(self, by: complex) -> Leg:
        """The leg, moved."""
        return replace(self, end=self.end + by, centre=self.centre + by)


@dataclass(frozen=True)
class Contour:
    """A profile: where the tool stands before it, if its first move is fast, its legs from there on."""

    start: complex
    fast: bool
    legs: tuple[Leg, ...]


@dataclass(frozen=True)
class Roughing:
    """How much a pass of G71 or G72 takes."""

    depth: float  # of a pass [mm]
    retract: float  # e, by which the tool leaves each pass in x and z [mm]
    allowance: complex  # left for G70, w + i u / 2 [mm]
    # left by the passes beside it, and taken off by the last one along the profile, k + i i [mm]
    more: complex = 0j


def pattern_repeat(contour: Contour, passes: int, shift: complex, allowance: complex) -> Iterator[Leg]:
    """The moves of G73: `passes` times along the profile, the first off by `shift`. Raises ValueError."""
    if not 1 <= passes <= PASSES_MAX:
        raise ValueError(f"G73 makes 1 to {PASSES_MAX} passes, not {passes}")
    for n in range(passes):
        by = allowance + (shift * (passes - 1 - n) / (passes - 1) if passes > 1 else 0.0)
        yield Leg(contour.start + by, fast=True)
        yield from _along(contour, by)
    yield Leg(contour.start, fast=True)


def stock_removal(contour: Contour, given: Roughing) -> Iterator[Leg]:
    """The moves of G71, whose levels are imaginary parts; those of G72 with x and z exchanged. Raises
    ValueError."""
    _require_one_way(contour)
    moved = [leg.moved(given.allowance + given.more) for leg in contour.legs]
    first, last = moved[0].end, moved[-1].end
    top = contour.start + given.allowance
    height = top.imag - first.imag
    if not given.depth > 0 or abs(height) / given.depth > PASSES_MAX:
        raise ValueError(f"the depth of a pass must be above 0 and lead to at most {PASSES_MAX} passes")
    out = math.copysign(1.0, height)
    ahead = math.copysign(1.0, last.real - first.real)
    yield Leg(top, fast=True)
    n = 1
    while (level := top.imag - out * n * given.depth) * out - first.imag * out > SAME:
        end = _reached(moved, level, out)
        away = complex(-ahead, out) * given.retract
        yield Leg(complex(top.real, level), fast=contour.fast)
        if (end - top.real) * ahead > SAME:
            yield Leg(complex(end, level))
            yield Leg(complex(end, level) + away, fast=True)
            yield Leg(complex(top.real, level + away.imag), fast=True)
        n += 1
    yield Leg(complex(top.real, first.imag), fast=contour.fast)
    yield from _along(contour, given.allowance)
    yield Leg(complex(contour.legs[-1].end.real + given.allowance.real, top.imag), fast=True)
    yield Leg(contour.start, fast=True)


def _along(contour: Contour, by: complex) -> Iterator[Leg]:
    yield replace(contour.legs[0].moved(by), fast=contour.fast)
    yield from (leg.moved(by) for leg in contour.legs[1:])


def _reached(legs: list[Leg], level: float, out: float) -> float:
    """The real part where a profile first reaches a level, behind its first point; else its end."""
    start = legs[0].end
    for leg in legs[1:]:
        if (leg.end.imag - level) * out >= 0.0:
            return _crossing(start, leg, level)
        start = leg.end
    return start.real


def _crossing(start: complex, leg: Leg, level: float) -> float:
    """The real part of the point of a leg, which does not turn back, at a level between its ends."""
    if not leg.turning:
        rise = leg.end.imag - start.imag
        part = (level - start.imag) / rise if abs(rise) > SAME else 0.0
        return start.real + part * (leg.end.real - start.real)
    radius, height = abs(leg.end - leg.centre), level - leg.centre.imag
    reach = math.sqrt(max(radius * radius - height * height, 0.0))
    low, high = sorted((start.real, leg.end.real))
    both = leg.centre.real - reach, leg.centre.real + reach
    return min(max(min(both, key=lambda v: max(low - v, v - high)), low), high)


def _require_one_way(contour: Contour) -> None:
    """See that neither x nor z turns back along the profile. Raises ValueError."""
    if len(contour.legs) < 2:
        raise ValueError("the profile has no move behind its first one")
    at = contour.legs[0].end
    ways = {"z": {0.0}, "x": {0.0}}
    for leg in contour.legs[1:]:
        for direction in _directions(at, leg):
            for axis, part in (("z", direction.real), ("x", direction.imag)):
                if abs(part) > SAME:
                    ways[axis].add(math.copysign(1.0, part))
        at = leg.end
    for axis, found in ways.items():
        if len(found) > 2:
            raise ValueError(
                f"{axis} turns back along the profile: only profiles without pockets (type I) are read; write these passes out"
            )
    if len(ways["x"]) < 2 and len(ways["z"]) < 2:
        raise ValueError("the profile has no move behind its first one")


def _directions(start: complex, leg: Leg) -> list[complex]:
    """Directions of a leg at its ends, and of an arc in the middle of its part of each quadrant."""
    if not leg.turning:
        return [leg.end - start]
    from_centre = start - leg.centre
    sweep = cmath.phase((leg.end - leg.centre) / from_centre) * leg.turning % (2.0 * math.pi)
    begin = cmath.phase(from_centre)
    quarter = math.pi / 2.0
    cuts = [0.0, sweep]
    for n in range(-8, 9):
        turned = (n * quarter - begin) * leg.turning
        if 0.0 < turned < sweep:
            cuts.append(turned)
    cuts.sort()
    middles = [(a + b) / 2.0 for a, b in pairwise(cuts) if b - a > SAME]
    return [1j * leg.turning * from_centre * cmath.exp(1j * leg.turning * m) for m in middles]


def facing(cycle: Callable[..., Iterator[Leg]], *given: Any) -> Iterator[Leg]:
    """The moves of a cycle with x and z exchanged."""
    return map(exchanged, cycle(*map(exchanged, given)))


def exchanged(one: Any) -> Any:
    """A point with x and z exchanged, and a record with all of its points so."""
    if isinstance(one, complex):
        return complex(one.imag, one.real)
    if isinstance(one, tuple):
        return tuple(map(exchanged, one))
    if not is_dataclass(one):
        return one
    values = {field.name: exchanged(getattr(one, field.name)) for field in fields(one)}
    return replace(one, **values | ({"turning": -values["turning"]} if isinstance(one, Leg) else {}))  # type: ignore[type-var]
