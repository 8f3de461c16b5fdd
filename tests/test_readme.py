"""What README.md and the pages of docs/ show is so: Python, options, output, links, and the files they name."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from hand_made import PRICES, make_plan
from typer.testing import CliRunner

from planner.base.names import CORNER_SHAPES, GEOMETRIES, METHODS
from planner.cli import app
from planner.report.brief import brief_rows
from planner.report.rows import plan_rows
from planner.report.units import UNITS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {"README.md": README} | {
    f"docs/{page.name}": page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").glob("*.md"))
}
COMMANDS = PAGES["docs/command-line.md"]


@pytest.mark.shows("python", "sampled: the examples of the pages run as they stand")
@pytest.mark.slow
def test_the_python_example_runs_and_the_output_is_that_of_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(ROOT)
    seen: dict[str, object] = {}
    exec(example, seen)
    plan = seen["plan"]
    assert plan.verdict.passed  # type: ignore[attr-defined]
    ratio = plan.corners.feed_planned / plan.corners.feed_closed_form  # type: ignore[attr-defined]
    assert ratio.max() <= 1.0 + 1e-6
    time, stops = plan.trajectory.cycle_time, plan.stop_time  # type: ignore[attr-defined]
    shown = " ".join(README.split())
    for label, said in brief_rows(plan, UNITS["mm"]):  # type: ignore[arg-type]
        assert f"{label} {said}" in shown
    assert f"against a stop at every block: {stops:.4f} s" in README
    told = dict(plan_rows(plan))  # type: ignore[arg-type]
    for label in ("fastest possible", "corners", "10 % more saves", "10 µm more tolerance"):
        (quoted,) = re.findall(rf"^    {label}  +(.*)$", README, re.MULTILINE)
        begin, _, end = quoted.partition("...")
        assert told[label].startswith(begin)
        assert told[label].endswith(end)
    assert f"{time:.1f} s, against {stops:.1f} s with a stop at every block" in README
    assert f"{len(plan.program)} blocks" in README  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", ["plan", "what-if", "sweep", "compare", "verify", "info", "pulses"])
def test_options_that_are_shown_exist_and_the_others_are_shown(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(os.environ, "COLUMNS", "200")
    monkeypatch.setitem(os.environ, "TERMINAL_WIDTH", "200")
    usage = re.search(
        rf"^    planner {command} (.*?)(?=^    planner|\n\n)", COMMANDS, re.DOTALL | re.MULTILINE
    )
    assert usage is not None
    text = usage[1]
    for name in ("PLANNING", "READING"):  # options of several commands are written once, behind such a name
        if name in text:
            text += re.findall(
                rf"^    {name}: (.*?)(?=^    [A-Z]+:|\n\n)", COMMANDS, re.DOTALL | re.MULTILINE
            )[0]
    shown = set(re.findall(r"(?<![\w-])(--?[a-z][a-z-]*)", text))
    help_text = CliRunner().invoke(app, [command, "--help"]).stdout
    missing = {option for option in shown if not re.search(rf"(?<![\w-]){option}(?![\w-])", help_text)}
    assert shown
    assert not missing
    long = set(re.findall(r"^. (?:-\w, )?(--[a-z][a-z-]*)", help_text, re.MULTILINE))
    short = {"--machine": "-m", "--output": "-o", "--quiet": "-q", "--help": "-h", "--verbose": "-v"}
    assert long
    assert not {short.get(option, option) for option in long} - shown - {"-h"}


def test_every_method_geometry_and_corner_shape_is_described() -> None:
    described = set(re.findall(r"^\| ([^|]*)\|", PAGES["docs/methods.md"], re.MULTILINE))
    names = {name for cell in described for name in re.findall(r"`([\w-]+)`", cell)}
    assert set(METHODS) | set(GEOMETRIES) <= names
    assert f"--geometry {'|'.join(GEOMETRIES)}" in COMMANDS
    assert f"--corner {'|'.join(CORNER_SHAPES)}" in COMMANDS


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_is_named_exists(page: str) -> None:
    text = PAGES[page]
    for name in re.findall(r"`((?:benchmarks/results|docs|planner|tests|notebooks)/[\w./-]+)`", text):
        place = ROOT / name
        assert place.exists() or list(place.parent.glob(f"{place.name}.*")), f"{page}: {name}"
    for name in re.findall(r"\]\(([^)#:]+)\)", text):
        assert ((ROOT / page).parent / name).exists(), f"{page}: {name}"


def anchors(text: str) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES)
def test_every_heading_that_is_linked_exists(page: str) -> None:
    for name, anchor in re.findall(r"\]\(([^)#:]*)#([\w-]+)\)", PAGES[page]):
        target = (ROOT / page).parent / name if name else ROOT / page
        assert anchor in anchors(target.read_text(encoding="utf-8")), f"{page}: {name}#{anchor}"


def test_modules_in_the_pictures_exist() -> None:
    """`planning/optimal/reshape.py` and the like, and folders, in the pictures of the algorithm's page."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", PAGES["docs/algorithm.md"], re.MULTILINE | re.DOTALL)
    drawn = "".join(text for language, text in blocks if not language)
    assert "/" in drawn
    for name in re.findall(r"(?<![\w/])([a-z]+/(?:\w+/)*(?:\w+\.py)?)", drawn):
        assert (ROOT / "planner" / name).exists(), name


def test_every_folder_of_the_package_is_on_the_page_of_the_algorithm() -> None:
    folders = {place.parent.name for place in (ROOT / "planner").glob("*/__init__.py")}
    assert not {name for name in folders if f"{name}/" not in PAGES["docs/algorithm.md"]}


def test_lines_of_the_output_are_those_of_plan() -> None:
    """The labels of the example's output, as the code prints them."""
    for label in ("fastest possible", "corners", "10 % more saves", "10 µm more tolerance"):
        assert f"    {label}  " in README
    made = make_plan(prices=PRICES)
    assert {"corners", "10 % more saves", "10 µm more tolerance"} <= dict(plan_rows(made)).keys()
