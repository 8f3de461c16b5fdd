"""A program with parameters, expressions, loops or subprograms through the interpreter, and what was expanded on the way."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from planner.nc.faults import Fault
from planner.nc.interpreter import Interpreter
from planner.nc.language import linuxcnc
from planner.nc.language.asked import LinuxcncAsked
from planner.nc.language.compiled import Compiled, ProgramFault, compile_procedures
from planner.nc.language.rows import Rows
from planner.nc.language.run import Expanded, Run
from planner.nc.language.source import Source
from planner.nc.lexer import Words, split_words
from planner.nc.program import Frame

ENTRIES_MAX = 10_000  # files and folders that are looked at for a called file
FILE_MAX = 100_000_000  # bytes of a called file
_CALLED = re.compile(r"[\w.+-]+")


@dataclass(frozen=True)
class Expansion:
    """What a program was expanded to.

    dialect : "linuxcnc" or "fanuc"
    frames  : the calls of its blocks
    counts  : calls by name, turns of loops, rows
    faults  : what could not be run; the interpreter has those of single words
    """

    dialect: str
    frames: tuple[Frame, ...]
    counts: Expanded
    faults: tuple[Fault, ...]


def expand(
    interpreter: Interpreter,
    words: Words,
    *,
    dialect: str,
    block_delete: bool,
    tee: Callable[[Words], None] | None = None,
) -> Expansion:
    """Run a program of that dialect through the interpreter.

    words : of the whole program; rows that compute are read again as text
    tee   : gets every chunk of expanded rows before it is executed

    Nothing is run if a line cannot be read; otherwise the program is run to its end, or to what stops it.
    """
    rows = Rows()
    first, begin = rows.add_file(words, interpreter.source)
    source = Source(words, 0, first, begin)
    asked = LinuxcncAsked(interpreter)
    run = Run(interpreter, rows, linuxcnc.LANGUAGE, asked)
    run.tee = tee or run.tee
    sources = [source]
    files = _Files(run, rows, sources, block_delete)
    run.load = files.load
    faults = files.add(source)
    if not faults:
        stopped = run.start()
        faults = [stopped] if stopped else []
    run.expanded.turns = run.turns
    return Expansion(
        dialect,
        tuple(run.frames),
        run.expanded,
        tuple(
            sources[f.place.file].fault(f, run.files[f.place.file] if f.place.file else "") for f in faults
        ),
    )


class _Files:
    """The files of a program: its own, and those in its folder that it calls."""

    def __init__(self, run: Run, rows: Rows, sources: list[Source], block_delete: bool):
        self.run, self.rows, self.sources, self.block_delete = run, rows, sources, block_delete

    def add(self, source: Source) -> list[ProgramFault]:
        """Compile a file; returns what cannot be read in it."""
        parser = linuxcnc.Parser(source)
        procedures = parser.parse()
        if parser.faults:
            return sorted(parser.faults, key=lambda fault: fault.place.line)
        marker = f"<nc {source.file}>"
        try:
            compiled = compile_procedures(procedures, self.run.language, self.rows, marker)
        except ProgramFault as fault:
            return [fault]
        self.run.add(compiled, marker)
        return []

    def load(self, name: str) -> Compiled | None:
        """The file name.ngc in the program's folder, or in a folder below it. Raises ProgramFault if it cannot be read."""
        path = self._find(name)
        if path is None:
            return None
        words = split_words(path.read_bytes(), block_delete=self.block_delete)
        first, begin = self.rows.add_file(words, str(path))
        source = Source(words, len(self.sources), first, begin)
        self.sources.append(source)
        self.run.files.append(str(path))
        faults = self.add(source)
        if faults:
            raise faults[0]
        return self.run.units[f"<nc {source.file}>"]

    def _find(self, name: str) -> Path | None:
        folder = Path(self.run.interpreter.source).parent
        if not Path(self.run.interpreter.source).is_file() or not _CALLED.fullmatch(name):
            return None
        wanted = f"{name}.ngc"
        for path in _below(folder):
            if path.name.lower() == wanted and path.is_file() and path.stat().st_size <= FILE_MAX:
                return path
        return None


def _below(folder: Path) -> Iterator[Path]:
    """Files in a folder, then in the folders below it; links to folders are not followed."""
    seen = 0
    for place, folders, files in os.walk(folder):
        folders.sort()
        for name in sorted(files):
            seen += 1
            if seen > ENTRIES_MAX:
                return
            path = Path(place) / name
            if not path.is_symlink():
                yield path
