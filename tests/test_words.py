"""One word for one thing: words that the glossary has replaced stay out of names and texts."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "planner"
# In names: what the glossary says instead. A cell is one of a table, of times or of a free space, never of a path.
INSTEAD = {
    "course": "guide, chain or run",
    "stretch": "run, leg, element or range",
    "section": "segment, leg, element or run",
    "portion": "segment, leg, element or run",
    "subpath": "segment, leg, element or run",
    "slice": "segment, leg, element or run; Python's own `slice` is a name of its own",
    "cell": "velocity pulse, link, step or interval",
}
CELLS_IN = ("report/", "verifier/")
# In texts: a pattern, and what the glossary says instead.
TEXTS = {r"\bset[ -]points?\b": "setpoint", r"\bstretch(es)?\b": "run, leg, element or range"}


def names(tree: ast.Module) -> Iterator[str]:
    """All names that a module defines or uses."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.keyword(arg=str(name)):
                yield name
            case ast.alias(name=name, asname=other):
                yield from name.split(".")
                yield from [other] if other else []


@cache
def words(name: str) -> frozenset[str]:
    """The words of a name, in the singular: `first_cell`, `StraightCells`."""
    found = {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
    singular = {word.removesuffix("s") for word in found} | {word.removesuffix("es") for word in found}
    return frozenset(found | singular)


def wrong_words(name: str, module: str) -> set[str]:
    """The words of a name that a module of planner/ must not use."""
    if name == "slice":
        return set()
    allowed = {"cell"} if module.startswith(CELLS_IN) else set()
    return set(words(name) & INSTEAD.keys()) - allowed


def test_words_of_names_are_told_apart() -> None:
    assert wrong_words("first_cell", "baselines/fir/command.py") == {"cell"}
    assert wrong_words("cells_per_period", "verifier/reading.py") == set()
    assert wrong_words("StraightCourse", "baselines/fir/guide.py") == {"course"}
    assert (
        wrong_words("per_stretch", "baselines/fir/guide.py")
        == wrong_words("STRETCHES", "feedrate/sampling/feed_limited.py")
        == {"stretch"}
    )
    assert (
        wrong_words("slice", "baselines/fir/rules.py")
        == set()
        != wrong_words("time_slices", "baselines/fir/rules.py")
    )
    assert wrong_words("excellent_intersections", "baselines/fir/rules.py") == set()


def test_names_use_the_words_of_the_glossary() -> None:
    found = []
    for file in sorted(PACKAGE.rglob("*.py")):
        module = file.relative_to(PACKAGE).as_posix()
        for name in sorted(set(names(ast.parse(file.read_text("utf-8")))) | {file.stem}):
            found += [f"{module}: {name}: {INSTEAD[word]}" for word in sorted(wrong_words(name, module))]
    assert not found, "\n".join(found)


def test_texts_use_the_words_of_the_glossary() -> None:
    found = []
    for file in (
        *PACKAGE.rglob("*.py"),
        *PACKAGE.rglob("*.toml"),
        *(ROOT / "docs").rglob("*.md"),
        ROOT / "README.md",
    ):
        for number, line in enumerate(file.read_text("utf-8").splitlines(), start=1):
            for pattern, instead in TEXTS.items():
                if re.search(pattern, line, flags=re.IGNORECASE):
                    found.append(f"{file.relative_to(ROOT)}:{number}: {line.strip()[:80]}: {instead}")
    assert not found, "\n".join(found)


def test_the_glossary_has_what_is_asked_for_instead() -> None:
    page = (ROOT / "docs" / "glossary.md").read_text("utf-8")
    rows = re.findall(r"^\| (.+?) \|", page, flags=re.MULTILINE)
    defined = set(rows) - {"word"}
    assert len(rows) - rows.count("word") == len(defined), "a word stands twice"
    assert {
        "run",
        "leg",
        "element",
        "segment",
        "guide",
        "chain",
        "velocity pulse",
        "link",
        "interval",
        "setpoint",
    } <= defined
    assert not defined & INSTEAD.keys()
