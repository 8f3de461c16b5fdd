"""`planner plan`: exit codes, what is said, and which files are written and not replaced."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import run
from hand_made import SQUARE

from planner.base.errors import InputError


@pytest.mark.slow
def test_plan_writes_and_exits_0(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned()
    result = run("plan", job, "-o", tmp_path / "out", "--plot", "--corners")
    assert result.exit_code == 0, result.output
    assert "limited by" in result.stdout
    assert "feed / its own" in result.stdout  # the corner table
    files = {"profiles.png", "summary.json", "toolpath.png", "trajectory.parquet"}
    assert {file.name for file in (tmp_path / "out").iterdir()} == files
    assert f"files in {tmp_path / 'out'}: {', '.join(sorted(files))}" in result.stdout


def test_that_there_are_no_corners_is_said(planned: Callable[..., None], job: Path) -> None:
    planned(turns=False)
    assert "no corners to list" in run("plan", job, "--corners").stdout
    assert "no corners to list" not in run("plan", job).stdout


def test_json_is_all_there_is_on_stdout(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned()
    result = run("plan", job, "--json", "--quiet", "-o", tmp_path / "out")
    assert json.loads(result.stdout)["cycle_time_s"] == pytest.approx(0.8)
    assert result.stderr == ""


def test_failed_verdict_exits_1_and_is_written(
    planned: Callable[..., None], job: Path, tmp_path: Path
) -> None:
    planned(passed=False)
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["verdict"]["passed"] is False


def test_unsolved_exits_3_and_writes_nothing(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned(solved=False)
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert result.stderr.startswith("not solved: no feed satisfies all limits; loosen the tolerance")
    assert not (tmp_path / "out").exists()


def test_bad_input_exits_2(planned: Callable[..., None], job: Path) -> None:
    planned(raises=InputError("G41: cutter compensation", source="job.ngc", line=3, column=7))
    result = run("plan", job)
    assert result.exit_code == 2
    assert result.stderr == "job.ngc:3:7: G41: cutter compensation\n"
    assert result.stdout == ""


def test_a_bug_exits_70_with_its_traceback(planned: Callable[..., None], job: Path) -> None:
    planned(raises=ZeroDivisionError("oops"))
    result = run("plan", job)
    assert result.exit_code == 70
    assert "Traceback" in result.stderr
    assert "ZeroDivisionError: oops" in result.stderr
    assert "Please report it" in result.stderr


def test_interrupt_exits_130(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned(raises=KeyboardInterrupt())
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 130
    assert result.stderr == "interrupted\n"
    assert not (tmp_path / "out").exists()


def test_plot_needs_a_directory(job: Path) -> None:
    result = run("plan", job, "--plot")
    assert result.exit_code == 2
    assert "-o DIR" in result.stderr


def test_unwritable_output(planned: Callable[..., None], job: Path) -> None:
    planned()
    result = run("plan", job, "-o", job)
    assert result.exit_code == 2
    assert result.stderr == f"{job}: cannot be written: is a file, not a directory\n"


def test_outputs_do_not_replace_what_is_not_ours(
    planned: Callable[..., None], job: Path, tmp_path: Path
) -> None:
    planned()
    (tmp_path / "summary.json").write_text("mine")
    refused = run("plan", job, "-o", tmp_path)
    assert refused.exit_code == 2
    assert "summary.json: was not written by planner" in refused.stderr
    assert (tmp_path / "summary.json").read_text() == "mine"
    assert run("plan", job, "-o", tmp_path, "--force").exit_code == 0
    assert run("plan", job, "-o", tmp_path).exit_code == 0


def test_a_job_is_not_overwritten(planned: Callable[..., None], tmp_path: Path) -> None:
    planned()
    job = tmp_path / "trajectory.parquet"
    job.write_text(SQUARE)
    result = run("plan", job, "-o", tmp_path, "--force")
    assert result.exit_code == 2
    assert "read as input" in result.stderr
    assert job.read_text() == SQUARE


@pytest.mark.parametrize("method", ["optimal", "stop", "fir"])
@pytest.mark.parametrize(
    "move", ["F0.0001\nG1 X10", "F3000\nG2 X10 Y0 R-900000000", "F3000\nG1 X10\nG4 P1000000"]
)
def test_motions_that_take_for_ever_are_refused_at_once(tmp_path: Path, method: str, move: str) -> None:
    (tmp_path / "job.ngc").write_text(f"G21 G90 G17\n{move}\nM2\n")
    result = run("plan", tmp_path / "job.ngc", "--method", method)
    assert result.exit_code == 2
    assert "samples are made: raise the feed" in result.stderr
