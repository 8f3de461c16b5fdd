"""From the blocks of a program to the segments and joints of a toolpath.

A joint is a full stop where the program needs rest: at both ends, at a dwell or program stop, where it asks
for exact stop (G61.1), or exact path (G61) with a turn (with limited jerk also where the curvature jumps:
corners/smooth.py), and between rapid and feed moves (unless the machine blends rapids). Where the tangents
agree it is smooth; everywhere else, a path that turns right back included, it is a corner. An axis that never
moves and that the machine lacks is left out.

Rotary axes are measured at a radius R (`Machine.radius`): a coordinate is R times the angle. All axes are
lengths then, and a tolerance is one of the norm over all of them: with it x y z keep eps, and the angles eps
/ R. F is the speed of the linear part of a block (program.py); in that norm it becomes F ds/dl, constant
along lines, arcs and helices.

A block along a spline becomes several segments (geometry/curves.py), few of them lines where its curvature is
infinite. Between them the motion goes on as at smooth joints, in exact stop mode too; where the spline itself
has a kink there is a corner.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.geometry.curves import CHORD_SHARE, CurveSegments, curve_segments
from planner.geometry.extrusion import Laid, Waits, extruder_limits, extrusion_of, waits
from planner.geometry.run_in import require_room
from planner.geometry.toolpath import Arcs, Joint, Toolpath
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.machine.parts import TOLERANCE_MIN
from planner.nc.bezier import homogeneous
from planner.nc.program import Kind, PathControl, Program

# Turning angle below which two tangents are the same [rad]: coordinates of 1e3 mm have 1e-13 mm of rounding,
# and at 1e-8 rad the velocity jumps by 1e-6 mm/s at 100 mm/s, below any drive's resolution.
COLLINEAR_ANGLE = 1e-8
# Coordinates beyond this are certainly a mistake, ten kilometres [mm]; beyond 1e9 float64 loses the micrometre.
COORDINATE_MAX = 1e7
# Speeds that differ by less are the same [-]: rounding.
SAME_SPEED = 1e-9
# A move shorter than this goes nowhere [mm]: a picometre, the rounding of coordinates around 1e3 mm.
ZERO_LENGTH = 1e-9


def toolpath_from_program(program: Program, machine: Machine, tolerance: float | None = None) -> Toolpath:
    """Lay out the blocks of a program as segments and joints.

    tolerance : contour tolerance [mm] in place of the program's G64 P and the machine's; None for those

    Raises InputError for a program that moves nowhere, a tolerance below `TOLERANCE_MIN` or beyond
    `COORDINATE_MAX`, an axis that moves and that the machine lacks, and coordinates beyond `COORDINATE_MAX`.
    """
    if isinstance(tolerance, str):
        raise InputError(f"tolerance '{tolerance}'; give a number, in mm")
    if tolerance is not None and not (TOLERANCE_MIN <= tolerance <= COORDINATE_MAX):
        raise InputError(
            f"tolerance {tolerance} mm; it must be between {TOLERANCE_MIN:g} and {COORDINATE_MAX:g}"
        )
    program = _measured(program, machine.radius)
    axis = _axes_in_use(program, machine)
    axes = tuple(program.axes[k] for k in axis)
    machine.limits("velocity", axes)
    if not len(program):
        said = "".join(f" ({text})" for text in program.assumptions[:1])
        raise InputError(f"the program has no move{said}", source=program.source)
    _check_coordinates(program)
    position = np.vstack([program.start, program.end])
    chord = np.linalg.norm(np.diff(position, axis=0), axis=1)
    of_block = np.full(len(program), tolerance) if tolerance is not None else program.tolerance
    of_block = np.where(np.isnan(of_block), machine.tolerance, of_block)
    splines = _curves_of(program, of_block)
    spline_block = program.splines.block[splines.owner]
    count = np.where(program.kind == Kind.SPLINE, 0, chord > ZERO_LENGTH).astype(np.int64)
    count[program.arc_block] = 1
    np.add.at(count, spline_block, 1)
    real = count > 0
    block = np.repeat(np.arange(len(program)), count)  # of each segment
    if not len(block):
        raise InputError("the program moves nowhere: every move ends where it starts", source=program.source)

    laid = _laid(program, splines, block)
    theta = np.zeros(len(block) + 1)
    theta[1:-1] = turning_angle(laid.tangent_end[:-1], laid.tangent_start[1:])
    stands = np.isin(program.kind, (Kind.DWELL, Kind.STOP))
    if len(program.extruded):
        stands |= ~real & (program.extruded != 0.0)
    found = waits(program, machine, np.flatnonzero(stands))
    joint, dwell = _joints(program, machine, block, theta, found)
    feed, of_joint = _feeds(program, machine, block, laid), of_block[np.append(block[:1], block)]
    extrusion = None
    if len(program.extruded):
        at_joints = Laid(block, laid.length, joint == Joint.STOP)
        extrusion = extrusion_of(program, extruder_limits(machine), at_joints, of_joint, found)
        with np.errstate(divide="ignore"):
            feed = np.minimum(feed, extrusion.limits[0] / extrusion.ratio)
    toolpath = Toolpath(
        source=program.source,
        axes=axes,
        **{name: getattr(laid, name)[:, axis] for name in ("start", "end", "tangent_start", "tangent_end")},
        **{name: getattr(laid, name) for name in ("length", "arc", "curve", "curvature")},
        feed=feed,
        rapid=program.kind[block] == Kind.RAPID,
        block=block,
        line=program.line[block],
        arcs=_of_axes(laid.arcs, axis),
        curves=dataclasses.replace(splines.curves, points=splines.curves.points[:, :, axis]),
        joint=joint,
        theta=theta,
        tolerance=of_joint,
        dwell=dwell,
        held=np.isin(block, program.synchronised),
        exact=_exact(program, block, joint),
        radius=machine.radius,
        extrusion=extrusion,
    )
    require_room(toolpath, machine)
    return _in_motion(toolpath, program, machine, laid) if any(program.speeds) else toolpath


def _measured(program: Program, radius: float) -> Program:
    """The program with its angles as lengths at a radius [mm]."""
    rotary = np.array([axis in ROTARY_AXES for axis in program.axes])
    if not rotary.any():
        return program
    scale = np.where(rotary, radius, 1.0)
    return dataclasses.replace(
        program,
        start=program.start * scale,
        end=program.end * scale,
        splines=dataclasses.replace(program.splines, points=program.splines.points * scale),
    )


class _Laid(NamedTuple):
    """Lines, arcs and curves of N segments, in all A axes of the program."""

    start: FloatArray  # (N, A) [mm]
    end: FloatArray  # (N, A) [mm]
    length: FloatArray  # (N,) [mm]
    tangent_start: FloatArray  # (N, A)
    tangent_end: FloatArray  # (N, A)
    curvature: FloatArray  # (N,) at most [1/mm]
    arc: Array  # (N,) row of `arcs`, -1 of others
    arcs: Arcs
    curve: Array  # (N,) row of the curves, -1 of others


def _laid(program: Program, splines: CurveSegments, block: Array) -> _Laid:
    """The segments of the blocks (N,)."""
    position = np.vstack([program.start, program.end])
    arc_of_block = np.full(len(program), -1, dtype=np.int64)
    arc_of_block[program.arc_block] = np.arange(len(program.arc_block))
    start, end = position[block], position[block + 1]
    is_curve = program.kind[block] == Kind.SPLINE
    start[is_curve], end[is_curve] = splines.ends[:, 0, 0], splines.ends[:, 1, 0]
    arc_row = arc_of_block[block]
    is_arc = arc_row >= 0
    rows = arc_row[is_arc]
    arcs, arc_length = _arcs(program, start[is_arc], end[is_arc], rows)
    arc = np.full(len(block), -1, dtype=np.int64)
    arc[is_arc] = np.arange(len(rows))
    length = np.linalg.norm(position[block + 1] - position[block], axis=1)
    length[is_arc], length[is_curve] = arc_length, splines.length
    tangent_start, tangent_end = _tangents(start, end, length, arc, arcs)
    tangent_start[is_curve], tangent_end[is_curve] = splines.ends[:, 0, 1], splines.ends[:, 1, 1]
    curvature = np.zeros(len(block))
    curvature[is_arc] = _curvature_bound(arcs)
    curvature[is_curve] = np.where(splines.chord, 0.0, splines.curvature)
    curve = np.full(len(block), -1, dtype=np.int64)
    curve[is_curve] = np.where(splines.chord, -1, np.arange(len(splines.length)))
    return _Laid(start, end, length, tangent_start, tangent_end, curvature, arc, arcs, curve)


def turning_angle(u1: FloatArray, u2: FloatArray) -> FloatArray:
    """(n,) angles between unit vectors u1 and u2 (n, A) [rad]; exact near 0 and pi, unlike acos."""
    return 2.0 * np.arctan2(np.linalg.norm(u2 - u1, axis=-1), np.linalg.norm(u1 + u2, axis=-1))


def _axes_in_use(program: Program, machine: Machine) -> Array:
    """Indices of the axes that the machine has or that move: a plotter needs no z to stay in the plane."""
    moved = (program.end != program.start).any(axis=0)
    for normal in np.unique(program.arc_normal):
        moved[: len(LINEAR_AXES)][np.arange(len(moved[: len(LINEAR_AXES)])) != normal] = True
    moved |= (np.ptp(program.splines.points, axis=1) > 0.0).any(axis=0)
    return np.flatnonzero(moved | [letter in machine.axes for letter in program.axes])


def _of_axes(arcs: Arcs, axis: Array) -> Arcs:
    """The arcs in the coordinates of some axes; they do not move along the others."""
    names = ("center", "e1", "e2", "drift")
    return dataclasses.replace(arcs, **{name: getattr(arcs, name)[:, axis] for name in names})


def _check_coordinates(program: Program) -> None:
    """Raise InputError for a coordinate beyond `COORDINATE_MAX`."""
    bad = np.flatnonzero(np.abs(program.end).max(axis=1, initial=0.0) > COORDINATE_MAX)
    if len(bad):
        block = int(bad[0])
        axis = int(np.abs(program.end[block]).argmax())
        raise InputError(
            f"{program.axes[axis].upper()} = {program.end[block, axis]:g} mm; coordinates up to {COORDINATE_MAX:g} mm "
            "are allowed: a digit too many, or a point missing?",
            source=program.source,
            line=int(program.line[block]),
        )


def _curves_of(program: Program, tolerance: FloatArray) -> CurveSegments:
    """The segments of all splines, for tolerances (B,) of blocks [mm]; those that go nowhere left out."""
    splines = program.splines
    goes = np.flatnonzero(np.ptp(splines.points, axis=1).max(axis=1, initial=0.0) > ZERO_LENGTH)
    near = CHORD_SHARE * tolerance[splines.block[goes]]
    found = curve_segments(homogeneous(splines.points[goes], splines.weights[goes]), near)
    return found._replace(owner=goes[found.owner])


def _arcs(program: Program, start: FloatArray, end: FloatArray, rows: Array) -> tuple[Arcs, FloatArray]:
    """Arc data and lengths of the arcs in `rows`, given their end points (K, A)."""
    count, axes = start.shape
    pick = np.arange(count)
    normal = program.arc_normal[rows]
    first, second = (normal + 1) % 3, (normal + 2) % 3
    sweep = program.arc_sweep[rows]
    space = len(LINEAR_AXES)
    radial = start - program.arc_center[rows]
    radial[pick, normal] = 0.0
    radial[:, space:] = 0.0
    radius = np.linalg.norm(radial, axis=1)
    if not (radius > 0).all():
        bad = int(np.flatnonzero(~(radius > 0))[0])
        raise InputError(
            "arc of radius 0 mm", source=program.source, line=int(program.line[program.arc_block[rows[bad]]])
        )
    e1 = radial / radius[:, None]
    e2 = np.zeros((count, axes))
    e2[pick, first], e2[pick, second] = -e1[pick, second], e1[pick, first]
    rise = end[pick, normal] - start[pick, normal]
    length = np.hypot(radius * sweep, rise)
    if axes > space:
        length = np.hypot(length, np.linalg.norm((end - start)[:, space:], axis=1))
    center = program.arc_center[rows].copy()
    center[pick, normal] = start[pick, normal]
    center[:, space:] = start[:, space:]
    on_circle = center + radius[:, None] * (np.cos(sweep)[:, None] * e1 + np.sin(sweep)[:, None] * e2)
    drift = (end - on_circle) / length[:, None]
    return Arcs(center=center, e1=e1, e2=e2, drift=drift, radius=radius, rate=sweep / length), length


def _tangents(
    start: FloatArray, end: FloatArray, length: FloatArray, arc: Array, arcs: Arcs
) -> tuple[FloatArray, FloatArray]:
    """Unit tangents (M, A) at both ends of the segments."""
    first = (end - start) / length[:, None]
    last = first.copy()
    is_arc = arc >= 0
    speed = (arcs.radius * arcs.rate)[:, None]
    angle = (arcs.rate * length[is_arc])[:, None]
    first[is_arc] = speed * arcs.e2 + arcs.drift
    last[is_arc] = speed * (np.cos(angle) * arcs.e2 - np.sin(angle) * arcs.e1) + arcs.drift
    return (
        first / np.linalg.norm(first, axis=1, keepdims=True),
        last / np.linalg.norm(last, axis=1, keepdims=True),
    )


def _curvature_bound(arcs: Arcs) -> FloatArray:
    """|p''| / (smallest |p'|)^2 on the arc [1/mm]; |p'| is at least what remains after the in-plane gap."""
    in_plane = arcs.radius * np.abs(arcs.rate)
    rise = np.sqrt(np.maximum(1.0 - in_plane**2, 0.0))
    gap = np.sqrt(np.maximum((arcs.drift**2).sum(axis=1) - rise**2, 0.0))
    return arcs.radius * arcs.rate**2 / np.maximum(1.0 - gap, 0.5) ** 2


def _feeds(program: Program, machine: Machine, block: Array, laid: _Laid) -> FloatArray:
    """Feed (M,) [mm/s] along the path in all axes, at most the machine's `feed_max`; of threads as it is."""
    feed = program.feed[block].copy()
    if len(program.axes) > len(LINEAR_AXES):
        feed *= path_per_length(program.axes, machine.radius, laid)
    if machine.feed_max is not None:
        cut = (program.kind[block] != Kind.RAPID) & ~np.isin(block, program.synchronised)
        feed[cut] = np.minimum(feed[cut], machine.feed_max)
    return feed


def feed_groups(axes: tuple[str, ...]) -> Array:
    """(A,) what F goes by, the first that moves: 0 for x, y, z, 1 for u, v, w, 2 for rotary axes."""
    return np.array([0 if axis in LINEAR_AXES else 2 if axis in ROTARY_AXES else 1 for axis in axes])


def path_per_length(axes: tuple[str, ...], radius: float, laid: _Laid | Toolpath) -> FloatArray:
    """(M,) ds/dl: the length in all axes [mm], for a unit of what F goes by (program.py)."""
    change, groups = (laid.end - laid.start) ** 2, feed_groups(axes)
    further = change[:, groups > 0].sum(axis=1)
    linear, parallel, rotary = (np.sqrt(change[:, groups == n].sum(axis=1)) for n in range(3))
    turned = (laid.arc >= 0) | (laid.curve >= 0)
    linear[turned] = np.sqrt(np.maximum(laid.length[turned] ** 2 - further[turned], 0.0))
    by = np.where(linear > ZERO_LENGTH, linear, np.where(parallel > ZERO_LENGTH, parallel, rotary / radius))
    per: FloatArray = laid.length / by
    return per


def _in_motion(toolpath: Toolpath, program: Program, machine: Machine, laid: _Laid) -> Toolpath:
    """The path with the speeds at which the program begins and ends. Raises InputError for one above the feed there or the
    limit of an axis."""
    more = len(program.axes) > len(LINEAR_AXES)
    per = path_per_length(program.axes, machine.radius, laid)[[0, -1]] if more else np.ones(2)
    begin, end = program.speeds * per
    toolpath = dataclasses.replace(toolpath, speeds=(float(begin), float(end)))
    limits = machine.limits("velocity", toolpath.axes)
    for k, name in ((0, "start"), (-1, "end")):
        shares = np.append(np.abs(toolpath.velocities[k]) / limits, toolpath.speeds[k] / toolpath.feed[k])
        worst = int(shares.argmax())
        if shares[worst] > 1.0 + SAME_SPEED:
            by = ("the axis " + toolpath.axes[worst].upper()) if worst < len(limits) else "the feed there"
            asked, most = program.speeds[k], program.speeds[k] / shares[worst]
            said = f"{name} speed {asked:g} mm/s: {by} allows {most:.6g} mm/s"
            raise InputError(said, source=program.source)
    return toolpath


def _exact(program: Program, block: Array, joint: Array) -> Array:
    """(M,) True for segments under G61 and G61.1, but where the corner at their start is under G64."""
    rounded = joint == Joint.CORNER
    exact: Array = (program.path_control[block] != PathControl.BLEND) & ~rounded[:-1] & ~rounded[1:]
    return exact


def _joints(
    program: Program, machine: Machine, block: Array, theta: FloatArray, found: Waits
) -> tuple[Array, FloatArray]:
    """Kind and dwell of every joint."""
    joint = np.where(theta < COLLINEAR_ANGLE, Joint.SMOOTH, Joint.CORNER).astype(np.uint8)
    inner = np.flatnonzero((block[1:] == block[:-1]) & (joint[1:-1] == Joint.SMOOTH)) + 1  # of splines
    control = program.path_control[block]
    joint[1:][(control == PathControl.EXACT_PATH) & (joint[1:] == Joint.CORNER)] = Joint.STOP
    joint[1:][control == PathControl.EXACT_STOP] = Joint.STOP
    joint[inner] = Joint.SMOOTH
    if not machine.blend_rapids:
        rapid = program.kind[block] == Kind.RAPID
        joint[1:-1][rapid[:-1] != rapid[1:]] = Joint.STOP
    at = np.searchsorted(block, found.block)  # the joint before the first segment behind the standstill
    joint[at] = Joint.STOP
    dwell = np.zeros(len(block) + 1)
    np.add.at(dwell, at, found.lasts)
    joint[0] = joint[-1] = Joint.STOP
    return joint, dwell
