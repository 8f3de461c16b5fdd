"""Jobs of the tool's tip: planned through the kinematics, delivered as setpoints of the joints, judged there and at the tip."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

from planner.job.plan import Plan
from planner.kinematics import Chain, at_tip, kinematics_of
from planner.kinematics.limits import LinearJoint
from planner.kinematics.setpoints import joint_setpoints
from planner.machine import Machine
from planner.nc.program import Program
from planner.verify.joints import verify_joints
from planner.verify.verdict import Verdict


def chain_of(program: Program, machine: Machine) -> Chain | None:
    """The kinematics that a program is planned through: those of the machine with the program's tool, if its tool centre point is on;
    None where x, y and z are joints, and for a machine that is planned for at the tip already (`at_tip`)."""
    if program.tool_point is None or any(isinstance(limit, LinearJoint) for limit in machine.own):
        return None
    return kinematics_of(machine, program.tool_point.length)


def planned(program: Program, machine: Machine, plan_on: Callable[[Program, Machine], Plan]) -> Plan:
    """The plan of a program by `plan_on`, through the kinematics where its tool centre point is on."""
    chain = chain_of(program, machine)
    if chain is None:
        return plan_on(program, machine)
    return in_joints(plan_on(program, at_tip(machine, chain)), machine, chain)


def in_joints(plan: Plan, machine: Machine, chain: Chain) -> Plan:
    """A plan of the tip with its setpoints of the joints, judged by them too: the verdict fails where one of both does."""
    if plan.trajectory is None or plan.verdict is None:
        return dataclasses.replace(plan, machine=machine)
    began = time.perf_counter()
    joints = joint_setpoints(plan.trajectory, chain)
    found = verify_joints(
        joints,
        plan.toolpath,
        machine,
        tool_length=chain.length,
        not_limited=_not_limited(plan.verdict),
    ).verdict()
    spent = plan.timings.get("verify", 0.0) + time.perf_counter() - began
    return dataclasses.replace(
        plan,
        machine=machine,
        joints=joints,
        verdict=_both(plan.verdict, found),
        timings={**plan.timings, "verify": spent},
    )


def _both(tip: Verdict, joints: Verdict) -> Verdict:
    """The verdict on the motion of the tip, between its samples too, with the limits of the joints in place of those of its
    coordinates, and with what the judgement of the setpoints found."""
    limits = dict(joints.limits)
    for name, check in tip.limits.items():
        quantity, _, what = name.partition(".")
        own = f"{quantity}.{what.removeprefix('joint ')}" if what else name
        if what in ("x", "y", "z"):
            continue  # the tip's own coordinates have no limits
        if own not in limits or check.ratio > limits[own].ratio:
            limits[own] = dataclasses.replace(check, name=own)
    return dataclasses.replace(
        tip,
        passed=tip.passed and joints.passed,
        limits=limits,
        contour=max(tip.contour, joints.contour, key=lambda check: check.ratio),
        contour_error_mm=_larger(tip.contour_error_mm, joints.contour_error_mm),
        faults=tuple(dict.fromkeys((*tip.faults, *joints.faults))),
        notes=tuple(dict.fromkeys((*tip.notes, *joints.notes))),
    )


def _larger(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else max(one, other)


def _not_limited(verdict: Verdict) -> tuple[str, ...]:
    return tuple(
        dict.fromkeys(n.partition(".")[0] for n, check in verdict.limits.items() if not check.limited)
    )
