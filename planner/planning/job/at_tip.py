"""Jobs of the tool's tip: planned through the kinematics, delivered and judged in the joints.

Between two setpoints the joints run straight, and the tip does not: its way bows from the chord between both tips
by about dt^2/8 |D2p(q', q')|, p the tip as a function of the joints q. The largest on the path, as fast as feed and
joints allow, is left free of the tolerance (`room_for_joints`), as the verdict adds the largest bow to the
contour error. It is no bound: it is looked at in some places of each block, and a motion may leave the path within the
tolerance; the verdict tells.
"""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.chords import points_on
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.machine.kinematics import Chain, kinematics_of
from planner.machine.kinematics.chain import in_rad
from planner.machine.kinematics.limits import LinearJoint
from planner.motion.chain_setpoints import joint_setpoints
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.planning.job.plan import Plan
from planner.verifier import WHOLE, Given, Verdict, verify, verify_joints

# Intervals of a block in which the bow of the tip is looked at.
LOOKED_AT = 4
# Share of the tolerance that is left free for it at most [-]: with more the motion has to be slower, and the verdict says so.
LEFT_FREE_MOST = 0.5


def chain_of(program: Program, machine: Machine) -> Chain | None:
    """The kinematics that a program is planned through: those of the machine with the program's tool, if its
    tool centre point is on; None where x, y and z are joints, and for a machine that is planned for at the
    tip already (`at_tip`)."""
    if program.tool_point is None or any(isinstance(limit, LinearJoint) for limit in machine.own):
        return None
    return kinematics_of(machine, program.tool_point.length)


def room_for_joints(toolpath: Toolpath, machine: Machine) -> float:
    """The largest that is found on the path of how far the tip leaves its chord between two setpoints of the joints (module
    text) [mm]; 0 where the machine is not one for the tip (`at_tip`)."""
    joints = {limit.letter: limit for limit in machine.own if isinstance(limit, LinearJoint)}
    chain = next((one.kinematics for one in joints.values() if isinstance(one.kinematics, Chain)), None)
    if chain is None:
        return 0.0
    axes, radius = toolpath.axes, machine.radius
    fastest = machine.limits("velocity", axes).copy()
    for k, letter in enumerate(axes):
        fastest[k] = joints[letter].velocity if letter in joints else fastest[k]

    def changed(places: FloatArray, function: Callable[[dict[str, Any]], dict[str, Any]]) -> FloatArray:
        still = dict.fromkeys(chain.axes, np.zeros(len(places)))
        found = function(in_rad(still | dict(zip(axes, places.T, strict=True)), radius))
        return np.column_stack([found.get(letter, places[:, k]) for k, letter in enumerate(axes)])

    share = np.linspace(0.0, 1.0, LOOKED_AT + 1)
    tips = toolpath.start[:, None] + share[:, None] * (toolpath.end - toolpath.start)[:, None]
    curved = np.flatnonzero((toolpath.arc >= 0) | (toolpath.curve >= 0))
    segment = np.repeat(curved, len(share))
    along = toolpath.length[segment] * np.tile(share, len(curved))
    tips[curved] = points_on(toolpath, segment, along).reshape(-1, *tips.shape[1:])
    q = changed(tips.reshape(-1, len(axes)), chain.joints).reshape(tips.shape)
    way = np.diff(q, axis=1)
    lasts = np.maximum(
        toolpath.length[:, None] / LOOKED_AT / toolpath.feed[:, None], (np.abs(way) / fastest).max(axis=2)
    )
    speed = (way / lasts[:, :, None]).reshape(-1, len(axes))
    # where two blocks meet the motion has some of the velocity of both
    bent = np.concatenate([speed, (speed[1:] + speed[:-1]) / 2.0])
    at = np.concatenate(
        [(q[:, 1:] + q[:, :-1]).reshape(-1, len(axes)) / 2.0, q[:, 1:].reshape(-1, len(axes))[:-1]]
    )
    before, behind = (changed(at + side * machine.dt / 2.0 * bent, chain.point) for side in (-1.0, 1.0))
    off = changed(at, chain.point) - (before + behind) / 2.0
    linear = [axes.index(letter) for letter in joints if letter in axes]
    return float(np.linalg.norm(off[:, linear], axis=1).max(initial=0.0))


def joints_of(plan: Plan) -> Callable[[Trajectory], Trajectory] | None:
    """What makes setpoints of the joints of any samples of the plan; None where the axes are the joints."""
    chain = None if plan.joints is None else chain_of(plan.program, plan.machine)
    return None if chain is None else lambda samples: joint_setpoints(samples, chain)


def of_axes(plan: Plan, samples: Trajectory) -> Trajectory:
    """Samples of the plan's trajectory as the axes get them."""
    made = joints_of(plan)
    return samples if made is None else made(samples)


def directions_of(plan: Plan, samples: Trajectory) -> FloatArray | None:
    """(n, 3) unit vectors along the tool, from its tip to the spindle as seen from the workpiece, at samples
    of the plan's trajectory; None where that is one of the axes."""
    chain = None if plan.joints is None else chain_of(plan.program, plan.machine)
    if chain is None:
        return None
    columns = dict(zip(samples.axes, samples.position.T, strict=True))
    return np.stack(np.broadcast_arrays(*chain.direction(in_rad(columns, samples.radius))), axis=1)


def judged(
    setpoints: Trajectory,
    program: Program,
    toolpath: Toolpath,
    machine: Machine,
    *,
    given: Given = WHOLE,
    not_limited: tuple[str, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """The verdict on setpoints of the axes, in the joints and at the tip with the tool centre point on; the rest as of
    `verify`."""
    chain, free = chain_of(program, machine), (*not_limited, *program.reading.unjudged)
    how: dict[str, Any] = {"given": given, "not_limited": free, "progress": progress}
    if chain is None:
        return verify(setpoints, toolpath, machine, **how)
    return verify_joints(setpoints, toolpath, machine, tool_length=chain.length, **how)


def in_joints(plan: Plan, machine: Machine, chain: Chain) -> Plan:
    """A plan of the tip with its setpoints of the joints; the verdict fails where one of both does."""
    if plan.trajectory is None or plan.verdict is None:
        return dataclasses.replace(plan, machine=machine)
    began = time.perf_counter()
    joints = joint_setpoints(plan.trajectory, chain)
    free = (*plan.verdict.not_limited, *plan.program.reading.unjudged)
    found = verify_joints(joints, plan.toolpath, machine, tool_length=chain.length, not_limited=free)
    spent = plan.timings.get("verify", 0.0) + time.perf_counter() - began
    return dataclasses.replace(
        plan,
        machine=machine,
        joints=joints,
        verdict=_both(plan.verdict, found),
        timings={**plan.timings, "verify": spent},
    )


def _both(tip: Verdict, joints: Verdict) -> Verdict:
    """The verdict on the motion of the tip, between its samples too, with the limits of the joints in place
    of those of its coordinates, and with what the judgement of the setpoints found."""
    limits = dict(joints.limits)
    faults = {fault.sentence: fault for fault in (*tip.faults, *joints.faults)}
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
        linear_error_mm=_larger(tip.linear_error_mm, joints.linear_error_mm),
        angle_error_deg=_larger(tip.angle_error_deg, joints.angle_error_deg),
        faults=tuple(faults.values()),
        notes=tuple(dict.fromkeys((*tip.notes, *joints.notes))),
    )


def _larger(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else max(one, other)
