"""A program of points: straight moves from one to the next, for paths that do not come from an NC program."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.machine import LINEAR_AXES, Machine, load_machine
from planner.machine.kinematics.chain import LINEAR, kinematics_of
from planner.machine.kinematics.directions import rotary_along
from planner.machine.parts import TOLERANCE_MIN
from planner.nc.points import AXES, program_of_points
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.planning.methods.registry import DEFAULT_MACHINE
from planner.report.judging import judge
from planner.report.trajectory_reader import trajectory_of_columns
from planner.verifier import NOT_LIMITED_NAMES, Verdict


def path(points: ArrayLike, feed: ArrayLike | None = None, *, tolerance: float | None = None) -> Program:
    """A program that goes straight from each point to the next.

    points    : (n, 2) or (n, 3) x, y and z, n > 1 [mm]; z is 0 where there is none
    feed      : [mm/s], one for all moves or (n-1,) one for each; None for rapid moves, which only the
                machine's limits hold
    tolerance : contour error budget [mm]; None for that of the machine

    `Program.line` counts the moves from 1.

    Raises InputError for arrays of another shape, values that are not finite, feeds that are not above 0, and
    a tolerance below 1e-5.

    >>> import planner
    >>> square = planner.path([[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]], feed=50.0)
    >>> len(square), square.end[1].tolist()
    (4, [20.0, 20.0, 0.0])
    >>> planner.plan(square, "mill", method="stop").verdict.passed
    True
    """
    position = _points(points)
    moves = len(position) - 1
    if tolerance is not None and not TOLERANCE_MIN <= tolerance < np.inf:
        raise InputError(f"tolerance {tolerance} mm; it must be {TOLERANCE_MIN:g} or more, and finite")
    return program_of_points(
        position, np.full(moves, np.inf) if feed is None else _feeds(feed, moves), tolerance
    )


def _points(points: ArrayLike) -> FloatArray:
    """(n, 3) the points. Raises InputError unless they are (n, 2) or (n, 3) finite numbers, n > 1."""
    given = _numbers(points, "points: not an array of numbers; give (n, 2) or (n, 3), one row for each point")
    if given.ndim != 2 or given.shape[1] not in (2, 3) or len(given) < 2:
        raise InputError(f"points: shape {given.shape}; it must be (n, 2) or (n, 3) with at least two points")
    bad = np.logical_not(np.isfinite(given).all(axis=1))
    _refuse("points: row", bad, given, "every coordinate must be finite")
    return np.pad(given, ((0, 0), (0, len(AXES) - given.shape[1])))


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
    return program_of_points(points, speed, tolerance, axes=chain.axes)


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
    if not isinstance(machine, Machine):
        machine = load_machine(DEFAULT_MACHINE if machine is None else machine)
    machine.check()
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
