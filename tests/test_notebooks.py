"""The notebooks run from top to bottom without an error or a warning, their assertions hold, and they stay notebooks: short, without
definitions, committed with their outputs. README shows pictures of three of them."""

from __future__ import annotations

import ast
import base64
import re
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode

FOLDER = Path(__file__).resolve().parent.parent / "notebooks"
NAMES = sorted(file.name for file in FOLDER.glob("*.ipynb"))
# Before the first cell of each: of the one before nothing is left but what it imported, and warnings are errors, but
# for those of the kernel itself.
FRESH = """%reset -f
def fresh():
    import sys, warnings
    import matplotlib.pyplot
    matplotlib.pyplot.close("all")
    matplotlib.rcdefaults()
    sys.path[:] = [place for place in sys.path if place != ".."]
    for name in list(sys.modules):
        if name.partition(".")[0] == "benchmarks":
            del sys.modules[name]
    warnings.simplefilter("error")
    warnings.filterwarnings("ignore", module="ipykernel")
fresh()
del fresh
"""
# Before all: margins that fit a picture would draw it twice, and nobody looks at it here.
DRAWN_ONCE = """import matplotlib_inline.backend_inline
matplotlib_inline.backend_inline.set_matplotlib_formats("png", bbox_inches=None)
"""
TIMEOUT = 300  # [s] for one cell; the first run of a fresh installation compiles kernels
SIZE_MAX = 450_000  # [bytes]
CODE_CELLS_MAX = 9
LESSON = "first-lesson.ipynb"
TITLES = re.compile(r"title=|suptitle\(|set_title\(")
GALLERY = {
    "first-lesson": 1,
    "002-bezier-allocation": 1,
    "006-geometry-and-feed": 0,
}  # README's pictures: which of a notebook


def read(name: str) -> NotebookNode:
    return nbformat.read(FOLDER / name, as_version=4)


def code(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="module")
def executed() -> dict[str, list[NotebookNode]]:
    """`FRESH` and the code cells of each notebook with their outputs.

    All are run by one kernel: starting it and importing take as long as most notebooks.
    """
    from nbclient import NotebookClient  # 0.2 s, and only slow tests need it

    whole, begins = nbformat.v4.new_notebook(), dict[str, int]()
    whole.cells.append(nbformat.v4.new_code_cell(DRAWN_ONCE))
    for name in NAMES:
        begins[name] = len(whole.cells)
        whole.cells += [nbformat.v4.new_code_cell(FRESH), *code(read(name))]
    client = NotebookClient(
        whole,
        timeout=TIMEOUT,
        kernel_name="python3",
        allow_errors=True,
        resources={"metadata": {"path": str(FOLDER)}},
    )
    client.execute()
    return {name: whole.cells[at : at + 1 + len(code(read(name)))] for name, at in begins.items()}


def kinds(cells: list[NotebookNode]) -> list[list[str]]:
    """What each code cell gives: the kinds of text and pictures."""
    return [
        sorted({kind for one in cell.outputs for kind in one.get("data", {one.output_type: 0})})
        for cell in cells
    ]


def pictures(name: str) -> list[bytes]:
    outputs = [one for cell in code(read(name)) for one in cell.outputs]
    return [base64.b64decode(one.data["image/png"]) for one in outputs if "image/png" in one.get("data", {})]


def test_there_is_one_per_paper_one_each_for_solvers_methods_and_the_joint_optimum_and_a_first_lesson() -> (
    None
):
    assert [name[:3] for name in NAMES[:-1]] == ["000", "001", "002", "003", "004", "005", "006"]
    assert NAMES[-1] == LESSON


def test_the_first_lesson_needs_the_package_alone() -> None:
    roots = set()
    for cell in code(read(LESSON)):
        for node in ast.walk(ast.parse(cell.source)):
            if isinstance(node, ast.Import):
                roots |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                roots.add((node.module or "").partition(".")[0])
    assert roots == {"matplotlib", "numpy", "planner"}


@pytest.mark.parametrize(("name", "number"), GALLERY.items())
def test_readme_shows_the_pictures_of_the_notebooks(name: str, number: int) -> None:
    root = FOLDER.parent
    file = f"docs/notebook-{name}.png"
    assert (root / file).read_bytes() == pictures(f"{name}.ipynb")[number]
    assert f"({file})" in (root / "README.md").read_text(encoding="utf-8")


@pytest.mark.shows("notebooks", "sampled: they run, and their assertions hold")
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_it_runs_without_error_or_warning(executed: dict[str, list[NotebookNode]], name: str) -> None:
    made = executed[name]
    outputs = [output for cell in made for output in cell.outputs]
    assert not ["\n".join(output.traceback) for output in outputs if output.output_type == "error"]
    assert not [
        output.text for output in outputs if output.output_type == "stream" and output.name == "stderr"
    ]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    assert kinds(made[1:]) == kinds(code(read(name)))


@pytest.mark.parametrize("name", NAMES)
def test_it_is_short_asserts_its_numbers_and_defines_nothing(name: str) -> None:
    notebook = read(name)
    assert (FOLDER / name).stat().st_size < SIZE_MAX
    assert len(code(notebook)) <= CODE_CELLS_MAX
    assert [cell.execution_count for cell in code(notebook)] == list(range(1, len(code(notebook)) + 1))
    for cell in code(notebook):
        shows = any("image/png" in one.get("data", {}) for one in cell.outputs)
        assert shows == bool(re.search(r"plt\.(figure|subplots)\(", cell.source))
        assert not shows or TITLES.search(cell.source)
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert "**Claim" in text
    assert "**Verdict" in text
    nodes = [node for cell in code(notebook) for node in ast.walk(ast.parse(cell.source))]
    assert sum(isinstance(node, ast.Assert) for node in nodes) >= 4
    assert not [node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.ClassDef))]
