"""Corners that a method rounds each by itself: their shape, and their speed next to eq. (19), (20) for this very shape.

    v = sqrt(X / kappa_max),    X = min(A, (eps - eps_ap) / (dt^2/8 + sum T^2/24))

with A as in corners/allocation.py. The planned speed at the apex never exceeds it, and reaches it where normal acceleration or
the error budget is what limits. kappa_max is the curvature at the corner's joint, where it is largest between straight legs
(docs/papers.md C); on arcs it is the curvature at the same place. Whether the delivered motion keeps eq. (18)-(20), at all corners
and for all
methods, is the verifier's business (verify/error_allocation.py), which shares nothing with this.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.arrays import Array, FloatArray, freeze
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, active_names, constraint_ratios
from planner.path import PathSamples


@dataclass(frozen=True, eq=False, kw_only=True)
class CornerTable:
    """One row per blended corner, in the order of the path.

    line             : (C,) source line of the block that ends there
    theta            : (C,) turning angle [rad]
    d_in, d_out      : (C,) tangent lengths before and after the vertex [mm]
    tol_ap           : (C,) budget used by the rounding, eps_ap [mm]
    kappa_max        : (C,) curvature at the apex [1/mm]
    feed_closed_form : (C,) error-allocation speed [mm/s]
    feed_planned     : (C,) planned speed at the apex [mm/s]
    limited_by       : (C,) name of the constraint that is closest to its limit there
    """

    line: Array
    theta: FloatArray
    d_in: FloatArray
    d_out: FloatArray
    tol_ap: FloatArray
    kappa_max: FloatArray
    feed_closed_form: FloatArray
    feed_planned: FloatArray
    limited_by: Array

    def __post_init__(self) -> None:
        corners = len(self.line)
        freeze(self, "line", np.int32, (corners,))
        for name in ("theta", "d_in", "d_out", "tol_ap", "kappa_max", "feed_closed_form", "feed_planned"):
            freeze(self, name, np.float64, (corners,))

    def __len__(self) -> int:
        return len(self.line)

    def worst_ratio(self) -> float:
        """Largest planned over closed-form speed; 0 without corners."""
        return float((self.feed_planned / self.feed_closed_form).max(initial=0.0))


def corner_table(samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution) -> CornerTable:
    """Put the planned speeds at all corners next to the closed form. Raises NotSolvedError without a solution."""
    apex = corner_apexes(samples)
    ratio, which = constraint_ratios(problem, solution)
    before = ratio[apex - 1] > ratio[apex]  # the interval that ends at the apex may be the one that limits it
    limited_by = np.array(active_names(problem))[np.where(before, which[apex - 1], which[apex])]
    return corners_at(samples, apex, np.sqrt(solution.feed_sq[apex]), limited_by)


def corner_apexes(samples: PathSamples) -> Array:
    """(C,) grid points in the middle of the corners."""
    middle = (samples.element < 0) & (samples.w0 == 0.5)
    middle[samples.piece[1:] - 1] = False  # they repeat what is said of the interval before
    return np.flatnonzero(middle)


def corners_at(samples: PathSamples, apex: Array, feed: FloatArray, limited_by: Array) -> CornerTable:
    """The table of the corners whose middles are the grid points `apex` (C,), passed at `feed` [mm/s]."""
    path, joint = samples.path, ~samples.element[apex]
    kappa = np.linalg.norm(samples.d2_right[apex], axis=1)
    return CornerTable(
        line=path.toolpath.line[path.legs.first[joint] - 1],
        theta=path.theta[joint],
        d_in=path.d_in[joint],
        d_out=path.d_out[joint],
        tol_ap=path.tol_ap[joint],
        kappa_max=kappa,
        feed_closed_form=np.sqrt(path.normal_max[joint] / kappa),
        feed_planned=feed,
        limited_by=limited_by,
    )
