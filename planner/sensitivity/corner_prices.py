"""The prices of corners: how much of the cycle time hangs on the size of each rounded corner, and on its
error budget.

1. Every corner is grown to scale by a little, its legs giving way, and the Lagrangian on the corresponding
grid tells what that does
   to the time: dT/d(size) of each corner, from one evaluation of the path, or two where it has arcs;
2. the multipliers of the chord (and filter) error bounds are dT/d(ln budget) of each corner; 3. the path is
rounded again with a little more tolerance, or acceleration; by how much that changes sizes and budgets,
shared legs
   included, times 1. and 2. is the price.

Growing to scale is what Bezier corners do. Corner shapes that limits and filters design ("fir", "kinematic")
bend while they grow: there acceleration and jerk are priced with the shape as it is, and the tolerance to
within 10 % (kinematic) or a third (fir).

Single corners are not solved for again. What accelerations let through a corner goes with the root of its
size, so

    saved = -dT/dtol 2 tol (sqrt(1 + more/tol) - 1),

against plans made again, for 10 um at each of 40 corners of five jobs, mostly within 10 % at a tolerance of
50 um; mostly within 15 % at 10 um, where three corners soon hit another limit and saved two thirds of it.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.limits import ACCELERATION, CHORD_ERROR, FILTER_ERROR
from planner.feedrate.constraints.on_grid import interval_sides
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.lagrangian import Lagrangian, lagrangian
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.rows import FREE_PART_MIN
from planner.feedrate.sampling.samples import moved_grid
from planner.feedrate.solution import FeedrateSolution
from planner.geometry.toolpath import lesser_end
from planner.machine import Machine
from planner.sensitivity.prices import MORE_TOLERANCE, STEP, dearest_of
from planner.sensitivity.records import DearCorners
from planner.sensitivity.savings import more_of

STEP_OF_LEG = 1e-2  # of differences, at most: a share of the free part of a leg [-]
CANDIDATES = 30  # corners whose own price is looked at
# Joints on either side of a corner whose sizes it can change: neighbours share legs, one more in each round
# (corners/sharing.py).
REACH = 12
TIGHT = 1e-3  # legs with a smaller free share are shared by their corners, to rounding of that sharing [-]
BUDGETS = (
    CHORD_ERROR.name,
    FILTER_ERROR.name,
)  # bounds in proportion to what the rounding leaves of the tolerance


@dataclass(frozen=True, eq=False, kw_only=True)
class CornerPrices:
    """The prices of the R+1 corners of a path, by the cycle time T."""

    path: SmoothPath
    machine: Machine
    size: FloatArray  # (R+1,) dT/d(d), d the tangent length [s/mm]
    budget: FloatArray  # (R+1,) dT/d(ln budget) of the chord and filter errors [s]
    segment: FloatArray  # (M,) the same of the budgets of segments between corners [s]

    def by_acceleration(self, axis: str) -> float:
        """dT/d(ln acceleration) of an axis, as far as it acts through sizes and budgets of the corners
        [s]."""
        machine = more_of(self.machine, ACCELERATION.called(axis))(STEP)
        return float(self._change(machine, self.path.toolpath.tolerance).sum()) / STEP

    def by_tolerance(self) -> FloatArray:
        """(R+1,) contribution of each corner to dT/d(tolerance of all corners) [s/mm]; `between` is that of
        the segments."""
        before = self.path.toolpath.tolerance
        step = STEP * float(before.mean())
        return self._change(self.machine, before + step) / step

    def between(self) -> float:
        """dT/d(tolerance) through the error bounds of the segments between corners [s/mm]."""
        return float((self.segment / lesser_end(self.path.toolpath.tolerance)).sum())

    def dearest(self, together: FloatArray) -> DearCorners:
        """Prices of single corners.

        together : (R+1,) price of each corner when the tolerance of all is raised [s/mm]

        Of corners that share a leg only the `CANDIDATES` with the largest `together` are looked at.
        """
        toolpath, at = self.path.toolpath, self.path.legs.first
        joint = np.argsort(-np.asarray(_saved(together, self.path.tol)), kind="stable")[:CANDIDATES]
        joint = np.sort(joint[together[joint] < 0.0])
        price = together[joint]
        step = STEP * toolpath.tolerance[at]
        shared = np.flatnonzero(self._shares_leg()[joint])
        for batch in _apart(joint, shared):
            tolerance = toolpath.tolerance.copy()
            tolerance[at[joint[batch]]] += step[joint[batch]]
            change = self._change(self.machine, tolerance)
            for k in batch:
                near = slice(max(joint[k] - REACH, 0), joint[k] + REACH + 1)
                price[k] = change[near].sum() / step[joint[k]]
        saved = np.asarray(_saved(price, self.path.tol[joint]))
        return dearest_of(toolpath, at[joint], price, saved)

    def _shares_leg(self) -> Array:
        """(R+1,) True for the corners that can take something from a neighbour: a leg beside them has next to
        nothing free."""
        path = self.path
        tight = path.legs.length - path.d_out[:-1] - path.d_in[1:] < TIGHT * path.legs.length
        return np.append(tight, False) | np.insert(tight, 0, False)

    def _change(self, machine: Machine, tolerance: FloatArray) -> FloatArray:
        """(R+1,) change of the time by every corner if the path is rounded for another machine and another
        tolerance (M+1,) [s]."""
        path = self.path
        toolpath = dataclasses.replace(path.toolpath, tolerance=tolerance)
        new = round_corners(toolpath, machine, path.corner, blend_tangents=True)
        budgets = np.log((new.tol - new.tol_ap) / (path.tol - path.tol_ap))
        return self.size * (new.d - path.d) + self.budget * budgets


def _apart(joint: Array, shared: Array) -> list[list[int]]:
    """Indices `shared` into ascending joints, in batches whose members change nothing at one another's
    corners."""
    batches: list[list[int]] = []
    for k in shared:
        for batch in batches:
            if joint[k] - joint[batch[-1]] > 2 * REACH:
                batch.append(int(k))
                break
        else:
            batches.append([int(k)])
    return batches


def corner_prices(
    path: SmoothPath,
    samples: PathSamples,
    problem: FeedrateProblem,
    solution: FeedrateSolution,
    machine: Machine,
    now: Lagrangian,
) -> CornerPrices:
    """Grow every corner a little (module text, 1.) and sort the multipliers of the error bounds by corner
    (2.).

    now : the Lagrangian of the solution on its own grid
    """
    joints = np.arange(len(path.d))
    corner, leg = samples.element < 0, np.maximum(samples.element, 0)
    growth, total = _growth(path), np.zeros(len(joints))
    # Between straight legs it does not matter at which end a leg gives way; on arcs the ends differ, and take
    # turns.
    turns = (joints % 2 == 0, joints % 2 == 1) if path.legs.table["round"].any() else (joints >= 0,)
    for own in turns:
        by = np.where(own, growth, 0.0)
        grown = dataclasses.replace(path, scale=path.scale * (1.0 + by)[:, None])
        moved = feedrate_problem(moved_grid(samples, grown), machine)
        moved = dataclasses.replace(moved, limit_scale=problem.limit_scale, margin=problem.margin)
        there = lagrangian(moved, solution)
        change = there.value - now.value
        total += sums(~samples.element[corner], change[corner], len(joints))
        on_leg = sums(leg[~corner], change[~corner], len(joints) - 1)
        first, second = by[:-1] * path.d_out[:-1], by[1:] * path.d_in[1:]
        share = np.divide(first, first + second, out=np.zeros(len(first)), where=first + second > 0)
        total[:-1] += share * on_leg
        total[1:] += (1.0 - share) * on_leg
    # A bound of an error belongs to the interval on its right if that is in a corner, else to the one on its
    # left.
    left, right = interval_sides(samples)
    side = np.where(corner[right], right, left)
    names = [k for k, name in enumerate(problem.bound_names) if name in BUDGETS]
    of_budget = np.where(np.isin(problem.feed_sq_bound, names), now.feed_sq_max, 0.0)
    inside = corner[side]
    return CornerPrices(
        path=path,
        machine=machine,
        size=np.divide(total, growth * path.d, out=np.zeros(len(joints)), where=path.d > 0),
        budget=sums(~samples.element[side[inside]], of_budget[inside], len(joints)),
        segment=sums(samples.segment[side[~inside]], of_budget[~inside], len(path.toolpath)),
    )


def _growth(path: SmoothPath) -> FloatArray:
    """(R+1,) by what share to grow the corners, less where the legs have next to nothing to give; legs
    without a free part do not count, their corners grow over each other."""
    taken = path.d_out[:-1] + path.d_in[1:]
    free = path.legs.length - taken
    gives = (free > FREE_PART_MIN * path.legs.length) & (taken > 0)
    most = np.divide(STEP_OF_LEG * free, taken, out=np.full(len(free), STEP), where=gives)
    beside = np.full((2, len(path.d)), STEP)
    beside[0, :-1], beside[1, 1:] = most, most
    return np.minimum(beside.min(axis=0), STEP)


def sums(index: Array, values: FloatArray, count: int) -> FloatArray:
    """(count,) sums of `values` (n,) by their `index` (n,)."""
    return np.bincount(index, values, count).astype(np.float64)


def _saved(price: FloatArray | float, tol: FloatArray | float) -> FloatArray | float:
    """Seconds that `MORE_TOLERANCE` saves (module text)."""
    return -2.0 * price * tol * (np.sqrt(1.0 + MORE_TOLERANCE / tol) - 1.0)
