"""A program with parameters, expressions, loops or subprograms through the interpreter, and what was expanded
on the way."""

import dataclasses
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.nc.faults import Fault
from planner.nc.integers import Integers
from planner.nc.interpreter import Interpreter
from planner.nc.language.compiled import compile_procedures
from planner.nc.language.fanuc import calls
from planner.nc.language.fanuc.calls import fanuc_files
from planner.nc.language.fanuc.lathe import LatheParser
from planner.nc.language.fanuc.lathe_cycles import LatheCycles
from planner.nc.language.fanuc.lathe_words import LatheVariables
from planner.nc.language.fanuc.parser import FanucParser
from planner.nc.language.heidenhain import text as heidenhain_text
from planner.nc.language.heidenhain.flow import files as heidenhain_files
from planner.nc.language.heidenhain.parser import HeidenhainParser
from planner.nc.language.linuxcnc import parser
from planner.nc.language.linuxcnc.parser import LinuxcncParser
from planner.nc.language.makers import with_makers
from planner.nc.language.rows import AppendedRows
from planner.nc.language.run import ProgramRun
from planner.nc.language.siemens import text as siemens_text
from planner.nc.language.siemens.commands import siemens_files
from planner.nc.language.siemens.parser import SiemensParser
from planner.nc.language.source import Source
from planner.nc.language.system_variables import (
    FanucVariables,
    LinuxcncVariables,
    PositionVariables,
    SystemVariables,
)
from planner.nc.language.tree import Language, ProgramFault
from planner.nc.lexer import Words, split_words
from planner.nc.program import Expansion, Program
from planner.nc.reading import FANUC, HEIDENHAIN, LATHE, LINUXCNC, SIEMENS

ENTRIES_MAX = 10_000  # files and folders that are looked at for a called file
FILE_MAX = 100_000_000  # bytes of a called file
_CALLED = re.compile(r"[\w.+-]+")
# Gets every chunk of expanded rows before it is executed.
Tee = Callable[[Words], None]


def expand(
    interpreter: Interpreter, words: Words, dialect: str, integers: Integers, tee: Tee | None = None
) -> tuple[Program, Sequence[Fault]]:
    """Run a program of that dialect through the interpreter; returns it and its faults, those of its
    statements first.

    words    : of the whole program; rows that compute are read again as text
    integers : what numbers without a point mean, applied to the words already

    Nothing is run if a line cannot be read; otherwise the program is run to its end, or to what stops it.
    """
    rows = AppendedRows()
    front = _FRONTS[dialect]
    run = ProgramRun(interpreter, rows, front.language, front.variables(interpreter))
    run.tee = tee or run.tee
    front.set_up(run)
    files = _Files(run, rows, front, integers)
    found = files.read(words, interpreter.source)
    if not found:
        stopped = run.start()
        found = [stopped] if stopped else []
    faults = [
        files.sources[f.place.file].fault(f, run.files[f.place.file] if f.place.file else "") for f in found
    ]
    program = dataclasses.replace(
        interpreter.program(run.frames),
        expansion=Expansion(
            dialect=FANUC if dialect == LATHE else dialect,
            calls=tuple(run.calls.items()),
            turns=run.turns,
            rows=run.executed,
        ),
    )
    return program, [*faults, *interpreter.faults()]


@dataclass(frozen=True)
class _Front:
    language: Language
    variables: type[SystemVariables]
    parser: Callable[[Source], Any]  # with `parse`, that gives procedures, and `faults`
    files: Callable[[str], frozenset[str]]  # names, in small letters, of the file that holds a subprogram
    set_up: Callable[[ProgramRun], object] = lambda run: None  # gives a run the makers of its rows


_FRONTS = {
    LINUXCNC: _Front(
        parser.LANGUAGE, LinuxcncVariables, LinuxcncParser, lambda name: frozenset({f"{name}.ngc"})
    ),
    FANUC: _Front(calls.LANGUAGE, FanucVariables, FanucParser, fanuc_files),
    LATHE: _Front(calls.LANGUAGE, LatheVariables, LatheParser, fanuc_files, LatheCycles),
    HEIDENHAIN: _Front(
        heidenhain_text.LANGUAGE, PositionVariables, HeidenhainParser, heidenhain_files, with_makers
    ),
    SIEMENS: _Front(siemens_text.LANGUAGE, PositionVariables, SiemensParser, siemens_files, with_makers),
}


class _Files:
    """The files of a program: its own, and those in its folder that it calls."""

    def __init__(self, run: ProgramRun, rows: AppendedRows, front: _Front, integers: Integers):
        self.run, self.rows, self.front, self.integers = run, rows, front, integers
        self.sources: list[Source] = []
        run.load = self.load

    def read(self, words: Words, name: str) -> list[ProgramFault]:
        """Compile a file; returns what cannot be read in it."""
        first, begin = self.rows.add_file(words, name)
        source = Source(words, len(self.sources), first, begin, self.integers)
        source.at_tip = self.run.interpreter.ignored.at_tip
        self.sources.append(source)
        if source.file:
            self.run.files.append(name)
        parser = self.front.parser(source)
        procedures = parser.parse()
        if parser.faults:
            return sorted(parser.faults, key=lambda fault: fault.place.line)
        marker = f"<nc {source.file}>"  # the name of the file in Python's tracebacks
        try:
            self.run.add(compile_procedures(procedures, self.front.language, self.rows, marker), marker)
        except ProgramFault as fault:
            return [fault]
        return []

    def load(self, name: str) -> bool:
        """Read a subprogram in the program's folder or below; False for none. Raises ProgramFault."""
        program, wanted = Path(self.run.interpreter.source), self.front.files(name)
        if not program.is_file() or not _CALLED.fullmatch(name):
            return False
        found = (path for path in _below(program.parent) if path.name.lower() in wanted and path.is_file())
        path = next((path for path in found if path.stat().st_size <= FILE_MAX), None)
        if path is None:
            return False
        words = split_words(path.read_bytes(), block_delete=self.run.interpreter.reading.block_delete)
        faults = self.read(self.integers.applied(words), str(path))
        if faults:
            raise faults[0]
        nameless = self.run.functions.pop("file", None)  # a subprogram that only its file names
        if nameless is not None:
            self.run.functions.setdefault(name, nameless)
        return True


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
