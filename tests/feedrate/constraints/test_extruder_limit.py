"""The extruder's limit is part of the problem where the axes alone could break it, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from planner.feedrate.constraints.extruder import TURNING, ExtruderLimit, with_extruder_limit
from planner.machine import load_machine

ROUTER = load_machine("router")
AXES = ("x", "y", "z")


@pytest.mark.parametrize("which", [1, 2])
@pytest.mark.parametrize(("share", "joins"), [(0.99, False), (1.01, True), (1.5, True)])
def test_it_joins_where_the_axes_can_reach_it(which: int, share: float, joins: bool) -> None:
    """Along the diagonal the axes together reach the norm of their accelerations; of jerk twice that, where the path turns."""
    quantity = ("velocity", "acceleration", "jerk")[which]
    reach = float(np.linalg.norm(ROUTER.limits(quantity, AXES))) * (TURNING if which == 2 else 1.0)
    limits, ratio = np.array([1e9, 1e12, 1e15]), 0.05
    limits[which] = ratio * reach / share
    machine = with_extruder_limit(ROUTER, AXES, limits, np.array([0.01, ratio]), np.array([0, 1]))
    assert any(isinstance(limit, ExtruderLimit) for limit in machine.own) == joins
