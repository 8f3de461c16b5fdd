"""Setpoints of the joints of a five-axis machine, judged: their limits, and the tip that they carry.

    joints   the limits of x, y, z as those of limits.py: on the delivered columns, and on divided differences of the positions
    tip      brought back by the chain, positions alone, and judged like any motion: rotary limits, feed, contour, vertices, order
    between  the joints run straight from setpoint to setpoint, and so the tip does not: how far its middle leaves the middle of the
             tips at both ends is added to the contour error

A program's path has tip and angles in one norm, angles at a radius. The tool's direction turns by no more
than the norm of what the angles change, d(direction)^2 = d(tilt)^2 + sin(tilt)^2 d(c)^2, so that the
tolerance of the angles is one of the direction, too.

The tip and the direction of the tool are a chain of frames, from the tool's tip through the head to the machine and
through the table to the workpiece, by other formulas than the planner's: with M1, M2 the matrices of the axes that carry
the workpiece (outer, inner) about the points c1, c2, a point P of the machine is that of the workpiece

    p = c2 + M2^T (c1 + M1^T (P - c1) - c2)

and the tool's tip in the machine is the joints plus the vector from the spindle at rest, turned by the head.
Program coordinates have the tool's length in z (G43), which turns with neither.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, ROTARY_AXES, Axis, KinematicsData, Machine
from planner.motion.trajectory import Trajectory
from planner.verifier import travel
from planner.verifier.excess import Fault, Kind
from planner.verifier.findings import check_of
from planner.verifier.given import DERIVATIVES, Given
from planner.verifier.judge import verify
from planner.verifier.limits import NORMAL_NAME, limits_of, look_at_axes, rows_of
from planner.verifier.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING
from planner.verifier.stream import overlapping
from planner.verifier.verdict import LimitCheck, Verdict
from planner.verifier.worst import BACK, SampleBlock, Worst, state_of

# Limits of the tip's own coordinates, which are not judged: so many times the largest of the joints [-].
NOT_JUDGED = 100.0


def verify_joints(
    setpoints: Trajectory,
    toolpath: Toolpath,
    machine: Machine,
    *,
    tool_length: float | None = None,
    given: Given | None = None,
    not_limited: tuple[str, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """Judge setpoints of the joints against a path of the tip and a machine with a table [kinematics]: limits
    of the linear joints in place of those of the tip's coordinates; errors with what lies between setpoints.

    tool_length : [mm]; None for that of the machine file
    given       : which columns were delivered; None for all
    not_limited : quantities that are not judged, such as "jerk"
    progress    : called now and then with the fraction done (0 to 1)

    Raises InputError for a machine without kinematics, and as `verify` does.
    """
    if machine.kinematics is None:
        raise InputError(f"machine '{machine.name}' has no table [kinematics]")
    length = machine.kinematics.tool_length if tool_length is None else tool_length
    carried = _Carried(machine, setpoints, length)
    given = Given() if given is None else given
    # a limit of the normal acceleration is not one of the tip, with whose workpiece it moves
    tip = verify(
        carried.motion(setpoints),
        toolpath,
        _of_tip(machine),
        given=dataclasses.replace(given, columns=()),
        not_limited=(*not_limited, NORMAL_NAME, travel.NAME),
        progress=progress,
    )
    gap = max((carried.gap(part) for part in overlapping(setpoints, 1)), default=0.0)
    limits = _joint_checks(setpoints, toolpath, machine, given, not_limited)
    broken = [check.fault(Kind.LIMIT, setpoints.axes) for check in limits.values() if check.broken]
    faults = [dataclasses.replace(fault, name=f"joint {fault.name}") for fault in broken]
    if travel.NAME not in not_limited:
        faults += travel.travel_faults(setpoints, toolpath, machine)
    error = None if tip.contour_error_mm is None else tip.contour_error_mm + gap
    tolerance = tip.contour.limit
    beyond = error is None or error > tolerance * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING
    if beyond and not tip.contour.broken:
        of_path = "an unknown distance" if error is None else f"{error:.6g} mm"
        found = (
            f"up to {gap:.4g} mm beside its chord between setpoints of the joints: {of_path} from the path, "
        )
        found += f"with {tolerance:.6g} mm allowed"
        faults.append(Fault(Kind.CONTOUR, "tip", found, ratio=None if error is None else error / tolerance))
    more, linear = 0.0 if error is None else gap, tip.linear_error_mm
    value, ratio = tip.contour.value + more, tip.contour.ratio + more / tolerance
    contour = dataclasses.replace(tip.contour, value=value, ratio=ratio)
    return dataclasses.replace(
        tip,
        passed=not faults and tip.passed,
        limits=_in_order(limits | {n: c for n, c in tip.limits.items() if not _of_linear(n)}),
        contour=contour,
        contour_error_mm=error,
        linear_error_mm=None if linear is None else linear + more,
        faults=(*faults, *tip.faults),
    )


def _of_linear(name: str) -> bool:
    return name.rpartition(".")[2] in LINEAR_AXES


def _in_order(limits: dict[str, LimitCheck]) -> dict[str, LimitCheck]:
    """Velocities, accelerations and jerks first, as for other motions."""
    order = {quantity: k for k, quantity in enumerate(DERIVATIVES)}
    return dict(sorted(limits.items(), key=lambda one: order.get(one[0].partition(".")[0], len(order))))


class _Carried:
    """The tip that joints carry, by the chain of frames."""

    def __init__(self, machine: Machine, setpoints: Trajectory, length: float):
        axes, radius = setpoints.axes, setpoints.radius
        self.data, self.length, self.axes = machine.kinematics, length, axes
        self.per_length = np.array([1.0 / radius if letter in ROTARY_AXES else 1.0 for letter in axes])
        self.linear = [axes.index(letter) for letter in LINEAR_AXES]

    def tips(self, position: FloatArray) -> FloatArray:
        """(n, A) places with x, y, z of the tip for those of the joints."""
        assert self.data is not None
        found, joints = position.copy(), position * self.per_length
        found[:, self.linear], _ = tip_and_direction(self.data, self.length, self.axes, joints)
        return found

    def motion(self, setpoints: Trajectory) -> Trajectory:
        """The motion of the tip, positions alone."""

        def of(samples: Trajectory) -> Trajectory:
            tips, no = self.tips(samples.position), np.zeros_like(samples.position)
            return dataclasses.replace(samples, position=tips, velocity=no, acceleration=no, jerk=no)

        return setpoints.through(of)

    def gap(self, samples: Trajectory) -> float:
        """How far the middle of the tip's way between two setpoints leaves the middle of both tips [mm]."""
        q = samples.position
        at, middle = self.tips(q), self.tips(0.5 * (q[1:] + q[:-1]))
        return float(np.linalg.norm(middle - 0.5 * (at[1:] + at[:-1]), axis=1).max(initial=0.0))


def _of_tip(machine: Machine) -> Machine:
    """The machine without limits of the tip's own coordinates."""
    linear = [machine.axes[letter] for letter in LINEAR_AXES]
    free = Axis(**{name: NOT_JUDGED * max(getattr(axis, name) for axis in linear) for name in DERIVATIVES})
    axes = {letter: free if letter in LINEAR_AXES else axis for letter, axis in machine.axes.items()}
    # cubics of the joints are not cubics of the tip: it is taken along its chord, and `gap` is added
    way = "linear" if machine.interpolation == "cubic" else machine.interpolation
    return machine.model_copy(update={"axes": axes, "interpolation": way}).with_own(())


def _joint_checks(
    setpoints: Trajectory, toolpath: Toolpath, machine: Machine, given: Given, not_limited: tuple[str, ...]
) -> dict[str, LimitCheck]:
    """The worst of each limit of the linear joints, by name."""
    limits = limits_of(machine, setpoints, given, not_limited)
    worst = Worst(rows_of(limits), len(limits.axes))
    travelled, skip = 0.0, 0
    for part in overlapping(setpoints, BACK):
        t, state = state_of(part)
        piece = np.asarray(part.line, dtype=np.int64)  # the line itself
        block = SampleBlock(t=t, state=state, piece=piece, skip=skip, travelled=travelled)
        travelled, skip = look_at_axes(block, limits, worst), min(BACK, len(part))
    checks = [
        check_of(worst, row, toolpath, int(worst.piece[row]), not_limited)
        for row in range(len(DERIVATIVES) * len(limits.axes))
    ]
    return {check.name: check for check in checks if _of_linear(check.name)}


def _about(letter: str, angle: FloatArray) -> FloatArray:
    """(n, 3, 3) right-handed rotations about x, y or z by angle (n,)."""
    i, j = {"a": (1, 2), "b": (2, 0), "c": (0, 1)}[letter]
    matrix = np.tile(np.eye(3), (len(angle), 1, 1))
    matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
    matrix[:, j, i] = np.sin(angle)
    matrix[:, i, j] = -matrix[:, j, i]
    return matrix


def tip_and_direction(
    data: KinematicsData, length: float, axes: tuple[str, ...], joints: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n, 3) controlled point in program coordinates [mm] and (n, 3) unit vector of the tool, seen from the
    workpiece, for joints (n, A) of the axes [mm, rad] and a tool of that length [mm]."""
    column = dict(zip(axes, np.asarray(joints, dtype=np.float64).T, strict=True))
    sign = {letter: -1.0 if letter in data.reversed else 1.0 for letter in data.rotary}
    turned = {letter: _about(letter, sign[letter] * column[letter]) for letter in data.rotary}
    tilt, c = turned[data.rotary[0]], turned["c"]
    q = np.stack([column["x"], column["y"], column["z"]], axis=1)
    rest = np.broadcast_to(np.eye(3), tilt.shape)
    point = np.array([data.x_rot_point, data.y_rot_point, data.z_rot_point])
    offset = np.array([data.x_offset, data.y_offset, data.z_offset])
    tool = np.array([0.0, 0.0, -length])
    if data.type in ("xyzac-trt", "xyzbc-trt"):
        outer, inner, head, arm, centre = tilt, c, rest, np.zeros(3), point + offset
    else:
        arm = np.array([data.x_offset, data.y_offset, -data.pivot_length])
        outer, centre = rest, point
        inner, head = (rest, c @ tilt) if data.type == "head-head" else (c, tilt)
    tip = q - arm + np.einsum("nij,j->ni", head, arm + tool)
    on_first = centre + np.einsum("nji,nj->ni", outer, tip - centre)
    on_work = point + np.einsum("nji,nj->ni", inner, on_first - point)
    direction = np.einsum("nji,nj->ni", inner, np.einsum("nji,nj->ni", outer, head[:, :, 2]))
    return on_work - tool, direction
