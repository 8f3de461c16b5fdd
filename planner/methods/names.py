"""The methods by their names on the command line, and `plan`, the one call that does a whole job."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from planner.errors import InputError
from planner.machine import Machine, load_machine
from planner.methods.bezier import BezierMethod
from planner.methods.fir import FirMethod
from planner.methods.fir_spline import FirSplineMethod
from planner.methods.job import Method
from planner.methods.kinematic import KinematicMethod
from planner.methods.optimal import OptimalMethod
from planner.methods.plan import Plan
from planner.methods.stages import Progress, Stages
from planner.methods.stop import StopMethod
from planner.methods.toppra import SOLVERS, ToppraMethod
from planner.methods.tube import TubeMethod
from planner.nc.program import Program
from planner.nc.reader import read_program

DEFAULT_MACHINE = "mill"
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
    corner: str = "auto",
    solver: str = "reachability",
    rounds: int | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Plan, sample and verify the motion of an NC program.

    program   : a file, or a program read before
    machine   : a machine file, the name of a built-in machine, or a machine; None means "mill"
    method    : a name of `METHODS`, or a method with settings of your own
    corner    : "auto", "spline", "bezier", "fir" or "kinematic"; for "toppra" and "optimal"
    solver    : "reachability" or "toppra"; for "toppra"
    rounds    : in which "optimal" and "toppra" reshape splines by what their motion pays for; None for as many as the job's size
                lets pay
    tolerance : contour error budget [mm]; beats the program's G64 P and the machine's
    progress  : called with the stage's name and the fraction done

    Raises InputError naming file, line and column. A problem that could not be solved is the plan's status; `Plan.require`
    turns it into an exception.
    """
    chosen = _method(method, corner, solver, rounds) if isinstance(method, str) else method
    if not isinstance(machine, Machine):
        machine = load_machine(DEFAULT_MACHINE if machine is None else machine)
    if isinstance(program, Program):
        return chosen.plan(program, machine, tolerance, progress)
    reading = Stages(progress)
    with reading.stage("read"):
        program = read_program(program, machine)
    made = chosen.plan(program, machine, tolerance, progress)
    return dataclasses.replace(made, timings=reading.timings | made.timings)


def _method(name: str, corner: str, solver: str, rounds: int | None) -> Method:
    if solver not in SOLVERS:
        raise InputError(f"no solver '{solver}'; there are {', '.join(SOLVERS)}")
    if rounds is not None and rounds < 0:
        raise InputError(f"{rounds} rounds; it must be 0 or more")
    if name == "optimal":
        return OptimalMethod(corner=corner, rounds=rounds)
    if name == "toppra":
        return ToppraMethod(corner=corner, solver=solver, rounds=rounds)
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
