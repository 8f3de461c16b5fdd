"""The package in numbers: modules, lines, arguments, names that stand twice, files per limit, constants without a reason.

    python -m benchmarks.house [COMMIT ...]     a column for each commit and one for the tree as it is; into results/house.json and .md

A constant is an upper-case name that a module assigns a number to; it counts as without a reason if no comment stands behind or right
above it. Constants that follow each other under one comment share it.
"""

from __future__ import annotations

import argparse
import ast
import io
import statistics
import subprocess
import tarfile
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

ROOT = Path(__file__).resolve().parent.parent
MOST_ARGUMENTS = 8
LIMIT_WORDS = "normal_acceleration", "normal_max"
# Names of limits as they are printed, those that are no words of other things; "X." stands for one with an axis behind it.
LIMIT_NAMES = (
    "normal_acceleration",
    "chord_error",
    "filter_error",
    "phase_lag",
    "curvature_jump.",
    "velocity.",
    "acceleration.",
)

# Functions that modules of one kind have in common: a limit's own law, and what the file of one control says.
OF_A_KIND = {
    "feed_sq_max": "constraints",
    "rate": "constraints",
    "recognised": "machine_import",
    "settings": "machine_import",
}


def measured(root: Path) -> dict[str, Any]:
    """The figures of the package in a tree."""
    package = root / "planner"
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    trees = {path: ast.parse(text) for path, text in texts.items()}
    lines = {path: text.count("\n") for path, text in texts.items()}
    functions = [
        node
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    arguments = {id(node): _arguments(node) for node in functions}
    many = [node for node in functions if arguments[id(node)] > MOST_ARGUMENTS and not _is_command(node)]
    lengths = sorted((node.end_lineno or node.lineno) - node.lineno + 1 for node in functions)
    names = Counter(
        node.name
        for path, tree in trees.items()
        for node in tree.body
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and _stands_alone(node.name, path)
    )
    public = [node for node in functions if not node.name.startswith("_")]
    longest = max(lines, key=lambda path: lines[path])
    constants = [found for path, tree in trees.items() for found in _constants(tree, texts[path])]
    return {
        "modules": len(texts),
        "lines": sum(lines.values()),
        "median file": statistics.median(lines.values()),
        "longest file": f"{lines[longest]} ({longest.relative_to(package)})",
        "function, median / 99 % / longest": f"{statistics.median(lengths):g} / {lengths[int(0.99 * len(lengths))]} / {lengths[-1]}",
        f"functions with more than {MOST_ARGUMENTS} arguments": len(many),
        "most arguments": max(arguments[id(node)] for node in functions if not _is_command(node)),
        "public names that stand twice": sum(count > 1 for count in names.values()),
        "public functions with a docstring": f"{100 * sum(bool(ast.get_docstring(node)) for node in public) / len(public):.0f} %",
        "files that name the normal acceleration limit": sum(
            any(word in text for word in LIMIT_WORDS) for text in texts.values()
        ),
        "files of the planner that spell a limit's printed name, at most": max(
            sum(_spells(tree, name) for path, tree in trees.items() if "verify" not in path.parts)
            for name in LIMIT_NAMES
        ),
        "constants": len(constants),
        "constants without a comment": sum(not reason for _, reason in constants),
        "test files, lines": _tests(root),
    }


def details(root: Path) -> str:
    """What to look at: the functions with many arguments, the names that stand twice and the bare constants of a tree."""
    package, out = root / "planner", []
    where: dict[str, list[str]] = {}
    for path in sorted(package.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        tree, name = ast.parse(text), str(path.relative_to(package))
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.FunctionDef)
                and _arguments(node) > MOST_ARGUMENTS
                and not _is_command(node)
            ):
                out.append(f"{name}:{node.lineno} {node.name}: {_arguments(node)} arguments")
        for node in tree.body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and _stands_alone(node.name, path):
                where.setdefault(node.name, []).append(name)
        out += [f"{name} {constant}: no comment" for constant, reason in _constants(tree, text) if not reason]
    out += [f"{name} in {', '.join(files)}" for name, files in where.items() if len(files) > 1]
    return "\n".join(out)


def _stands_alone(name: str, path: Path) -> bool:
    """Whether a name is public and should be that of one thing only."""
    return not name.startswith("_") and OF_A_KIND.get(name) != path.parent.name


def _spells(tree: ast.Module, name: str) -> bool:
    """Whether a string of a module, other than its texts, is the name, or begins with it where it ends in a dot."""
    return any(
        isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and "\n" not in node.value
        and (node.value.startswith(name) if name.endswith(".") else node.value == name)
        and " " not in node.value
        for node in ast.walk(tree)
    )


def _arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    given = node.args
    own = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    return len([argument for argument in own if argument.arg not in ("self", "cls")])


def _is_command(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """True for commands, whose arguments are the options of the command line."""
    return any("guarded" in ast.unparse(decorator) for decorator in node.decorator_list)


def _constants(tree: ast.Module, text: str) -> Iterator[tuple[str, bool]]:
    """Names of a module's numeric constants, each with whether a comment is beside or above it."""
    rows = text.splitlines()
    shared = False  # the constant on the line above has a comment above it
    last = -1
    for node in tree.body:
        if not isinstance(node, ast.Assign) or not any(
            isinstance(n, ast.Constant) for n in ast.walk(node.value)
        ):
            continue
        numbers = [
            n
            for n in ast.walk(node.value)
            if isinstance(n, ast.Constant)
            and isinstance(n.value, int | float)
            and not isinstance(n.value, bool)
        ]
        targets = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
        if not numbers or not all(name.strip("_").isupper() for name in targets):
            continue
        end = node.end_lineno or node.lineno
        beside = any("#" in row for row in rows[node.lineno - 1 : end])
        above = rows[node.lineno - 2].lstrip().startswith("#") if node.lineno > 1 else False
        shared = above or (shared and last == node.lineno - 1)
        last = end
        for name in targets:
            yield name, beside or shared


def _tests(root: Path) -> str:
    files = sorted((root / "tests").rglob("*.py"))
    return f"{len(files)}, {sum(path.read_text(encoding='utf-8').count(chr(10)) for path in files)}"


def at_commit(commit: str) -> dict[str, Any]:
    """The figures at a commit."""
    archive = subprocess.run(
        ["git", "archive", commit, "planner", "tests"], cwd=ROOT, capture_output=True, check=True
    ).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            tar.extractall(folder, filter="data")
        return measured(Path(folder))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commits", nargs="*")
    parser.add_argument(
        "--details", action="store_true", help="only list what to look at in the tree as it is"
    )
    given = parser.parse_args()
    if given.details:
        print(details(ROOT))
        return
    columns = {commit: at_commit(commit) for commit in given.commits} | {"now": measured(ROOT)}
    names = list(columns["now"])
    rows = [[name, *(str(column[name]) for column in columns.values())] for name in names]
    write_results("house", {"columns": columns}, markdown(["", *columns], rows))
    print(markdown(["", *columns], rows))


if __name__ == "__main__":
    main()
