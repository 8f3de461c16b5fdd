"""The notebooks run from top to bottom without an error or a warning, their assertions hold, and they stay notebooks: short, without
definitions, committed without outputs."""

from __future__ import annotations

import ast
import asyncio
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode

FOLDER = Path(__file__).resolve().parent.parent / "notebooks"
NAMES = sorted(file.name for file in FOLDER.glob("*.ipynb"))
# Before the first cell: warnings are errors, but for those of the kernel itself.
STRICT = (
    "import warnings\nwarnings.simplefilter('error')\nwarnings.filterwarnings('ignore', module='ipykernel')"
)
AT_ONCE = 2
TIMEOUT = 300  # [s] for one cell; the first run of a fresh installation compiles kernels
SIZE_MAX = 300_000  # [bytes]
CODE_CELLS_MAX = 9


def read(name: str) -> NotebookNode:
    return nbformat.read(FOLDER / name, as_version=4)


def code(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


async def execute_all() -> dict[str, NotebookNode | Exception]:
    """Each notebook with its outputs, or the error that ended it."""
    from nbclient import NotebookClient  # 0.2 s, and only slow tests need it
    from nbclient.exceptions import CellExecutionError

    turn = asyncio.Semaphore(AT_ONCE)

    async def execute(name: str) -> NotebookNode | Exception:
        notebook = read(name)
        notebook.cells.insert(0, nbformat.v4.new_code_cell(STRICT))
        client = NotebookClient(
            notebook, timeout=TIMEOUT, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}
        )
        async with turn:
            try:
                return await client.async_execute()
            except CellExecutionError as fault:
                return fault

    return dict(zip(NAMES, await asyncio.gather(*map(execute, NAMES)), strict=True))


@pytest.fixture(scope="module")
def executed() -> dict[str, NotebookNode | Exception]:
    return asyncio.run(execute_all())


def test_there_is_one_per_paper_and_one_each_for_solvers_methods_and_the_joint_optimum() -> None:
    assert [name[:3] for name in NAMES] == ["000", "001", "002", "003", "004", "005", "006"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_it_runs_without_error_or_warning(executed: dict[str, NotebookNode | Exception], name: str) -> None:
    made = executed[name]
    if isinstance(made, Exception):
        raise made
    outputs = [output for cell in code(made) for output in cell.outputs]
    assert not [
        output.text for output in outputs if output.output_type == "stream" and output.name == "stderr"
    ]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2


@pytest.mark.parametrize("name", NAMES)
def test_it_is_short_asserts_its_numbers_and_defines_nothing(name: str) -> None:
    notebook = read(name)
    assert (FOLDER / name).stat().st_size < SIZE_MAX
    assert len(code(notebook)) <= CODE_CELLS_MAX
    assert all(not cell.outputs and cell.execution_count is None for cell in code(notebook))
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert "**Claim" in text
    assert "**Verdict" in text
    nodes = [node for cell in code(notebook) for node in ast.walk(ast.parse(cell.source))]
    assert sum(isinstance(node, ast.Assert) for node in nodes) >= 4
    assert not [node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.ClassDef))]
