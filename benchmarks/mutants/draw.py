"""Draws mutants: small changes of the source, one each, at random places of the files of an area.

Each is an operator, a comparison, a number, a word of logic or the name of a function that is exchanged for another one. What is left
out is no computation: docstrings, messages, annotations, decorators, default values, and numbers up to `ROUNDING`, which are what is
taken for rounding. A place is drawn from all places of all files of the area, each with the same chance; of files with kernels, which
are compiled anew for each mutant, one place in `KERNELS` counts. `strict=` of zip computes nothing either.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path

from benchmarks.record import ROOT

AREAS = {
    "formulas": ("planner/corners/*.py", "planner/baselines/fir/*.py", "planner/motion/*.py"),
    "constraints": ("planner/feedrate/constraints/*.py",),
    "judge": ("planner/verifier/*.py",),
    "reader": ("planner/nc/*.py", "planner/nc/language/*.py", "planner/nc/language/*/*.py", "planner/nc/hpgl/*.py"),
    "exports": ("planner/controls/export/*.py",),
    "imports": ("planner/controls/machine_import/*.py",),
    "prices": ("planner/sensitivity/*price*.py", "planner/sensitivity/*activity.py"),
    "bound": tuple(
        f"planner/sensitivity/{name}.py"
        for name in (
            "least_time", "straight_time", "bends", "waypoints", "sampled_*", "linear_program",
        )
    ),
}  # fmt: skip
ROUNDING = 1e-5
KERNELS = 5
COMPARED: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", ">"), ast.Gt: (">", "<"), ast.LtE: ("<=", ">"), ast.GtE: (">=", "<"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: (" is ", " is not "), ast.IsNot: (" is not ", " is "), ast.In: (" in ", " not in "),
    ast.NotIn: (" not in ", " in "),
}  # fmt: skip
COMPUTED: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Mod: ("%", "+"),
}  # fmt: skip
NAMES = {
    "min": "max", "max": "min", "any": "all", "all": "any", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin",
    "argmin": "argmax", "argmax": "argmin", "floor": "ceil", "ceil": "floor", "True": "False", "False": "True",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change: in line `line` of `file`, the text `old` from column `column` on becomes `new`."""

    area: str
    file: str
    line: int
    column: int
    old: str
    new: str

    @property
    def key(self) -> str:
        """Names it."""
        return f"{self.file}:{self.line}:{self.column}: {self.old.strip()} -> {self.new.strip()}"

    def of(self, text: str) -> str:
        """The source with this change. Raises ValueError where it does not have the old text at its place."""
        lines = text.splitlines(keepends=True)
        row = lines[self.line - 1]
        if not row.startswith(self.old, self.column):
            raise ValueError(f"{self.key}: the source is another one")
        lines[self.line - 1] = row[: self.column] + self.new + row[self.column + len(self.old) :]
        return "".join(lines)


def drawn(area: str, count: int, seed: int = 0) -> list[Mutant]:
    """So many of an area, in a random order that the seed fixes: the first of them are the same for any count."""
    places = list(_places_of(area))
    random.Random(f"{area} {seed}").shuffle(places)
    return list(islice((place for place in places if not _is_strict(place)), count))


@cache
def _places_of(area: str) -> tuple[Mutant, ...]:
    places = list[Mutant]()
    for file in sorted({file for pattern in AREAS[area] for file in ROOT.glob(pattern)}):
        found = list(_places(file, area))
        if "@kernel" in file.read_text(encoding="utf-8"):
            found = found[::KERNELS]
        places += found
    return tuple(places)


def _is_strict(place: Mutant) -> bool:
    row = (ROOT / place.file).read_text(encoding="utf-8").splitlines()[place.line - 1]
    return row[: place.column].endswith("strict=")


def _places(file: Path, area: str) -> Iterator[Mutant]:
    text = file.read_text(encoding="utf-8")
    lines = text.splitlines()
    name = file.relative_to(ROOT).as_posix()
    for node in _computing(ast.parse(text)):
        for line, column, old, new in _changes(node, lines):
            if lines[line - 1].isascii():  # columns of ast are bytes
                yield Mutant(area=area, file=name, line=line, column=column, old=old, new=new)


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below that compute something."""
    yield node
    match node:
        case ast.FunctionDef() | ast.ClassDef():
            children: list[ast.AST] = list(node.body)
        case ast.AnnAssign(value=value):
            children = [value] if value is not None else []
        case ast.Raise() | ast.Assert() | ast.JoinedStr() | ast.Expr(value=ast.Constant()):
            children = []
        case _:
            children = list(ast.iter_child_nodes(node))
    for child in children:
        yield from _computing(child)


def _changes(node: ast.AST, lines: list[str]) -> Iterator[tuple[int, int, str, str]]:
    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARED:
            yield from _between(left, right, *COMPARED[type(op)], lines)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in COMPUTED and not _is_text(left, right):
            yield from _between(left, right, *COMPUTED[type(op)], lines)
        case ast.BoolOp(op=op, values=[left, right]):
            words = (" and ", " or ")
            yield from _between(left, right, *(words if isinstance(op, ast.And) else words[::-1]), lines)
        case ast.UnaryOp(op=ast.Not()):
            yield node.lineno, node.col_offset, "not ", ""
        case ast.Constant(value=bool(value)):
            yield node.lineno, node.col_offset, str(value), str(not value)
        case ast.Constant(value=int() | float() as number) if number == 0 or abs(number) > ROUNDING:
            old = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
            yield (
                node.lineno,
                node.col_offset,
                old,
                f"{number + 1}" if isinstance(number, int) else f"{_other(number)!r}",
            )
        case ast.Name(id=name) if name in NAMES:
            yield node.lineno, node.col_offset, name, NAMES[name]
        case ast.Attribute(attr=name, end_lineno=int(line), end_col_offset=int(end)) if name in NAMES:
            yield line, end - len(name), name, NAMES[name]


def _other(number: float) -> float:
    return 1.0 if number == 0.0 else 1.5 * number


def _is_text(*nodes: ast.AST) -> bool:
    return any(
        isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
        for node in nodes
    )


def _between(
    left: ast.expr, right: ast.expr, old: str, new: str, lines: list[str]
) -> Iterator[tuple[int, int, str, str]]:
    """An operator that stands between two operands, all in one line."""
    line = left.end_lineno
    if line is None or line != right.lineno:
        return
    begin, end = left.end_col_offset or 0, right.col_offset
    at = lines[line - 1].find(old, begin, end)
    if at >= 0:
        yield line, at, old, new
