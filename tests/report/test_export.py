"""The files of a plan: complete, of one run, and JSON that any parser reads."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hand_made import SQUARE, make_plan

from planner.base.errors import InputError
from planner.machine import machine_from_dict
from planner.nc.info import describe
from planner.nc.reader import parse_program
from planner.report.export import check_places, write_plan
from planner.report.summary import info_summary, summary
from planner.report.trajectory_file import FORMATS, read_trajectory
from tests.commands.command_line import run


@pytest.mark.parametrize("file_format", FORMATS)
def test_files_belong_together(tmp_path: Path, file_format: str) -> None:
    plan = make_plan()
    names = write_plan(plan, tmp_path / "out", file_format=file_format)  # type: ignore[arg-type]
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert names == written["files"] == sorted(file.name for file in (tmp_path / "out").iterdir())
    read = read_trajectory(tmp_path / "out" / f"trajectory.{file_format}")
    assert read.metadata["run_id"] == written["run_id"]
    assert read.metadata["tolerance_mm"] == 0.02
    assert read.metadata["not_limited"] == ["jerk"]
    assert machine_from_dict(read.metadata["machine"]) == plan.machine
    assert np.array_equal(read.trajectory.jerk, plan.trajectory.jerk)


def test_another_format_replaces_the_first(tmp_path: Path) -> None:
    write_plan(make_plan(), tmp_path / "out", file_format="csv")
    (tmp_path / "out" / "mine.txt").write_text("mine")
    write_plan(make_plan(), tmp_path / "out", file_format="npz")
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == [
        "mine.txt",
        "summary.json",
        "trajectory.npz",
    ]


def test_a_summary_of_the_user_stays(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(InputError, match=r"summary.json: was not written by planner"):
        write_plan(make_plan(), tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]
    assert "summary.json" in write_plan(make_plan(), tmp_path, force=True)
    write_plan(make_plan(), tmp_path)


def test_inputs_are_no_outputs(tmp_path: Path) -> None:
    """Not even with --force; but a planned.ngc that is the program stays, and the rest is written."""
    program, machine = tmp_path / "trajectory.parquet", tmp_path / "summary.json"
    for given in (program, machine):
        given.write_text("G1 X1")
        with pytest.raises(InputError, match="read as input"):
            check_places(tmp_path, [program, machine], file_format="parquet", plots=False, force=True)
        given.unlink()
    (tmp_path / "planned.ngc").write_text("G1 X1")
    check_places(tmp_path, [tmp_path / "planned.ngc"], file_format="parquet", plots=False, force=False)
    with pytest.raises(InputError, match=r"planned.ngc: was not written by planner"):
        check_places(tmp_path, [program], file_format="parquet", plots=False, force=False)


def test_summary_has_the_contract_s_keys() -> None:
    said = json.loads(json.dumps(summary(make_plan()), allow_nan=False))
    assert said["cycle_time_s"] == pytest.approx(0.8)
    assert said["status"] == "OPTIMAL"
    assert said["verdict"]["passed"] is True
    assert said["verdict"]["limits"]["velocity.x"] == 0.5
    assert set(said["verdict"]) >= {"contour_error_mm", "vertex_error_mm", "end_error_mm"}
    assert said["corners"] == {
        "count": 3,
        "not_looked_at": 0,
        "held": 3,
        "worst_speed_ratio": 1.0,
        "worst_budget_ratio": 0.75,
        "stopped_at": 1,
        "gain": pytest.approx(1.35),
        "gain_min": pytest.approx(1.3),
        "gain_max": pytest.approx(1.4),
        "gain_count": 2,
    }
    assert set(said) >= {"method", "corner", "blocks", "grid_points", "timings_s", "versions"}
    assert set(said["versions"]) >= {"planner", "python", "numpy"}


def test_summary_of_an_unsolved_plan() -> None:
    plan = make_plan(solved=False)
    plan.stop_time = float("nan")
    said = json.loads(json.dumps(summary(plan), allow_nan=False))
    assert said["cycle_time_s"] is None
    assert said["verdict"] is None
    assert said["corners"] == {"count": 0, "worst_speed_ratio": None}
    assert said["stop_time_s"] is None
    assert "loosen" in said["sentence"]


def test_an_unsolved_plan_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no trajectory"):
        write_plan(make_plan(solved=False), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_unwritable_directory(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written") as fault:
        write_plan(make_plan(), tmp_path / "file" / "out")
    assert fault.value.source == str(tmp_path / "file" / "out")
    with pytest.raises(InputError, match="is a file, not a directory"):
        write_plan(make_plan(), tmp_path / "file")


def test_info_is_json() -> None:
    said = info_summary(describe(parse_program(SQUARE), lines=7))
    assert json.loads(json.dumps(said, allow_nan=False))["blocks"]["line"] == 4


@pytest.mark.parametrize("name", ["planned.ngc", "summary.json"])
def test_a_called_file_named_as_one_of_the_directory_is_refused_before_any_work(
    tmp_path: Path, name: str
) -> None:
    word = Path(name).stem
    (tmp_path / f"{word}.ngc").write_text(f"o<{word}> sub\nG1 X5\no<{word}> endsub\n")
    (tmp_path / "job.ngc").write_text(f"G21 G90 F100\nG0 X0\no<{word}> call\nM2\n")
    done = run("plan", tmp_path / "job.ngc", "-o", tmp_path / "out")
    refused = name == "planned.ngc"  # a subprogram's file ends in .ngc
    assert done.exit_code == (2 if refused else 0)
    assert ("rename it" in done.output) == refused
    assert (tmp_path / "out").exists() != refused
    assert run("plan", tmp_path / "job.ngc").exit_code == 0
