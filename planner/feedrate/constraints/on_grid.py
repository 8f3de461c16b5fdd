"""The input of the limits: a sampled path on a machine, the sides of its points, the error budget there.

The budget is what the rounding leaves of the tolerance. Where the filters' error is bounded by its closed
form, chords and filters share it in proportion to what they cost per unit of normal acceleration, dt^2/8 :
sum T^2/24 (docs/papers.md D): on programmed lines and arcs always, elsewhere unless the filtered motion is
measured afterwards (planning/optimal/behind_filters.py). There chords have all of it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.budget import chord_rate, error_rate
from planner.feedrate.sampling.path_samples import PathSamples
from planner.geometry.word_feed import allowed_along
from planner.machine import Machine

# Jumps of r'' below this are rounding of the two elements' formulas [share of the larger r''].
JUMP_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False, kw_only=True)
class Side:
    """The curve on one side of P points."""

    kappa: FloatArray  # (P,) effective curvature of the interval (feedrate/sampling/grid.py) [1/mm]
    # (P,) parts of the error budget of chords and of filters [mm]; inf where filters are measured afterwards
    tol_chord: FloatArray
    tol_filter: FloatArray


@dataclass(frozen=True, eq=False)
class OnGrid:
    """A sampled path with P points on a machine."""

    samples: PathSamples
    machine: Machine
    measured: bool = False  # the filters' error is measured afterwards

    @property
    def axes(self) -> tuple[str, ...]:
        """Letters of the A axes."""
        return self.samples.path.toolpath.axes

    @cached_property
    def left(self) -> Array:
        """(P,) index of the interval to the left of every point."""
        return interval_sides(self.samples)[0]

    @cached_property
    def right(self) -> Array:
        """(P,) index of the interval to the right of every point."""
        return interval_sides(self.samples)[1]

    def feed_of_words(self, side: Array) -> FloatArray:
        """(P,) feed in all axes at which what F goes by moves at F, for intervals `side` (P,) [mm/s]."""
        return allowed_along(self.samples.path.toolpath, self.samples.segment[side], self.samples.d1)

    def sides(self) -> tuple[Side, Side]:
        """The curves to the left and to the right of the points."""
        samples, machine = self.samples, self.machine
        budget = remaining_budget(samples)
        closed = _programmed(samples) | (not self.measured)
        share = chord_rate(machine) / error_rate(machine)
        of_chord = np.where(closed, budget * share, budget)
        of_filter = np.where(closed, budget - of_chord, np.inf)
        left, right = (
            Side(kappa=kappa, tol_chord=of_chord[side], tol_filter=of_filter[side])
            for side, kappa in ((self.left, samples.kappa_left), (self.right, samples.kappa_right))
        )
        return left, right

    @property
    def jumps(self) -> tuple[FloatArray, FloatArray]:
        """(P, A) r'' on both sides of every point, made equal where they differ by rounding only [1/mm]."""
        left, right = self.samples.d2_left, self.samples.d2_right
        size = np.maximum(np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1))
        real = np.linalg.norm(right - left, axis=1) > JUMP_ROUNDING * size
        return left, np.where(real[:, None], right, left)


def interval_sides(samples: PathSamples) -> tuple[Array, Array]:
    """(P,) index of the intervals left and right of every point; at a piece's ends the only one there is."""
    right = np.arange(len(samples))
    left = right - 1
    left[samples.piece[:-1]] += 1
    right[samples.piece[1:] - 1] -= 1
    return left, right


def remaining_budget(samples: PathSamples) -> FloatArray:
    """(P,) what rounding leaves of the contour budget for chords and filters, to the right [mm]."""
    path = samples.path
    element = samples.element
    corner = element < 0
    joint = np.where(corner, ~element, 0)
    budget = np.where(corner, path.tol[joint] - path.tol_ap[joint], path.toolpath.along[samples.segment])
    span = element - len(samples.table.legs)
    if (span >= 0).any():
        budget[span >= 0] = path.spline.budget[span[span >= 0]]
    return budget


def _programmed(samples: PathSamples) -> Array:
    """(P,) True for intervals on programmed lines and arcs."""
    return (samples.element >= 0) & (samples.element < len(samples.table.legs))
