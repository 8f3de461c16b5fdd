"""The methods by their names (`planner.base.names`), and `plan`, the one call that does a whole job."""

import dataclasses
import difflib
from collections.abc import Sequence
from importlib import import_module
from numbers import Real
from pathlib import Path
from typing import Any, TypedDict, Unpack, cast

import numpy as np

from planner.base.errors import InputError
from planner.base.names import BEZIER, EFFORTS, METHODS, SOLVERS, known_name, method_name, smoothing, users_of
from planner.corners.smooth import CornerShape
from planner.machine import LINEAR_AXES, Machine, load_machine
from planner.machine.kinematics import at_tip
from planner.machine.kinematics.limits import WIDE
from planner.machine.user_limit import OwnLimit
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.set_limits import limited
from planner.planning.job.at_tip import chain_of, in_joints
from planner.planning.job.plan import Plan
from planner.planning.job.trace import Log, Progress, Stages
from planner.planning.page import Method

DEFAULT_MACHINE = "mill"


class MethodSettings(TypedDict, total=False):
    """Settings of methods "optimal" and "second-order"; None, or left out, for the method's own.

    geometry : how the path is smoothed: "spline" (one spline from stop to stop), "corners" (each corner by
               itself) or "auto" (splines, or corners where they take less time); None for "auto", or for
               "corners" where `corner` is given
    corner   : the shape of single corners: "bezier", "fir", "kinematic", or your own; None for "bezier"
    solver   : "own", "ipopt", "fatrop"; "reachability", "toppra"; None for the method's first
    effort   : "quick", "normal" or "best": how fine grids and search are; None for "normal"
    smooth   : weight of the jerk against the time, 0 or more [-]: with more the joint search of "optimal"
               finds a smoother and slower motion; None for 0, where jerk is small as far as it costs no time
    shaped   : deliver setpoints that leave the machine's vibration modes at rest
    """

    geometry: str | None
    corner: str | CornerShape | None
    solver: str | None
    effort: str | None
    smooth: float | None
    shaped: bool | None


def plan(
    program: Program | str | Path,
    machine: Machine | str | Path | None = None,
    *,
    method: str | Method = "optimal",
    limits: OwnLimit | Sequence[OwnLimit] = (),
    tolerance: float | None = None,
    reading: Reading = AS_USUAL,
    progress: Progress | None = None,
    log: Log | None = None,
    **settings: Unpack[MethodSettings],
) -> Plan:
    """Plan, sample and verify the motion of an NC program.

    program   : a file, or a program read before
    machine   : a machine file, the name of a built-in machine, or a machine; None means "mill"
    method    : a name of `planner.base.names.METHODS`, or a method with settings of your own
    settings  : geometry, corner, solver, effort, smooth, shaped: `MethodSettings`
    limits    : of your own, one or several, beside the machine's (docs/extending.md): "optimal" and
                "second-order" keep them, the verdict judges every method by them
    tolerance : contour error budget [mm]; takes precedence over the program's G64 P and the machine file
    reading   : what is refused, left out and assumed in a program file
    progress  : called with the stage's name and the fraction done (0 to 1)
    log       : called with every step of the planning; a `Trace` keeps them as a table and as JSON

    Returns the plan, judged by the verifier. A problem that could not be solved is the plan's status;
    `Plan.require` turns it into a NotSolvedError.

    Raises InputError for a program or machine that cannot be read, naming file, line and column, for a
    machine with a value that no machine file may have, for an unknown name, and for a setting that the method
    does not use.
    """
    if not isinstance(method, str | Method):
        raise InputError(f"method = {method}: give a name, {', '.join(METHODS)}, or a method")
    given = check_settings(method, **settings)
    joints = not isinstance(method, str) or METHODS[method_name(method)].joints
    if isinstance(method, str):
        method = make_method(method, **given)
    machine, stages = machine_of(machine, limits), Stages(progress)
    program = program_of(program, machine, reading, stages)
    machine = limited(machine, program.limits)
    chain = chain_of(program, machine)
    if chain is not None and np.isfinite(machine.powers(LINEAR_AXES)).any():
        raise InputError(
            "the machine limits the power of linear axes, which no method keeps on a path of the tool's tip; leave power out of them"
        )
    used = machine if chain is None else at_tip(machine, chain, wide=WIDE if joints else None)
    made = method.plan(program, used, tolerance, progress, log)
    if chain is not None:
        made = in_joints(made, machine, chain)
    return dataclasses.replace(made, timings=stages.timings | made.timings)


def machine_of(machine: Machine | str | Path | None, limits: OwnLimit | Sequence[OwnLimit] = ()) -> Machine:
    """A machine as `plan` takes it, with `limits` beside its own. Raises InputError as `plan` does."""
    if not isinstance(machine, Machine):
        machine = load_machine(DEFAULT_MACHINE if machine is None else machine)
    machine.check()
    more = limits if isinstance(limits, Sequence) else (limits,)
    return machine.with_own((*machine.own, *more)) if more else machine


def program_of(program: Program | str | Path, machine: Machine, reading: Reading, stages: Stages) -> Program:
    """A program as `plan` takes it. Raises InputError for settings of the reader beside one that is read already, too."""
    if not isinstance(program, Program):
        with stages.stage("read"):
            return read_program(program, machine, reading)
    if reading != AS_USUAL:
        raise InputError("reading: the program is read already; give the settings to read_program")
    return program


def make_method(name: str, **settings: Unpack[MethodSettings]) -> Method:
    """The method of that name with these settings.

    Raises InputError for an unknown name of a method, geometry, corner shape, solver or effort.
    """
    given = _given(settings)
    entry = METHODS[method_name(name)]
    made: dict[str, Any] = dict(entry.settings)
    if entry.shapes:
        kind, shape = _smoothing(given.get("geometry"), given.get("corner"))
        made |= {"corner": shape or kind, "shaped": bool(given.get("shaped"))}
        if (effort := given.get("effort")) is not None:
            made["effort"] = known_name("effort", effort, EFFORTS)
    if (smooth := given.get("smooth")) is not None:
        made["smooth"] = float(smooth)
    if entry.solvers and (solver := given.get("solver")) is not None:
        made["solver"] = known_name("solver", solver, SOLVERS)
    module, _, class_name = entry.home.partition(":")
    method = getattr(import_module(module), class_name)(**made)
    assert isinstance(method, Method)
    return method


def check_settings(method: str | Method = "optimal", **settings: Unpack[MethodSettings]) -> MethodSettings:
    """The settings that are set. Raises InputError for an unknown name or a setting not used."""
    given = _given(settings)
    _check_used(method_name(method) if isinstance(method, str) else method, given)
    return given


def _given(settings: MethodSettings) -> MethodSettings:
    """The settings that are set. Raises TypeError for others than those of `MethodSettings`, and InputError
    for values that are none of theirs, in as far as names do not say it."""
    unknown = settings.keys() - MethodSettings.__annotations__.keys()
    if unknown:
        wrong, allowed = min(unknown), (*MethodSettings.__annotations__, "tolerance", "limits", "reading")
        near = difflib.get_close_matches(wrong, allowed, n=1, cutoff=0.4)
        hint = f" (did you mean '{near[0]}'?)" if near else ""
        raise TypeError(f"unexpected keyword argument '{wrong}'; settings are {', '.join(allowed)}{hint}")
    given = {name: value for name, value in settings.items() if value is not None and value is not False}
    corner, smooth, shaped = (given.get(name) for name in ("corner", "smooth", "shaped"))
    if "smooth" in given and not (isinstance(smooth, Real) and 0.0 <= float(smooth) < np.inf):
        raise InputError(f"smooth = {smooth!r}: it is a number, 0 or more")
    if "corner" in given and not (isinstance(corner, str) or hasattr(corner, "at")):
        raise InputError(f"corner = {corner}: give the name of a shape, or a shape of your own")
    if "shaped" in given and shaped is not True:
        raise InputError(f"shaped = {shaped!r}: it is True or False")
    return cast(MethodSettings, given)


def _check_used(method: str | Method, given: MethodSettings) -> None:
    """Raise InputError for a setting that the method would ignore."""
    for setting, value in given.items():
        if isinstance(method, Method):
            raise InputError(
                f"{setting} = {value} beside a method with settings of its own: {method!r}; set it there"
            )
        if method not in users_of(setting):
            raise InputError(
                f"{setting} = {value}: method {method} does not use it; it is for {' and '.join(users_of(setting))}"
            )
        if setting == "solver" and value not in METHODS[method].solvers:
            raise InputError(
                f"solver = {value}: method {method} does not use it; it has {', '.join(METHODS[method].solvers)}"
            )


def _smoothing(
    geometry: str | None, corner: str | CornerShape | None
) -> tuple[str, str | CornerShape | None]:
    """The geometry and the corner shape that are meant. Raises InputError for names that do not fit."""
    if corner is None or isinstance(corner, str):
        return smoothing(geometry, corner)
    return smoothing(geometry, BEZIER)[0], corner  # a shape of one's own goes where the usual one goes
