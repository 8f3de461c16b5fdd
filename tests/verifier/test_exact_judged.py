"""Blocks under G61 are judged by their distance from the path itself; the same motion under G64 by the tolerance."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planner
from planner.base.arrays import FloatArray
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.planning.job.plan import Plan
from planner.verifier import Given, verify

TEXT = (
    "G21 G17 {mode} F3000\nG1 X10 Y5\nG2 X10 Y5 Z6 I5 J0 P3\nG18 G3 X20 Z6 I5 K0\nG17 G3 X30.0002 Y15 I0 J10\nG1 Y30 Z0\n"
    "G5 X40 Y40 I0 J5 P-5 Q0\n"
)


@pytest.fixture(scope="module")
def plan() -> Plan:
    machine = planner.load_machine("mill")
    program = planner.read_program(text=TEXT.format(mode="G61.1"), machine=machine)
    made = planner.plan(program, machine, method="stop")
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults
    return made


def bumped(plan: Plan, by: FloatArray, block: int) -> Trajectory:
    """The motion with the samples in the middle of a block moved."""
    assert plan.trajectory is not None
    motion = plan.trajectory
    inside = np.flatnonzero(motion.block == block)
    bump = np.zeros(len(motion))
    bump[inside] = np.sin(np.linspace(0.0, np.pi, len(inside))) ** 4
    return dataclasses.replace(motion, position=motion.position + bump[:, None] * by)


def faults(plan: Plan, motion: Trajectory, mode: str) -> list[str]:
    program = planner.read_program(text=TEXT.format(mode=mode), machine=plan.machine)
    path = toolpath_from_program(program, plan.machine)
    found = verify(motion, path, plan.machine, not_limited=("acceleration", "jerk", "velocity"))
    return [fault for fault in found.sentences if "exact path" in fault]


@pytest.mark.shows("exact-path", "sampled: verified within 1 nm of lines, arcs and curves")
@pytest.mark.parametrize("block", range(6))
def test_samples_beside_the_path_are_found_on_every_kind_of_block(plan: Plan, block: int) -> None:
    aside = np.array(
        [
            [0.5, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.6, -0.8, 0.0],
        ]
    )
    assert faults(plan, bumped(plan, 0.0 * aside[block], block), "G61.1") == []
    found = faults(plan, bumped(plan, 5e-5 * aside[block], block), "G61.1")
    assert len(found) == 1
    assert f"line {block + 2}:" in found[0]
    assert " mm off at t = " in found[0]


def test_under_g64_the_tolerance_counts(plan: Plan) -> None:
    assert plan.trajectory is not None
    shifted = plan.trajectory.position.copy()
    shifted[:, 2] += 5e-5 * np.sin(np.linspace(0.0, np.pi, len(shifted))) ** 4
    motion = dataclasses.replace(plan.trajectory, position=shifted)
    assert faults(plan, motion, "G61.1") != []
    assert faults(plan, motion, "G64") == []


def test_a_sample_beyond_pieces_shorter_than_a_period_is_on_the_path() -> None:
    """Found by the campaign of random jobs: a spline of seven pieces is passed within two periods, and the joints' times are good to
    one."""
    limits = {"x": (1356.63, 29283.7), "y": (1407.18, 32242.24), "z": (1481.96, 35410.65)}
    axes = {letter: Axis(velocity=v, acceleration=a, jerk=3e7) for letter, (v, a) in limits.items()}
    machine = Machine(name="quick", dt=0.002, tolerance=0.8036, feed_default=10.0, axes=axes)
    text = (
        "G21 G17 G61 F118474.054\nG5 X-0.072072 Y-0.006866 I0.002819 J0.042341 P-0.001324 Q-0.021307\n"
        "G1 X-0.218 Y0.069 F62582.44\nG0 X-0.330 Y-0.147\nG1 X-0.712 Y-0.886\nG2 X-1.35 Y-2.121 R-3.586437\n"
        "G1 X-1.5009 Y-2.413 F8092.1\nG1 X-1.577 Y-2.56 Z0.085\nG1 X-2.3679 Y-4.0905\n"
    )
    made = planner.plan(planner.read_program(text=text, machine=machine), machine, method="second-order")
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults


def test_a_sample_just_before_the_stop_where_g61_begins_may_be_of_the_block_before() -> None:
    """Found by the campaign: the block before it, a tangent arc under G64, has used some of its tolerance."""
    limits = {
        "x": (460.9802366380376, 3995.911078937642),
        "y": (335.91758470765325, 9095.049377635476),
        "z": (600.0, 1e4),
    }
    axes = {letter: Axis(velocity=v, acceleration=a, jerk=3e7) for letter, (v, a) in limits.items()}
    machine = Machine(name="quick", dt=0.002, tolerance=0.013642721725888783, feed_default=10.0, axes=axes)
    text = (
        "G21 G17 G64 F2037.360350294874\nG5 X-0.0268 Y-0.0919 I-0.000298 J0.065761 P-0.052556 Q0.120002\nG61\n"
        "G3 X0.688162 Y-0.305173 R1.998237\nG2 X0.82 Y0.13 R-0.442402\n"
    )
    made = planner.plan(planner.read_program(text=text, machine=machine), machine, method="second-order")
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults


@pytest.mark.parametrize(
    "text", ["G3 X0 Y0 I0.14795 J-0.02212 P2\nG5 X0.005 Y-0.011 I0.001493 J0.004828 P0.001836 Q-0.00439\n"]
)
def test_within_the_tolerance_of_a_whole_circle_the_order_says_where_a_sample_is(text: str) -> None:
    """Found by the campaign: a tolerance larger than the circle, whose end is passed at its start as well."""
    axes = {letter: Axis(velocity=4000, acceleration=1e5, jerk=3e7) for letter in "xyz"}
    machine = Machine(name="quick", dt=0.002, tolerance=0.323, feed_max=921.9, feed_default=10.0, axes=axes)
    program = planner.read_program(text=f"G61 F1236\n{text}", machine=machine)
    made = planner.plan(program, machine, method="second-order")
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults
    assert made.trajectory is not None
    beside = made.trajectory.position.copy()
    beside[len(beside) // 2] += [0.0, 0.0, 5e-5]
    found = verify(
        dataclasses.replace(made.trajectory, position=beside),
        toolpath_from_program(program, machine),
        machine,
        not_limited=("acceleration", "jerk", "velocity"),
    )
    assert any(fault.startswith("exact path: 5e-05 mm off") for fault in found.sentences)


# ---- the order of the path within the tolerance -------------------------------------------------------------------------

AXES = {letter: Axis(velocity=100, acceleration=2000, jerk=2e5) for letter in "xyz"}
COARSE = Machine(name="coarse", dt=0.001, tolerance=0.3, feed_default=10.0, axes=AXES)
RUN_IN, RADIUS = "G21 G17 G90 G61 F1200\nG1 X-5 Y0\nX0\n", 0.1
SIDES = ("X0.1 Y0", "X0.1 Y0.1", "X0 Y0.1", "X0 Y0")
SQUARE, SQUARE_BACK = ("\n".join(sides) + "\n" for sides in (SIDES, (*SIDES[2::-1], SIDES[3])))


def circle(arcs: int, turn: int = 1) -> str:
    """A circle from the origin about (0, `RADIUS`), in so many arcs; turn 1 or -1 is its sense."""
    angles = turn * 2.0 * np.pi * np.arange(arcs + 1) / arcs
    x, y = RADIUS * np.sin(angles), RADIUS * (1.0 - np.cos(angles))
    code = "G3" if turn > 0 else "G2"
    return "".join(
        f"{code} X{x[k + 1]:.9f} Y{y[k + 1]:.9f} I{-x[k]:.9f} J{RADIUS - y[k]:.9f}\n" for k in range(arcs)
    )


def found_in(asked: str, run: str, method: str = "second-order", machine: Machine = COARSE) -> list[str]:
    """What the verifier says of the motion of the program `run`, judged against the program `asked`."""
    made = planner.plan(planner.read_program(text=RUN_IN + run, machine=machine), machine, method=method)
    assert made.verdict is not None
    assert made.trajectory is not None
    assert made.verdict.passed, made.verdict.faults
    motion, program = made.trajectory, planner.read_program(text=RUN_IN + asked, machine=machine)
    axes = "".join(motion.axes)
    found = planner.verify(motion.t, motion.position, program, machine, axes=axes, not_limited=("jerk",))
    return list(found.sentences)


@pytest.mark.parametrize(
    ("asked", "run", "method"),
    [
        pytest.param(SQUARE + "G1 Y-5\n", SQUARE_BACK + "G1 Y-5\n", "second-order", id="square backwards"),
        pytest.param(
            circle(8) + "G1 Y-5\n", circle(8, -1) + "G1 Y-5\n", "second-order", id="8 arcs backwards"
        ),
        pytest.param(circle(8) + "G1 X5\n", "G1 X5\n", "second-order", id="8 arcs left out"),
        pytest.param(circle(1) + "G1 Y-5\n", circle(1, -1) + "G1 Y-5\n", "stop", id="circle backwards"),
        pytest.param(circle(1) + "G1 X5\n", "G1 X5\n", "second-order", id="circle left out"),
        pytest.param(circle(8), "G1 X-0.3\nX0\n", "second-order", id="circle left out at the end"),
        pytest.param(
            SQUARE + "G64\nG1 X5\n", SQUARE_BACK + "G64\nG1 X5\n", "stop", id="square before G64 backwards"
        ),
        pytest.param(
            "G64\nX5\nG61\nX10\nX9.9\nX15\n", "G64\nX5\nG61\nX15\n", "second-order", id="a way back left out"
        ),
    ],
)
def test_another_order_within_the_tolerance_is_a_fault(asked: str, run: str, method: str) -> None:
    found = [fault for fault in found_in(asked, run, method) if fault.startswith("exact path")]
    assert len(found) == 1
    assert "followed in its order only as far as line" in found[0] or " mm off" in found[0]


@pytest.mark.parametrize("method", ["second-order", "stop", "optimal"])
@pytest.mark.parametrize(
    "program", [SQUARE + "G1 Y-5\n", circle(8) + "G1 X5\n", circle(1) + "G64\nG1 X5\nY5\n"]
)
def test_the_program_in_its_order_is_none(program: str, method: str) -> None:
    assert found_in(program, program, method) == []


@pytest.mark.parametrize("digits", [3, 6])
def test_digits_of_the_positions_are_allowed(digits: int) -> None:
    text = RUN_IN + SQUARE + circle(8) + "G5 X0.2 Y0.3 I0 J0.1 P-0.1 Q0\n"
    program = planner.read_program(text=text, machine=COARSE)
    made = planner.plan(program, COARSE, method="second-order")
    assert made.trajectory is not None
    found = verify(
        dataclasses.replace(made.trajectory, position=np.round(made.trajectory.position, digits)),
        toolpath_from_program(program, COARSE),
        COARSE,
        given=Given(columns=(), position_rounding=np.full(3, 0.5 * 10.0**-digits)),
        not_limited=("jerk",),
    )
    assert not [fault for fault in found.sentences if fault.startswith("exact path")]


def test_an_overshoot_along_a_side_is_measured() -> None:
    found = found_in(SQUARE + "G1 Y-5\n", "X0.12\nX0.1\n" + SQUARE + "G1 Y-5\n")
    assert any(fault.startswith("exact path: 0.02 mm off") and "line 4:" in fault for fault in found), found


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_half_of_a_line_beside_a_block_under_g64_is_exact(plan: Plan, share: float) -> None:
    """A tangent joint without a stop: the corner may be rounded on the half beside it, and no further."""
    program = planner.read_program(
        text="G21 G17 G64 F3000\nG3 X10 Y10 I0 J10\nG61\nG1 Y40\n", machine=plan.machine
    )
    made = planner.plan(program, plan.machine, method="optimal")
    assert made.verdict is not None
    assert made.trajectory is not None
    assert made.verdict.passed, made.verdict.faults
    aside = made.trajectory.position.copy()
    aside[int(np.argmin(np.abs(aside[:, 1] - (10.0 + share * 30.0)))), 0] += 5e-5
    found = verify(
        dataclasses.replace(made.trajectory, position=aside),
        toolpath_from_program(program, plan.machine),
        plan.machine,
        not_limited=("acceleration", "jerk", "velocity"),
    )
    exact = [fault for fault in found.sentences if fault.startswith("exact path: 5e-05 mm off")]
    assert len(exact) == (share > 0.5)
