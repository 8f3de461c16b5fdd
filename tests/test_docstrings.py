"""Every public module, class and function says what it is; where arrays go in or come out it says their shapes."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.syntax import statements

PACKAGE = Path(__file__).resolve().parent.parent / "planner"
ARRAYS = re.compile(r"\b(FloatArray|Array)\b")
SHAPE = re.compile(
    r"\((?:[\w+\-*. ]+,|\.\.\.,|\*[\w.]+, )[\w+\-*., ]*\)"
)  # (n,), (N+1, 3, A), (*times.shape, A)


def trees() -> dict[str, ast.Module]:
    """All modules of the package by name, of functions their heads, docstrings and classes: all of it together would take most of
    its time to be looked through for what is no longer used."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        tree = found[file.relative_to(PACKAGE).as_posix()] = ast.parse(file.read_text("utf-8"))
        for node in statements(tree):
            if isinstance(node, ast.FunctionDef):
                first, *others = node.body
                node.body = [first, *(one for one in others if isinstance(one, ast.ClassDef))]
    return found


def is_public(name: str) -> bool:
    return not name.startswith("_")


def is_protocol(node: ast.ClassDef) -> bool:
    return "Protocol" in bases(node)


def documented_methods(trees: dict[str, ast.Module]) -> dict[str, set[str]]:
    """Methods with a docstring of all classes, their own and those of their base classes, by the name of the class."""
    classes = {
        node.name: node
        for tree in trees.values()
        for node in statements(tree)
        if isinstance(node, ast.ClassDef)
    }

    def of(name: str) -> set[str]:
        if name not in classes:
            return set()
        own = [one for one in classes[name].body if isinstance(one, ast.FunctionDef)]
        return {one.name for one in own if ast.get_docstring(one)}.union(*map(of, bases(classes[name])))

    return {name: of(name) for name in classes}


def bases(node: ast.ClassDef) -> list[str]:
    return [ast.unparse(base).partition("[")[0] for base in node.bases]


def faults(trees: dict[str, ast.Module]) -> list[str]:
    """What lacks a docstring, or in its docstring a shape or the name of an array.

    A method may have it from a base class, or from a protocol in its module.
    """
    known, found = documented_methods(trees), []

    def look(body: list[ast.stmt], where: str, inherited: set[str], asked: set[str]) -> None:
        for node in body:
            if not isinstance(node, ast.FunctionDef | ast.ClassDef) or not is_public(node.name):
                continue
            place, text = f"{where}.{node.name}", ast.get_docstring(node)
            if isinstance(node, ast.ClassDef):
                found.extend([] if text else [f"{place}: no docstring"])
                look(node.body, place, asked | known[node.name], asked)
            elif text is None:
                found.extend([] if node.name in inherited else [f"{place}: no docstring"])
            else:
                found.extend(f"{place}: {fault}" for fault in array_faults(node, text))

    for module, tree in trees.items():
        found += [] if ast.get_docstring(tree) else [f"{module}: no docstring"]
        protocols = [node.name for node in tree.body if isinstance(node, ast.ClassDef) and is_protocol(node)]
        look(tree.body, module, set(), set().union(*(known[name] for name in protocols)))
    return found


def array_faults(function: ast.FunctionDef, text: str) -> list[str]:
    """What the docstring of a function does not say of its arrays."""
    given = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    arrays = [one.arg for one in given if one.annotation and ARRAYS.search(ast.unparse(one.annotation))]
    returned = function.returns is not None and ARRAYS.search(ast.unparse(function.returns))
    if not arrays and not returned:
        return []
    if not SHAPE.search(text):
        return ["no shape"]
    return [f"{name} is not named" for name in arrays if not re.search(rf"\b{name}\b", text)]


def test_every_public_name_says_what_it_is() -> None:
    found = faults(trees())
    assert not found, "\n".join(found)


EXAMPLE = '''"""A module."""

class Base:
    """A base."""

    def said(self):
        """Something."""

class Between(Base):
    """Another."""

class Derived(Between):
    """And another."""

    def said(self):
        return 1

    def silent(self):
        return 2

class Asked(Protocol):
    """What is asked of others."""

    def value(self):
        """A number."""

class Own:
    """Conforms to it."""

    def value(self):
        return 3

def bare(x: FloatArray) -> float:
    """Its sum."""

def shaped(x: FloatArray, y: FloatArray) -> FloatArray:
    """(n,) sums of x (n,)."""

def value():
    return 4

def whole(x: FloatArray) -> FloatArray:
    """(n,) squares of x (n, A)."""

def _private(x: FloatArray): ...
'''


def test_what_lacks_is_found() -> None:
    assert faults({"a.py": ast.parse(EXAMPLE)}) == [
        "a.py.Derived.silent: no docstring",
        "a.py.bare: no shape",
        "a.py.shaped: y is not named",
        "a.py.value: no docstring",
    ]
    assert faults({"b.py": ast.parse("x = 1")}) == ["b.py: no docstring"]
