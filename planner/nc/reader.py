"""Reading an NC program or a plotter file (HPGL): from text to `Program`, or an `InputError` that names file,
line, column, the word, and what to do. The content of a text says which of the two it is, and its name if the
content does not.
"""

import dataclasses
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from planner.base.errors import InputError
from planner.base.files import STDIN, require_ending, standard_input
from planner.machine import EXTRUDER, Machine, load_machine
from planner.nc.capped import capped
from planner.nc.extruder import with_extruder
from planner.nc.faults import Fault, require_none
from planner.nc.integers import IN_INCREMENTS, integers_of, mixed
from planner.nc.interpreter import Interpreter
from planner.nc.language import detect
from planner.nc.lexer import Words, split_words, text_alone
from planner.nc.macros import Called, written_out
from planner.nc.points import are_points, read_points
from planner.nc.printer import is_printer
from planner.nc.program import Expansion, Program
from planner.nc.reading import (
    ABSOLUTE,
    AS_USUAL,
    AUTO,
    CL,
    FANUC,
    GRBL,
    HEIDENHAIN,
    KLIPPER,
    LATHE,
    LINUXCNC,
    PRINTERS,
    SIEMENS,
    Reading,
)
from planner.nc.unreadable import refuse_models

_WORDS = re.compile(r"\s*(N\d+\s*)?[GMTFS]\d+(\.\d)?(\s|$)")  # how a program begins, and hardly a file name
_DELETED = re.compile(rb"^[ \t]*/[ \t\d]*[A-Z#%<\[$]", re.MULTILINE | re.IGNORECASE)
_G20, _G70 = 20.0, 70.0


def read_program(
    path: str | Path | None = None,
    machine: Machine | str | Path | None = None,
    reading: Reading = AS_USUAL,
    *,
    text: str | bytes | None = None,
) -> Program:
    """Read an NC program or a plotter file.

    path    : the file; None where `text` is given
    text    : the program itself
    machine : gives tool lengths, G28 and G30 positions, work offsets, the first path control, and what
              plotter files need, as a machine, its file or the name of a built-in one; None for zeros and blending
    reading : what is refused, left out and assumed

    Raises InputError if a file cannot be read, for the first construct that is not supported or not valid,
    and unless one of file and text is given.

    >>> import planner
    >>> len(planner.read_program(text="G21 F3000\\nG1 X10\\nY5\\n"))
    2
    """
    if (path is None) == (text is None):
        raise InputError("give a program file, or its text as text=...")
    if path is not None and not isinstance(path, str | os.PathLike):
        allowed = "a program is a file, or planner.path(points), or planner.read_program(text=...)"
        raise InputError(f"{allowed}; found a {type(path).__name__}")
    if isinstance(machine, str | os.PathLike):
        machine = load_machine(machine)
    if path is not None:
        data, source = load(path), source_name(path)
    else:
        data, source = text.encode() if isinstance(text, str) else text or b"", "<text>"
    return dataclasses.replace(parse_program(data, machine, reading, source=source), text=data)


def source_name(path: str | Path) -> str:
    """The name of a program file in messages."""
    return "<stdin>" if str(path) == STDIN else str(path)


def parse_program(
    text: bytes | str, machine: Machine | None = None, reading: Reading = AS_USUAL, *, source: str = "<text>"
) -> Program:
    """Read an NC program given as text; like `read_program`."""
    program, faults = interpret(text, machine, reading, source=source)
    require_none(faults, source)
    return capped(program, reading.caps, text.encode() if isinstance(text, str) else text)


def interpret(
    text: bytes | str, machine: Machine | None, reading: Reading = AS_USUAL, *, source: str
) -> tuple[Program, Sequence[Fault]]:
    """Run a program to its end, past everything that is not supported. Returns the program and the faults, in
    the order of the lines. Raises InputError for an empty or binary text."""
    data = text.encode("utf-8", "replace") if isinstance(text, str) else text
    if are_points(data):
        return read_points(data, source), ()
    refuse_models(data, source)
    _check_text(data, source)
    if detect.is_plotter_file(data, source):
        from planner.nc.hpgl.plotter import read_drawing  # 10 ms

        return read_drawing(data, machine, source, reading)
    run, program, faults = execute(data, machine, reading, source)
    if reading.arc_centres == AUTO and not reading.strict and run.all_arcs_close_otherwise:
        absolute = dataclasses.replace(reading, arc_centres=ABSOLUTE)
        other, as_absolute, found = execute(data, machine, absolute, source)
        if not other.open_arcs:
            arcs = run.open_arcs
            note = (
                f"line {arcs[0].line}: arc centres read as absolute, as after G90.1: {len(arcs):,} arcs close only so "
                "(--arc-centres absolute|incremental says which)"
            )
            notes, assumptions = (note, *as_absolute.notes), (note, *as_absolute.assumptions)
            return dataclasses.replace(as_absolute, notes=notes, assumptions=assumptions), found
    if faults and reading.dialect not in (AUTO, HEIDENHAIN) and detect.language_of(data):
        text = f"{faults[0].message} (the program looks like Heidenhain's: leave --dialect out, or write heidenhain)"
        faults = [dataclasses.replace(faults[0], message=text), *faults[1:]]
    return program, faults


def execute(
    data: bytes,
    machine: Machine | None,
    reading: Reading,
    source: str,
    tee: Callable[[Words], None] | None = None,
) -> tuple[Interpreter, Program, Sequence[Fault]]:
    """Execute a program once, as `reading` says. Raises InputError if there is no word in it.

    tee : gets the expanded rows of a program that computes, chunk by chunk
    """
    interpreter = Interpreter(machine, source, reading)
    state, findings = interpreter.state, interpreter.findings
    data, left = reading.kept(data, source)
    for line, what in left:
        findings.assume(f"{what} left out, as --ignore says", line)
    text, line, seen = "begins with / and is left out, as with block delete on", 1, 0
    for deleted in _DELETED.finditer(data) if reading.block_delete else ():
        line, seen = line + data.count(b"\n", seen, deleted.start()), deleted.start()
        if reading.strict:
            raise InputError(f"{text} (assumed without --strict)", source=source, line=line, column=1)
        findings.assume(text, line)
    interpreter.archive = detect.programs_of(data)
    data = next((one.text() for name, one in interpreter.archive.items() if name.endswith("mpf")), data)
    called = rewritten(data, machine, reading, source)
    if called is not None and called.dialect == CL:
        reading = dataclasses.replace(reading, dialect=LINUXCNC)
    automatic = reading.dialect == AUTO
    language = detect.language_of(data) if automatic else reading.dialect
    if language == HEIDENHAIN:
        from planner.nc.language.expand import expand  # 8 ms, for programs that compute

        state.seconds_meant = state.centres_known = True
        return interpreter, *expand(interpreter, text_alone(data), HEIDENHAIN, tee)
    if language != SIEMENS:
        data, leader = detect.without_leader(data, reading)
        if leader:
            findings.note(f"the text before the first % is not read ({leader!r})", 1)
    words = split_words(data if called is None else called.data, block_delete=reading.block_delete)
    if called is not None:
        words = dataclasses.replace(words, line=called.line[words.line - 1], files=called.files)
    if not len(words.line):
        raise InputError("the program is empty: there is no word in it", source=source, line=1, column=1)
    mark = ""
    if automatic:
        mark = "its %_N_" if interpreter.archive else detect.siemens_mark(words, source)
    siemens, first_line = bool(mark) or language == SIEMENS, int(words.line[0])
    prints = (called is not None and called.dialect == KLIPPER) or language in PRINTERS
    if not siemens and not reading.strict:
        extruder = automatic and machine is not None and EXTRUDER in machine.axes
        prints |= is_printer(words, extruder=extruder)
    if prints:
        interpreter.ignored.read_printer()
        words.value[words.find("G", 0.0)] = 1.0  # G0 runs at F there
    if not siemens and not reading.strict and (units := detect.units(words)):
        text = "G70 and G71 without the words of a cycle are inch and mm, as in ISO 6983 and Mach3"
        findings.assume(text, int(words.line[words.row(units[0])]))
        words.value[units] += _G20 - _G70
    dialect = SIEMENS if siemens else detect.dialect_of(words, reading, prints=prints)
    siemens = dialect == SIEMENS
    if not prints and not siemens and detect.is_turned(words, dialect, reading, machine):
        dialect = LATHE
        findings.assume(detect.LATHE_NOTE, first_line)
    elif not siemens and not reading.strict:
        interpreter.two_axes = detect.has_two_axes(words)
    if siemens and detect.has_two_axes(words) and b"DIAM" not in data.upper():
        text = "X is a radius, though nothing moves Y: many lathes begin with DIAMON (diameters)"
        findings.assume(text, first_line, grave=True)
    of_fanuc = FANUC in (reading.dialect, dialect) or dialect == LATHE
    state.fanuc = of_fanuc or detect.is_fanuc(words, dialect, reading)
    state.own_feed = state.fanuc or reading.dialect == GRBL
    state.centres_known = siemens
    state.plane_known = not state.fanuc or dialect == LATHE
    state.seconds_meant = not automatic or siemens or state.fanuc
    integers = integers_of(machine)
    if state.fanuc and integers.increment is None and (whole := mixed(words)) is not None:
        text = f"{words.text(whole)} without a point beside coordinates with one is in whole units; {IN_INCREMENTS}"
        findings.assume(text, int(words.line[words.row(whole)]))
    words = integers.applied(words)
    if dialect is not None:
        interpreter.ignored.refuse_extruder()
        from planner.nc.language.expand import expand

        program, faults = expand(interpreter, words, dialect, tee)
        if mark and faults:
            why = f"{faults[0].message} (read as a Sinumerik's because of {mark}; --dialect says otherwise)"
            faults = [dataclasses.replace(faults[0], message=why), *faults[1:]]
        return interpreter, program, faults
    # of printers, whose lines make several blocks in macros: the row that a block comes from
    words = dataclasses.replace(words, frame=np.arange(len(words.line), dtype=np.int32))
    interpreter.execute(interpreter.in_seconds(words))
    interpreter.note_what_follows(words)
    program, faults = interpreter.program(), interpreter.faults()
    if interpreter.ignored.follows and not len(faults):
        of_rows = interpreter.limits.factors, interpreter.saved.marks, interpreter.ignored.retractions
        row = interpreter.table.block.frame[: interpreter.table.blocks]
        if len(row) != len(program):  # the tool centre point has divided rapids
            row = np.searchsorted(words.line, program.line)
        program = with_extruder(program, row, words, interpreter.rows_read, *of_rows)
    if called is not None:
        program, faults = _of_called(called, program, faults)
    return interpreter, program, faults


def rewritten(data: bytes, machine: Machine | None, reading: Reading, source: str) -> Called | None:
    """The G code of a CL file, or of a program with macros; None for others. Raises InputError."""
    if detect.is_cl_file(data):
        from planner.nc.cl_file import codes_of  # 10 ms

        return codes_of(data, machine, source)
    if machine is None or not machine.gcode_macros or reading.strict:
        return None
    return written_out(data, machine.gcode_macros, reading.ignore)


def _of_called(called: Called, program: Program, faults: Sequence[Fault]) -> tuple[Program, Sequence[Fault]]:
    """A program that was rewritten, and its faults with the macros that led to them."""
    within = (f"{fault.message} (in the macro {fault.source})" for fault in faults)
    faults = [
        dataclasses.replace(fault, source="", column=1, message=text) if fault.source else fault
        for fault, text in zip(faults, within, strict=True)
    ]
    notes = *program.notes, *(f"the macro {name} is not run: {why}" for name, why in called.left.items())
    expansion = program.expansion
    if called.calls or called.dialect == CL:
        calls = tuple(called.calls.items())
        expansion = Expansion(dialect=called.dialect, calls=calls, turns=0, rows=len(called.line))
    return dataclasses.replace(program, notes=notes, expansion=expansion), faults


def load(path: str | Path) -> bytes:
    """The bytes of a program file, or of the standard input for "-". Raises InputError."""
    try:
        if str(path) == STDIN:
            return standard_input()
        require_ending(path)
        return Path(path).read_bytes()
    except FileNotFoundError as fault:
        text = "; its text goes into planner.read_program(text=...)" if _WORDS.match(str(path)) else ""
        raise InputError(f"program file not found{text}", source=str(path)) from fault
    except IsADirectoryError as fault:
        raise InputError("this is a directory; give the program file", source=str(path)) from fault
    except InputError:
        raise
    except (OSError, ValueError) as fault:
        raise InputError(f"program file cannot be read: {fault}", source=str(path)) from fault


def _check_text(data: bytes, source: str) -> None:
    padding = len(data) - len(data.lstrip(b"\0"))  # of tapes, and of transfers in blocks
    nul = data.strip(b"\0").find(b"\0") + padding
    if nul >= padding and data.strip(b"\0"):
        is_utf16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
        what = "UTF-16 text; save it as UTF-8" if is_utf16 else "a binary file; give a text file"
        text = f"NUL byte found between other characters: this looks like {what}"
        line, column = data.count(b"\n", 0, nul) + 1, nul - data.rfind(b"\n", 0, nul)
        raise InputError(text, source=source, line=line, column=column)
