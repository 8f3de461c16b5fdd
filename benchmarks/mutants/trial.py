"""Runs the tests of a file's room against a mutant of it, in a copy of the checkout.

Libraries are imported once; each run is a fork that imports the package and its tests from the copy. A mutant is killed if a test
fails, or takes `CPU` processor seconds more than usual; what a mutant does outside of its process (files, other processes) goes with
it.
"""

from __future__ import annotations

import importlib.util
import os
import re
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from benchmarks.mutants.covered import Covered, cover
from benchmarks.mutants.draw import Mutant
from benchmarks.record import ROOT

CPU = 60  # more than a test takes: kernels of a mutant are compiled anew [s]
LONGER = 10.0  # and so many times what it takes
WALL = 1500.0  # of a run, on a machine that does other things too [s]
FILES = 20  # of tests at most, those that name the module most often
LIBRARIES = (
    "numpy",
    "scipy.optimize",
    "scipy.sparse",
    "scipy.interpolate",
    "numba",
    "hypothesis",
    "pydantic",
    "pytest",
    "typer",
    "rich",
)
# imported anew in every run; hypothesis because pytest wants to import its plugins itself
OWN = ("planner", "benchmarks", "tests", "hypothesis", "_hypothesis")
NOT_COPIED = (".git", ".venv", "docs", ".hypothesis", ".mypy_cache", ".ruff_cache", ".pytest_cache", "build")
KILLED, SURVIVED, NO_END = "killed", "survived", "does not end"


@contextmanager
def copy_of_checkout(where: Path) -> Iterator[Path]:
    """A copy of the checkout, removed at the end."""
    folder = where / "checkout"
    shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(*NOT_COPIED), symlinks=True)
    (folder / "docs").symlink_to(ROOT / "docs")
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def room_of(file: str) -> list[str]:
    """Test files for a file of the package: those that name its module, that have a folder of it in their name, or mirror its own."""
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    mirror = (ROOT / "tests").joinpath(*Path(file).parts[1:-1])
    while not list(mirror.glob("test_*.py")):
        if any(mirror.rglob("test_*.py")) or mirror == ROOT / "tests":
            break
        mirror = mirror.parent
    rooms = set(Path(file).parts[1:-1])
    score: dict[str, float] = {}
    parent, _, stem = module.rpartition(".")
    names = re.compile(rf"\b{re.escape(module)}\b|\b{re.escape(parent)} import [^\n]*\b{stem}\b")
    for test in (ROOT / "tests").rglob("test_*.py"):
        text = test.read_text(encoding="utf-8")
        near = test.is_relative_to(mirror) and mirror != ROOT / "tests"
        alike = len(set(stem.split("_")) & set(test.stem.split("_")[1:]))
        told = sum(text.count(word.removesuffix("s")) for word in stem.split("_"))
        own = (
            10.0 * len(names.findall(text))
            + 5.0 * alike
            + text.count(parent)
            + 0.2 * told
            + (3.0 if near else 0.0)
        )
        if names.search(text) or (near and own > 0) or rooms & set(test.stem.split("_")):
            score[test.relative_to(ROOT).as_posix()] = own
    return sorted(score, key=lambda name: (-score[name], name))[:FILES]


def outcome(
    mutant: Mutant, folder: Path, tests: list[str], without: set[str], usual: dict[str, float] | None = None
) -> tuple[str, str, float]:
    """What became of a mutant: `KILLED`, `SURVIVED` or `NO_END`; by which test; and processor seconds."""
    file = folder / mutant.file
    right = file.read_text(encoding="utf-8")
    # Python knows bytecode by the second and the size of its source, and the mutant before may have had both
    bytecode = Path(importlib.util.cache_from_source(str(file)))
    file.write_text(mutant.of(right), encoding="utf-8")
    bytecode.unlink(missing_ok=True)
    try:
        return run(folder, tests, without, usual)
    finally:
        file.write_text(right, encoding="utf-8")
        bytecode.unlink(missing_ok=True)


def run(
    folder: Path, tests: list[str], without: set[str], usual: dict[str, float] | None = None
) -> tuple[str, str, float]:
    """Run quick tests, or all of test files, in a copy of the checkout but those of `without`; `usual` is what tests take [CPU s]."""
    files = list(dict.fromkeys(name.partition("::")[0] for name in tests))
    options = ["-x", *files, *(f"--deselect=tests/{name}" for name in without)]
    plugins = [Chosen(tests, usual or {})]
    status, said, cpu = forked(folder, lambda: _pytest(options, plugins), WALL)
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
    if os.WIFSIGNALED(status):
        return NO_END, said.splitlines()[-1][:80] if said else "", cpu
    code = os.WEXITSTATUS(status)
    if not failed and code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        raise RuntimeError(f"tests ended with {code}, and none failed: {said[-2000:]}")
    by = failed[0].removeprefix("tests/") if failed else ""
    return (SURVIVED if code in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED) else KILLED), by, cpu


class Chosen:
    """Plugin of pytest: runs tests by name, or of files, in their order, and ends the process where one takes far too long."""

    def __init__(self, tests: list[str], usual: dict[str, float]) -> None:
        self.rank, self.usual = {name: at for at, name in enumerate(tests)}, usual

    def _rank(self, item: pytest.Item) -> int | None:
        return self.rank.get(item.nodeid, self.rank.get(item.nodeid.partition("::")[0]))

    @pytest.hookimpl(wrapper=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> Iterator[None]:
        """Leave out the others."""
        yield
        ranks = [(rank, at) for at, item in enumerate(items) if (rank := self._rank(item)) is not None]
        items[:] = [items[at] for _, at in sorted(ranks)]

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """`CPU` seconds from here on, and some times what the test takes otherwise."""
        end = int(time.process_time() + CPU + LONGER * self.usual.get(item.nodeid, 0.0)) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (end, resource.RLIM_INFINITY))


def covered(folder: Path, mutants: list[Mutant], file: Path) -> Covered:
    """Which tests of the rooms of mutants run their files' lines, from a file, or found in a copy of the checkout and written to it."""
    files = sorted({mutant.file for mutant in mutants})
    tests = sorted({test for name in files for test in room_of(name)})

    def work() -> int:
        cover(folder, files, lambda plugins: _pytest(tests, plugins)).write(file)
        return 0

    if not file.exists():
        status, said, _ = forked(folder, work, float("inf"))
        if os.waitstatus_to_exitcode(status) != 0:
            raise RuntimeError(f"no lines of tests: {said[-2000:]}")
    return Covered.read(file)


def _pytest(options: list[str], plugins: list[Any]) -> int:
    usual = [
        "-rfE",
        "-q",
        "-m",
        "not slow",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "--no-header",
        "--tb=line",
    ]
    return int(pytest.main([*usual, *options], plugins))


def forked(folder: Path, work: Callable[[], int], wall: float) -> tuple[int, str, float]:
    """Do something in a fork that imports the package and its tests from a copy: status of the process, what it said, CPU seconds."""
    for name in LIBRARIES:
        importlib.import_module(name)
    log = folder / "mutant.log"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = os.fork()
    if child == 0:
        _child(folder, work, log)
    end, status = time.monotonic() + wall, None
    while status is None:
        done, code = os.waitpid(child, os.WNOHANG)
        if done:
            status = code
        elif time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
        else:
            time.sleep(0.05)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return status, log.read_text(encoding="utf-8", errors="replace"), cpu


def _child(folder: Path, work: Callable[[], int], log: Path) -> None:
    code = 1
    try:
        os.setsid()
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
        for name in [name for name in sys.modules if name.startswith(OWN)]:
            del sys.modules[name]
        os.chdir(folder)
        sys.dont_write_bytecode = False  # or every run would compile all sources again
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        os.environ |= {
            "PYTHONPATH": str(folder),
            "PLANNER_SHARED": os.environ.get("PLANNER_SHARED", str(ROOT.parent / "shared")),
        }
        sys.path[:] = [str(folder), *(place for place in sys.path if place not in ("", str(ROOT)))]
        code = work()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
