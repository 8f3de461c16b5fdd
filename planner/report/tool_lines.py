"""Lines along the tool at places of a path, for pictures of programs with the tool centre point on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import LINEAR_AXES
from planner.nc.program import Kind
from planner.planning.job.at_tip import directions_of

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

TOOL = "#D55E00"
SEEN = 50  # samples looked at for each place: a long motion is not evaluated as a whole
SHARE = 0.12  # length of a line, of the largest extent of the path [-]


def tool_lines(plan: Plan, most: int) -> FloatArray | None:
    """(n, 2, 3) the tip and a point on the tool on feed moves, at up to `most` places that are as far from each other along the path
    [mm]; None where the trajectory is not one of the tip. The plan must have a trajectory."""
    trajectory = plan.trajectory
    if plan.joints is None or trajectory is None:
        return None
    seen = trajectory.rows(np.unique(np.linspace(0, len(trajectory) - 1, SEEN * most).astype(np.int64)))
    at = np.searchsorted(seen.s, np.linspace(0.0, float(seen.s[-1]), most))
    places = seen.rows(np.unique(np.minimum(at, len(seen) - 1)))
    places = places.rows(np.flatnonzero(plan.program.kind[places.block] != Kind.RAPID))
    directions = directions_of(plan, places)
    if directions is None:
        return None
    linear = [k for k, axis in enumerate(trajectory.axes) if axis in LINEAR_AXES]
    tip = places.position[:, linear]
    length = SHARE * float(np.ptp(seen.position[:, linear], axis=0).max())
    return np.stack([tip, tip + length * directions], axis=1)
