"""How large the package is, commit by commit: files, lines, tokens, rooms, circles of files, and words of the docs.

    python -m benchmarks.net.house COMMIT [COMMIT ...]     into results/house.json and .md

Tokens are Python's without comments, indents and ends of lines; a room is a folder of planner/; a circle is a set of
files that import each other, imports for annotations and inside functions included.
"""

from __future__ import annotations

import argparse
import ast
import io
import subprocess
import tokenize

from benchmarks.record import ROOT, markdown, write_results

LAYOUT = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
)
WIDE = 110  # columns


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=ROOT).stdout


def texts(commit: str) -> dict[str, str]:
    """The files of the package and the docs at a commit, by name."""
    names = _git("ls-tree", "-r", "--name-only", commit).splitlines()
    wanted = [
        name
        for name in names
        if (name.startswith("planner/") and name.endswith(".py"))
        or (name.startswith("docs/") and name.endswith(".md"))
        or name == "README.md"
    ]
    return {name: _git("show", f"{commit}:{name}") for name in wanted}


def tokens(text: str) -> int:
    """Of a module."""
    return sum(one.type not in LAYOUT for one in tokenize.generate_tokens(io.StringIO(text).readline))


def in_circles(modules: dict[str, str]) -> int:
    """How many modules, by name, take part in circles of imports."""
    imports = {name: _imports(name, text, modules.keys()) for name, text in modules.items()}
    return sum(module in _reached(module, imports) for module in imports)


def _reached(module: str, imports: dict[str, set[str]]) -> set[str]:
    """The modules that a module imports, and those that these import."""
    found: set[str] = set()
    left = set(imports[module])
    while left:
        one = left.pop()
        found.add(one)
        left |= imports[one] - found
    return found


def _imports(module: str, text: str, known: object) -> set[str]:
    assert hasattr(known, "__contains__")
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            named = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in known else node.module for name in named}  # type: ignore[operator]
    return {name for name in found if name in known} - {"planner", module}  # type: ignore[operator]


def measured(commit: str) -> dict[str, object]:
    """The figures of a commit."""
    found = texts(commit)
    package = {name: text for name, text in found.items() if name.startswith("planner/")}
    modules = {
        name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): text
        for name, text in package.items()
    }
    lines = [line for text in package.values() for line in text.splitlines()]
    return {
        "commit": commit,
        "files": len(package),
        "lines": len(lines),
        "tokens": sum(map(tokens, package.values())),
        "lines above 110 columns": sum(len(line) > WIDE for line in lines),
        "rooms": len({name.split("/")[1] for name in package if name.count("/") > 1}),
        "files in circles": in_circles(modules),
        "words of the docs": sum(len(text.split()) for name, text in found.items() if name not in package),
    }


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description="how large the package is")
    parser.add_argument("commits", nargs="+")
    rows = [measured(commit) for commit in parser.parse_args().commits]
    columns = ["", *(str(row["commit"]) for row in rows)]
    table = [
        [name, *(f"{row[name]:,}" if isinstance(row[name], int) else str(row[name]) for row in rows)]
        for name in rows[0]
        if name != "commit"
    ]
    text = markdown(columns, table)
    print(text)
    write_results("house", {"rows": rows}, text)


if __name__ == "__main__":
    main()
