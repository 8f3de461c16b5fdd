"""The text of a plan's program that an export goes by: its own, the expanded one, or one written for it."""

import dataclasses
import re

import numpy as np

from planner.base.errors import InputError
from planner.base.units import MILLISECOND, SECONDS_PER_MINUTE
from planner.controls.export.chords import DECIMALS
from planner.controls.export.controls import GRBL, Control, is_setting, sets_tools, takes_move
from planner.controls.export.rows import ENDS, G4, G10, G92, HOMES, Row, Source, rows_of
from planner.machine import Machine
from planner.nc import codes
from planner.nc.language.detect import without_leader
from planner.nc.points import own_text
from planner.nc.program import FEED_MOVES, Kind, Program, plain
from planner.nc.reader import parse_program
from planner.nc.reading import ABSOLUTE, AUTO, INCREMENTAL, LINUXCNC, Reading
from planner.nc.writer import FEED_MIN, flat_program, program_text, round_down
from planner.planning.job.plan import Plan

CURVE = "G6.2"  # of a curve without a text, which no control is given: chords stand for it
WRITTEN = "<written>"  # the name of a text that was written for a program
SAME_PLACE = 1e-6  # of an end point that was written with seven decimals and read back [mm]


def text_of(program: Program) -> bytes | None:
    """The program's own NC text; None for points and plotter files."""
    return None if program.pen else own_text(program)


def source_of(plan: Plan) -> Source:
    """The rows that an export of the plan goes by, which read as its blocks. Raises InputError if the text
    has changed since it was planned, or cannot be written out."""
    program, text = plan.program, text_of(plan.program)
    if program.reading.caps is not None:
        raise InputError(
            "a program under feed caps is not exported: its F words are not those of the plan; plan planned.ngc, "
            "which has the caps as F words, and export that",
            source=program.source,
        )
    if text is None:
        if not program.pen:
            return rows_of(*_of_points(program), plan.machine)
        feeds = np.where(np.isfinite(program.feed), program.feed, FEED_MIN)
        return _read(program_text(program, feeds, 1.0).encode(), plan, "as an NC program")
    if program.expansion is None:
        return rows_of(text, _same(text, plan, program.reading, ""), plan.machine)
    found = flat_program(text, plan.machine, program.reading, source=program.source)
    if found is None:
        raise InputError("the program has changed since it was planned", source=program.source)
    return _read(found[0].encode(), plan, "expanded")


def _read(text: bytes, plan: Plan, how: str) -> Source:
    usual = plan.program.reading  # lines of the text that it was written out from are not its own
    ignore = tuple(entry for entry in usual.ignore if not entry[0].isdigit())
    reading = dataclasses.replace(usual, dialect=AUTO, ignore=ignore)
    return rows_of(text, _same(text, plan, reading, f", {how},"), plan.machine)


def _same(text: bytes, plan: Plan, reading: Reading, how: str) -> Program:
    """The program that the text reads as. Raises InputError if that is not the plan's program."""
    program = plan.program
    said = f"the program{how} does not read back"
    # the ending of the file says of its own text whose language that is, of no other
    name = WRITTEN if how else program.source
    try:
        read = parse_program(text, plan.machine, reading, source=name)
    except InputError as fault:
        raise InputError(f"{said}: {fault.message}", source=program.source) from None
    if not same_places(read, program):
        raise InputError(f"{said} as the one that was planned", source=program.source)
    return dataclasses.replace(read, source=program.source)


def same_places(one: Program, other: Program) -> bool:
    """Whether two programs have the same kinds of blocks with the same ends."""
    same = one.end.shape == other.end.shape and np.array_equal(one.kind, other.kind)
    return same and np.allclose(one.end, other.end, rtol=0.0, atol=SAME_PLACE)


def _of_points(program: Program) -> tuple[bytes, Program]:
    """A path of points as text, and the program with the lines of it: a rapid to where it begins, which is no
    block, then its moves. Raises InputError for points of other axes than x, y and z."""
    if len(program.axes) > len("xyz"):
        said = "points of rotary or second axes have no program; export their setpoints"
        raise InputError(said, source=program.source)
    lines = ["G21 G90 G17 G94", "G0 " + _words(program.start)]
    for end, kind, feed in zip(program.end, program.kind.tolist(), program.feed.tolist(), strict=True):
        f_word = f" F{round_down(max(feed, FEED_MIN) * SECONDS_PER_MINUTE)}" if kind in FEED_MOVES else ""
        code = CURVE if kind == Kind.SPLINE else "G1" if f_word else "G0"
        lines.append(f"{code} {_words(end)}{f_word}")
    own = dataclasses.replace(program, line=np.arange(3, 3 + len(program)))
    return "\n".join([*lines, "M2", ""]).encode(), own


def _words(place: np.ndarray) -> str:
    written = (plain(round(float(value), DECIMALS + 3) + 0.0) for value in place)
    return " ".join(map("".join, zip("XYZ", written, strict=False)))  # points may have no z


SAME_FEED = 1e-6  # by its size: what writing a program out rounds
SAME_DWELL = 1e-9  # [s], the rounding of milliseconds
# The words of commands that stand alone on their lines.
_OWN = {
    **dict.fromkeys(("G0", "G1"), "XYZEF"),
    **dict.fromkeys(("G2", "G3"), "XYZIJREF"),
    **dict.fromkeys(("M3", "M4"), "S"),
    "G4": "P",
    "G92": "XYZE",
}
# What the reader takes and controls do not: a byte order mark, no-break spaces, NUL, the end of a file of DOS, lines that end
# with a carriage return alone.
_FOREIGN = re.compile(rb"\xef\xbb\xbf|\xc2\xa0|[\0\x1a]|\r[^\r\n]")
_LONG_NUMBER = re.compile(
    rb"^[ \t]*N[ \t]*\d{8}", re.MULTILINE | re.IGNORECASE
)  # grbl has them up to 10,000,000
_ASIDE = re.compile(rb"\([^)\n]*\)|;[^\n]*|[ \t\r]+")
_PAREN = re.compile(rb"^[^;\n]*\(", re.MULTILINE)
_SLASH = re.compile(rb"^\s*/", re.MULTILINE)
_NUMBER = re.compile(rb"^\s*N\s*\d", re.MULTILINE | re.IGNORECASE)


def why_not(source: Source, text: bytes, control: Control, machine: Machine) -> str:
    """Why the control cannot be given the program as it is, with the first line; "" if it can. `source` are
    the rows that are executed, of the `text` as it is or of the expanded program."""
    program, linuxcnc = source.program, control.name == LINUXCNC
    if linuxcnc and _reads_otherwise(source, text, machine):
        return "LinuxCNC reads it otherwise than it was planned"
    for holds, why in (
        (source.data != text and not linuxcnc, "it has parameters, loops or calls"),
        (_SLASH.search(text) and not linuxcnc, "lines begin with /, which this control does not leave out"),
        (not control.paren and _PAREN.search(text), "it has comments in parentheses"),
        (program.reading.ignore and not linuxcnc, "words were left out by --ignore"),
        (program.reading.lines or program.reading.names, "lines or words were left out by --ignore"),
        (without_leader(text, program.reading)[1], "there is text before the first %"),
        (not control.number and _NUMBER.search(text), "its lines have numbers"),
        (control.name == GRBL.name and _LONG_NUMBER.search(text), "its lines have numbers of eight digits"),
        (
            _FOREIGN.search(text),
            "it has a byte order mark, no-break spaces, NUL bytes, or lines that end with CR alone",
        ),
        (
            re.search(control.at_once.encode("latin-1"), text),
            "it has characters that this control obeys at once, in comments too: ! ~ and those beyond ASCII",
        ),
        (
            _longest(text, control) > control.line_max > 0,
            f"it has lines of more than {control.line_max} characters",
        ),
        (linuxcnc and not _has_end(source.rows), "it does not end with M2, M30 or %"),
    ):
        if holds:
            return why
    fed = False
    for row in source.rows:
        # takes F back, also G94 after G94
        mode = any(codes.G_GROUP[code] == "feed mode" for code in row.g())
        fed = (fed and not mode) or row.value("F") is not None
        if not fed and any(program.kind[k] in FEED_MOVES for k in range(row.first, row.last)):
            return f"line {row.line}: a feed move without an F word before it, or after G93, G94 or G95"
        why = _row_why_not(row, source, control)
        if why:
            return f"line {row.line}: {why}"
    return ""


def _longest(text: bytes, control: Control) -> int:
    """The length of its longest line, as the control counts them [bytes]."""
    return max(map(len, (text if control.whole_line else _ASIDE.sub(b"", text)).split(b"\n")))


def _has_end(rows: list[Row]) -> bool:
    """Whether M2 or M30 ends the rows, or the second of two percent signs."""
    percent = [bool(row.others) and row.others[0][0].letter == "%" for row in (*rows[:1], *rows[-1:])]
    return any(not ENDS.isdisjoint(w.code for w in row.words if w.letter == "M") for row in rows[-1:]) or (
        len(rows) > 1 and all(percent)
    )


def _row_why_not(row: Row, source: Source, control: Control) -> str:
    if row.text:
        return "" if control.is_command(row.text) else f"{row.text!r} is no command of this control"
    for other in row.others:
        name = f"{other[0].letter}{codes.number(other[0].code)}"
        left_out = control.percent and (name[0] == "%" or name in source.program.reading.ignore)
        if not left_out and not is_setting(other, control):
            return f"{''.join(map(str, other))} is not known"
    for word in row.words:
        arc = word.code in codes.ARCS and control.name == "marlin"
        of_code = {"G": word.code in control.g or arc, "M": word.code // 10 in control.m}.get(word.letter)
        if of_code is False:
            return f"{word} is not known"
        if of_code is None and not control.one_command and word.letter not in control.letters:
            return f"{word}: letter {word.letter} is not known"
    if row.at_feed and not control.rapid_feed:
        return "G0, which printers run at F"
    if G4 in row.g():
        p = row.value("P")
        lasts = 0.0 if p is None else p.value * (MILLISECOND if control.milliseconds else 1.0)
        if abs(lasts - source.dwell(row)) > SAME_DWELL:
            return "the P of G4 lasts otherwise there"
    if control.one_command:
        return _line_why_not(row)
    return _rs274_why_not(row, source) if control.name == LINUXCNC else _grbl_why_not(row, source, control)


def _line_why_not(row: Row) -> str:
    """The reason why a line is not one command with the words that are its own."""
    commands = [word for word in row.words if word.letter in "GM"] + [other[0] for other in row.others]
    if not row.words and len(commands) <= 1:
        return ""
    if len(commands) != 1 or row.words[0].letter not in "GM":
        return "a line holds one command, which comes first"
    first = row.words[0]
    own = _OWN.get(f"{first.letter}{codes.number(first.code)}", "")
    alien = next((word for word in row.words[1:] if word.letter not in own), None)
    return f"{alien} beside {first}, which does not take it" if alien is not None else ""


def _grbl_why_not(row: Row, source: Source, control: Control) -> str:
    if row.motion in codes.ARCS and not takes_move(row, control, source.program):
        return "an arc with P or absolute centres, without a coordinate in its plane, or off its radius"
    if sets_tools(row):
        return "G10 or G43.1 with more than grbl's"
    if row.inch != row.inch_before and row.value("F") is not None:
        return "F beside G20 or G21, which grbl reads in the new units"
    tool = row.value("T")
    return f"{tool} is above T{control.tool_max:g}" if tool and tool.value > control.tool_max else ""


def _rs274_why_not(row: Row, source: Source) -> str:
    """The reason why LinuxCNC's interpreter refuses what the reader takes."""
    letters = [word.letter for word in row.words if word.letter not in "GM"]
    if len(set(letters)) < len(letters) or any("e" in word.text.lower() for word in row.words):
        return "a letter twice, or a number with an exponent"
    if row.motion in codes.ARCS:
        centre = ["IJK"["XYZ".index(axis)] for axis in row.plane]
        off = any(letter in "IJK" and letter not in centre for letter in letters)
        if off or source.program.reading.arc_centres == ABSOLUTE:
            return "an arc with absolute centres, or with one off its plane"
    if {G10, G92, *HOMES} & set(row.g()) and any(codes.G_GROUP[code] == "motion" for code in row.g()):
        return "two codes that use the coordinates"
    own = "".join(codes.WORDS.get((word.letter, word.code), "") for word in row.words if word.letter in "GM")
    own += codes.WORDS.get(("G", row.motion), "")
    unused = next((word for word in row.words if word.letter in "DEH" and word.letter not in own), None)
    return f"{unused} without a code that uses it" if unused is not None else ""


def _reads_otherwise(source: Source, text: bytes, machine: Machine) -> bool:
    """Whether the text is another program in LinuxCNC's own language."""
    program = source.program
    reading = dataclasses.replace(program.reading, strict=False, dialect=LINUXCNC, arc_centres=INCREMENTAL)
    try:
        again = parse_program(text, machine, reading, source=program.source)
    except InputError:
        return True
    return not (
        again.axes == program.axes
        and same_places(again, program)
        and np.allclose(again.dwell, program.dwell, rtol=0.0, atol=SAME_DWELL)
        and np.allclose(again.feed, program.feed, rtol=SAME_FEED, atol=0.0)
    )
