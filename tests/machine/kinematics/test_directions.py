"""Rotary angles from directions, and what happens at the pole."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine.kinematics.chain import Chain
from planner.machine.kinematics.directions import rotary_along
from planner.machine.parts import KinematicsData

CHAIN = Chain(data=KinematicsData(type="xyzac-trt"), length=0.0)
TOLERANCE = np.radians(0.1)


def seen(angles: np.ndarray) -> np.ndarray:
    place = {"a": angles[:, 0], "c": angles[:, 1]}
    return np.stack(np.broadcast_arrays(*CHAIN.direction(place)), axis=1)


def plane(tilt: np.ndarray, offset: float) -> np.ndarray:
    """Directions in a plane that passes the pole at the angle `offset`."""
    return np.stack(
        [np.sin(tilt) * np.cos(offset), np.full(len(tilt), np.sin(offset)), np.cos(tilt) * np.cos(offset)], 1
    )


def test_angles_give_the_directions_and_turn_without_jumps() -> None:
    turn = np.linspace(0.0, 5 * np.pi, 200)
    directions = np.stack([0.5 * np.sin(turn), 0.5 * np.cos(turn), np.full(200, 0.9)], axis=1)
    angles = rotary_along(CHAIN, 7.0 * directions, TOLERANCE)
    np.testing.assert_allclose(seen(angles) * np.hypot(0.5, 0.9), directions, atol=1e-12)
    assert np.abs(np.diff(angles[:, 1])).max() < 0.1  # 2.5 turns on end
    assert np.ptp(angles[:, 0]) < 1e-12


def test_through_the_pole_the_tilt_changes_sign_and_c_stays() -> None:
    angles = rotary_along(CHAIN, plane(np.linspace(-0.5, 0.5, 101), 0.0), TOLERANCE)
    assert np.ptp(angles[:, 1]) < 1e-12
    np.testing.assert_allclose(np.abs(np.diff(angles[:, 0])), 0.01, atol=1e-12)


def test_past_the_pole_within_half_the_tolerance_c_is_free() -> None:
    directions = plane(np.linspace(-0.01, 0.01, 402), 0.1 * TOLERANCE)
    angles, exact = (
        rotary_along(CHAIN, directions, tolerance) for tolerance in (TOLERANCE, 0.01 * TOLERANCE)
    )
    away = np.linalg.norm(seen(angles) - directions, axis=1)
    assert 0.1 * TOLERANCE < away.max() <= TOLERANCE
    assert np.abs(np.diff(angles[:, 1])).max() < 0.3 * np.abs(np.diff(exact[:, 1])).max()


def test_past_the_pole_beyond_the_tolerance_c_swings_where_there_are_points_and_else_is_refused() -> None:
    many = np.sinh(np.linspace(-7.0, 7.0, 4001)) / np.sinh(7.0) * 0.5
    angles = rotary_along(CHAIN, plane(many, 3.0 * TOLERANCE), TOLERANCE)
    np.testing.assert_allclose(seen(angles), plane(many, 3.0 * TOLERANCE), atol=1e-12)
    few = plane(np.linspace(-0.5, 0.5, 40), 3.0 * TOLERANCE)
    with pytest.raises(InputError, match=r"line 50: near the pole, .* c turns by .* in one move"):
        rotary_along(CHAIN, few, TOLERANCE, lines=range(30, 70))


@pytest.mark.parametrize(
    ("directions", "tolerance", "said"),
    [
        (np.zeros((2, 3)), 0.1, "row 1 has no length"),
        (np.ones((2, 2)), 0.1, r"\(n, 3\) finite numbers"),
        (np.ones((2, 3)), 0.0, "must be above 0"),
    ],
)
def test_what_is_no_direction_is_refused(directions: np.ndarray, tolerance: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        rotary_along(CHAIN, directions, tolerance)
