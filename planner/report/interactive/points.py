"""A program of points, for paths that do not come from an NC program; a plan run slower; any motion, judged."""

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.machine.kinematics.chain import LINEAR, kinematics_of
from planner.machine.kinematics.directions import rotary_along
from planner.machine.parts import TOLERANCE_MIN
from planner.nc.points import AXES, known_axes, program_of_points
from planner.nc.program import Kind, Program, SplineTable
from planner.nc.reader import read_program
from planner.planning.job.at_tip import judged
from planner.planning.job.plan import Plan
from planner.planning.methods.registry import machine_of
from planner.report.judging import judge
from planner.report.trajectory_reader import trajectory_of_columns
from planner.verifier import NOT_LIMITED_NAMES, Verdict, fit_axes

_LAST = 1e-6  # of a period: a setpoint that is nearer to the end is the end


def path(
    points: ArrayLike,
    feed: ArrayLike | None = None,
    *,
    axes: str = "",
    tolerance: float | None = None,
    spline: bool = False,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
) -> Program:
    """A program that goes straight from each point to the next, or on a spline through all of them.

    points    : (n, A), n > 1 [mm, rotary axes degrees]; axes that they have not stay at 0
    feed      : [mm/s], one for all moves or (n-1,) one for each: the speed of x, y and z together; where they stand
                that of u, v and w, where those stand too that of a, b and c [deg/s]. None for rapid moves, which only the
                machine's limits hold
    axes      : letters of the columns, up to nine of x y z a b c u v w; "" for the first two or three
    tolerance : contour error budget [mm]; None for that of the machine
    spline    : the cubic spline through the points with no curvature at its ends, over the lengths of the moves (in mm and
                degrees): tangents and curvature go on at each point

    start_speed, end_speed : [mm/s] along the path at its first and last point, counted as the feed is, with no
                acceleration: 0 for rest

    `Program.line` counts the moves from 1. A start or end in motion is for methods `optimal` and `second-order`. One above
    the feed or the limits of the axes is refused; where a path cannot be left or reached so fast `Plan.solved` is False.

    Raises InputError for arrays of another shape, values that are not finite, letters that are no axes or come twice,
    feeds that are not above 0, a tolerance below 1e-5, and splines without a feed or with a point twice running, and
    speeds below 0 or without a feed.

    >>> import planner
    >>> square = planner.path([[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]], feed=50.0)
    >>> len(square), square.end[1].tolist()
    (4, [20.0, 20.0, 0.0])
    >>> planner.plan(square, "mill", method="stop").verdict.passed
    True
    """
    given, letters = _points(points, axes)
    moves = len(given) - 1
    if tolerance is not None and not TOLERANCE_MIN <= tolerance < np.inf:
        raise InputError(f"tolerance {tolerance} mm; it must be {TOLERANCE_MIN:g} or more, and finite")
    others = tuple(letter for letter in letters if letter not in AXES)
    position = np.zeros((len(given), len(AXES) + len(others)))
    named = (*AXES, *others)
    unit = np.array([RAD_PER_DEG if letter in ROTARY_AXES else 1.0 for letter in letters])
    columns = [named.index(letter) for letter in letters]
    position[:, columns] = given * unit
    speed = np.full(moves, np.inf) if feed is None else _feeds(feed, moves)
    still = np.array([letter in ROTARY_AXES for letter in named])
    turning = (np.diff(position[:, np.logical_not(still)], axis=0) == 0.0).all(axis=1)
    program = program_of_points(
        position, np.where(turning, speed * RAD_PER_DEG, speed), tolerance, axes=named
    )
    speeds = _speeds(start_speed, end_speed, given=feed is not None)
    speeds *= np.where(turning[[0, -1]], RAD_PER_DEG, 1.0)
    program = dataclasses.replace(program, speeds=tuple(speeds.tolist()))
    return program if not spline else _on_spline(program, given, unit, columns)


def _speeds(start: float, end: float, *, given: bool) -> FloatArray:
    """(2,) the speeds at both ends. Raises InputError unless they are finite and 0 or more; above it where a feed is given."""
    speeds = _numbers([start, end], "start_speed and end_speed: give a number, in mm/s")
    if speeds.shape != (2,) or not (np.isfinite(speeds) & (speeds >= 0.0)).all():
        raise InputError(f"start_speed {start}, end_speed {end}; they must be 0 mm/s or more, and finite")
    if speeds.any() and not given:
        raise InputError("start_speed and end_speed need a feed, and there is none")
    return speeds


def _on_spline(program: Program, points: FloatArray, unit: FloatArray, columns: list[int]) -> Program:
    """The program on a spline through points (n, A), which times `unit` (A,) are its `columns`."""
    from scipy.interpolate import CubicSpline  # 0.2 s

    if np.isinf(program.feed).any():
        raise InputError("a spline needs a feed, and there is none")
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _refuse("points: row", np.append(False, length == 0.0), points, "a spline passes no point twice running")
    at = np.append(0.0, np.cumsum(length))
    slope = CubicSpline(at, points, bc_type="natural")(at, 1) * unit
    places = np.vstack([program.start, program.end])
    control = np.stack([places[:-1], places[:-1], places[1:], places[1:]], axis=1)
    control[:, 1, columns] += slope[:-1] * length[:, None] / 3.0
    control[:, 2, columns] -= slope[1:] * length[:, None] / 3.0
    table = SplineTable(block=np.arange(len(length)), points=control, weights=np.ones((len(length), 4)))
    kind = np.full(len(length), Kind.SPLINE)
    return dataclasses.replace(program, kind=kind, splines=table)


def stretched(plan: Plan, duration: float) -> Plan:
    """A plan with its motion run evenly slower, so that it takes a given time: at k times the time speeds are 1/k,
    accelerations 1/k^2 and jerks 1/k^3 of what they were, on the same path. Dwells last longer too.

    duration : [s]

    The motion is sampled anew at the interpolation period, between setpoints on polynomials of degree five that have
    their positions, velocities and accelerations; the derivatives are differences of these samples. They are judged as any
    motion is.

    Raises NotSolvedError for a plan without a motion; InputError for a duration below the plan's, and for plans with threads,
    an extruder or the tool centre point on.
    """
    was = plan.require().trajectory
    assert was is not None
    if not was.cycle_time <= duration < np.inf:
        raise InputError(
            f"duration {duration} s; the plan takes {was.cycle_time:.4f} s, and can only be slower"
        )
    if plan.toolpath.held.any() or len(was.extruder) or plan.joints is not None:
        raise InputError("threads, an extruder and the tool centre point are not run slower")
    if duration == was.cycle_time:
        return plan
    if any(plan.toolpath.speeds):
        raise InputError(
            "a motion that begins or ends in motion is not run slower: the speeds there are those asked for"
        )
    factor, dt = duration / was.cycle_time, plan.machine.dt
    t = np.append(np.arange(np.ceil(duration / dt - _LAST)) * dt, duration)
    theta = np.minimum(t / factor, was.t[-1])
    k = np.clip(np.searchsorted(was.t, theta, side="right") - 1, 0, len(was) - 2)
    from scipy.interpolate import BPoly  # 0.2 s

    place = BPoly.from_derivatives(was.t, np.stack([was.position, was.velocity, was.acceleration], axis=1))(
        theta
    )
    columns = {axis: (place * was.in_degrees)[:, i] for i, axis in enumerate(was.axes)}
    read = trajectory_of_columns({"t": t, **columns}, "<stretched>")
    motion, given, _ = fit_axes(read.trajectory, read.given, plan.toolpath)
    s = np.interp(theta, was.t, was.s)
    motion = dataclasses.replace(motion, s=s, block=was.block[k], line=was.line[k])
    verdict = judged(motion, plan.program, plan.toolpath, plan.machine, given=given)
    return dataclasses.replace(plan, trajectory=motion, verdict=verdict, grid=None, prices=None)


def _points(points: ArrayLike, axes: str) -> tuple[FloatArray, str]:
    """(n, A) the points, and the letters of their columns. Raises InputError unless they are finite numbers, n > 1, of
    axes that there are."""
    given = _numbers(
        points,
        "points: not an array of numbers; give (n, A), a row for each point, and axes='xya' to name columns",
    )
    letters = axes.lower() or "".join(AXES[: given.shape[-1] if given.ndim else 0])
    if not known_axes(letters):
        raise InputError(f"axes '{axes}': give each letter once, of x y z a b c u v w")
    wanted = (len(letters),) if axes else (2, 3)
    if given.ndim != 2 or given.shape[1] not in wanted or len(given) < 2:
        needed = f"(n, {len(letters)})" if axes else "(n, 2) or (n, 3), with axes='xyzabc' for more columns,"
        raise InputError(f"points: shape {given.shape}; it must be {needed} with at least two points")
    bad = np.logical_not(np.isfinite(given).all(axis=1))
    _refuse("points: row", bad, given, "every coordinate must be finite")
    return given, letters


def _feeds(feed: ArrayLike, moves: int) -> FloatArray:
    """(moves,) feeds [mm/s]. Raises InputError unless they are one number, or one above 0 for each move."""
    given = _numbers(feed, "feed: not a number and not an array of numbers; give one, or one for each move")
    if given.shape not in ((), (moves,)):
        raise InputError(f"feed: shape {given.shape}; give one number, or one for each of the {moves} moves")
    given = np.broadcast_to(given, (moves,))
    bad = np.logical_not(np.isfinite(given) & (given > 0))
    _refuse("feed: move", bad, given, "every feed must be above 0 mm/s, and finite")
    return given


def _numbers(given: ArrayLike, otherwise: str) -> FloatArray:
    """The array of what was given. Raises InputError, saying `otherwise`, if it is none."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(otherwise) from None


def _refuse(what: str, bad: NDArray[np.bool_], given: FloatArray, needed: str) -> None:
    """Raise InputError naming the first row of `given` (n, ...) that is `bad` (n,)."""
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(f"{what} {first + 1}: {given[first].tolist()}; {needed}")


def tip_path(
    machine: Machine,
    tips: ArrayLike,
    *,
    directions: ArrayLike | None = None,
    angles: ArrayLike | None = None,
    feed: float | None = None,
    tolerance: float | None = None,
    tool_length: float | None = None,
) -> Program:
    """A program for a machine with a table [kinematics], planned on `at_tip(machine)`.

    tips        : (n, 3) x, y, z of the tip, n > 1 [mm]
    directions  : (n, 3) along the tool, from its tip to the spindle, seen from the workpiece; of any length
                  above 0
    angles      : (n, 2) in their place: of the tilting axis and c [rad]
    feed        : of tip and angles in one norm, angles at the machine's radius [mm/s]; None for rapid moves
    tolerance   : of tip and angles in that norm [mm]; None for that of the machine
    tool_length : [mm], added to z as G43 does; None for that of the machine file

    Raises InputError for arrays of other shapes, a machine without kinematics, and as `rotary_along` does at
    the pole.
    """
    chain = kinematics_of(machine, tool_length)
    at = np.asarray(tips, dtype=np.float64)
    if at.ndim != 2 or at.shape[1] != len(LINEAR) or len(at) < 2 or not np.isfinite(at).all():
        raise InputError(f"tips: shape {at.shape}; (n, 3) finite numbers with n > 1 are needed")
    if (directions is None) == (angles is None):
        raise InputError("give either directions of the tool or angles")
    radius = machine.radius
    budget = machine.tolerance if tolerance is None else tolerance
    turns = (
        rotary_along(chain, np.asarray(directions, dtype=np.float64), budget / radius)
        if angles is None
        else np.asarray(angles, dtype=np.float64)
    )
    if turns.shape != (len(at), len(chain.data.rotary)) or not np.isfinite(turns).all():
        raise InputError(
            f"angles or directions: {turns.shape[0]} for {len(at)} tips; one finite row for each is needed"
        )
    points = np.hstack([at + np.array([0.0, 0.0, chain.length]), turns])
    speed = np.full(len(at) - 1, np.inf if feed is None else feed)
    return program_of_points(points, speed, tolerance, "<tips>", chain.axes)


def verify(
    t: ArrayLike,
    q: ArrayLike,
    program: Program | str | Path,
    machine: Machine | str | Path | None = None,
    *,
    axes: str = "",
    tolerance: float | None = None,
    not_limited: tuple[str, ...] = (),
) -> Verdict:
    """Judge a motion, wherever it comes from, against a program and a machine: `Verdict.faults` says what is
    wrong with it.

    t           : (T,) times of the samples [s]
    q           : (T, A) positions of the axes then [mm, rotary axes degrees]; velocities and so on are taken
                  from their differences. Of a program with the tool centre point on they are those of the
                  joints
    program     : a file, or a program read before
    machine     : a machine file, the name of a built-in machine, or a machine; None means "mill"
    axes        : letters of the columns of q; "" for the first A of x, y, z
    tolerance   : contour error budget [mm]; None for that of the program or the machine
    not_limited : quantities that are reported and not judged, such as "jerk"

    Raises InputError for arrays that do not go together, for other axes than the program's, and for a program
    or a machine that cannot be read.

    >>> import numpy as np, planner
    >>> there = planner.path([[0, 0], [10, 0]], feed=20.0)
    >>> t = np.arange(0.0, 1.001, 0.001)
    >>> x = 10.0 * t**2 * (3.0 - 2.0 * t)
    >>> found = planner.verify(t, np.stack([x, 0.0 * x], axis=1), there, "mill")
    >>> found.passed, str(found.faults[0])[:18], round(found.limits["feed"].ratio, 2)
    (False, 'start: not at rest', 0.75)
    """
    machine = machine_of(machine)
    for name in not_limited:
        if name not in NOT_LIMITED_NAMES:
            raise InputError(f"not_limited: no such limit '{name}'; there are {', '.join(NOT_LIMITED_NAMES)}")
    times, position = np.asarray(t), np.asarray(q)
    letters = axes or "".join(LINEAR_AXES[: position.shape[-1] if position.ndim else 0])
    if times.ndim != 1 or position.shape != (len(times), len(letters)):
        raise InputError(
            f"t has the shape {times.shape} and q {position.shape}; they must be (T,) and (T, A), "
            "a column for each axis (axes='xyz' names them)"
        )
    read = trajectory_of_columns(
        {"t": times, **{letter: position[:, k] for k, letter in enumerate(letters)}}, "<samples>"
    )
    if not isinstance(program, Program):
        program = read_program(program, machine)
    return judge(read, program, machine, tolerance=tolerance, not_limited=not_limited).verdict
