"""The shipped program through the command line: planned, written, verified again from the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from quick import slow_but
from typer.testing import CliRunner

from planner.cli import app

STOPPING = "--method stop --format npz"
BRACKET = Path(__file__).resolve().parent.parent / "planner" / "examples" / "bracket.ngc"


@pytest.mark.parametrize("arguments", slow_but([STOPPING], ["", "--corner fir --effort quick", STOPPING]))
def test_plan_then_verify_the_file(tmp_path: Path, arguments: str) -> None:
    out = tmp_path / "out"
    planned = CliRunner().invoke(app, ["plan", str(BRACKET), "-o", str(out), "--json", *arguments.split()])
    assert planned.exit_code == 0, planned.output
    summary = json.loads((out / "summary.json").read_text())
    assert json.loads(planned.stdout)["cycle_time_s"] == summary["cycle_time_s"]
    assert summary["cycle_time_s"] <= summary["stop_time_s"] * (1 + 1e-9)
    trajectory = out / next(name for name in summary["files"] if name.startswith("trajectory."))
    again = CliRunner().invoke(app, ["verify", str(trajectory), str(BRACKET), "--json"])
    assert again.exit_code == 0, again.output
    # the samples alone see no more than samples and dense motion together
    for name, ratio in json.loads(again.stdout)["limits"].items():
        assert ratio <= summary["verdict"]["limits"][name] * (1 + 1e-9)
