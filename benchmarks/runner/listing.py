"""What there is: suites, ways, and the scripts of benchmarks/, each with its purpose in a line and the results that it writes."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path

from benchmarks.runner.suites import SUITES
from benchmarks.runner.ways import MODELS, PEERS
from planner.base.names import CORNER_SHAPES, EFFORTS, METHODS

HERE = Path(__file__).resolve().parent.parent


@dataclass(frozen=True, kw_only=True)
class Script:
    """A module of benchmarks/.

    says    : the first sentence of its docstring
    results : files that it writes into results/, as its docstring or its code names them
    runs    : whether it is a script; otherwise others import it
    """

    name: str
    says: str
    results: tuple[str, ...]
    runs: bool


def scripts(folder: Path = HERE) -> list[Script]:
    """All modules of the folder's families."""
    files = sorted(file for file in folder.glob("*/*.py") if file.parent.name != "runner")
    return [
        _script(file) for file in files if file.stem != "__init__" or "def main" in file.read_text("utf-8")
    ]


def _script(file: Path) -> Script:
    text = file.read_text(encoding="utf-8")
    doc = ast.get_docstring(ast.parse(text)) or ""
    first = " ".join(doc.split("\n\n")[0].split())
    named = re.findall(r"results/([A-Za-z0-9_-]+)\.(?:json|md|jsonl)\b", doc)
    written = re.findall(r"write_results\(\s*\"([A-Za-z0-9_-]+)\"", text)
    default = re.findall(r"\"--name\", default=\"([A-Za-z0-9_-]+)\"", text)
    names = dict.fromkeys(default or [*written, *named])
    return Script(
        name=file.parent.name + ("" if file.stem.startswith("__") else f".{file.stem}"),
        says=first,
        results=tuple(f"{name}.md" for name in names),
        runs='if __name__ == "__main__"' in text,
    )


def listed() -> str:
    """The list as text."""
    lines = ["Suites (python -m benchmarks run SUITE):"]
    for name, suite in SUITES.items():
        absent = suite.absent()
        count = f"skipped: {absent}" if absent else f"{len(suite.jobs())} jobs"
        lines.append(f"  {name:10} {suite.says} ({count})")
    lines += ["", "Ways:", f"  methods    {', '.join(METHODS)}"]
    lines += [
        f"             with /{', /'.join(CORNER_SHAPES)}, /spline and :{', :'.join(EFFORTS)} for those that take them"
    ]
    lines += [f"  peers      {', '.join(PEERS)}", f"  models     {', '.join(MODELS)}"]
    found = scripts()
    lines += ["", "Other scripts (python -m benchmarks.NAME):"]
    lines += [
        f"  {one.name:24} {one.says}" + (f" -> {', '.join(one.results)}" if one.results else "")
        for one in found
        if one.runs
    ]
    lines += ["", "Imported by the others:"]
    lines += [f"  {one.name:24} {one.says}" for one in found if not one.runs]
    return "\n".join(lines)
