"""The parts of Heidenhain's programmed frame, and rotations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
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
        """Whether there is nothing but the datum shift."""
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
