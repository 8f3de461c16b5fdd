"""The record of a sampled path."""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.corners.elements import ElementTable
from planner.corners.smooth import SmoothPath


@dataclass(frozen=True, eq=False, kw_only=True)
class PathSamples:
    """The path on a grid: G pieces between full stops, P points, one interval to the right of each but the
    last of a piece. A full stop is there twice, as the end of one piece and the start of the next."""

    path: SmoothPath
    table: ElementTable
    piece: Array  # (G+1,) piece g holds the points piece[g] : piece[g+1]
    stop: Array  # (G+1,) joint (0..R) at which each piece starts; the last entry is the end of the path
    s: FloatArray  # (P,) arc length from the start of the job [mm]
    position: FloatArray  # (P, A) [mm]
    d1: FloatArray  # (P, A) r' = dr/ds
    # (P, A) r'' just before and just after the point [1/mm]; they differ where the curvature jumps
    d2_left: FloatArray
    d2_right: FloatArray
    # d3_left and d3_right: (P, A) r''' [1/mm2]
    d3_left: FloatArray
    d3_right: FloatArray
    # (P,) element of the interval to the right (corners/elements.py); of the last interval at a piece's end
    element: Array
    # w0 and w1: (P,) parameter range of that interval on its element
    w0: FloatArray
    w1: FloatArray
    segment: Array  # (P,) toolpath segment of that interval
    margin: FloatArray  # (P,) interpolation error of that interval, share of the acceleration limits [-]
    # (P,) effective curvature in the intervals to the left and to the right [1/mm]
    kappa_left: FloatArray
    kappa_right: FloatArray

    def __post_init__(self) -> None:
        points, axes = np.shape(self.position)
        freeze(self, "piece", np.int64, (None,))
        freeze(self, "stop", np.int64, (len(self.piece),))
        freeze(self, "s w0 w1 margin kappa_left kappa_right", np.float64, (points,))
        freeze(self, "position d1 d2_left d2_right d3_left d3_right", np.float64, (points, axes))
        freeze(self, "element segment", np.int64, (points,))

    def __len__(self) -> int:
        return len(self.s)

    @property
    def intervals(self) -> Array:
        """(n,) indices of the points that have an interval to their right."""
        inner = np.ones(len(self), dtype=bool)
        inner[self.piece[1:] - 1] = False
        return np.flatnonzero(inner)
