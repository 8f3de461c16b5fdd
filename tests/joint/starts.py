"""Runs from which searches of these tests begin."""

from __future__ import annotations

from functools import cache

import numpy as np

from benchmarks.jobs import problems
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.joint.guess import DEFAULT_CUT, Cut, Guess, guesses_from
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.machine import Axis, Machine
from planner.machine.user_limit import JointLimit, PathLimit
from planner.motion.vertex_times import passing_times
from planner.nc.program import Program
from planner.nc.reader import parse_program, read_program
from planner.planning.methods.optimal import OptimalMethod

MACHINE = problems.machine()
TURNING = Axis(velocity=90.0, acceleration=1500.0, jerk=1e5)


class Wall(PathLimit):
    """Bounds of all three along the path, which change with the place."""

    name = "wall"

    def velocity(self, at):
        return 60.0 + 8.0 * at.x

    def acceleration(self, at):
        return 900.0 + 40.0 * at.y

    def jerk(self, at):
        return 9e4 + 1e3 * at.x


class Arm(JointLimit):
    """An angle, whose derivatives bend."""

    name, unit, velocity, acceleration, jerk = "arm", "rad", 9.0, 150.0, 1.5e4

    def joint(self, at):
        return np.arctan2(at.y + 6.0, at.x + 5.0)


MACHINES = {
    "own": MACHINE.with_own([Wall(), Arm()]),
    "powered": MACHINE.model_copy(
        update={"axes": {k: v.model_copy(update={"power": 0.08}) for k, v in MACHINE.axes.items()}}
    ),
    "pushed": MACHINE.model_copy(update={"tangential_acceleration": 300.0}),
    "turned": MACHINE.model_copy(update={"axes": MACHINE.axes | {"a": TURNING}}),
}
PROGRAMS = {
    "corner": problems.polyline([[0, 0], [4, 0], [4, 4]]),
    "arcs": parse_program("G21 G17 G90 F6000\nG1 X4\nG3 X8 Y4 I0 J4\nG2 X12 Y8 Z1 I4 J0\nM2\n"),
    "curves": parse_program("G21 G17 G90 F6000\nG1 X4\nG5 X12 Y0 I3 J3 P-3 Q5\nG1 X16\nM2\n"),
    "narrow": parse_program("G21 G17 G90 F6000\nG1 X4\nG3 X4.08 Y0.08 J0.08\nG1 Y4\nG2 X9 Y9 I5\nM2\n"),
    "pentagon": problems.pentagon(side=6.0),
    "turned": read_program(text="G21 G90 F2400\nG1 X4 A3\nG1 X7 Y5 A8\nM2\n", machine=MACHINES["turned"]),
    "own": problems.polyline([[0, 0], [4, 0], [4, 4]]),
    "powered": problems.polyline([[0, 0], [4, 0], [4, 4]]),
    "pushed": problems.polyline([[0, 0], [4, 0], [4, 4]]),  # along which a tangential acceleration holds
}


@cache
def begun(name: str, cut: Cut = DEFAULT_CUT) -> tuple[TubeRun, Guess]:
    """A run, and its motion on Bezier corners cut into steps."""
    return begun_on(PROGRAMS[name], cut, MACHINES.get(name, MACHINE))


def toolpath_of(name: str) -> Toolpath:
    """The toolpath of a run."""
    return toolpath_from_program(PROGRAMS[name], MACHINES.get(name, MACHINE))


def begun_on(program: Program, cut: Cut = DEFAULT_CUT, machine: Machine = MACHINE) -> tuple[TubeRun, Guess]:
    """The same of a program of one run."""
    toolpath = toolpath_from_program(program, machine)
    (run,) = tube_runs_of(toolpath, machine)
    free = machine.model_copy(
        update={"axes": {k: v.model_copy(update={"power": None}) for k, v in machine.axes.items()}}
    )
    seen = OptimalMethod(corner="bezier").plan(program, free.with_own(machine.own)).require().trajectory
    times = np.maximum.accumulate(passing_times(seen, toolpath))
    times[-1] = seen.t[-1]
    return run, guesses_from([run], seen, [times[run.first]], cut)[0]
