"""Corners that a method rounds each by itself: their shape, and their speed next to eq. (19), (20) for this
very shape.

    v = sqrt(X / kappa_max),    X = min(A, (eps - eps_ap) / (dt^2/8 + sum T^2/24))

with A as in corners/budget.py. The planned speed at the apex never exceeds it, and reaches it where normal
acceleration or the error budget is what limits. kappa_max is the curvature at the corner's joint, where it is
largest between straight legs (docs/papers.md C); on arcs it is the curvature at the same place. Whether the
delivered motion keeps eq. (18)-(20), at all corners and for all methods, is the verifier's business
(verifier/error_allocation.py), which shares nothing with this.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.solution import FeedrateSolution, active_names, constraint_ratios
from planner.sensitivity.records import CornerTable

STRAIGHT = 1e-9  # [1/mm] a curvature below this is none: a radius of a thousand kilometres


def corner_table(samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution) -> CornerTable:
    """The planned speeds at all rounded corners, beside the closed form. Raises NotSolvedError if there is no
    solution."""
    apex = corner_apexes(samples)
    ratio, which = constraint_ratios(problem, solution)
    before = ratio[apex - 1] > ratio[apex]  # the interval that ends at the apex may be the one that limits it
    limited_by = np.array(active_names(problem))[np.where(before, which[apex - 1], which[apex])]
    return corners_at(samples, apex, np.sqrt(solution.feed_sq[apex]), limited_by)


def corner_apexes(samples: PathSamples) -> Array:
    """(C,) indices of the grid points at the apexes of the corners."""
    middle = (samples.element < 0) & (samples.w0 == 0.5)
    middle[samples.piece[1:] - 1] = False  # they repeat what is said of the interval before
    return np.flatnonzero(middle)


def corners_at(samples: PathSamples, apex: Array, feed: FloatArray, limited_by: Array) -> CornerTable:
    """The table of the corners with their apexes at given grid points; without those that are straight at the
    apex, as a blend between arcs that turn to different sides can be: eq. (19) is no bound there.

    apex       : (C,) indices of grid points
    feed       : (C,) planned speed there [mm/s]
    limited_by : (C,) name of the constraint that is closest to its limit there
    """
    kappa = np.linalg.norm(samples.d2_right[apex], axis=1)
    bent = kappa > STRAIGHT
    apex, feed, limited_by, kappa = apex[bent], feed[bent], limited_by[bent], kappa[bent]
    path, joint = samples.path, ~samples.element[apex]
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
