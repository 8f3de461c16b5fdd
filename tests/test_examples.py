"""The examples in docstrings of public names, and those of docs/python.md, run as they stand."""

from __future__ import annotations

import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MODULES = [
    "planner",
    "planner.report.interactive.points",
    "planner.report.interactive.points",
    "planner.nc.reader",
]


@pytest.mark.shows("python", "sampled: the examples of the pages run as they stand")
@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    done = doctest.testmod(import_module(name))
    assert done.attempted > 0
    assert done.failed == 0


def test_every_module_with_an_example_is_tested() -> None:
    with_example = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for file in (ROOT / "planner").rglob("*.py")
        if ">>> " in file.read_text(encoding="utf-8")
    }
    assert with_example == set(MODULES)


def examples(page: str) -> list[str]:
    """The Python of a page in docs/."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.mark.shows("python", "sampled: the examples of the pages run as they stand")
@pytest.mark.slow
def test_the_page_on_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    seen: dict = {}
    for example in examples("python.md"):
        exec(example.replace("planner/examples/", f"{ROOT.as_posix()}/planner/examples/"), seen)
    assert seen["p"].verdict.passed
    assert seen["judged"].passed
    assert {one.name for one in Path("out").iterdir()} >= {"summary.json", "report.html"}
    assert seen["round_"].cycle_time < seen["stop"].cycle_time
    assert seen["round_"].verdict.passed
