"""The frame in force: where the program's points are in the work system, and arcs in it.

The parts of Heidenhain's programmed frame, and rotations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import IN_PLANE, Arc, arc_from_centre, arc_from_radius
from planner.nc.language.travel_rows import CENTRES, RADIUS, TURNS
from planner.nc.state import System


@dataclass
class FrameParts:
    """Heidenhain's: datum shift (3,) [mm], mirror (3,) of 1 and -1, rotation [degrees], scale (3,), centre of the scale (3,) [mm]."""

    datum: FloatArray = field(default_factory=lambda: np.zeros(3))
    mirror: FloatArray = field(default_factory=lambda: np.ones(3))
    rotation: float = 0.0
    scale: FloatArray = field(default_factory=lambda: np.ones(3))
    centre: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def only_shifted(self) -> bool:
        """True if there is nothing but the datum shift."""
        return (self.mirror * self.scale == 1.0).all() and self.rotation % 360.0 == 0.0

    def affine(self) -> tuple[FloatArray, FloatArray]:
        """Matrix (3, 3) and shift (3,). Raises ValueError for what depends on an order that is not known."""
        uneven = len({*np.abs(self.scale)}) > 1
        if self.rotation % 360.0 and (uneven or (self.mirror != 1.0).any()):
            raise ValueError(
                "a rotation (cycle 10) together with a mirror image (8) or a scale of single axes (26) is not read: "
                "which acts first is not documented; let the CAM system write the moves out"
            )
        stretched = np.diag(self.scale * self.mirror)
        about = self.centre - np.diag(self.scale) @ self.centre
        return turned(self.rotation, 2) @ stretched, self.datum + about


def turned(degrees: float, axis: int) -> FloatArray:
    """The matrix (3, 3) of a rotation about an axis."""
    quarter = System(np.zeros(3), degrees)
    plane = quarter.turn(np.array([1.0, 0.0, 0.0])), quarter.turn(np.array([0.0, 1.0, 0.0]))
    a, b = ((1, 2), (2, 0), (0, 1))[axis]
    matrix = np.eye(3)
    matrix[np.ix_([a, b], [a, b])] = np.array([plane[0][:2], plane[1][:2]]).T
    return matrix


_EVEN = 1e-9  # relative error of a frame that still counts as even


class Coordinates:
    """A point p of the program is at matrix p + shift; lengths in mm.

    matrix, shift : (3, 3) and (3,)
    programmed    : the frame as the program has it; a shift alone is a G52 and not in `matrix` and `shift`
    parts         : of a conversational program's frame
    normal        : axis normal to the plane
    """

    def __init__(self) -> None:
        self.matrix, self.shift = np.eye(3), np.zeros(3)
        self.programmed = np.eye(3), np.zeros(3)
        self.parts = FrameParts()
        self.normal = 2

    @property
    def is_plain(self) -> bool:
        """True if the program's points are those of the work system."""
        return not self.shift.any() and bool((self.matrix == np.eye(3)).all())

    @property
    def mirrored(self) -> bool:
        """True if the frame mirrors the plane."""
        return self._plane_size() < 0.0

    def scale(self) -> float:
        """By what the frame multiplies lengths in the plane. Raises ValueError where it does so unevenly."""
        self.check_even()
        return math.sqrt(abs(self._plane_size()))

    def mapped(self, point: FloatArray) -> FloatArray:
        """(3,) where a point (3,) of the program is."""
        return self.matrix @ point + self.shift

    def unmapped(self, point: FloatArray) -> FloatArray:
        """(3,) the point of the program that is there."""
        found: FloatArray = np.linalg.solve(self.matrix, point - self.shift).astype(np.float64)
        return found

    def check_even(self) -> None:
        """Arcs stay arcs. Raises ValueError."""
        plane, normal = list(IN_PLANE[self.normal]), self.normal
        inner = self.matrix[np.ix_(plane, plane)]
        size = abs(self._plane_size())
        off = max(abs(inner.T @ inner - size * np.eye(2)).max(), abs(self.matrix[normal, plane]).max())
        if max(off, abs(self.matrix[plane, normal]).max()) > _EVEN * max(size, 1.0):
            raise ValueError(
                "an arc whose plane the frame scales unevenly, or turns out of itself, is no arc"
            )

    def arc(
        self, start: FloatArray, end: FloatArray, given: Mapping[int, float], clockwise: bool, unit: float
    ) -> Arc:
        """The arc of a row in the work system.

        start, end : (3,) in the program's coordinates
        given      : lengths and turns by letter code

        Raises ValueError for one that does not close.
        """
        self.check_even()
        if RADIUS not in given and not set(CENTRES) & set(given):
            raise ValueError("an arc needs a centre or a radius")
        how = {"normal": self.normal, "clockwise": clockwise, "turns": round(given.get(TURNS, 1.0))}
        if RADIUS in given:
            arc = arc_from_radius(start, end, given[RADIUS], unit=unit, **how)  # type: ignore[arg-type]
        else:
            centre = start + np.array([given.get(letter, 0.0) for letter in CENTRES])
            arc = arc_from_centre(start, end, centre, unit=unit, **how)  # type: ignore[arg-type]
        return Arc(self.mapped(arc.centre), -arc.sweep if self.mirrored else arc.sweep)

    def _plane_size(self) -> float:
        plane = list(IN_PLANE[self.normal])
        return float(np.linalg.det(self.matrix[np.ix_(plane, plane)]))
