"""Closed paths at equal distances from the walls of a pocket, as complex numbers in its plane.

    RoundedRectangle    also circles (both halves equal to the corner radius) and straight slots (corner radius half the width)
    ArcSlot             a slot along an arc

`loop(d)` is the path at the distance d from the walls, 0 <= d < room; what is left at d = room is a line or an arc, the `core`, or a
point. A tool of radius r whose centre runs along `loop(r)` touches all walls and cuts none of them, where corners have a radius of at
least r.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Protocol

_SHORT = 1e-9  # relative length of a leg that is left out


@dataclass(frozen=True)
class PocketLeg:
    """A straight leg to its end, or an arc about a centre (turning 1 counter-clockwise, -1 clockwise)."""

    end: complex
    centre: complex = 0j
    turning: int = 0


Path = tuple[complex, list[PocketLeg]]  # a start and the legs from there


class PocketShape(Protocol):
    """A pocket. room: the largest distance of a point of it from the walls; corner : radius of its corners."""

    @property
    def room(self) -> float:
        """Half the width."""

    @property
    def corner(self) -> float:
        """The smallest radius that the walls turn inwards with."""

    def loop(self, inset: float, turning: int) -> Path:
        """The closed path at a distance from the walls, in a direction."""

    def core(self) -> Path:
        """The path at the distance `room`; no legs for a point."""

    def to_wall(self) -> list[PocketLeg]:
        """From the start of the core to where a straight leg to the start of a loop stays inside."""


@dataclass(frozen=True)
class RoundedRectangle:
    """Half length a along x, half width b along y, radius of the corners."""

    a: float
    b: float
    corner: float

    @property
    def room(self) -> float:
        """Half the shorter side."""
        return min(self.a, self.b)

    def loop(self, inset: float, turning: int) -> Path:
        """From the middle of the left wall round, counter-clockwise (turning 1) or clockwise."""
        a, b = self.a - inset, self.b - inset
        r = min(max(self.corner - inset, 0.0), a, b)
        legs: list[PocketLeg] = []
        place = start = complex(-a, 0.0)
        for corner, before, after in (
            (complex(-a, -b), -1j, 1),
            (complex(a, -b), 1, 1j),
            (complex(a, b), 1j, -1),
            (complex(-a, b), -1, -1j),
        ):
            first, last = corner - r * before, corner + r * after
            if abs(first - place) > _SHORT * (a + b):
                legs.append(PocketLeg(first))
            if r > _SHORT * (a + b):
                legs.append(PocketLeg(last, corner - r * before + r * after, 1))
            place = last
        if abs(start - place) > _SHORT * (a + b):
            legs.append(PocketLeg(start))
        if turning < 0:
            legs = [PocketLeg(leg.end.conjugate(), leg.centre.conjugate(), -leg.turning) for leg in legs]
        return start, legs

    def to_wall(self) -> list[PocketLeg]:
        """None: every straight leg stays inside."""
        return []

    def core(self) -> Path:
        """From the middle to the one end and to the other."""
        along = complex(self.a - self.room, self.b - self.room)
        return 0j, [] if along == 0 else [PocketLeg(along), PocketLeg(-along)]


@dataclass(frozen=True)
class ArcSlot:
    """A slot of half width b along an arc about 0 with a radius, from an angle on, by a sweep, counter-clockwise if positive [rad]."""

    radius: float
    b: float
    begin: float
    sweep: float

    @property
    def room(self) -> float:
        """Half the width."""
        return self.b

    @property
    def corner(self) -> float:
        """Radius of the ends."""
        return self.b

    def loop(self, inset: float, turning: int) -> Path:
        """From the tip of the far end round."""
        w, way = self.b - inset, 1 if self.sweep > 0 else -1
        near, far = cmath.rect(1.0, self.begin), cmath.rect(1.0, self.begin + self.sweep)
        inner, outer = self.radius - w, self.radius + w
        start = far * (self.radius + 1j * way * w)
        # the far end, inwards; the inner wall back; the near end; the outer wall forth; and the far end again
        legs = [
            PocketLeg(inner * far, self.radius * far, way),
            PocketLeg(inner * near, 0j, -way),
            PocketLeg(outer * near, self.radius * near, way),
            PocketLeg(outer * far, 0j, way),
            PocketLeg(start, self.radius * far, way),
        ]
        return (start, legs) if turning == way else (start, backwards(start, legs))

    def to_wall(self) -> list[PocketLeg]:
        """Along the arc to the far end."""
        return self.core()[1]

    def core(self) -> Path:
        """Along the arc."""
        near, far = cmath.rect(self.radius, self.begin), cmath.rect(self.radius, self.begin + self.sweep)
        return near, [PocketLeg(far, 0j, 1 if self.sweep > 0 else -1)]


def backwards(start: complex, legs: list[PocketLeg]) -> list[PocketLeg]:
    """The legs from their end to the start."""
    ends = [start, *(leg.end for leg in legs)]
    return [
        PocketLeg(end, leg.centre, -leg.turning)
        for end, leg in zip(reversed(ends[:-1]), reversed(legs), strict=True)
    ]


def loops(shape: PocketShape, outermost: float, step: float, turning: int) -> list[Path]:
    """The core and the closed paths from inside to outside that clear a pocket.

    outermost : distance of the last path from the walls: the tool's radius and the allowance
    step      : most between two paths

    Raises ValueError if the pocket is too narrow for the tool.
    """
    width = shape.room - outermost
    if width < -_SHORT * shape.room:
        raise ValueError(
            f"the pocket leaves room for a tool of radius {shape.room:.6g} mm less its allowance; the tool is larger"
        )
    if width <= _SHORT * shape.room:
        return [shape.core()]
    count = max(1, math.ceil(width / step - _SHORT))
    found = [shape.core()]
    found += [shape.loop(outermost + k * width / count, turning) for k in range(count - 1, -1, -1)]
    return found
