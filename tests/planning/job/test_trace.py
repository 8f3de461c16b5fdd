"""The trace of a plan: what it says is what was done, it changes nothing, and the command line has it as lines and as a file."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hand_made import SQUARE
from typer.testing import CliRunner

from benchmarks.jobs.random_lines import job
from planner.cli import app
from planner.planning.job.trace import Step, Trace
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.second_order import SecondOrderMethod
from planner.planning.methods.stop import StopMethod


@pytest.fixture(scope="module")
def told():
    program, machine = job(3)
    trace = Trace()
    return OptimalMethod(corner="spline").plan(program, machine, log=trace), trace


def test_a_trace_changes_nothing(told):
    plan, _ = told
    silent = OptimalMethod(corner="spline").plan(*job(3))
    assert (silent.trajectory.position == plan.trajectory.position).all()


def test_every_step_is_told_and_what_was_kept_is_the_fastest_so_far(told):
    plan, trace = told
    names = [step.name for step in trace.steps]
    assert {"splines", "solve", "between points", "plan"} <= set(names)
    for step in trace.steps:
        if step.kept is not None:
            assert step.kept == (step.found < step.before)
            assert step.gain == (1.0 - step.found / step.before if step.kept else 0.0)
    assert [step.at for step in trace.steps] == sorted(step.at for step in trace.steps)
    last = next(step for step in trace.steps if step.name == "plan")
    assert last.found == plan.trajectory.cycle_time
    assert last.facts["passed"] is True


def test_the_solver_s_windows_and_points_are_told(told):
    plan, trace = told
    solves = [step.facts for step in trace.steps if step.name == "solve"]
    assert all(facts["windows"] >= facts["runs"] >= 1 for facts in solves)
    assert plan.grid_points in [facts["points"] for facts in solves]


def test_second_order_is_told_likewise_and_other_methods_in_a_line():
    program, machine = job(3)
    second, stop = Trace(), Trace()
    SecondOrderMethod(corner="spline").plan(program, machine, log=second)
    assert {"splines", "solve", "plan"} <= {step.name for step in second.steps}
    StopMethod().plan(program, machine, log=stop)
    assert [(step.name, step.facts.get("method")) for step in stop.steps] == [
        ("programmed feed", None),
        ("plan", "stop"),
    ]


def test_lines_of_a_table():
    trace, lines = Trace(), []
    live = Trace(line=lines.append)
    for log in (trace, live):
        log(Step(at=0.5, name="solve", found=2.0, facts={"points": 12345, "passed": True}))
        log(Step(at=0.75, name="finer grid", found=1.0, before=2.0, kept=True, facts={"excess": 1e-4}))
        log(Step(at=1.0, name="corners", found=math.nan, before=1.0, kept=False))
    assert trace.table().splitlines() == lines
    assert lines[1].split() == ["0.50s", "0.50s", "solve", "2", "s", "points", "12,345,", "passed", "yes"]
    assert lines[2].split() == [
        "0.75s",
        "0.25s",
        "finer",
        "grid",
        "1",
        "s",
        "5.0e-01",
        "yes",
        "excess",
        "0.0001",
    ]
    assert lines[3].split() == ["1.00s", "0.25s", "corners", "none", "no"]
    assert trace.as_json()[2] == {"at": 1.0, "name": "corners", "found": None, "before": 1.0, "kept": False}


def run(*arguments: object):
    return CliRunner().invoke(app, ["plan", *(str(argument) for argument in arguments)])


@pytest.mark.slow
def test_the_command_line_has_lines_and_a_file(tmp_path: Path):
    program, file = tmp_path / "square.ngc", tmp_path / "trace.json"
    program.write_text(SQUARE)
    result = run(program, "--method", "stop", "--verbose", "--trace", file)
    assert result.exit_code == 0
    header, _, line = result.stderr.splitlines()
    assert header.split()[:3] == ["at", "took", "step"]
    assert "method stop" in line
    written = json.loads(file.read_text())
    assert written["method"] == "stop"
    assert [step["name"] for step in written["steps"]] == ["programmed feed", "plan"]
    again = run(program, "--method", "stop", "--trace", file, "--json")  # a trace may be replaced
    assert again.exit_code == 0
    json.loads(again.stdout)
    refused = run(program, "--method", "stop", "--trace", program)
    assert refused.exit_code == 2
    assert program.read_text() == SQUARE
