"""The lines of a program: which are plain words, and which belong to the language.

The lexer has split every line into words as far as it goes. A row with what it could not read, or with an O
word or a code that calls a subprogram, is looked at again here as text; all others stay as they are, in runs
of rows (`tree.PlainRows`).
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import MM_PER_INCH
from planner.nc.faults import Fault
from planner.nc.integers import integers_of
from planner.nc.interpreter import Interpreter
from planner.nc.language import tree
from planner.nc.language.detect import bare, computes, ends_frame, may_compute
from planner.nc.language.tree import PlainRows, ProgramFault, SourcePlace
from planner.nc.lexer import BOM, Words
from planner.nc.state import DEGREES, begins_in_inches

NESTED_MAX = 100  # loops and branches in each other
_PROGRAM = re.compile(r"[O:]\d+")  # the number of a program, or of a subprogram without keywords
_MESSAGE = re.compile(rb"\([ \t]*(?:DEBUG|PRINT|MSG)[ \t]*,", re.IGNORECASE)


@dataclass(frozen=True)
class SourceLine:
    """A line of the source as text."""

    row: int  # its row of words; -1 for a comment alone
    place: SourcePlace
    start: int  # byte offset of its first character in the words' data
    text: str
    scale: float = 1.0  # what a length without a point is multiplied by

    def fault(self, message: str, at: int | None = None) -> ProgramFault:
        """A fault of the line, or of what begins at a byte of it."""
        return ProgramFault(self.place if at is None else self.place._replace(at=at), message)

    def require(self, good: object, message: str, at: int | None = None) -> None:
        """Raise such a fault unless all is good."""
        if not good:
            raise self.fault(message, at)


class Source:
    """One file: its words, and the lines among them that may belong to the language."""

    def __init__(self, words: Words, file: int, first_row: int, begin: int, interpreter: Interpreter):
        self.words, self.file, self.first_row, self.begin = words, file, first_row, begin
        machine = interpreter.machine
        self.scale = integers_of(machine).scale(words)
        self.unit = MM_PER_INCH if begins_in_inches(machine) else 1.0  # mm per unit at the start of a program
        self.at_tip = interpreter.ignored.at_tip  # words that switch the tool centre point are read
        self.rotary = "".join(letter for letter in interpreter.state.others if letter in DEGREES)
        self.skips = interpreter.reading.block_delete  # lines that start with "/" are left out
        # subprograms of the machine's builder that move nothing, as the machine file or the user says
        given = machine.dialect.subprograms if machine is not None and machine.dialect is not None else ()
        self.harmless = {*map(str.upper, given), *interpreter.reading.ignore}
        bare_texts = ((row, bare(words.row_text(row))) for row in may_compute(words))
        # rows, ascending, that are statements of the language rather than words
        self.lines = [
            row for row, text in bare_texts if computes(text) or _PROGRAM.match(text) or ends_frame(text)
        ]

    def _message_lines(self) -> list[tuple[int, SourceLine]]:
        """Lines with a message in a comment, each with the row that it comes before."""
        data = self.words.data
        found = [match.start() for match in _MESSAGE.finditer(data)]
        if not found:
            return []
        newlines = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == 10)
        lines = []
        for number in np.unique(np.searchsorted(newlines, found)).tolist():
            start = int(newlines[number - 1]) + 1 if number else 0
            end = int(newlines[number]) if number < len(newlines) else len(data)
            place = SourcePlace(self.file, number + 1, self.begin + start)
            row = int(np.searchsorted(self.words.line, number + 1))
            lines.append((row, SourceLine(row, place, start + self.begin, data[start:end].decode("latin-1"))))
        return lines

    def line(self, row: int) -> SourceLine:
        """A row as the source line that it comes from."""
        words = self.words
        at = int(words.at[words.first[row]])
        start, end = words.line_at(at)
        if start == 0 and words.data.startswith(BOM):
            start = len(BOM)
        text = words.data[start:end]
        place = SourcePlace(self.file, int(words.line[row]), self.begin + at)
        return SourceLine(row, place, start + self.begin, text.decode("latin-1"), float(self.scale[row]))

    def in_order(self, *, messages: bool = True) -> Iterator[SourceLine | PlainRows]:
        """The program in its order: lines of the language and, with `messages`, those with one in a comment,
        and runs of plain rows between them."""
        waiting = [(row, self.line(row)) for row in self.lines]
        known = {row for row, _ in waiting}
        for row, line in self._message_lines() if messages else ():
            if row < len(self.words.line) and self.words.line[row] == line.place.line:
                if row not in known:
                    waiting.append((row, self.line(row)))
            else:
                waiting.append((row, replace(line, row=-1)))
        waiting.sort(key=lambda item: item[1].place.line)
        done = 0
        for row, line in waiting:
            if row > done:
                yield from self.plain(done, row)
            yield line
            done = row if line.row < 0 else row + 1
        if len(self.words.line) > done:
            yield from self.plain(done, len(self.words.line))

    def plain(self, first: int, last: int) -> list[PlainRows]:
        """Statements for the rows `first` to `last` - 1; those that may end the program stand alone."""
        words = self.words
        letter, value = words.of_rows(first, last)
        ends = (letter == ord("%")) | ((letter == ord("M")) & np.isin(value, (2, 30)))
        rows = words.rows_with(np.flatnonzero(ends) + int(words.first[first]))
        begins = [first, *(row + 1 for row in rows)]
        runs = [self._run(k, row + 1, may_end=True) for k, row in zip(begins[:-1], rows, strict=True)]
        return [*runs, *([self._run(begins[-1], last, may_end=False)] if begins[-1] < last else [])]

    def words_of(self, rows: PlainRows) -> tuple[Array, FloatArray]:
        """Letters (n,) and values (n,) of rows."""
        return self.words.of_rows(rows.first - self.first_row, rows.last - self.first_row)

    def _run(self, first: int, last: int, *, may_end: bool) -> PlainRows:
        at = self.begin + int(self.words.at[self.words.first[first]])
        place = SourcePlace(self.file, int(self.words.line[first]), at)
        return PlainRows(place, self.first_row + first, self.first_row + last, may_end)

    def part(self, rows: PlainRows, first: int, last: int) -> PlainRows:
        """The rows `first` to `last` - 1 of some."""
        may_end = rows.may_end and last == rows.last
        return self._run(first - self.first_row, last - self.first_row, may_end=may_end)

    def fault(self, fault: ProgramFault, name: str = "") -> Fault:
        """A fault of this file as the reader reports it."""
        at = fault.place.at - self.begin
        match = re.match(rb"[^\s(;]{1,20}", self.words.data[at:])
        word = match.group().decode("utf-8", "replace") if match else ""
        return Fault(fault.place.line, self.words.column_at(at), word, fault.message, name)


class LineParser:
    """Makes statements of one file, line by line.

    body, base : where the next statement goes, and where it goes outside of all that is open
    open       : statements without an end, the outermost first
    faults     : those of all lines
    """

    def __init__(self, source: Source):
        self.source = source
        self.main: list[tree.Statement] = []
        self.base = self.body = self.main
        self.open: list[tree.OpenStatement] = []
        self.faults: list[ProgramFault] = []

    def begin(self, opened: tree.OpenStatement) -> tree.OpenStatement:
        """Open a statement, in whose body the next ones go. Raises ProgramFault for too many in each other."""
        if len(self.open) >= NESTED_MAX:
            raise ProgramFault(opened.place, f"more than {NESTED_MAX} loops and branches in each other")
        self.open.append(opened)
        self.body = opened.body
        return opened

    def close(self) -> tree.OpenStatement:
        """The innermost open statement ends."""
        closed = self.open.pop()
        self.body = self.open[-1].body if self.open else self.base
        return closed

    def add_loop(self, closed: tree.OpenStatement, condition: tree.Expression, kind: str = "while") -> None:
        """Add the loop of an open statement that has been closed."""
        name = f"{closed.kind} {closed.place.at}"
        self.body.append(tree.Loop(closed.place, kind, name, condition, closed.body))

    def read(self, items: Iterable[SourceLine | PlainRows]) -> None:
        """Take the lines and plain rows of a program in its order."""
        for item in items:
            try:
                if isinstance(item, PlainRows):
                    self.take_plain(item)
                else:
                    self.take_line(item)
            except ProgramFault as fault:
                self.faults.append(fault)

    def take_plain(self, rows: PlainRows) -> None:
        """Add rows of plain words to the statements."""
        raise NotImplementedError

    def take_line(self, line: SourceLine) -> None:
        """Add the statements of a line of the language. Raises ProgramFault."""
        raise NotImplementedError
