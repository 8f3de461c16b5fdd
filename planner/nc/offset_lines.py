"""Lines and circles beside moves of a plane, and where they cross. Points and vectors are complex numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

NOWHERE = 1e-9  # a move that is shorter stays where it is [mm]: the rounding of coordinates around 1e3 mm


@dataclass(frozen=True)
class OffsetMove:
    """An offset move: where it would end, its tangent there and at its start, and its line or circle."""

    end: complex
    first: complex  # unit tangent
    last: complex  # unit tangent
    turning: int = 0  # +1 counter-clockwise, -1 clockwise, 0 for a line
    centre: complex = 0j
    radius: float = 0.0

    def tangent(self, point: complex) -> complex:
        """Unit tangent at a point of the line or circle."""
        if not self.turning:
            return self.first
        spoke = point - self.centre
        return 1j * self.turning * spoke / abs(spoke)


def meeting(before: OffsetMove, after: OffsetMove, sense: float) -> complex | None:
    """Where two offset moves cross in a sense (the sign of the turn from the one to the other), or None."""
    crossing = [
        p for p in _crossings(before, after) if cross(before.tangent(p), after.tangent(p)) * sense > 0
    ]
    return min(crossing, key=lambda p: abs(p - before.end)) if crossing else None


def _crossings(one: OffsetMove, other: OffsetMove) -> Sequence[complex]:
    if not one.turning and not other.turning:
        slope = cross(one.first, other.first)
        if slope == 0.0:
            return []
        along = cross(other.end - one.end, other.first) / slope
        return [one.end + along * one.first]
    if one.turning and other.turning:
        apart = other.centre - one.centre
        distance = abs(apart)
        if distance < NOWHERE:
            return []
        along = (distance**2 + one.radius**2 - other.radius**2) / (2.0 * distance)
        direction, foot, size = 1j * apart / distance, one.centre + along * apart / distance, one.radius
        rest = size**2 - along**2
    else:
        line, circle = (other, one) if one.turning else (one, other)
        direction = line.first
        foot = line.end + dot(circle.centre - line.end, direction) * direction
        rest = circle.radius**2 - abs(foot - circle.centre) ** 2
    if rest < 0.0:
        return []
    reach = math.sqrt(rest)
    return [foot - reach * direction, foot + reach * direction]


def cross(one: complex, other: complex) -> float:
    """Positive where the other vector lies to the left."""
    return (one.conjugate() * other).imag


def dot(one: complex, other: complex) -> float:
    """The scalar product."""
    return (one.conjugate() * other).real
