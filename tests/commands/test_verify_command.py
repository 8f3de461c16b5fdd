"""`planner verify`: what a file says of itself is told and not believed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from hand_made import SQUARE, trajectory_along

from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.report.trajectory_file import write_trajectory


def test_verify_needs_a_trajectory_that_fits(job: Path, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("t,x\n0,0\n1,1\n")
    result = run("verify", tmp_path / "t.csv", job)
    assert result.exit_code == 2
    assert "column 'y' is missing" in result.stderr


def test_verify_takes_the_recorded_machine(job: Path, tmp_path: Path) -> None:
    machine = load_machine("router")
    program = parse_program(SQUARE, machine)
    path = tmp_path / "t.parquet"
    write_trajectory(
        path,
        trajectory_along(toolpath_from_program(program, machine), time=1.5),
        {"machine": machine.model_dump(mode="json", exclude_none=True), "tolerance_mm": 0.01},
    )
    result = run("verify", path, job, "--json")
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout)
    assert said["machine"] == "router"
    assert said["contour_error_mm"] < 1e-9
    assert said["tolerance_mm"] == 0.01
    assert said["cycle_time_s"] == 6.0
    assert said["notes"] == [
        "the file says: machine router (taken)",
        "the file says: tolerance 0.01 mm (taken)",
    ]
    other = run("verify", path, job, "-m", "mill")
    assert other.exit_code == 0
    assert "the file says: tolerance 0.01 mm (not taken, -m or --tolerance is given)" in other.stderr
    assert ["tolerance", f"{load_machine('mill').tolerance:g}", "mm"] in [
        row.split() for row in other.stdout.splitlines()
    ]
    assert ["cycle", "time", "6.0000", "s"] in [row.split() for row in other.stdout.splitlines()]
    assert json.loads(run("verify", path, job, "--tolerance", "0.5", "--json").stdout)["tolerance_mm"] == 0.5
    unknown = run("verify", path, job, "--not-limited", "yerk")
    assert unknown.exit_code == 2
    assert "jerk" in unknown.stderr
    fast = tmp_path / "fast.csv"
    write_trajectory(fast, trajectory_along(toolpath_from_program(program, machine), time=0.1))
    result = run("verify", fast, job, "-m", "router")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout


def test_verify_does_not_believe_what_a_file_says_of_its_limits(job: Path, tmp_path: Path) -> None:
    machine = load_machine("router")
    program = parse_program(SQUARE, machine)
    path = tmp_path / "fast.npz"
    about = {
        "machine": machine.model_dump(mode="json", exclude_none=True),
        "not_limited": ["jerk", "acceleration", 5],
    }
    write_trajectory(path, trajectory_along(toolpath_from_program(program, machine), time=0.1), about)
    result = run("verify", path, job)
    assert result.exit_code == 1
    assert "the file says: not limited: jerk, acceleration (judged all the same" in result.stderr
    assert (
        "jerk is exceeded; the file says that its plan did not limit it: --not-limited jerk reports it"
        in result.stderr
    )


@pytest.mark.parametrize(
    "said", [{"tolerance_mm": "wide"}, {"tolerance_mm": -1.0}, {"not_limited": None}, {"machine": 7}]
)
def test_verify_takes_no_harm_from_what_a_file_says_of_itself(job: Path, tmp_path: Path, said: dict) -> None:
    machine = load_machine("mill")
    path = tmp_path / "t.npz"
    write_trajectory(
        path, trajectory_along(toolpath_from_program(parse_program(SQUARE, machine), machine), time=1.5), said
    )
    assert run("verify", path, job, "-m", "mill").exit_code == 0
    assert run("verify", path, job).exit_code == 0


@pytest.mark.parametrize(
    "about", ['{"not_limited": null}', '{"not_limited": 3}', "[" * 100_000, '{"a": ' + "1" * 5000 + "}"]
)
def test_metadata_beyond_reason(job: Path, tmp_path: Path, about: str) -> None:
    (tmp_path / "t.csv").write_text("t,x,y,z\n" + "".join(f"{k},{k},0,0\n" for k in range(9)))
    (tmp_path / "t.meta.json").write_text(about)
    result = run("verify", tmp_path / "t.csv", job)
    assert result.exit_code == (1 if "null" in about or "3}" in about else 2), result.output
    assert "Traceback" not in result.stderr


def test_an_array_named_npz(job: Path, tmp_path: Path) -> None:
    with (tmp_path / "t.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    result = run("verify", tmp_path / "t.npz", job)
    assert result.exit_code == 2
    assert "a single array" in result.stderr
