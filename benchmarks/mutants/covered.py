"""Which quick tests run which lines of some files, and how long each takes: one run of the tests of their rooms under coverage.py.

What a fixture runs is of all tests of its file. What runs as a module is imported, or is compiled, is of no test. A file that has
changed since has no lines here, and a test file that has changed is taken whole.
"""

from __future__ import annotations

import ast
import hashlib
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

BUDGET = 30.0  # of tests for one mutant: those of the room first, then the shortest [CPU s]
Lines = dict[int, list[str]]  # of a line: tests, or test files


def digest(file: Path) -> str:
    """Of what is in a file; empty where it is not."""
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16] if file.is_file() else ""


class Watch:
    """Plugin of pytest: tells coverage.py which test runs, and measures each [CPU s]."""

    def __init__(self, coverage: Any) -> None:
        self.coverage, self.seconds, self.passed = coverage, dict[str, float](), dict[str, bool]()

    def _phase(self, item: pytest.Item, context: str) -> Iterator[None]:
        self.coverage.switch_context(context)
        begin = time.process_time()
        yield
        self.seconds[item.nodeid] = self.seconds.get(item.nodeid, 0.0) + time.process_time() - begin
        self.coverage.switch_context("")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Iterator[None]:
        """What fixtures run is of the file."""
        yield from self._phase(item, item.nodeid.partition("::")[0])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """What the test runs is its own."""
        yield from self._phase(item, item.nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Tests that fail, or are skipped, tell nothing of a mutant."""
        self.passed[report.nodeid] = self.passed.get(report.nodeid, True) and report.passed


@dataclass(frozen=True)
class Covered:
    """Of files of the source their lines; of tests that pass their CPU seconds; of all files what they were."""

    lines: dict[str, Lines]
    seconds: dict[str, float]
    digests: dict[str, str]

    def write(self, file: Path) -> None:
        """As JSON."""
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps([self.lines, self.seconds, self.digests]), encoding="utf-8")

    @classmethod
    def read(cls, file: Path) -> Covered:
        """What `write` wrote."""
        lines, seconds, digests = json.loads(file.read_text(encoding="utf-8"))
        return cls(
            {name: {int(at): tests for at, tests in own.items()} for name, own in lines.items()},
            seconds,
            digests,
        )

    def tests_of(self, root: Path, file: str, line: int, room: list[str]) -> list[str]:
        """Tests for a change of a line, those that ought to see it first, `BUDGET` seconds of them.

        They are those that run the line's statement and the changed test files of the room. All of the room are taken where the file
        has changed, for kernels, and for what runs as the module is imported.
        """
        path, own = root / file, set[str]()
        text, seen = path.read_text(encoding="utf-8"), self.lines.get(file, {})
        where, inside = statement(text, line)
        anywhere = self.digests.get(file) != digest(path) or "@njit" in text or "@kernel" in text
        anywhere = anywhere or (
            not any(seen.get(at) for at in where) and (not inside or any(at in seen for at in where))
        )
        if not anywhere:
            own = {test for at in where for test in seen.get(at, [])}
        files = {name for name in own if "::" not in name}
        known = [name for name in self.seconds if name in own or name.partition("::")[0] in files]
        there = [name for name in room if (root / name).is_file()]  # in the copy, which may be older
        changed = [name for name in there if self.digests.get(name) != digest(root / name)]
        if anywhere:
            known = [name for name in self.seconds if name.partition("::")[0] in room]
        rank = {name: at for at, name in enumerate(room)}
        known.sort(key=lambda name: (rank.get(name.partition("::")[0], len(rank)), self.seconds[name]))
        taken, spent = list[str](), 0.0
        for name in known:
            if name.partition("::")[0] not in changed:
                spent += self.seconds[name]
                if spent < BUDGET or not taken:
                    taken.append(name)
        return changed + taken


def statement(text: str, line: int) -> tuple[range, bool]:
    """The lines of the statement of a line, of one with a body those before it; and whether it is in a function."""
    found, inside = range(line, line + 1), False
    for node in ast.walk(ast.parse(text)):  # inner statements come after outer ones
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or line):
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body else node.end_lineno or line
            inside = inside or (isinstance(node, ast.FunctionDef) and line > last)
            if line <= last:
                found = range(node.lineno, last + 1)
    return found, inside


def cover(root: Path, files: list[str], run: Callable[[list[Any]], int]) -> Covered:
    """Run tests by `run(plugins)` and see which of them run lines of files of `root`, the checkout that they run in."""
    import coverage

    watched = coverage.Coverage(
        data_file=None, include=[str(root / name) for name in files], config_file=False
    )
    watch = Watch(watched)
    watched.start()
    try:
        run([watch])
    finally:
        watched.stop()
    data, lines = watched.get_data(), dict[str, Lines]()
    for name in data.measured_files():
        found = {at: [one for one in tests if one] for at, tests in data.contexts_by_lineno(name).items()}
        lines[Path(name).relative_to(root).as_posix()] = {at: tests for at, tests in found.items() if tests}
    seconds = {name: spent for name, spent in watch.seconds.items() if watch.passed.get(name)}
    names = {*files, *(name.partition("::")[0] for name in watch.seconds)}
    return Covered(lines, seconds, {name: digest(root / name) for name in sorted(names)})
