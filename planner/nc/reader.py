"""Reading an NC program or a plotter file (HPGL): from text to `Program`, or an `InputError` that names file, line, column, the word,
and what to do. The content of a text says which of the two it is, and its name if the content does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.machine import Machine
from planner.nc.dialects import is_plotter_file, recognise
from planner.nc.faults import Fault, require_none
from planner.nc.interpreter import Interpreter
from planner.nc.language.detect import dialect_of
from planner.nc.lexer import split_words
from planner.nc.program import Program
from planner.nc.reading import AS_USUAL, Reading


def read_program(path: str | Path, machine: Machine | None = None, reading: Reading = AS_USUAL) -> Program:
    """Read an NC program or a plotter file.

    machine : gives tool lengths, G28 and G30 positions, work offsets, the first path control, and what plotter files need;
              None for zeros and blending
    reading : what is refused, left out and assumed

    Raises InputError if the file cannot be read, and for the first construct that is not supported or not valid.
    """
    return parse_program(load(path), machine, reading, source=str(path))


def parse_program(
    text: bytes | str, machine: Machine | None = None, reading: Reading = AS_USUAL, *, source: str = "<text>"
) -> Program:
    """Read an NC program given as text; like `read_program`."""
    program, faults = interpret(text, machine, reading, source=source)
    require_none(faults, source)
    return program


def interpret(
    text: bytes | str, machine: Machine | None, reading: Reading = AS_USUAL, *, source: str
) -> tuple[Program, Sequence[Fault]]:
    """Run a program to its end, past everything that is not supported.

    Returns the program and the faults, in the order of the lines. A program in another language is one fault, and nothing of it is run.

    Raises InputError for an empty or binary text.
    """
    data = text.encode("utf-8", "replace") if isinstance(text, str) else text
    _check_text(data, source)
    if is_plotter_file(data, source):
        from planner.nc.hpgl.plotter import read_drawing  # 10 ms

        return read_drawing(data, machine, source, reading)
    foreign = recognise(data)
    words = split_words(b"" if foreign else data, block_delete=reading.block_delete)
    if not foreign and not len(words.line):
        raise InputError("the program is empty: there is no word in it", source=source, line=1, column=1)
    interpreter = Interpreter(machine, source, reading)
    dialect = dialect_of(words, reading)
    if dialect is not None:
        from planner.nc.language.expand import expand  # 8 ms, for programs that compute

        return expand(interpreter, words, dialect)
    interpreter.execute(words)
    interpreter.note_what_follows(words)
    return interpreter.program(), [foreign] if foreign else interpreter.faults()


def load(path: str | Path) -> bytes:
    """The bytes of a program file. Raises InputError if there is no such file or it cannot be read."""
    try:
        require_ending(path)
        return Path(path).read_bytes()
    except FileNotFoundError as fault:
        raise InputError("program file not found", source=str(path)) from fault
    except IsADirectoryError as fault:
        raise InputError("this is a directory; give the program file", source=str(path)) from fault
    except InputError:
        raise
    except (OSError, ValueError) as fault:
        raise InputError(f"program file cannot be read: {fault}", source=str(path)) from fault


def _check_text(data: bytes, source: str) -> None:
    nul = data.find(b"\0")
    if nul >= 0:
        line = data.count(b"\n", 0, nul) + 1
        column = nul - data.rfind(b"\n", 0, nul)
        what = (
            "UTF-16 text; save it as UTF-8"
            if data[:2] in (b"\xff\xfe", b"\xfe\xff")
            else "a binary file; give a text file"
        )
        raise InputError(f"NUL byte found: this looks like {what}", source=source, line=line, column=column)
