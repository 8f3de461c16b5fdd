"""Limits of the joints on paths of the tip: closed forms, and all limits kept in the joints."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine
from planner.machine.kinematics import at_tip, kinematics_of
from planner.motion.chain_setpoints import joint_setpoints
from planner.planning.job.plan import Plan
from planner.verifier.joints import tip_and_direction
from tests.machine.kinematics.five_axis import table_machine, tip_program

FAST = 1e4  # a feed that holds nothing [mm/s]


def in_rad(machine: Machine, columns: np.ndarray) -> np.ndarray:
    """Columns of the path with their angles in rad."""
    out = columns.copy()
    out[:, 3:] /= getattr(machine, "radius", 1.0)
    return out


def rest_to_rest(machine: Machine, letter: str, angle: float) -> float:
    """Closed form of a turn by an angle [deg] that reaches the axis' velocity and acceleration [s]."""
    axis = machine.axes[letter]
    return angle / axis.velocity + axis.velocity / axis.acceleration + axis.acceleration / axis.jerk


def planned(machine: Machine, points: np.ndarray, feed: float, method: str, **settings: str) -> Plan:
    return planner.plan(tip_program(machine, points, feed, 0.01), at_tip(machine), method=method, **settings)


def test_a_factor_that_would_hold_the_tip_is_refused() -> None:
    with pytest.raises(InputError, match="must be 1 or more"):
        at_tip(table_machine(), wide=0.5)


@pytest.mark.slow
def test_a_point_on_the_axis_of_the_table_turns_at_the_joint_limit() -> None:
    """Closed form: rest to rest through 100 deg with c's limits alone; no linear joint moves."""
    machine = table_machine(x_rot_point=12.0, y_rot_point=-7.0)
    points = np.array([[12.0, -7.0, 5.0, 0.0, 0.0], [12.0, -7.0, 5.0, 0.0, 100.0 * RAD_PER_DEG]])
    plan = planned(machine, points, FAST, "optimal")
    assert plan.require().verdict.passed
    assert plan.cycle_time == pytest.approx(rest_to_rest(machine, "c", 100.0), rel=1e-3)
    joints = joint_setpoints(plan.trajectory, kinematics_of(machine))
    np.testing.assert_allclose(
        joints.position[:, :3], np.tile([12.0, -7.0, 5.0], (len(joints), 1)), atol=1e-9
    )


@pytest.mark.shows("tool-point", "exact: derivatives by casadi, circles by the table alone")
@pytest.mark.slow
def test_a_circle_at_the_tip_by_the_table_alone_takes_the_time_of_its_axis() -> None:
    """Points of a circle about the axis, the tool turning with them: the linear joints stay where they are but for the chords."""
    machine = table_machine(x_rot_point=12.0)
    c = np.linspace(0.0, 1.5 * np.pi, 91)
    circle = np.stack([12.0 + 30.0 * np.cos(c), -30.0 * np.sin(c), 0.0 * c, 0.0 * c, c], axis=1)
    plan = planned(machine, circle, FAST, "optimal")
    assert plan.require().verdict.passed
    exact = rest_to_rest(machine, "c", 270.0)
    assert exact * (1.0 - 1e-4) < plan.cycle_time < 1.02 * exact


@pytest.mark.slow
@pytest.mark.parametrize("method", ["second-order", "optimal"])
def test_joints_keep_their_limits_and_carry_the_tip_along_the_path(method: str) -> None:
    """Setpoints of the joints, brought back to the tip by the verifier's own chain, are those of the tip, and their divided differences
    stay within the machine's limits."""
    machine = table_machine(y_offset=-20.0, z_offset=35.0, tool_length=60.0)
    t = np.linspace(0.0, 0.6, 24)
    tip = [30 * np.cos(5 * t), 20 * np.sin(5 * t), 4 * np.sin(9 * t), 0.3 * np.sin(6 * t), t**2]
    plan = planned(machine, np.stack(tip, axis=1), 80.0, method, effort="quick")
    assert plan.require().verdict.passed
    joints = joint_setpoints(plan.trajectory, kinematics_of(machine))
    found, _ = tip_and_direction(machine.kinematics, 60.0, joints.axes, in_rad(machine, joints.position))
    np.testing.assert_allclose(found, plan.trajectory.position[:, :3], atol=1e-10)
    names = ("velocity", "acceleration", "jerk")[: 2 if method == "second-order" else 3]
    seen, over = joints.position[:-1], np.ones(1)
    for order, name in enumerate(names, start=1):
        seen, over = np.diff(seen, axis=0), over * machine.dt
        ratio = np.abs(seen / over).max(axis=0) / machine.limits(name, joints.axes)
        assert ratio.max() < 1.0 + 1e-6 * 10**order
        assert (np.abs(getattr(joints, name)) / machine.limits(name, joints.axes)).max() < 1.0 + 1e-6
