"""A program with the tool centre point on, from the command line to its files and back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.machine.kinematics import kinematics_of
from planner.nc.reader import read_program
from planner.planning.job.at_tip import directions_of
from planner.report.figure import tool_lines
from planner.report.html.page import path_picture
from planner.report.html.saved import saved_plan
from planner.report.plots import toolpath_figure
from planner.report.units import UNITS
from planner.report.word_feed import planned_blocks
from tests.commands.command_line import run

TEXT = "G21 G90\nG0 X1 Y2 Z50\nM428\nG1 X2 A3 C5 F600\nX3 A6\nM429\nG0 Z52\nM2\n"
AXES = {"x": (300, 3000, 60000), "y": (300, 3000, 60000), "z": (200, 2000, 40000), "a": (90, 900, 18000)}
AXES["c"] = (180, 1800, 36000)


def machine_file(folder: Path, **limits: float) -> Path:
    """A machine with a tilting rotary table; `limits`: other velocities by axis."""
    text = 'name = "five"\ndt = 0.001\ntolerance = 0.01\n'
    for letter, (velocity, acceleration, jerk) in AXES.items():
        text += f"[axes.{letter}]\nvelocity = {limits.get(letter, velocity)}\nacceleration = {acceleration}\njerk = {jerk}\n"
    text += '[kinematics]\ntype = "xyzac-trt"\ny_offset = -20.0\nz_offset = 35.0\ntool_length = 60.0\n'
    file = folder / ("slow.toml" if limits else "five.toml")
    file.write_text(text)
    return file


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("five")
    (folder / "part.ngc").write_text(TEXT)
    done = run(
        "plan", folder / "part.ngc", "-m", machine_file(folder), "--method", "second-order", "-q", "-o", folder / "out",
        "--format", "npz", "--plot", "--report",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    return folder


@pytest.mark.slow
def test_files_have_joints_and_tip(made: Path) -> None:
    with np.load(made / "out" / "trajectory.npz") as file:
        columns = {name: file[name] for name in file.files}
    about = json.loads(str(columns["metadata"]))
    assert about["units"]["tip_x"] == "mm"
    assert about["tool_point"] == {"word": "M428", "line": 3, "length": 60.0, "rapids_off": 1}
    place = {"a": np.deg2rad(columns["a"]), "c": np.deg2rad(columns["c"])}
    q = kinematics_of(load_machine(made / "five.toml")).joints(
        place | {letter: columns[f"tip_{letter}"] for letter in "xyz"}
    )
    for letter in "xyz":
        assert np.allclose(columns[letter], q[letter], atol=1e-9)
        speed = np.gradient(columns[letter], 0.001)[1:-1]
        assert (
            np.median(np.abs(speed - columns[f"v{letter}"][1:-1])) < 0.01
        )  # but where the acceleration jumps
    assert np.ptp(columns["z"] - columns["tip_z"]) > 1.0
    said = json.loads((made / "out" / "summary.json").read_text())
    assert said["tool_point"]["length"] == 60.0
    assert {"toolpath.png", "profiles.png", "report.html", "planned.ngc"} <= {*said["files"]}


@pytest.mark.slow
def test_verify_judges_the_joints_and_the_tip(made: Path) -> None:
    passed = run("verify", made / "out", "-q", "--json", "--not-limited", "jerk")
    assert passed.exit_code == 0, passed.output
    found = json.loads(passed.stdout)
    planned = json.loads((made / "out" / "summary.json").read_text())["verdict"]
    for name in ("velocity.z", "acceleration.x", "velocity.a", "feed"):
        assert found["limits"][name] == pytest.approx(
            planned["limits"][name], rel=0.05
        )  # at the samples alone
    slow = machine_file(made, z=20.0)
    failed = run("verify", made / "out", "-m", slow, "-q", "--json", "--not-limited", "jerk")
    assert failed.exit_code == 1
    assert any(fault.startswith("joint velocity.z") for fault in json.loads(failed.stdout)["faults"])


@pytest.mark.slow
def test_the_plan_again_from_its_files(made: Path) -> None:
    plan, summary = saved_plan(made / "out")
    assert plan.verdict is not None
    assert plan.verdict.passed == summary["verdict"]["passed"]
    with np.load(made / "out" / "trajectory.npz") as file:
        assert np.allclose(plan.trajectory.position[:, 1], file["tip_y"], atol=1e-9)
        assert np.allclose(plan.setpoints.position[:, 1], file["y"], atol=1e-9)


@pytest.mark.slow
def test_planned_program_is_that_of_the_tip_with_block_times_under_g93(made: Path) -> None:
    plan, _ = saved_plan(made / "out")
    program = read_program(made / "out" / "planned.ngc", plan.machine)
    assert program.tool_point == plan.program.tool_point
    again = toolpath_from_program(program, plan.machine)
    assert np.array_equal(again.end, plan.toolpath.end)
    turning = np.isin(again.line, (4, 5))
    highest = planned_blocks(plan.trajectory, plan.toolpath).highest[turning]
    assert (again.feed[turning] <= plan.toolpath.feed[turning] * (1.0 + 1e-9)).all()
    assert (again.feed[turning] >= np.minimum(highest, plan.toolpath.feed[turning]) * 0.998).all()
    assert "G93" in (made / "out" / "planned.ngc").read_text()


@pytest.mark.slow
def test_exports(made: Path) -> None:
    refused = run("export", made / "out", "--for", "linuxcnc", "-o", made / "linuxcnc")
    assert refused.exit_code == 2
    assert "tool centre point" in refused.output
    assert run("export", made / "out", "--for", "linuxcnc-stream", "-o", made / "stream").exit_code == 0
    (table,) = (file for file in (made / "stream").iterdir() if file.suffix == ".txt")
    rows = np.loadtxt(table, comments="#")
    with np.load(made / "out" / "trajectory.npz") as file:
        assert np.allclose(rows[: len(file["y"]), 1], file["y"], atol=1e-5)


def test_info_tells_it(tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text(TEXT)
    done = run("info", tmp_path / "part.ngc", "-m", machine_file(tmp_path))
    assert "on by M428, line 3; a tool of 60 mm" in done.stdout
    found = run("info", tmp_path / "part.ngc", "-m", machine_file(tmp_path), "--json")
    assert json.loads(found.stdout)["tool_point"]["word"] == "M428"


@pytest.mark.slow
def test_the_picture_has_the_tool(made: Path) -> None:
    plan, _ = saved_plan(made / "out")
    figure = toolpath_figure(plan, UNITS["mm"])
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert "tool" in labels
    lines = tool_lines(plan, 500)
    assert 10 < len(lines) <= 500
    assert np.allclose(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1), 0.12 * 52.0, rtol=0.05)
    assert path_picture(plan, 300.0).count('stroke="#D55E00"') > 5
    places = plan.trajectory.rows(np.array([0, len(plan.trajectory) - 1]))
    begin, end = directions_of(plan, places)
    assert np.allclose(begin, [0.0, 0.0, 1.0])
    tilt, turn = np.deg2rad([6.0, 5.0])
    assert np.allclose(end, [np.sin(turn) * np.sin(tilt), np.cos(turn) * np.sin(tilt), np.cos(tilt)])


@pytest.mark.slow
def test_stops_that_know_no_joint_are_not_compared_with(made: Path) -> None:
    told = dict(json.loads((made / "out" / "summary.json").read_text())["told"])
    assert told["saved"].endswith("without the limits of the joints")
