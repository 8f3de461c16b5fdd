"""Programs with the tool centre point on: planned at the tip, judged in the joints, from the call that plans."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planner
from planner.machine.kinematics import at_tip, kinematics_of
from planner.motion.on_demand import TrajectoryOnDemand
from planner.nc.reader import parse_program
from planner.planning.job.at_tip import in_joints, room_for_joints
from planner.verifier import verify
from tests.machine.kinematics.five_axis import table_machine

MACHINE = table_machine(y_offset=-20.0, z_offset=35.0, tool_length=60.0)
TEXT = "G21 G90\nG0 X1 Y2 Z50\nM428\nG1 X2 A3 C5 F600\nX3 A6\nM429\nG0 Z52\nM2"


@pytest.fixture(scope="module")
def plan() -> planner.Plan:
    return planner.plan(parse_program(TEXT, MACHINE), MACHINE, method="second-order").require()


@pytest.mark.shows("tool-point", "sampled: planned at the tip, judged in the joints")
@pytest.mark.slow
def test_planned_at_the_tip_and_judged_in_the_joints(plan: planner.Plan) -> None:
    assert plan.verdict is not None
    assert plan.verdict.passed
    assert plan.machine is MACHINE
    assert plan.joints is plan.setpoints
    ratios = {name: check.ratio for name, check in plan.verdict.limits.items()}
    assert {f"{q}.{a}" for q in ("velocity", "acceleration", "jerk") for a in "xyzac"} | {"feed"} == set(
        ratios
    )
    assert max(ratios[name] for name in ratios if not name.startswith("jerk")) == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < plan.verdict.linear_error_mm <= plan.verdict.contour_error_mm
    assert 0.0 < plan.verdict.angle_error_deg <= np.rad2deg(MACHINE.tolerance / MACHINE.radius)
    # the setpoints of z move far more than the tip does
    assert plan.joints is not None
    assert plan.trajectory is not None
    moved = [np.abs(np.diff(t.position[:, 1:3], axis=0)).sum() for t in (plan.joints, plan.trajectory)]
    assert moved[0] > 1.05 * moved[1]


@pytest.mark.slow
def test_a_joint_that_is_too_fast_fails_the_plan(plan: planner.Plan) -> None:
    slow = MACHINE.axes["y"].model_copy(update={"velocity": 1e-3 * MACHINE.axes["y"].velocity})
    slower = MACHINE.model_copy(update={"axes": {**MACHINE.axes, "y": slow}})
    found = in_joints(plan, slower, kinematics_of(slower)).verdict
    assert found is not None
    assert not found.passed
    assert any(fault.startswith("joint velocity.y") for fault in found.sentences)
    assert found.limits["velocity.y"].broken


@pytest.mark.slow
def test_setpoints_on_demand_are_those_of_the_whole(plan: planner.Plan) -> None:
    whole = plan.trajectory

    class Motion:
        end = whole.cycle_time

        def at(self, times: np.ndarray, dt: float):
            return whole.rows(np.minimum(np.searchsorted(whole.t, times - 1e-9), len(whole) - 1))

    lazy = TrajectoryOnDemand(Motion(), whole.dt, len(whole))
    found = in_joints(dataclasses.replace(plan, trajectory=lazy), MACHINE, kinematics_of(MACHINE))
    assert isinstance(found.joints, TrajectoryOnDemand)
    assert np.array_equal(found.joints.position, plan.joints.position)
    assert found.verdict.passed


@pytest.mark.slow
@pytest.mark.parametrize("method", ["stop", "kinematic"])
def test_methods_that_do_not_know_joints_keep_them_where_nothing_turns(method: str) -> None:
    text = "G21\nM428\nG1 X2 F6000\nX8 Z5\nA1 F60\nA0\nG0 X0 Z0\n"
    found = planner.plan(parse_program(text, MACHINE), MACHINE, method=method)
    assert found.verdict is not None
    still = {name: check for name, check in found.verdict.limits.items() if name[-2:] in (".x", ".z")}
    assert max(check.ratio for check in still.values()) > 0.99  # of the slower z too
    assert all(not check.broken for check in still.values()), found.verdict.faults


CORNERS = (
    "G21 G90 G94 F6000\nG64 P0.02\nM428\nG0 X20 Y0 Z10 A0 C0\nG1 X30 Y5 A5 C10\nX40 Y-5 A15 C30\n"
    "X35 Y-15 Z8 A20 C45\nX20 Y-10 Z5 A10 C20\nX0 Y0 Z10 A0 C0\nM429\nM2\n"
)


@pytest.fixture(scope="module")
def together() -> planner.Plan:
    return planner.plan(parse_program(CORNERS, MACHINE), MACHINE, effort="quick").require()


@pytest.mark.shows("tool-point", "sampled: path and feed found together under the limits of the joints")
@pytest.mark.slow
def test_path_and_feed_are_found_together_at_the_tip(together: planner.Plan) -> None:
    """Faster than along splines, and judged in the joints by other code."""
    along = planner.plan(together.program, MACHINE, effort="quick", geometry="spline").require()
    assert together.verdict is not None
    assert together.verdict.passed
    assert "together" in together.sentence
    assert together.cycle_time < 0.98 * along.cycle_time
    assert together.verdict.limits["acceleration.x"].ratio > 0.99  # of a joint


@pytest.mark.slow
def test_the_bow_of_the_tip_is_left_free(together: planner.Plan) -> None:
    """What is reserved is what the verdict finds between setpoints, or a little more; and the rest is used."""
    assert together.verdict is not None
    assert together.joints is not None
    assert together.trajectory is not None
    at_the_tip = at_tip(MACHINE, kinematics_of(MACHINE, together.program.tool_point.length))
    reserved = room_for_joints(together.toolpath, at_the_tip)
    at_setpoints = verify(
        together.trajectory, together.toolpath, at_the_tip.with_own(()), not_limited=("jerk",)
    )
    found = together.verdict.contour_error_mm - at_setpoints.contour_error_mm
    assert 0.3 * reserved < found <= reserved
    assert 0.98 * 0.02 < together.verdict.contour_error_mm <= 0.02
    assert room_for_joints(together.toolpath, MACHINE) == 0.0  # where x, y and z are joints
    twice = at_the_tip.model_copy(update={"dt": 2.0 * MACHINE.dt})
    assert room_for_joints(together.toolpath, twice) == pytest.approx(4.0 * reserved, rel=1e-3)


@pytest.mark.slow
def test_without_jerk_limits_they_are_found_together_too(together: planner.Plan) -> None:
    """Bounds of joints are the same everywhere, so that no step has to wait for one that jumps."""
    found = planner.plan(together.program, MACHINE, method="second-order", effort="quick").require()
    assert found.verdict is not None
    assert found.verdict.passed
    assert "together" in found.sentence
    assert found.cycle_time < together.cycle_time
