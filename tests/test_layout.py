"""The tests mirror the package: a folder for each of its folders, short files, and nothing but public names."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

TESTS = Path(__file__).resolve().parent
PACKAGE = TESTS.parent / "planner"
LONGEST = 350  # [lines]
NO_CODE = {"baselines", "controls", "examples", "machines", "planning", "templates"}
# Tested in the folder above: all solvers are held against each other there.
WITH_PARENT = {"feedrate/jerk", "feedrate/reference"}
FILES = sorted(TESTS.rglob("*.py"))


def test_every_folder_of_the_package_has_its_tests() -> None:
    folders = {
        str(file.parent.relative_to(PACKAGE)) for file in PACKAGE.rglob("*.py") if file.parent != PACKAGE
    } - NO_CODE
    without = [name for name in sorted(folders - WITH_PARENT) if not list((TESTS / name).glob("test_*.py"))]
    assert not without


def test_files_are_short_and_use_public_names() -> None:
    texts = {str(file.relative_to(TESTS)): file.read_text(encoding="utf-8") for file in FILES}
    long = {name: text.count("\n") for name, text in texts.items() if text.count("\n") > LONGEST}
    private = {name: found for name, text in texts.items() if (found := private_names(ast.parse(text)))}
    assert (long, private) == ({}, {})


def test_what_is_left_out_of_the_quick_subset_is_there() -> None:
    names = [line for line in (TESTS / "long.txt").read_text(encoding="utf-8").splitlines() if "::" in line]
    assert names == sorted(set(names))
    texts = {file.relative_to(TESTS.parent).as_posix(): file.read_text(encoding="utf-8") for file in FILES}
    gone = [n for n in names if f"def {n.partition('::')[2]}(" not in texts.get(n.partition("::")[0], "")]
    assert not gone


def test_file_names_are_used_once() -> None:
    """pytest imports test files by their name alone."""
    places = defaultdict(list)
    for file in FILES:
        if file.name != "conftest.py":
            places[file.name].append(str(file.relative_to(TESTS)))
    assert not [where for where in places.values() if len(where) > 1]


def private_names(tree: ast.Module) -> set[str]:
    """Names of the package with a leading underscore that are imported, or reached through an imported module."""
    modules, found, nodes = set(), set(), list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "planner":
            for alias in node.names:
                modules.add(alias.asname or alias.name)
                found |= {alias.name} if is_private(alias.name) else set()
        elif isinstance(node, ast.Import):
            modules |= {
                alias.asname or alias.name for alias in node.names if alias.name.startswith("planner")
            }
    for node in nodes:
        if isinstance(node, ast.Attribute) and is_private(node.attr):
            owner = node.value
            if isinstance(owner, ast.Name) and owner.id in modules:
                found.add(f"{owner.id}.{node.attr}")
        elif isinstance(node, ast.Call) and called(node) == "setattr" and len(node.args) > 1:
            name = node.args[1]
            if isinstance(name, ast.Constant) and isinstance(name.value, str) and is_private(name.value):
                found.add(name.value)
    return found


def called(call: ast.Call) -> str:
    """The last name of what is called: `setattr` of `monkeypatch.setattr(...)`."""
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")
