"""The methods by their names on the command line, and `plan`, the one call that does a whole job."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from planner.base.errors import InputError
from planner.feedrate.solvers import OWN, REACHABILITY, second_order_solver, third_order_solver
from planner.job.job import Method
from planner.job.plan import Plan
from planner.job.stages import Progress, Stages
from planner.machine import Machine, load_machine
from planner.methods.bezier import BezierMethod
from planner.methods.fir import FirMethod
from planner.methods.fir_spline import FirSplineMethod
from planner.methods.kinematic import KinematicMethod
from planner.methods.optimal import OptimalMethod
from planner.methods.second_order import ToppraMethod
from planner.methods.stop import StopMethod
from planner.methods.tube import TubeMethod
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.optimal.geometry import AUTO, SPLINE

DEFAULT_MACHINE = "mill"
# Which methods use which setting of `plan`.
USED_BY = {
    "corner": ("optimal", "toppra"),
    "solver": ("optimal", "toppra"),
    "rounds": ("optimal", "toppra"),
    "shaped": ("optimal", "toppra"),
}
METHODS = (
    "optimal",
    "toppra",
    "bezier",
    "kinematic",
    "fir",
    "fir-plain",
    "fir-spline",
    "fir-spline-plain",
    "tube",
    "stop",
)


def plan(
    program: Program | str | Path,
    machine: Machine | str | Path | None = None,
    *,
    method: str | Method = "optimal",
    corner: str | None = None,
    solver: str | None = None,
    rounds: int | None = None,
    shaped: bool = False,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Plan, sample and verify the motion of an NC program.

    program   : a file, or a program read before
    machine   : a machine file, the name of a built-in machine, or a machine; None means "mill"
    method    : a name of `METHODS`, or a method with settings of your own
    corner    : "auto", "spline", "bezier", "fir" or "kinematic", for "toppra" and "optimal" only; None for "auto"
    solver    : "own", "ipopt", "fatrop" or "sequential-convex" for "optimal", None for "own"; "reachability" or "toppra" for "toppra",
                None for "reachability" (feedrate/solvers.py)
    rounds    : in which "optimal" and "toppra" reshape splines ("auto", "spline") by what their motion pays for; None for as many as
                the size of the job lets pay
    shaped    : deliver set points that leave the machine's vibration modes at rest, for "toppra" and "optimal" only
    tolerance : contour error budget [mm]; beats the program's G64 P and the machine's
    progress  : called with the stage's name and the fraction done

    Raises InputError naming file, line and column, and for a setting that the method does not use. A problem that could not be
    solved is the plan's status; `Plan.require` turns it into an exception.
    """
    _check_used(method, corner=corner, solver=solver, rounds=rounds, shaped=shaped or None)
    if isinstance(method, str):
        method = _method(
            method,
            AUTO if corner is None else corner,
            solver,
            rounds,
            shaped,
        )
    if not isinstance(machine, Machine):
        machine = load_machine(DEFAULT_MACHINE if machine is None else machine)
    if isinstance(program, Program):
        return method.plan(program, machine, tolerance, progress)
    reading = Stages(progress)
    with reading.stage("read"):
        program = read_program(program, machine)
    made = method.plan(program, machine, tolerance, progress)
    return dataclasses.replace(made, timings=reading.timings | made.timings)


def _check_used(method: str | Method, **given: str | int | None) -> None:
    """Raise InputError for a setting that the method would ignore."""
    for setting, users in USED_BY.items():
        if given[setting] is None or method in users:
            continue
        if isinstance(method, Method):
            raise InputError(
                f"{setting} = {given[setting]} beside a method with settings of its own: {method!r}; set it there"
            )
        if method in METHODS:
            raise InputError(
                f"{setting} = {given[setting]}: method {method} does not use it; it is for {' and '.join(users)}"
            )
    if given["rounds"] is not None and given["corner"] not in (None, AUTO, SPLINE):
        raise InputError(
            f"rounds = {given['rounds']}: they reshape splines, and corner {given['corner']} has none"
        )


def _method(name: str, corner: str, solver: str | None, rounds: int | None, shaped: bool) -> Method:
    if rounds is not None and rounds < 0:
        raise InputError(f"{rounds} rounds; it must be 0 or more")
    if name == "optimal":
        third_order = third_order_solver(OWN if solver is None else solver)
        return OptimalMethod(corner=corner, solver=third_order, rounds=rounds, shaped=shaped)
    if name == "toppra":
        second_order = second_order_solver(REACHABILITY if solver is None else solver)
        return ToppraMethod(corner=corner, solver=second_order, rounds=rounds, shaped=shaped)
    if name == "bezier":
        return BezierMethod()
    if name == "kinematic":
        return KinematicMethod()
    if name in ("fir", "fir-plain"):
        return FirMethod(plain=name == "fir-plain")
    if name in ("fir-spline", "fir-spline-plain"):
        return FirSplineMethod(plain=name == "fir-spline-plain")
    if name == "tube":
        return TubeMethod()
    if name == "stop":
        return StopMethod()
    raise InputError(f"no method '{name}'; there are {', '.join(METHODS)}")
