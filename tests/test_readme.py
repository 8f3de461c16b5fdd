"""What README.md shows works: its Python, its options, its commands' exit codes, the files and pages it names."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from planner.cli import app

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_python_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(ROOT)
    seen: dict[str, object] = {}
    exec(example, seen)
    plan = seen["plan"]
    assert plan.verdict.passed  # type: ignore[attr-defined]
    ratio = plan.corners.feed_planned / plan.corners.feed_closed_form  # type: ignore[attr-defined]
    assert ratio.max() <= 1.0 + 1e-6


@pytest.mark.parametrize("command", ["plan", "compare", "verify", "info", "pulses"])
def test_every_option_that_is_shown_exists(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "COLUMNS", "200")
    monkeypatch.setitem(os.environ, "TERMINAL_WIDTH", "200")
    usage = re.search(rf"^    planner {command} (.*?)(?=^    planner|\n\n)", README, re.DOTALL | re.MULTILINE)
    assert usage is not None
    shown = set(re.findall(r"(?<![\w-])(--?[a-z][a-z-]*)", usage[1]))
    help_text = CliRunner().invoke(app, [command, "--help"]).stdout
    missing = {option for option in shown if not re.search(rf"(?<![\w-]){option}(?![\w-])", help_text)}
    assert shown
    assert not missing


@pytest.mark.parametrize(
    "name", sorted(set(re.findall(r"`((?:benchmarks/results|docs|planner|tests)/[\w./-]+)`", README)))
)
def test_every_file_that_is_named_exists(name: str) -> None:
    place = ROOT / name
    assert place.exists() or list(place.parent.glob(f"{place.name}.*"))


def test_notes_and_lines_of_the_output_are_those_of_plan() -> None:
    """The labels of the example's output, as the code prints them."""
    tables = (ROOT / "planner" / "report" / "tables.py").read_text(encoding="utf-8")
    optimum = (ROOT / "planner" / "report" / "optimum.py").read_text(encoding="utf-8")
    for label in ("cycle time", "stopping at every block", "corners", "verdict", "held by"):
        assert f'"{label}"' in tables + optimum, label
