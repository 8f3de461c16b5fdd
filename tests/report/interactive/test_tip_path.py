"""Programs of points of the tip: what they hold, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.machine.kinematics import at_tip, kinematics_of
from planner.report.interactive.points import tip_path
from tests.machine.kinematics.five_axis import table_machine

MACHINE = table_machine(tool_length=60.0)
TIPS = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [10.0, 3.0, 0.0]])


def test_directions_and_angles_give_the_same_program() -> None:
    angles = np.array([[0.1, 0.0], [0.2, 0.1], [0.2, 0.3]])
    chain = kinematics_of(MACHINE)
    directions = np.stack(
        np.broadcast_arrays(*chain.direction({"a": angles[:, 0], "c": angles[:, 1]})), axis=1
    )
    by_angles = tip_path(MACHINE, TIPS, angles=angles, feed=20.0, tolerance=0.2)
    by_directions = tip_path(MACHINE, TIPS, directions=3.0 * directions, feed=20.0, tolerance=0.2)
    np.testing.assert_allclose(by_directions.end, by_angles.end, atol=1e-12)
    assert by_angles.axes == ("x", "y", "z", "a", "c")
    assert by_angles.end[0, 2] == 60.0  # the tool's length, as G43 adds it


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"tips": TIPS[:, :2], "angles": np.zeros((3, 2))}, r"tips: shape \(3, 2\)"),
        ({"tips": TIPS}, "either directions of the tool or angles"),
        ({"tips": TIPS, "angles": np.zeros((2, 2))}, "2 for 3 tips"),
        ({"tips": TIPS, "directions": np.zeros((3, 3))}, "has no length"),
    ],
)
def test_what_is_no_path_of_the_tip_is_refused(given: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        tip_path(MACHINE, **given)


@pytest.mark.slow
def test_a_tool_that_stands_upright_needs_no_other_time_than_three_axes() -> None:
    """Law: with both angles at 0 the joints are the tip, and the plan is that of x, y, z."""
    points = np.stack([np.linspace(0.0, 40.0, 9), 5.0 * np.sin(np.arange(9.0)), np.zeros(9)], axis=1)
    five = planner.plan(
        tip_path(MACHINE, points, angles=np.zeros((9, 2)), feed=80.0), at_tip(MACHINE), method="second-order"
    )
    three = planner.plan(planner.path(points, 80.0), MACHINE, method="second-order")
    assert five.require().verdict.passed
    assert five.cycle_time == pytest.approx(three.cycle_time, rel=0.02)
