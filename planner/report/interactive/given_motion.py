"""Any motion judged, from arrays: what `planner verify` does with files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from planner.base.errors import InputError
from planner.machine import LINEAR_AXES, Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.planning.methods.registry import DEFAULT_MACHINE
from planner.report.judging import judge
from planner.report.trajectory_reader import trajectory_of_columns
from planner.verifier import NOT_LIMITED_NAMES, Verdict


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
    """Judge a motion, wherever it comes from, against a program and a machine: `Verdict.faults` says what is wrong with it.

    t           : (T,) times of the samples [s]
    q           : (T, A) positions of the axes then [mm, rotary axes degrees]; velocities and so on are taken from their differences.
                  Of a program with the tool centre point on they are those of the joints
    program     : a file, or a program read before
    machine     : a machine file, the name of a built-in machine, or a machine; None means "mill"
    axes        : letters of the columns of q; "" for the first A of x, y, z
    tolerance   : contour error budget [mm]; None for that of the program or the machine
    not_limited : quantities that are reported and not judged, such as "jerk"

    Raises InputError for arrays that do not go together, for other axes than the program's, and for a program or a machine that cannot
    be read.

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
