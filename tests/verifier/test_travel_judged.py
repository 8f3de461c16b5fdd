"""The verdict on the travel of the axes: against the extremes of the delivered positions."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planner
from planner.machine import Axis, Machine, load_machine
from planner.planning.job.at_tip import judged
from planner.planning.job.plan import Plan
from planner.verifier import Verdict
from tests.commands.command_line import run
from tests.nc.test_travel import MILL, reaching

JOB = "G21 G90 G64 P0.02 F3000\nG0 X10 Y5\nG1 X40\nG3 X40 Y25 J10\nG1 X10 Y20\nY5\n"


@cache
def job() -> Plan:
    """By the first test: at import every worker would compile what it takes."""
    return planner.plan(planner.read_program(text=JOB), method="kinematic")


def on(machine: Machine, made: Plan | None = None, **how: tuple[str, ...]) -> Verdict:
    made = made or job()
    motion = made.joints if made.joints is not None else made.trajectory
    assert motion is not None
    return judged(motion, made.program, made.toolpath, machine, **how)


@pytest.mark.shows("travel", "exact: how far a motion goes beyond")
@settings(deadline=None, max_examples=25)
@given(st.floats(11.0, 60.0), st.sampled_from("xy"), st.booleans())
def test_a_motion_beyond_the_travel_fails_by_how_far_it_goes(end: float, axis: str, other: bool) -> None:
    """Either end of the travel, against the furthest sample; the tolerance is allowed."""
    motion = job().trajectory
    assert motion is not None
    place = motion.position[:, "xy".index(axis)]
    travel = (-end, 60.0) if other else (-60.0, end)
    beyond = 0.0 if other else place.max() - end
    verdict = on(reaching({}, **{axis: travel}))
    assert verdict.passed == (beyond <= 0.02)
    if not verdict.passed:
        (fault,) = verdict.faults
        assert (fault.kind, fault.name) == ("travel", f"travel.{axis}")
        said = re.match(r"(\S+) mm, (\S+) mm beyond its travel of \S+ to (\S+) mm", fault.found)
        assert said is not None
        assert float(said[1]) == pytest.approx(place.max(), rel=1e-6)
        assert float(said[2]) == pytest.approx(beyond, rel=1e-3)
        at = int(np.argmin(np.abs(motion.t - fault.time)))
        assert place[at] == pytest.approx(place.max(), abs=1e-9)
        assert fault.line in {motion.line[at], motion.line[at] + 1}


def test_what_is_not_judged() -> None:
    short = {"x": (-5.0, 20.0)}
    assert on(reaching(None, **short)).passed, "without G54 machine coordinates are not known"
    assert not on(reaching({}, **short)).passed
    assert on(reaching({}, **short), not_limited=("travel",)).passed
    free = planner.plan(
        planner.read_program(
            text=JOB, machine=reaching({}, **short), reading=planner.Reading(ignore_travel=True)
        ),
        reaching({}, **short),
        method="kinematic",
    )
    assert free.verdict is not None
    assert free.verdict.passed


@pytest.mark.parametrize(("travel", "passed"), [((8.0, 60.0), True), ((12.0, 60.0), False)])
def test_a_start_beyond_the_travel_is_no_fault_of_the_motion(
    travel: tuple[float, float], passed: bool
) -> None:
    """The motion starts at 0, enters its travel, and comes back to x = 10."""
    assert on(reaching({}, x=travel)).passed == passed


def test_an_axis_that_starts_beyond_goes_no_further() -> None:
    assert on(reaching({}, z=(5.0, 60.0))).passed, "z stands still"
    away = planner.plan(planner.read_program(text="G21 G90 F600\nG1 X10 Z-1\n"), method="kinematic")
    assert not on(reaching({}, z=(5.0, 60.0)), away).passed


def test_an_axis_that_turns_on_has_no_end_of_its_travel() -> None:
    """Past 360 degrees it stands where it stood a turn before; one that does not turn on has left its travel there."""
    axis = {"velocity": 100, "acceleration": 1000, "jerk": 1e5, "travel_min": 0.0}
    passed = []
    for wrapped, last in ((True, 10), (False, 370)):
        far, short = (
            reaching({}).model_copy(
                update={"axes": MILL.axes | {"a": Axis(**axis, travel_max=end, wrapped=wrapped)}}
            )
            for end in (720.0, 360.0)
        )
        text = f"G21 G90 F3000\nG1 X5 A350\nX10 A{last}\n"
        made = planner.plan(planner.read_program(text=text, machine=far), far, method="stop")
        assert made.trajectory is not None
        assert np.rad2deg(made.trajectory.position[-1, -1] / made.trajectory.radius) == pytest.approx(370.0)
        passed.append(on(short, made).passed)
    assert passed == [True, False]


def test_joints_are_judged_where_the_tool_centre_point_is_on() -> None:
    data = load_machine("mill").model_dump(exclude_none=True) | {"work_offsets": {"g54": {}}}
    for letter in "ac":
        data["axes"][letter] = {"velocity": 100, "acceleration": 1000, "jerk": 1e5}
    data["kinematics"] = {"type": "xyzac-trt", "z_rot_point": -200.0}
    text = "G21 G90 F1000\nG43.4\nG1 X0 Y0 Z0\nG1 X1 A30\n"
    data["axes"]["y"] |= {"travel_min": -250.0, "travel_max": 250.0}
    wide = Machine(**data)
    for method in ("kinematic", "optimal"):
        made = planner.plan(planner.read_program(text=text, machine=wide), wide, method=method)
        assert made.verdict is not None
        assert made.verdict.passed
        data["axes"]["y"] |= {"travel_min": -50.0, "travel_max": 50.0}
        assert [fault.name for fault in on(Machine(**data), made).faults] == ["travel.y"]


def test_commands_tell(tmp_path: Path) -> None:
    """`verify` fails, `time` refuses as `plan` does."""
    axis = "velocity = 100\nacceleration = 1000\njerk = 1e5\ntravel_min = 0\ntravel_max = {}\n"
    for name, end in (("long", 100), ("short", 30)):
        axes = "".join(f"[axes.{c}]\n{axis.format(end)}" for c in "xyz")
        (tmp_path / f"{name}.toml").write_text(
            f'name = "{name}"\ndt = 0.001\ntolerance = 0.02\n{axes}[work_offsets.g54]\nx = 0\n'
        )
    job, out = tmp_path / "job.ngc", tmp_path / "out"
    job.write_text(JOB)
    assert run("plan", job, "-m", tmp_path / "long.toml", "--method", "kinematic", "-o", out).exit_code == 0
    assert run("verify", out).exit_code == 0
    failed = run("verify", out, "-m", tmp_path / "short.toml")
    assert failed.exit_code == 1
    assert "travel.x" in failed.output
    assert run("verify", out, "-m", tmp_path / "short.toml", "--not-limited", "travel").exit_code == 0
    words = ("time", job, "--control", "grbl", "-m")
    assert run(*words, tmp_path / "long.toml").exit_code == 0
    refused = run(*words, tmp_path / "short.toml")
    assert refused.exit_code == 2
    assert "job.ngc:3:4: X: in machine coordinates x goes to" in refused.output
    assert run(*words, tmp_path / "short.toml", "--ignore-travel").exit_code == 0
