"""Other people's solvers on the same jobs, limits and tolerance, judged by the same verifier; and models of controls.

    toppra              second-order feed on the planner's own geometry, by the package toppra; jerk is not limited
    sequential-convex   jerk-limited feed on the planner's splines, by convex problems and ipopt
    copp, copp-lp       the same by the package copp (copp-py), TOPP3-SOCP and TOPP3-LP, passes until nothing is gained, brought
                        onto constant jerks as the one before; copp:quick and so on: on the grid of that effort, with fewer points
    ruckig              every line from rest to rest by the package ruckig, phase-synchronised, so that the motion stays on the line.
                        Its open version has no waypoints of its own (it sends them to a server): it cannot do better here
    ipopt, fatrop       geometry and feed together (method tube), by casadi's solvers on a whole run

Models have no motion and no verdict: they are this project's short descriptions of what a control documents
(planner/controls/timing), and give a time only. grbl, Klipper and Marlin stay on the path and know no jerk; LinuxCNC gets G64 P
with the tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType

import numpy as np

import planner
from benchmarks.runner.judged import Judged, NotApplicable, NotHere
from planner.base.arrays import FloatArray
from planner.base.errors import NotSolvedError
from planner.base.names import NORMAL
from planner.controls.export.chords import Polyline, programmed_polyline
from planner.controls.timing import models
from planner.controls.timing.linuxcnc import linuxcnc_times
from planner.controls.timing.times import standing
from planner.feedrate.solvers import ThirdOrderSolver
from planner.machine import Machine
from planner.nc.program import Kind, Program
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod

SEQUENTIAL_CONVEX, COPP, COPP_LP = ALONG_SPLINES = ("sequential-convex", "copp", "copp-lp")
CHORDS = (
    0.1  # of the tolerance: how far the chords of arcs may be from them where a model takes lines only [-]
)


def toppra(program: Program, machine: Machine, tolerance: float | None) -> Plan:
    """Method second-order with toppra as its solver."""
    return planner.plan(program, machine, tolerance=tolerance, method="second-order", solver="toppra")


def along_splines(solver: str) -> Callable[[Program, Machine, float | None], Plan]:
    """The first splines, and the feed along them by "sequential-convex", "copp" or "copp-lp", each with ":EFFORT" for another grid than
    the usual one. The two of copp raise NotHere without the package."""
    name, _, effort = solver.partition(":")

    def planned(program: Program, machine: Machine, tolerance: float | None) -> Plan:
        own = _convex() if name == SEQUENTIAL_CONVEX else _copp(linear=name == COPP_LP)
        method = OptimalMethod(corner="spline", solver=own, effort=effort or NORMAL)
        return method.plan(program, machine, tolerance)

    return planned


def _convex() -> ThirdOrderSolver:
    from benchmarks.solvers.sequential_convex import ExactMotion, SequentialConvex

    return ExactMotion(solver=SequentialConvex())


def _copp(*, linear: bool) -> ThirdOrderSolver:
    from benchmarks.solvers import copp_solver

    if copp_solver.copp() is None:
        raise NotHere("copp-py is not installed (pip install '.[bench]')")
    return copp_solver.CoppMotion(solver=copp_solver.CoppSocp(linear=linear))


def tube_by(solver: str) -> Callable[[Program, Machine, float | None], Plan]:
    """Method tube by another solver."""

    def planned(program: Program, machine: Machine, tolerance: float | None) -> Plan:
        return planner.plan(program, machine, tolerance=tolerance, method="tube", solver=solver)

    return planned


def ruckig(program: Program, machine: Machine, tolerance: float | None) -> Judged:
    """Every line from rest to rest. Raises NotHere without the package, and NotApplicable for anything but lines in linear axes."""
    try:
        import ruckig as package
    except ModuleNotFoundError as fault:
        raise NotHere("ruckig is not installed (pip install '.[test]')") from fault
    if (program.kind != Kind.LINE).any():
        raise NotApplicable("lines only: ruckig moves from point to point")
    if set(program.axes) - set("xyzuvw"):
        raise NotApplicable("linear axes only: the feed of moves with rotary axes is not given to it")
    t, q = _from_rest_to_rest(package, program, machine)
    verdict = planner.verify(t, q, program, machine, axes="".join(program.axes), tolerance=tolerance)
    return Judged(verdict=verdict, cycle_s=float(t[-1]))


def _from_rest_to_rest(
    package: ModuleType, program: Program, machine: Machine
) -> tuple[FloatArray, FloatArray]:
    """Times (T,) [s] and positions (T, A) [mm] of lines one after the other, each so many whole periods long."""
    step = np.diff(np.vstack([program.start, program.end]), axis=0)
    limits = [machine.limits(name, program.axes) for name in ("velocity", "acceleration", "jerk")]
    if not np.isfinite(limits[2]).all():
        raise NotApplicable("ruckig needs a jerk limit on every axis")
    at, positions = np.array(program.start), [np.array(program.start)[None, :]]
    for move, feed in zip(step, program.feed, strict=True):
        length = float(np.linalg.norm(move))
        if length == 0.0:
            continue
        given = _line(package, at, at + move, limits, feed * np.abs(move) / length)
        path = package.Trajectory(len(at))
        try:
            result = package.Ruckig(len(at), machine.dt).calculate(given, path)
        except package.RuckigError as fault:
            raise NotSolvedError(str(fault).partition(" input:")[0].replace("\n", " ")) from fault
        if result not in (package.Result.Working, package.Result.Finished):
            raise NotSolvedError(f"ruckig ended with {result}")
        count = round(path.duration / machine.dt)
        positions.append(np.array([path.at_time(k * machine.dt)[0] for k in range(1, count + 1)]))
        at = at + move
    q = np.concatenate(positions)
    return machine.dt * np.arange(len(q)), q


def _line(
    package: ModuleType, start: FloatArray, end: FloatArray, limits: list[FloatArray], feed: FloatArray
) -> object:
    """What ruckig is asked for: rest to rest within limits (3 of (A,)) and the programmed feed of each axis (A,)."""
    given = package.InputParameter(len(start))
    given.current_position, given.target_position = start.tolist(), end.tolist()
    velocity, acceleration, jerk = limits
    given.max_velocity = np.where(feed > 0.0, np.minimum(velocity, feed), velocity).tolist()
    given.max_acceleration, given.max_jerk = acceleration.tolist(), jerk.tolist()
    given.synchronization = package.Synchronization.Phase
    given.duration_discretization = package.DurationDiscretization.Discrete
    return given


def modelled(control: str) -> Callable[[Program, Machine, float | None], float]:
    """The predicted time of a control [s]: "grbl", "klipper", "marlin" or "linuxcnc"."""

    def predicted(program: Program, machine: Machine, tolerance: float | None) -> float:
        stops = planner.plan(program, machine, method="stop", tolerance=tolerance)
        allowed = machine.tolerance if tolerance is None else tolerance
        line = programmed_polyline(stops, CHORDS * allowed)
        time = _linuxcnc(stops, line, allowed) if control == "linuxcnc" else _law(stops, line, control)
        if not math.isfinite(time):
            raise NotApplicable("the model gives no time")
        return time + float(program.dwell.sum())

    return predicted


def _law(stops: Plan, line: Polyline, control: str) -> float:
    feed = np.where(line.rapid, np.inf, line.feed)
    law, stands = models.CONTROLS[control], standing(stops.program, line.block, switches=True)
    times = models.predicted_times(line.points, feed, stands, stops.machine, stops.toolpath.axes, law)
    return float(times.sum())


def _linuxcnc(stops: Plan, line: Polyline, tolerance: float) -> float:
    feed = np.where(line.rapid, np.inf, line.feed)
    moves = np.linalg.norm(np.diff(line.points, axis=0), axis=1) > 0.0
    at = np.append(0, np.flatnonzero(moves) + 1)  # a point that moves on, after those that stand in its place
    stands = np.logical_or.reduceat(standing(stops.program, line.block, switches=True), at)
    room = tolerance - line.miss
    times = linuxcnc_times(line.points[at], feed[moves], stands, stops.machine, stops.toolpath.axes, room)
    return float(times.sum())
