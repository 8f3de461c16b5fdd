"""Which lines of the package's readers an input reaches, and by which ways.

A way is a pair of lines of one function that ran one after the other. Two libraries do this, and neither fits here:

    atheris   rewrites the byte code of what it guides. With all of planner/nc rewritten numba no longer compiles the lexer ("Unknown
              attribute '_trace_branch'"), so that every module with a kernel has to be kept from it by name; an input is a string of
              bytes; libFuzzer owns the process and ends it at the first finding, so that nothing can be summed up afterwards; and it
              does not say which lines were reached.
    hypofuzz  drives tests written with Hypothesis, whose inputs come from its strategies; these come from mutations.

`sys.settrace` costs what a measurement says (results/fuzz-guidance.md), and needs no more than this file. Compiled kernels are not seen
by it, nor what other threads do.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
LINES_MAX = 1 << 20  # in a file: a way is one number, line before * LINES_MAX + line


def sources(readers: Iterable[str]) -> list[Path]:
    """The modules of readers, named as files or folders below the project."""
    found: set[Path] = set()
    for name in readers:
        place = ROOT / name
        found |= {place} if place.is_file() else set(place.rglob("*.py"))
    return sorted(found)


def digest(files: Iterable[Path]) -> str:
    """What changes with the text of any of these files."""
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()[:16]


def count_lines(files: Iterable[Path]) -> int:
    """Lines inside functions, which inputs can reach: those of modules and classes run when they are imported."""
    return sum(
        len(_lines(compile(file.read_bytes(), str(file), "exec", dont_inherit=True))) for file in files
    )


def _lines(code: CodeType) -> set[int]:
    own = {line for _, _, line in code.co_lines() if line and line != code.co_firstlineno}
    found = own if code.co_flags & inspect.CO_OPTIMIZED else set()
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            found |= _lines(inner)
    return found


class Tracer:
    """The ways through some modules; `new` counts those that were not known before."""

    def __init__(self, files: Iterable[Path]):
        self.ways: dict[str, set[int]] = {str(file): set() for file in files}
        self.new = 0

    @property
    def lines(self) -> int:
        """How many lines inside functions were reached."""
        return sum(len({way % LINES_MAX for way in ways}) for ways in self.ways.values())

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Within, what runs in this thread is traced, and `new` begins at 0."""
        self.new = 0
        before = sys.gettrace()
        sys.settrace(self._enter)
        try:
            yield
        finally:
            sys.settrace(before)

    def _enter(self, frame: FrameType, event: str, arg: Any) -> Any:
        code = frame.f_code
        known = self.ways.get(code.co_filename)
        if known is None or not code.co_flags & inspect.CO_OPTIMIZED:
            return None
        last = code.co_firstlineno

        def step(frame: FrameType, event: str, arg: Any) -> Any:
            nonlocal last
            if event == "line":
                line = frame.f_lineno
                way = last * LINES_MAX + line
                last = line
                if way not in known:
                    known.add(way)
                    self.new += 1
            return step

        return step
