"""Setpoints of the joints of a five-axis machine, judged: their limits, and the tip that they carry along the program.

    joints   the limits of x, y, z as those of limits.py: on the delivered columns, and on divided differences of the positions
    tip      brought back by the chain of kinematics.py, positions alone, and judged like any motion: rotary limits, feed, contour,
             vertices, order
    between  the joints run straight from setpoint to setpoint, and so the tip does not: how far its middle leaves the middle of the
             tips at both ends is added to the contour error

A program's path has tip and angles in one norm, angles at a radius. The tool's direction turns by no more than the norm of what the
angles change, d(direction)^2 = d(tilt)^2 + sin(tilt)^2 d(c)^2, so that the tolerance of the angles is one of the direction, too.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, ROTARY_AXES, Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.verify.given import DERIVATIVES, Given
from planner.verify.judge import verify
from planner.verify.kinematics import tip_and_direction
from planner.verify.limits import NORMAL_NAME
from planner.verify.own import OwnSeen, SampleBlock
from planner.verify.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING
from planner.verify.stream import Limits
from planner.verify.verdict import Verdict

# Limits that the tip's own coordinates get, which are not judged: so many times the largest of the joints [-].
NOT_JUDGED = 100.0


@dataclass(frozen=True, eq=False, kw_only=True)
class JointVerdict:
    """The findings of `verify_joints`.

    passed       : True if every check holds
    ratios       : of the linear joints, "velocity.x" and so on, and of rotary joints, feed and tip: value / limit [-]
    tip          : the verdict of the tip's motion
    tip_error_mm : largest distance of tip and angles from the path, with what lies between setpoints [mm]; inf where it was lost
    faults       : one sentence for each failure
    """

    passed: bool
    ratios: dict[str, float]
    tip: Verdict
    tip_error_mm: float
    faults: tuple[str, ...]


def verify_joints(
    setpoints: Trajectory,
    toolpath: Toolpath,
    machine: Machine,
    *,
    tool_length: float | None = None,
    given: Given | None = None,
    not_limited: tuple[str, ...] = (),
) -> JointVerdict:
    """Judge setpoints of the joints against a path of the tip and a machine with a table [kinematics].

    tool_length : [mm]; None for that of the machine file
    given       : which columns were delivered; None for all
    not_limited : quantities that are not judged, such as "jerk"

    Raises InputError for a machine without kinematics, and as `verify` does.
    """
    if machine.kinematics is None:
        raise InputError(f"machine '{machine.name}' has no table [kinematics]")
    data = machine.kinematics
    length = data.tool_length if tool_length is None else tool_length
    given = Given() if given is None else given

    def tips(position: FloatArray) -> FloatArray:
        radius = setpoints.radius
        turns = np.array([letter in ROTARY_AXES for letter in setpoints.axes])
        angles = np.where(turns, position / radius, position)
        found = position.copy()
        linear = [setpoints.axes.index(letter) for letter in LINEAR_AXES]
        found[:, linear], _ = tip_and_direction(data, length, setpoints.axes, angles)
        return found

    at = tips(setpoints.position)
    middle = tips(0.5 * (setpoints.position[1:] + setpoints.position[:-1]))
    gap = float(np.linalg.norm(middle - 0.5 * (at[1:] + at[:-1]), axis=1).max(initial=0.0))
    nothing = np.zeros_like(at)
    motion = dataclasses.replace(setpoints, position=at, velocity=nothing, acceleration=nothing, jerk=nothing)
    # of machines with a limit of the normal acceleration that limit is not one of the tip: it moves with the workpiece
    tip = verify(
        motion,
        toolpath,
        _of_tip(machine),
        given=dataclasses.replace(given, columns=()),
        not_limited=(*not_limited, NORMAL_NAME),
    )
    ratios, faults = _joint_ratios(setpoints, machine, given, not_limited)
    of_tip = {name: c.ratio for name, c in tip.limits.items() if name.rpartition(".")[2] not in LINEAR_AXES}
    error = (np.inf if tip.contour_error_mm is None else tip.contour_error_mm) + gap
    tolerance = tip.contour.limit
    if error > tolerance * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING and not tip.contour.broken:
        faults.append(
            f"between setpoints of the joints the tip is up to {gap:.4g} mm beside its chord: {error:.6g} mm from the path, "
            f"with {tolerance:.6g} mm allowed"
        )
    faults += tip.faults
    return JointVerdict(
        passed=not faults, ratios=ratios | of_tip, tip=tip, tip_error_mm=error, faults=tuple(faults)
    )


def _of_tip(machine: Machine) -> Machine:
    """The machine without limits of the tip's own coordinates."""
    linear = [machine.axes[letter] for letter in LINEAR_AXES]
    free = Axis(**{name: NOT_JUDGED * max(getattr(axis, name) for axis in linear) for name in DERIVATIVES})
    axes = {letter: free if letter in LINEAR_AXES else axis for letter, axis in machine.axes.items()}
    return machine.model_copy(update={"axes": axes}).with_own(())


def _joint_ratios(
    setpoints: Trajectory, machine: Machine, given: Given, not_limited: tuple[str, ...]
) -> tuple[dict[str, float], list[str]]:
    """Ratios of the linear joints to their limits, and a sentence for each that is exceeded."""
    axes = setpoints.axes
    joints = tuple(_Joint(letter, machine.axes[letter]) for letter in LINEAR_AXES)
    seen = OwnSeen(joints, axes)
    rounding = np.zeros(len(axes)) if not len(given.position_rounding) else np.array(given.position_rounding)
    limits = Limits(
        per_axis=np.array([machine.limits(name, axes) for name in DERIVATIVES]),  # type: ignore[arg-type]
        linear=np.array([letter in LINEAR_AXES for letter in axes]),
        judged=np.array([name in given.columns for name in DERIVATIVES]),
        rounding=rounding,
        time_rounding=given.time_rounding,
        normal=np.inf,
        acceleration_at_stop=np.full(len(axes), np.inf),
        jerk_limited="jerk" not in not_limited,
    )
    seen.take(
        SampleBlock(
            **{name: getattr(setpoints, name) for name in ("t", "position", *DERIVATIVES)},
            piece=np.zeros(len(setpoints), dtype=np.int64),
            skip=0,
            travelled=0.0,
        ),
        limits,
    )
    ratios, faults = {}, []
    for row, (ratio, value, limit, _) in enumerate(seen.worst):
        name, unit = seen.name(row)
        ratios[name] = float(ratio)
        if name.partition(".")[0] not in not_limited and ratio > 1.0 + RATIO_ROUNDING:
            faults.append(
                f"{name}: {value:.7g} {unit}, {ratio:.6g} of the limit {limit:.6g} {unit} of the joint at t = {seen.time[row]:.6g} s"
            )
    return ratios, faults


class _Joint(SimpleNamespace):
    """A joint as `OwnSeen` asks for it: itself, with its limits."""

    def __init__(self, letter: str, axis: Axis):
        super().__init__(name=letter, unit="mm", turn=None, axis=axis)

    def bounds(self, at: Any) -> tuple[float, float, float]:
        return self.axis.velocity, self.axis.acceleration, self.axis.jerk

    def value(self, at: Any) -> Any:
        return getattr(at, self.name)
