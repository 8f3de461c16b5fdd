"""The page is what runs: its stages come in its order, its table has all retries that a trace can show, and plans keep nothing back."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import pytest

import planner
from benchmarks.net import ablation
from planner.feedrate.solution import Status
from planner.joint.parts import FoundRun
from planner.planning.attempts import ATTEMPTS
from planner.planning.job.job import Job
from planner.planning.job.trace import Trace

PACKAGE = Path(planner.__file__).parent
MILL = planner.load_machine("mill")
CORNERS = "G21 G90 G64 P0.05 F3000\nG1 X5\nX6 Y3\nX2 Y4\nM2\n"
# What a trace shows of a plan that passes at its first attempt, and what only tells of something.
WAY = ("programmed feed", "search", "solve", "final grid", "between points", "plan", "given up")
TOLD = ("bound on corners", "compare")


def told_names() -> set[str]:
    """The names of all steps that the planner tells a trace, as far as they are written."""
    names = set()
    for file in PACKAGE.rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "tell" in text else ():
            if not isinstance(node, ast.Call) or not node.args:
                continue
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            said = node.args[1 if called == "tell_of" else 0] if called in ("tell", "tell_of") else None
            if isinstance(said, ast.JoinedStr):
                said = said.values[0]
            if isinstance(said, ast.Constant) and isinstance(said.value, str):
                names.add(said.value.split(",")[0].strip())
    return names


def test_the_table_has_exactly_the_retries_that_a_trace_can_show() -> None:
    retried = {step for retry in ablation.RETRIES for step in retry.steps}
    told = told_names() | {attempt.name for attempt in ATTEMPTS}
    first = {"joint search", "motion on the path"}  # one of them is the first attempt of every plan
    assert told - first - set(WAY) - set(TOLD) == retried
    assert len(ablation.RETRIES) <= 12


def test_each_of_them_can_be_switched_off() -> None:
    assert set(ablation.SWITCHES) - set(ablation.NUMBERS) == {retry.steps[0] for retry in ablation.RETRIES}


def steps_of(text: str, **settings) -> list[str]:
    trace = Trace()
    made = planner.plan(planner.read_program(text=text), MILL, log=trace, **settings)
    assert made.verdict is not None
    assert made.verdict.passed
    return [step.name for step in trace.steps]


def test_a_job_runs_in_the_order_of_the_page() -> None:
    """Path, the first attempt: a motion on the first splines, the search from there, and the plan. Nothing else is tried."""
    assert steps_of(CORNERS) == ["programmed feed", "joint search", "solve", "search", "plan"]


def test_where_the_search_cannot_run_the_next_attempts_do_in_their_order() -> None:
    tried = steps_of(CORNERS.replace("G64 P0.05", "G61"))
    names = [attempt.name for attempt in ATTEMPTS]
    assert [name for name in tried if name in names] == ["motion on the path", "closed form"]
    assert tried.index("solve") < tried.index("between points") < tried.index("plan")


def test_an_attempt_that_makes_no_plan_leaves_it_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search finds nothing: then from a motion that would stay, and then that is delivered."""
    from planner.planning import joint_search

    def nothing(runs, *more, **named):
        return [FoundRun(run, Status.ACCEPTABLE, "made up") for run in runs]

    monkeypatch.setattr(joint_search, "searched_runs", nothing)
    names = [attempt.name for attempt in ATTEMPTS]
    steps = steps_of(CORNERS)
    assert [name for name in steps if name in names] == names
    assert steps.count("search") == 2
    assert "splines" in steps  # those that the search began with, handed on


def test_a_finished_plan_has_its_prices_and_nothing_that_only_planning_needs() -> None:
    for settings in ({}, {"geometry": "spline"}):
        made = planner.plan(planner.read_program(text=CORNERS), MILL, **settings)
        assert made.making is None
        assert made.prices is not None
        fields = {field.name: getattr(made, field.name) for field in dataclasses.fields(made)}
        assert [name for name, value in fields.items() if callable(value)] == []


def test_a_job_has_no_field_that_plans_could_share() -> None:
    """What one plan notes is not another's: a job has no list or set, and the clock alone runs on."""
    kinds = {field.name: str(field.type) for field in dataclasses.fields(Job)}
    assert not [name for name, kind in kinds.items() if kind.startswith(("list", "set", "dict"))]
