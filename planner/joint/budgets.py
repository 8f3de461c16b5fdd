"""What the path may use of the tolerance: the rest is for the chord error of the interpolation period and for
the filters behind it (corners/budget.py, eq. (18)-(20))."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.budget import error_rate, normal_anywhere
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine

# Of the tolerance that chords and filters take at most, as long as nothing tells better: where a corner is as fast as
# can be, eq. (20) [-].
HALF = 0.5


class Budgets(NamedTuple):
    """The parts of the tolerance that R legs and the R+1 vertices around them may use, eps_ap, and what the
    rest of it allows."""

    leg: FloatArray  # (R,) [mm]
    vertex: FloatArray  # (R+1,) 0 at both ends [mm]
    across: FloatArray  # (R,) normal acceleration [mm/s2]
    reserved: FloatArray  # (R,) that is asked for [mm/s2]

    def part(self, begin: int, end: int) -> "Budgets":
        """Those of the legs begin .. end - 1, as a run."""
        legs, vertex = slice(begin, end), self.vertex[begin : end + 1].copy()
        vertex[[0, -1]] = 0.0
        return Budgets(self.leg[legs], vertex, self.across[legs], self.reserved[legs])


def budgets_of(
    toolpath: Toolpath,
    machine: Machine,
    first: Array,
    reserved: FloatArray | None = None,
    share: FloatArray | float = HALF,
) -> Budgets:
    """The budgets by eq. (18)-(20) for the legs that hold the segments first[r] : first[r+1], first (R+1,).

    reserved : (R,) normal acceleration that chords and filters get room for [mm/s2]; None for the largest
               that the axes can give
    share    : (R,) of the tolerance that they take at most [-]
    """
    reachable = normal_anywhere(machine, toolpath.axes)
    rate = error_rate(machine)
    row = first[:-1]  # the segment that stands for its leg
    tol_leg = np.maximum(toolpath.tolerance[row], toolpath.tolerance[row + 1])
    most = np.full(len(tol_leg), reachable) if reserved is None else np.minimum(reserved, reachable)
    share = np.broadcast_to(share, len(row))
    chords = np.minimum(rate * most, share * tol_leg)
    at_vertex = np.minimum(
        toolpath.tolerance[first], np.minimum(np.append(tol_leg, np.inf), np.append(np.inf, tol_leg))
    )
    beside, at_most = (np.maximum(np.append(one, 0.0), np.append(0.0, one)) for one in (chords, share))
    vertex_ap = at_vertex - np.minimum(beside, at_most * at_vertex)
    vertex_ap[[0, -1]] = 0.0
    return Budgets(tol_leg - chords, vertex_ap, chords / rate, most)
