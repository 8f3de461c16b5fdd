"""What `plan` is asked for is used or refused, and what it assumed is said."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hand_made import SQUARE
from typer.testing import CliRunner, Result

import planner
from planner.base.errors import InputError
from planner.cli import app
from planner.planning.methods.stop import StopMethod


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["plan", *(str(argument) for argument in arguments)])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--method", "stop", "--corner", "auto"], "corner = auto: method stop does not use it"),
        (["--method", "bezier", "--corner", "bezier"], "it is for optimal and second-order"),
        (["--solver", "reachability"], "solver = reachability: method optimal does not use it"),
        (["--format", "parquet"], "name one with -o DIR"),
    ],
)
def test_options_that_would_be_ignored_are_refused(tmp_path: Path, arguments: list[str], said: str) -> None:
    job = tmp_path / "square.ngc"
    job.write_text(SQUARE)
    result = run(job, *arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert result.stdout == ""


def test_a_setting_beside_a_method_is_refused() -> None:
    for setting in ({"corner": "auto"}, {"solver": "toppra"}, {"effort": "quick"}):
        with pytest.raises(InputError, match="set it there"):
            planner.plan("absent.ngc", method=StopMethod(), **setting)


def test_notes_are_printed_and_in_json(tmp_path: Path) -> None:
    job, out = tmp_path / "job.ngc", tmp_path / "out"
    job.write_text("F3000\nG1 X10\nY10\n")
    note = "line 2: no G20 or G21 before the first move: mm"
    printed = run(job, "--method", "stop").stdout
    assert printed.startswith(f"assumed: {note}\n")
    assert printed.count(note) == 1
    said = json.loads(run(job, "--method", "stop", "--json", "-o", out).stdout)
    assert said["notes"] == json.loads((out / "summary.json").read_text())["notes"]
    assert said["notes"][0] == note
    assert said["assumptions"] == [note]
    assert said["notes"][1].startswith("planned.ngc equals the program")


def test_a_file_that_was_not_written_is_said(tmp_path: Path) -> None:
    job = tmp_path / "planned.ngc"
    job.write_text(SQUARE)
    result = run(job, "--method", "stop", "-o", tmp_path)
    assert "note: planned.ngc is the program that was planned, and stays as it is" in result.stdout
