"""How far each feature is known to be right, by what the tests themselves say.

    python -m benchmarks status     into results/status.md and .json, and the sentence on the front page (front.py)

A test says with `@pytest.mark.shows("feature", "kind: with what")` what it shows of a feature of features.toml. The marks are read from
the sources of the tests; nothing is run. That the marked tests pass is what the suite is for. A feature without a mark is
"only tried".
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.record import ROOT, markdown, write_results
from benchmarks.status import front

NAME = "status"  # of the table in results/
MARK = "shows"
TESTS = ROOT / "tests"
TRIED = "only tried"
# What a mark may say, the strongest first.
KINDS = {
    "exact": "equal, to rounding or a tolerance that the test names, to a closed form or to the same thing computed in another way",
    "certified": "a proved bound, which is held against cases that come close to it",
    "compared": "with another program",
    "measured": "on a real control",
    "sampled": "laws and second computations, on random or chosen jobs",
}


@dataclass(frozen=True, kw_only=True)
class Feature:
    """One of features.toml.

    what    : what it is, in a few words
    words   : of README.md, docs/command-line.md and docs/methods.md that stand for it
    results : files in results/ of what was measured of it
    """

    name: str
    what: str
    words: tuple[str, ...]
    results: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What one test shows: of which feature, how (a key of `KINDS`), with what; `place` is its file below tests/ and its name."""

    feature: str
    kind: str
    text: str
    place: str


def features() -> dict[str, Feature]:
    """All of features.toml by name, in the order of the file."""
    data = tomllib.loads(Path(__file__).with_name("features.toml").read_text(encoding="utf-8"))
    return {
        name: Feature(
            name=name, what=row["is"], words=tuple(row["words"]), results=tuple(row.get("results", ()))
        )
        for name, row in data.items()
    }


def marks(folder: Path = TESTS) -> list[Shown]:
    """The marks of all tests of a folder, in order.

    Raises ValueError for a mark that is not two texts, names of features and "kind: with what".
    """
    files = sorted(folder.rglob("test_*.py"))
    return [shown for file in files for shown in _of_file(file, file.relative_to(folder).as_posix())]


def _of_file(file: Path, name: str) -> Iterator[Shown]:
    text = file.read_text(encoding="utf-8")
    if f"mark.{MARK}(" not in text:
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            for made in node.decorator_list:
                if isinstance(made, ast.Call) and ast.unparse(made.func).endswith(f".{MARK}"):
                    yield from _mark(made, f"{name}::{node.name}")


def _mark(made: ast.Call, place: str) -> Iterator[Shown]:
    values = [argument.value for argument in made.args if isinstance(argument, ast.Constant)]
    if len(values) != 2 or made.keywords or not all(isinstance(value, str) for value in values):
        raise ValueError(f'{place}: a mark is shows("feature, ...", "kind: with what")')
    names, said = map(str, values)
    kind, colon, text = said.partition(": ")
    if not colon or kind not in KINDS:
        raise ValueError(f"{place}: {said!r} is not one of {', '.join(KINDS)}, a colon and with what")
    for name in names.split(", "):
        yield Shown(feature=name, kind=kind, text=text, place=place)


def named_words() -> set[str]:
    """The words that stand for features in the tables of README.md and docs/methods.md and in the synopsis of docs/command-line.md:
    commands ("planner plan"), what is exported ("export pvt"), options, and "method", "geometry", "corner", "solver" with a name."""
    page = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/command-line.md")}
    synopsis = page["docs/command-line.md"].split("\n## ")[0]
    rows = [line for line in page["README.md"].splitlines() if line.startswith("| ")]
    code = synopsis.split("\n\n")[1] + "\n" + "\n".join(synopsis.split("\n\n")[2].splitlines())
    code += "\n" + "\n".join(span for row in rows for span in re.findall(r"`(planner [^`]*)`", row))
    code = code.replace(
        "machine list | show NAME | init FILE", "machine list planner machine show planner machine init"
    )
    found = {" ".join(words) for words in re.findall(r"(planner) (machine [a-z]+|[a-z][a-z-]*)", code)}
    found |= set(re.findall(r"(?<![\w-])--[a-z-]+|(?<![\w-])-[a-z]\b", code)) - {"--for", "-m"}
    found |= {
        f"export {name}" for group in re.findall(r"--for ([a-z|-]+)", code) for name in group.split("|")
    }
    found |= {f"corner {name}" for name in re.findall(r"--corner ([a-z|]+)", code)[0].split("|")}
    found |= {f"geometry {name}" for name in re.findall(r"--geometry ([a-z|]+)", code)[0].split("|")}
    methods = (ROOT / "docs" / "methods.md").read_text(encoding="utf-8")
    first = methods.split("\n## ")[0]
    solvers = methods.partition("## Solvers of the feed")[2].split("\n## ")[0]
    found |= {f"method {name}" for name in _first_cells(first) | _first_cells("\n".join(rows))}
    found |= {
        f"solver {name}"
        for line in solvers.splitlines()
        if line.startswith("| ")
        for name in _second_cell(line)
    }
    return found | {"notebooks"}


def _first_cells(text: str) -> set[str]:
    """Names in backquotes in the first cells of tables; no commands."""
    cells = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    return {name for cell in cells for name in re.findall(r"`([a-z-]+)`", cell) if not name.startswith("--")}


def _second_cell(line: str) -> list[str]:
    cells = line.split("|")
    return re.findall(r"`([a-z-]+)`", cells[2]) if len(cells) > 4 and "--" not in cells[2] else []


def rows(shown: list[Shown]) -> list[list[str]]:
    """The table: feature, kinds, with what and how many tests, results."""
    table = []
    for feature in features().values():
        own = [one for one in shown if one.feature == feature.name]
        kinds = [kind for kind in KINDS if any(one.kind == kind for one in own)]
        lines = []
        for kind in kinds:
            texts = dict.fromkeys(one.text for one in own if one.kind == kind)
            lines.append(f"**{kind}**: {'; '.join(texts)}")
        links = ", ".join(f"[{name.removesuffix('.md')}]({name})" for name in feature.results)
        files = sorted({one.place.split("::")[0] for one in own})
        table.append(
            [feature.what, ", ".join(kinds) or TRIED, "<br>".join(lines), links,
             ", ".join(f"`{name}`" for name in files)]
        )  # fmt: skip
    return table


def page(shown: list[Shown]) -> str:
    """What stands in results/status.md behind its first line."""
    found = rows(shown)
    tried = sum(row[1] == TRIED for row in found)
    tests = len({one.place for one in shown})
    lines = [
        f"{len(found)} features; {tests} tests say what they show of them. {tried} are {TRIED}: tests run them, and no mark says more.",
        "Nothing here was measured on a machine that moved: LinuxCNC ran on a computer, other controls stand for themselves by their",
        "settings, their planners' code or models of it; no drive, robot or printer is known to have had an export of this program.",
        "",
        *(f"* **{kind}**: {says}" for kind, says in KINDS.items()),
        "",
        markdown(["feature", "known", "how", "measured", "tests in `tests/`"], found),
    ]
    return "\n".join(lines)


def main() -> int:
    """Write the table, and the sentence on the front page. The exit code is 0."""
    shown = marks()
    data = {"marks": [vars(one) for one in shown], "rows": rows(shown)}
    write_results(NAME, data, page(shown))
    front.PAGE.write_text(front.with_sentence(front.PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"results/{NAME}.md: {len(features())} features, {len(shown)} marks")
    return 0
