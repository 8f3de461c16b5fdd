"""Roughing cycles of lathes, G71, G72 and G73: from the profile of a part to its passes, as Fanuc and Haas
have them.

Points are complex numbers, z + i x in radii [mm]. The profile leads from A, where the tool stands, to its
first point and along lines and arcs. Moved by the finishing allowance w + i u / 2 it is the last pass of
every cycle; all cycles end at A. Rapid moves at its end only leave it: the last pass makes them.

    G71    passes along z at the levels x = C - n d, n = 1, 2 ..., while they lie outside of the profile's first point; C is A moved
           by the allowance. Each runs to where the moved profile crosses its level, leaves by (e, e) at 45
           degrees and goes back fast. Where x turns back (a pocket, type II) the passes below one level are
           those of one pocket after the other, each begun along the wall that leads down to it
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
    """The moves of G71, with imaginary levels; of G72 with x and z exchanged. Raises ValueError."""
    count = max((k + 1 for k, leg in enumerate(contour.legs) if k and not leg.fast), default=0)
    if count < 2:
        raise ValueError("the profile has no move at its feed behind its first one")
    cut = replace(contour, legs=contour.legs[:count])  # without the rapid moves that leave it
    removal = _Removal(cut, given)
    top = removal.top
    yield Leg(top, fast=True)
    yield from removal.below(1, removal.whole)
    if removal.at.real != top.real:
        yield Leg(complex(removal.at.real, top.imag), fast=True)
        yield Leg(top, fast=True)
    yield Leg(complex(top.real, removal.first.imag), fast=contour.fast)
    yield from _along(contour, given.allowance)
    yield Leg(complex(contour.legs[-1].end.real + given.allowance.real, top.imag), fast=True)
    yield Leg(contour.start, fast=True)


def has_pocket(contour: Contour) -> bool:
    """True if x turns back along a profile."""
    rises = [leg.end.imag - start.imag for start, leg in _monotone(list(contour.legs)) if not leg.fast]
    return min(rises, default=0.0) < -SAME and max(rises, default=0.0) > SAME


class _Removal:
    """The passes of G71 above a profile along which z does not turn back."""

    def __init__(self, contour: Contour, given: Roughing):
        moved = [leg.moved(given.allowance + given.more) for leg in contour.legs]
        self.given, self.fast = given, contour.fast
        # `top`: C, A moved by the allowance
        self.first, self.top = moved[0].end, contour.start + given.allowance
        self.at, self.pieces = self.top, list(_monotone(moved))  # `at`: where the tool is
        ends = [self.first, *(leg.end for _, leg in self.pieces)]
        height = self.top.imag - self.first.imag
        if abs(height) <= SAME:
            height = max((self.top.imag - end.imag for end in ends), key=abs)
        self.out = math.copysign(1.0, height)
        self.lowest = min(self.out * end.imag for end in ends)
        self.ahead = math.copysign(1.0, ends[-1].real - self.first.real)
        if any((leg.end - start).real * self.ahead < -SAME for start, leg in self.pieces):
            turns = "z turns back along the profile of G71, or x along that of G72"
            raise ValueError(f"{turns}: which passes a control makes is not known; write these passes out")
        depths = (self.out * self.top.imag - self.lowest) / given.depth if given.depth > 0 else math.inf
        if depths > PASSES_MAX:
            raise ValueError(f"the depth of a pass must be above 0 and lead to at most {PASSES_MAX} passes")
        self.whole = self.top.real, ends[-1].real  # the first and the last z of a pass that nothing stops

    def _level(self, n: int) -> float:
        return self.top.imag - self.out * n * self.given.depth

    def _go(self, end: complex, *, fast: bool = True) -> Iterator[Leg]:
        self.at = end
        yield Leg(end, fast=fast)

    def below(self, n: int, span: tuple[float, float]) -> Iterator[Leg]:
        """The passes from level n on below one of the level before, a pocket to its ground before the next."""
        level = self._level(n)
        if self.out * level - self.lowest <= SAME:
            return
        for begin, end, wall in self._free(n):
            if (begin - span[0]) * self.ahead < -SAME or (end - span[1]) * self.ahead > SAME:
                continue
            yield from self._pass(n, begin, end, wall)
            yield from self.below(n + 1, (begin, end))

    def _pass(self, n: int, begin: float, end: float, wall: list[Leg]) -> Iterator[Leg]:
        retract, level = self.given.retract, self._level(n)
        if wall:  # a pocket: over to its wall, and down along that
            above = self._level(n - 1)
            foot = wall[0].end
            for real in (self.at.real, foot.real):
                yield from self._go(complex(real, above + self.out * retract))
            yield from wall
        else:
            yield from self._go(complex(begin, level), fast=self.fast)
        if (end - begin) * self.ahead <= SAME:
            return
        back = min(retract, abs(end - begin)) if wall else retract
        yield from self._go(complex(end, level), fast=False)
        yield from self._go(self.at + complex(-self.ahead * back, self.out * retract))
        yield from self._go(complex(begin, level + self.out * retract))

    def _free(self, n: int) -> Iterator[tuple[float, float, list[Leg]]]:
        """Where the passes at a level begin and end, and the wall that leads down to each from the level
        before, if that is higher: nothing for a pass that begins beside the part."""
        level, walls = self._level(n), list[tuple[complex, Leg]]()
        begin = self.top.real if self.out * (self.first.imag - level) < -SAME else None
        down: list[Leg] = []
        for start, leg in self.pieces:
            low, high = (self.out * (point.imag - level) for point in (start, leg.end))
            if begin is None and high < -SAME:
                begin = _crossing(start, leg, level)
                way = [*walls, (start, replace(leg, end=complex(begin, level)))]
                down = self._wall(way, self._level(n - 1))
            elif begin is not None and high >= -SAME:
                yield begin, _crossing(start, leg, level), down
                begin = None
            walls = [*walls, (start, leg)] if begin is None and high < low else []
        if begin is not None:
            yield begin, self.pieces[-1][1].end.real, down

    def _wall(self, pieces: list[tuple[complex, Leg]], above: float) -> list[Leg]:
        """The way down along pieces of the profile, from where they are below a level."""
        inside = [(start, leg) for start, leg in pieces if self.out * (leg.end.imag - above) < -SAME]
        start, leg = inside[0]
        if self.out * (start.imag - above) > SAME:
            start = complex(_crossing(start, leg, above), above)
        return [Leg(start), *(leg for _, leg in inside)]


def _monotone(legs: list[Leg]) -> Iterator[tuple[complex, Leg]]:
    """The legs behind the first and their starts, arcs in parts along which no axis turns back."""
    at = legs[0].end
    for leg in legs[1:]:
        for end in (*_quadrants(at, leg), leg.end):
            yield at, replace(leg, end=end)
            at = end


def _along(contour: Contour, by: complex) -> Iterator[Leg]:
    yield replace(contour.legs[0].moved(by), fast=contour.fast)
    yield from (leg.moved(by) for leg in contour.legs[1:])


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


def _quadrants(start: complex, leg: Leg) -> list[complex]:
    """The points of an arc, between its ends, straight beside, above and below its centre."""
    if not leg.turning:
        return []
    from_centre = start - leg.centre
    sweep = cmath.phase((leg.end - leg.centre) / from_centre) * leg.turning % (2.0 * math.pi)
    quarter, begin = math.pi / 2.0, cmath.phase(from_centre)
    turns = sorted((n * quarter - begin) * leg.turning for n in range(-8, 9))
    within = SAME / abs(from_centre)
    inside = (turn for turn in turns if within < turn < sweep - within)
    return [leg.centre + from_centre * cmath.exp(1j * leg.turning * turn) for turn in inside]


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
