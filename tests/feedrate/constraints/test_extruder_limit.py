"""The extruder's limit is part of the problem where the axes alone could break it, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from planner.feedrate.constraints.extruder import TURNING, ExtruderLimit, with_extruder_limit
from planner.machine import load_machine
from planner.machine.user_limit import Place

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


def test_speed_acceleration_and_jerk_are_those_at_which_the_filament_is_at_its_own() -> None:
    """A block that feeds 0.05 mm a millimetre may run twenty times as fast as the extruder, one that feeds none at any speed."""
    limits, ratio = np.array([5.0, 300.0, 9e3]), np.array([0.05, 0.0, 0.2])
    at = Place(AXES, np.zeros((3, 4)), np.zeros((4, 3)), np.array([0, 1, 2, 0]))
    limit = ExtruderLimit(limits, ratio)
    found = limit.bounds(at)
    for bound, of_extruder in zip(found, limits, strict=True):
        np.testing.assert_allclose(bound, of_extruder * np.array([20.0, np.inf, 5.0, 20.0]))
