"""Runs the tests of a file's room against a mutant of it, in a copy of the checkout.

Libraries are imported once; each run is a fork that imports the package and its tests from the copy. A mutant is killed if a test
fails, or does not end within `CPU` processor seconds; what a mutant does outside of its process (files, other processes) goes with it.
"""

from __future__ import annotations

import importlib
import os
import re
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.mutants.draw import Mutant
from benchmarks.record import ROOT

CPU = 150  # of a run [s]
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


def outcome(mutant: Mutant, folder: Path, tests: list[str], without: set[str]) -> tuple[str, str, float]:
    """What became of a mutant: `KILLED`, `SURVIVED` or `NO_END`; by which test; and processor seconds."""
    file = folder / mutant.file
    right = file.read_text(encoding="utf-8")
    file.write_text(mutant.of(right), encoding="utf-8")
    try:
        return run(folder, tests, without)
    finally:
        file.write_text(right, encoding="utf-8")


def run(folder: Path, tests: list[str], without: set[str], marks: str = "not slow") -> tuple[str, str, float]:
    """Run tests in a copy of the checkout but those of `without`, the quick ones unless `marks` says otherwise."""
    for name in LIBRARIES:
        importlib.import_module(name)
    log = folder / "mutant.log"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = os.fork()
    if child == 0:
        _child(folder, [*tests, *(f"--deselect=tests/{name}" for name in without)], log, marks)
    end, status = time.monotonic() + WALL, None
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
    said = log.read_text(encoding="utf-8", errors="replace")
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
    if os.WIFSIGNALED(status):
        return NO_END, said.splitlines()[-1][:80] if said else "", cpu
    by = failed[0].removeprefix("tests/") if failed else ""
    return (SURVIVED if os.WEXITSTATUS(status) == 0 else KILLED), by, cpu


def _child(folder: Path, tests: list[str], log: Path, marks: str) -> None:
    os.setsid()
    out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
    resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU))
    for name in [name for name in sys.modules if name.startswith(OWN)]:
        del sys.modules[name]
    os.chdir(folder)
    os.environ |= {
        "PYTHONPATH": str(folder),
        "PLANNER_SHARED": os.environ.get("PLANNER_SHARED", str(ROOT.parent / "shared")),
    }
    sys.path[:] = [str(folder), *(place for place in sys.path if place not in ("", str(ROOT)))]
    code = 1
    try:
        import pytest

        options = [
            "-rfE",  # names what failed
            "-q",
            "-x",
            "-m",
            marks,
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            "--no-header",
            "--tb=line",
        ]
        code = int(pytest.main([*options, *tests]))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
