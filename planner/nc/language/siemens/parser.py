"""A Sinumerik program as statements (docs/language.md, "Sinumerik", says what is read and refused).

Lines of plain words stay as the lexer split them. The mode of G90 and G91 is that of the text above a line,
for AC and IC.
"""

import re
from collections.abc import Callable

import numpy as np

from planner.nc.language.makers import corner
from planner.nc.language.run import Dialect
from planner.nc.language.siemens import commands, patterns, tables
from planner.nc.language.siemens.block_words import COMMANDS, EACH_LINE, BlockWords
from planner.nc.language.siemens.text import LANGUAGE, LineTokens, variable
from planner.nc.language.source import SourceLine
from planner.nc.language.system_variables import PositionVariables
from planner.nc.language.tree import (
    ONE,
    ZERO,
    Label,
    PlainRows,
    Procedure,
    ProgramFault,
    SourcePlace,
    assign,
)

_LABEL = re.compile(r"\s*([A-Z_][A-Z0-9_]+)\s*:(?!=)", re.IGNORECASE)
_TARGETS = re.compile(rb"(?:GOTO[BFC]?|REPEATB?)\s+N(\d{1,9})\b", re.IGNORECASE)
_MODES = (0, 1, 2, 3, 17, 18, 19, 90, 91)
_NUMBER = re.compile(r"\s*[N:]\s*(\d+)\s*", re.IGNORECASE)


class SiemensParser(BlockWords):
    """Makes statements of one file, a main program or a subprogram; each line by its first word."""

    def parse(self) -> list[Procedure]:
        """The main program, under the empty name."""
        start = SourcePlace(self.source.file, 1, self.source.begin)
        self.source.lines = self._special()
        self.read(self.source.in_order(messages=False))
        for left in self.open[:1]:
            self.faults.append(ProgramFault(left.place, f"this {left.kind} has no end"))
        first = assign(start, *((variable(f"_count{k}"), ZERO) for k in range(self.counters)))
        return [Procedure("file" if self.source.file else "", start, [first, *self.main])]

    def _special(self) -> list[int]:
        words = self.source.words
        letter, value = words.letter, words.value
        same = np.isin(letter, [ord(c) for c in tables.PLAIN_LETTERS])
        same &= (letter != ord("G")) | np.isin(value, tables.SAME_CODES)
        same &= (letter != ord("M")) | ~np.isin(value, tables.RETURNS if self.source.file else (17,))
        targets = [int(label) for label in _TARGETS.findall(words.data)]
        same &= ~((letter == ord("N")) & np.isin(value, targets))
        found = words.rows_with(np.flatnonzero(~same))
        return [row for row in found if letter[words.first[row]] != ord("%")]

    def take_plain(self, rows: PlainRows) -> None:
        """Rows of plain words; while a cycle is modal, each that moves is followed by it."""
        one_by_one = range(rows.first - self.source.first_row, rows.last - self.source.first_row)
        for row in one_by_one if self.circular else ():  # behind CIP or CT
            letters, values = self.source.words.of_rows(row)
            if ((letters == ord("G")) & np.isin(values, (0, 1, 2, 3))).any():
                self.circular = False
                break
            if np.isin(letters, (ord("X"), ord("Y"), ord("Z"))).any():
                raise self.source.line(row).fault(EACH_LINE)
        letter, value = self.source.words_of(rows)
        codes = value[letter == ord("G")]
        for code in codes[np.isin(codes, _MODES)].tolist():
            self.absolute = code == 90.0 if code in (90.0, 91.0) else self.absolute
            self.normal = {17.0: 2, 18.0: 1, 19.0: 0}.get(code, self.normal)
            self.turns = code > 1.0 if code <= 3.0 else self.turns
        if self.cycle is None and self.rounding is None:
            self.body.append(rows)
            return
        for row in one_by_one:
            moves = np.isin(self.source.words.of_rows(row)[0], (ord("X"), ord("Y"))).any()
            (plain,) = self.source.plain(row, row + 1)
            if moves and self.rounding is not None:
                self.body.append(corner(plain.place, "RND", self.rounding, modal=True))
            self.body.append(plain)
            if moves and self.cycle is not None:
                self.body += self.cycle

    def take_line(self, line: SourceLine) -> None:
        """Put the statements of a line where they belong."""
        # without the comment; a semicolon in a text is none
        text = re.sub(r'("[^"]*")|;.*', lambda found: found.group(1) or "", line.text.rstrip("\r\n\x1a"))
        at = 0
        if text.lstrip().startswith("/"):
            at = text.index("/") + 1  # the lexer has left out skipped lines
        labels = []
        while label := _NUMBER.match(text, at) or _LABEL.match(text, at):
            name = label.group(1).upper()
            labels.append(f"N{int(name)}" if name.isdecimal() else name)
            at = label.end()
        self.body += [Label(line.place, self._number_of(name)) for name in labels]
        body, first = self.body, len(self.body)
        self._statement(text, at, line)
        if self.body is body:
            self.lines.update((name, (body, first, len(body))) for name in labels)

    def _statement(self, text: str, at: int, line: SourceLine) -> None:
        reader = LineTokens(" " * at + text[at:], line.place, line.start, self.names)
        if reader.ended:
            return
        read = None if reader.peek() in self.names else _STATEMENTS.get(reader.peek())
        if read is not None:
            reader.pop()
            read(self, reader)
            if not reader.ended:
                raise reader.fault(f"{reader.peek()} is not expected here")
        elif reader.peek() not in COMMANDS and self._is_call(reader):
            self._call(reader)
        else:
            self._words(reader)


_STATEMENTS: dict[str, Callable[[SiemensParser, LineTokens], object]] = {
    "DEF": SiemensParser._define,
    "IF": SiemensParser._if,
    "ELSE": SiemensParser._else,
    "ENDIF": SiemensParser._end_if,
    "WHILE": lambda parser, reader: parser._begin("WHILE", reader, reader.expression()),
    "LOOP": lambda parser, reader: parser._begin("LOOP", reader, ONE),
    **dict.fromkeys(("ENDWHILE", "ENDLOOP"), SiemensParser._end_loop),
    "FOR": SiemensParser._for,
    "ENDFOR": SiemensParser._end_for,
    "REPEAT": SiemensParser._repeat,
    "REPEATB": SiemensParser._repeat_block,
    "UNTIL": SiemensParser._until,
    **dict.fromkeys(
        ("GOTO", "GOTOF", "GOTOB", "GOTOC"), lambda parser, reader: parser.body.append(parser._jump(reader))
    ),
    "MCALL": SiemensParser._modal_call,
    **dict.fromkeys(patterns.PATTERNS, SiemensParser._pattern),
    "MSG": SiemensParser._message,
    **dict.fromkeys(("EXTERN", "WORKPIECE", "GROUP_BEGIN", "REDEF"), lambda parser, reader: reader.leave()),
    **dict.fromkeys(tables.TOOL_POINT, SiemensParser._tool_point),
    "PROC": SiemensParser._procedure,
    **dict.fromkeys(("CALL", "EXTCALL"), SiemensParser._call_text),
    "CASE": SiemensParser._case,
    "ENDLABEL": lambda parser, reader: None,
    "$P_UIFR": SiemensParser._offset,
    **dict.fromkeys(("RET", "STOPFROM"), SiemensParser._return),
    **dict.fromkeys(
        filter(re.compile(r"(?![ABCG]\d+\Z)").match, tables.REFUSED.keys() - COMMANDS.keys()),
        SiemensParser._refused,
    ),
}


DIALECT = Dialect(LANGUAGE, PositionVariables, SiemensParser, commands.siemens_files, tables.UNKNOWN)
