"""Setpoints of the joints, judged at the tip: what is planned passes, and each fault put into the joints is found."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.machine.kinematics import at_tip, kinematics_of
from planner.motion.chain_setpoints import joint_setpoints, tip_of_setpoints
from planner.motion.trajectory import Trajectory
from planner.verifier import Given, verify
from planner.verifier.joints import verify_joints
from tests.machine.kinematics.five_axis import table_machine, tip_program

MACHINE = table_machine(y_offset=-20.0, z_offset=35.0)


@pytest.fixture(scope="module")
def plan():
    t = np.linspace(0.0, 1.0, 25)
    tip = np.stack([30 * t, 10 * np.sin(4 * t), 2 * t, 0.2 * np.sin(5 * t), 0.5 * t**2], axis=1)
    return planner.plan(tip_program(MACHINE, tip, 40.0, 0.01), at_tip(MACHINE), method="second-order")


@pytest.fixture(scope="module")
def setpoints(plan) -> Trajectory:
    return joint_setpoints(plan.require().trajectory, kinematics_of(MACHINE))


NOT_LIMITED = ("jerk",)


def turned(motion: Trajectory, angle: float) -> np.ndarray:
    """An angle of the tilting axis [rad] as the trajectory has it."""
    return np.array([0.0, 0.0, 0.0, angle * getattr(motion, "radius", 1.0), 0.0])


@pytest.mark.slow
def test_planned_joints_pass(plan, setpoints: Trajectory) -> None:
    found = verify_joints(setpoints, plan.toolpath, MACHINE, not_limited=NOT_LIMITED)
    assert found.faults == ()
    assert found.passed
    assert found.contour_error_mm <= 0.01 + 1e-9
    verdict = plan.verdict
    for name in ("velocity.x", "acceleration.y", "velocity.z"):  # two codes, one motion
        quantity, _, letter = name.partition(".")
        planned = verdict.limits[f"{quantity}.joint {letter}"].ratio
        assert found.limits[name].ratio == pytest.approx(planned, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda q: {"position": q.position + np.array([0.03, 0, 0, 0, 0])}, "contour|start"),
        (lambda q: {"position": q.position + np.outer(np.sin(q.t), turned(q, 0.002))}, "contour"),
        (lambda q: {"t": 0.5 * q.t, "dt": 0.0005}, "joint acceleration"),
        (lambda q: {"velocity": 9.0 * q.velocity}, "joint velocity"),
    ],
    ids=["shifted", "tilted", "too fast", "other columns"],
)
def test_faults_are_found(plan, setpoints: Trajectory, change, said: str) -> None:
    changed = dataclasses.replace(setpoints, **change(setpoints))
    found = verify_joints(changed, plan.toolpath, MACHINE, not_limited=NOT_LIMITED)
    assert not found.passed
    assert any(re.search(said, str(fault)) for fault in found.faults), found.faults


@pytest.mark.slow
def test_another_tool_carries_the_tip_elsewhere(plan, setpoints: Trajectory) -> None:
    found = verify_joints(setpoints, plan.toolpath, MACHINE, tool_length=1.0, not_limited=NOT_LIMITED)
    assert not found.passed


@pytest.mark.slow
def test_setpoints_far_apart_leave_the_path_between_them(plan, setpoints: Trajectory) -> None:
    """Every fiftieth of them: the tips are on the path, the straight motion of the joints between them is not."""
    few = np.unique(np.append(np.arange(0, len(setpoints), 50), len(setpoints) - 1))
    sparse = dataclasses.replace(setpoints.rows(few), dt=0.05)
    found = verify_joints(sparse, plan.toolpath, MACHINE, not_limited=NOT_LIMITED)
    assert found.contour_error_mm > 0.01


def test_a_machine_without_kinematics_is_refused(setpoints: Trajectory, plan) -> None:
    without = MACHINE.model_copy(update={"kinematics": None})
    with pytest.raises(InputError, match="no table"):
        verify_joints(setpoints, plan.toolpath, without)


def test_what_lies_between_setpoints_is_added_to_the_error_of_the_tip(plan, setpoints: Trajectory) -> None:
    """Its middle by the planner's own chain, which the judge does not use."""
    few = np.unique(np.append(np.arange(0, len(setpoints), 50), len(setpoints) - 1))
    sparse = dataclasses.replace(setpoints.rows(few), dt=0.05)
    found = verify_joints(sparse, plan.toolpath, MACHINE, not_limited=NOT_LIMITED)
    q = sparse.position
    between = dataclasses.replace(sparse.rows(np.arange(len(q) - 1)), position=0.5 * (q[1:] + q[:-1]))
    tips, middle = (tip_of_setpoints(each, kinematics_of(MACHINE)).position for each in (sparse, between))
    gap = np.linalg.norm(middle - 0.5 * (tips[1:] + tips[:-1]), axis=1).max()
    assert gap > 0.01
    tip = tip_of_setpoints(sparse, kinematics_of(MACHINE))
    alone = verify(tip, plan.toolpath, at_tip(MACHINE), given=Given(columns=()))
    assert found.contour_error_mm == pytest.approx(alone.contour_error_mm + gap, abs=1e-9)
