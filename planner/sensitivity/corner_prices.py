"""The prices of rounded corners: how much of the cycle time T hangs on the path that they make.

More tolerance makes corners larger. More acceleration makes them smaller: the more a corner could use, the
more of its budget is set aside for the chord error that goes with it (eq. (20)). So the path is rounded again
with a little more of either, and the Lagrangian on the corresponding grid (feedrate/lagrangian.py) tells what
that does to the time, interval by interval:

    dT/dtheta = (L(theta + step) - L(theta)) / step.

What changes inside a corner is the corner's; what changes on a leg is shared by the corners at its ends, by
how much more each of them takes of it. Corner shapes that filters and limits design ("fir", "kinematic") are
scaled there as Bezier corners are, and bend while they grow: they are priced to within a third.
"""

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.lagrangian import Lagrangian, lagrangian
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import moved_grid
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine
from planner.sensitivity.prices import DEAREST, STEP

# Joints on either side of a corner whose sizes it can change (corners/sharing.py).
REACH = 12


class RoundedPath:
    """A solution on a path of M segments with R+1 joints, and what another rounding does to its time."""

    def __init__(
        self,
        samples: PathSamples,
        path: SmoothPath,
        problem: FeedrateProblem,
        solution: FeedrateSolution,
        machine: Machine,
        now: Lagrangian,
    ):
        """now : the Lagrangian of the solution on its own grid"""
        self.samples, self.path, self.machine = samples, path, machine
        self._problem, self._solution, self._now = problem, solution, now

    def change(self, machine: Machine, more: FloatArray | float = 0.0) -> FloatArray:
        """(R+1,) change of the time at every joint [s] with another machine, or `more` tolerance (M+1,)."""
        samples, path = self.samples, self.path
        toolpath = dataclasses.replace(path.toolpath, tolerance=path.toolpath.tolerance + more)
        new = round_corners(toolpath, machine, path.corner, blend_tangents=True)
        moved = feedrate_problem(moved_grid(samples, new), machine)
        moved = dataclasses.replace(moved, limit_scale=self._problem.limit_scale, margin=self._problem.margin)
        change = lagrangian(moved, self._solution).value - self._now.value
        corner, legs = samples.element < 0, len(path.legs)
        total = sums(~samples.element[corner], change[corner], legs + 1)
        on_leg = sums(samples.element[~corner], change[~corner], legs)
        first, second = np.abs(new.d_out - path.d_out)[:-1], np.abs(new.d_in - path.d_in)[1:]
        share = np.divide(first, first + second, out=np.full(legs, 0.5), where=first + second > 0.0)
        total[:-1] += share * on_leg
        total[1:] += (1.0 - share) * on_leg
        return total

    def by_tolerance(self) -> FloatArray:
        """(R+1,) contribution of each joint to dT/d(tolerance of all joints) [s/mm]."""
        step = STEP * float(self.path.toolpath.tolerance.mean())
        return self.change(self.machine, step) / step

    def alone(self, together: FloatArray) -> FloatArray:
        """(M+1,) dT/d(tolerance) at each joint alone [s/mm], 0 but at the dearest.

        together : (R+1,) what `by_tolerance` gives

        Where corners share a leg, one of them takes from the other when it alone grows. The dearest are
        looked at by themselves, as long as all grids for that have no more than `SIZES.priced` points.
        """
        at, step = self.path.legs.first, STEP * self.path.toolpath.tolerance
        price = np.zeros(len(step))
        best = np.argsort(together, kind="stable")[:DEAREST]
        best = np.sort(best[together[best] < 0.0])
        price[at[best]] = together[best]
        batches = _apart(best)
        for batch in batches if len(batches) * len(self.samples) <= SIZES.priced else []:
            more = np.zeros(len(step))
            more[at[batch]] = step[at[batch]]
            before = np.append(0.0, np.cumsum(self.change(self.machine, more)))
            last = np.minimum(batch + REACH + 1, len(at))
            price[at[batch]] = (before[last] - before[np.maximum(batch - REACH, 0)]) / step[at[batch]]
        return price


def _apart(joint: Array) -> list[Array]:
    """Ascending joints in batches whose members change nothing at one another's corners."""
    batches: list[list[int]] = []
    for k in joint.tolist():
        free = next((batch for batch in batches if k - batch[-1] > 2 * REACH), None)
        if free is None:
            batches.append([k])
        else:
            free.append(k)
    return [np.array(batch) for batch in batches]


def sums(index: Array, values: FloatArray, count: int) -> FloatArray:
    """(count,) sums of `values` (n,) by their `index` (n,)."""
    return np.bincount(index, values, count).astype(np.float64)
