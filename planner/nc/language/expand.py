"""A program with parameters, expressions, loops or subprograms through the interpreter, and what was expanded
on the way."""

import contextlib
import dataclasses
import gc
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from planner.nc.faults import Fault
from planner.nc.integers import integers_of
from planner.nc.interpreter import Interpreter
from planner.nc.language.compiled import compile_procedures
from planner.nc.language.fanuc import lathe
from planner.nc.language.fanuc import parser as fanuc
from planner.nc.language.heidenhain import parser as heidenhain
from planner.nc.language.linuxcnc import parser as linuxcnc
from planner.nc.language.rows import AppendedRows
from planner.nc.language.run import Dialect, ProgramRun
from planner.nc.language.siemens import parser as siemens
from planner.nc.language.source import Source
from planner.nc.language.tree import ProgramFault
from planner.nc.lexer import Words, split_words
from planner.nc.program import Expansion, Program
from planner.nc.reading import FANUC, HEIDENHAIN, LATHE, LINUXCNC, SIEMENS

ENTRIES_MAX = 10_000  # files and folders that are looked at for a called file
FILE_MAX = 100_000_000  # bytes of a called file
_CALLED = re.compile(r"[\w.+-]+")
# Gets every chunk of expanded rows before it is executed.
Tee = Callable[[Words], None]


def expand(
    interpreter: Interpreter, words: Words, dialect: str, tee: Tee | None = None
) -> tuple[Program, Sequence[Fault]]:
    """Run a program of that dialect through the interpreter; returns it and its faults, those of its
    statements first.

    words : of the whole program, numbers without a point in units; rows that compute are read again as text

    Nothing is run if a line cannot be read; otherwise the program is run to its end, or to what stops it.
    """
    rows = AppendedRows()
    run = ProgramRun(interpreter, rows, DIALECTS[dialect])
    run.tee = tee or run.tee
    files = _Files(run, rows, DIALECTS[dialect])
    found = files.read(words, interpreter.source)
    if not found:
        stopped = run.start()
        found = [stopped] if stopped else []
    names = ["", *run.files[1:]]
    faults = [files.sources[f.place.file].fault(f, names[f.place.file]) for f in found]
    calls, dialect = tuple(run.calls.items()), FANUC if dialect == LATHE else dialect
    expansion = Expansion(dialect=dialect, calls=calls, turns=run.turns, rows=run.executed)
    program = dataclasses.replace(interpreter.program(run.frames), expansion=expansion)
    return program, [*faults, *interpreter.faults()]


DIALECTS: dict[str, Dialect] = {
    LINUXCNC: linuxcnc.DIALECT,
    FANUC: fanuc.DIALECT,
    LATHE: lathe.DIALECT,
    HEIDENHAIN: heidenhain.DIALECT,
    SIEMENS: siemens.DIALECT,
}


class _Files:
    """The files of a program: its own, and those in its folder that it calls."""

    def __init__(self, run: ProgramRun, rows: AppendedRows, dialect: Dialect):
        self.run, self.rows, self.dialect = run, rows, dialect
        self.sources: list[Source] = []
        run.load = self.load

    def read(self, words: Words, name: str) -> list[ProgramFault]:
        """Compile a file; returns what cannot be read in it."""
        first, begin = self.rows.add_file(words, name)
        source = Source(words, len(self.sources), first, begin, self.run.interpreter)
        self.sources.append(source)
        if source.file:
            self.run.files.append(name)
        parser = self.dialect.parser(source)
        marker = f"<nc {source.file}>"  # the name of the file in Python's tracebacks
        with _garbage_waits():
            procedures = parser.parse()
            if parser.faults:
                return sorted(parser.faults, key=lambda fault: fault.place.line)
            try:
                functions, places = compile_procedures(procedures, self.dialect.language, self.rows, marker)
            except ProgramFault as fault:
                return [fault]
        self.run.units[marker] = places
        self.run.functions = functions | self.run.functions
        return []

    def load(self, name: str) -> bool:
        """Read a subprogram in the program's folder or below; False for none. Raises ProgramFault."""
        program, wanted = Path(self.run.interpreter.source), self.dialect.files(name)
        path, archive = None, self.run.interpreter.archive
        data = next((archive[file].text() for file in wanted if file in archive), None)
        if data is None and program.is_file() and _CALLED.fullmatch(name):
            found = (one for one in _below(program.parent) if one.name.lower() in wanted and one.is_file())
            path = next((one for one in found if one.stat().st_size <= FILE_MAX), None)
            data = None if path is None else path.read_bytes()
        if data is None:
            return False
        words = split_words(data, block_delete=self.run.interpreter.reading.block_delete)
        faults = self.read(integers_of(self.run.interpreter.machine).applied(words), str(path or program))
        if faults:
            raise faults[0]
        nameless = self.run.functions.pop("file", None)  # a subprogram that only its file names
        if nameless is not None:
            self.run.functions.setdefault(name, nameless)
        return True


@contextlib.contextmanager
def _garbage_waits() -> Iterator[None]:
    """Python looks for no garbage within: it would go through all statements again and again."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


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
