"""A Sinumerik program as statements.

    words      G0-G3 G9 G17-G19 G33 G40 G53-G57 G60 G64 G641-G645 G70 G71 G90 G91 G94 G500 G700 G710, G4 F,
               X Y Z I J K with = AC() IC(), CR= TURN= F S T D M, N
    language   DEF, assignments, labels, IF ELSE ENDIF, WHILE, FOR, LOOP, REPEAT UNTIL, GOTO GOTOF GOTOB, IF .. GOTO, REPEAT label P=n
    commands   SUPA, TRANS and ATRANS, MSG, MCALL and CYCLE81 82 83, CYCLE832 (tolerance), CYCLE800() (no tilt), and those that do not
               move anything (`codes.IDLE`)

Lines of plain words stay as the lexer split them. The mode of G90 and G91 is that of the text above a line, for AC and IC.

Refused with their line: tilted and turned frames (ROT, CYCLE800 with angles, TRAORI), mirrors and scales, RND and CHF, CIP and CT,
subprograms in other files, pockets and other cycles.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from planner.base.units import MM_PER_INCH
from planner.nc.language.siemens import codes, drilling, patterns
from planner.nc.language.siemens.calls import Calls
from planner.nc.language.siemens.commands import as_word
from planner.nc.language.siemens.text import TokenReader, operation, variable
from planner.nc.language.source import Source, SourceLine
from planner.nc.language.tree import (
    ONE,
    ZERO,
    Expression,
    Line,
    Number,
    Parameter,
    PlainRows,
    Procedure,
    ProgramFault,
    SourcePlace,
    Word,
)

_LABEL = re.compile(r"\s*([A-Z_][A-Z0-9_]+)\s*:(?!=)", re.IGNORECASE)
_NUMBER = re.compile(r"\s*[N:]\s*(\d+)\s*", re.IGNORECASE)


class SiemensParser(Calls):
    """Statements of one file. Faults of all its lines are kept in `faults`."""

    def __init__(self, source: Source):
        super().__init__()
        self.source = source
        self.faults: list[ProgramFault] = []

    def parse(self) -> list[Procedure]:
        """The main program, under the empty name."""
        start = SourcePlace(self.source.file, 1, self.source.begin)
        special = self._special()
        done, rows = 0, len(self.source.words.line)
        for row in [*special, rows]:
            if row > done:
                self._plain(done, row)
            if row < rows:
                try:
                    self._line(self.source.line(row))
                except ProgramFault as fault:
                    self.faults.append(fault)
                except RecursionError:
                    self.faults.append(
                        ProgramFault(self.source.line(row).place, "the line is nested too deep")
                    )
            done = row + 1
        for left in self.open[:1]:
            self.faults.append(ProgramFault(left.place, f"this {left.kind} has no end"))
        own = ["_depth", "_step", *(f"_count{k}" for k in range(self.counters))]
        own += [] if self.source.file else ["_tx", "_ty", "_tz"]
        first = Line(start, (), tuple((variable(name), ZERO) for name in own))
        return [Procedure("file" if self.source.file else "", start, [first, *self.main])]

    def _special(self) -> list[int]:
        """Rows, ascending, that are not words of the same meaning in RS274NGC."""
        words = self.source.words
        letter, value = words.letter, words.value
        same = np.isin(letter, [ord(c) for c in codes.PLAIN_LETTERS])
        same &= (letter != ord("G")) | np.isin(value, codes.SAME_CODES)
        same &= (letter != ord("M")) | ~np.isin(value, codes.RETURNS if self.source.file else (17,))
        found = np.unique(np.searchsorted(words.first, np.flatnonzero(~same), side="right") - 1)
        return [int(row) for row in found if letter[words.first[row]] != ord("%")]

    def _plain(self, first: int, last: int) -> None:
        """Rows of plain words; while a cycle is modal, each that moves is followed by it."""
        for run in self.source.plain(first, last):
            self._follow_modes(run)
            if self.cycle is None:
                self.body.append(run)
                continue
            for row in range(first, last):
                for one in self.source.plain(row, row + 1):
                    self.body.append(one)
                span = slice(int(self.source.words.first[row]), int(self.source.words.first[row + 1]))
                if np.isin(self.source.words.letter[span], (ord("X"), ord("Y"))).any():
                    self.body += self.cycle
            return

    def _follow_modes(self, run: PlainRows) -> None:
        """G90 and G91 of plain rows, the last one counts."""
        words = self.source.words
        first, last = run.first - self.source.first_row, run.last - self.source.first_row
        span = slice(int(words.first[first]), int(words.first[last]))
        modes = words.value[span][(words.letter[span] == ord("G")) & np.isin(words.value[span], (90, 91))]
        if len(modes):
            self.absolute = bool(modes[-1] == 90)

    # --- lines ------------------------------------------------------------------------------------------------------------------

    def _line(self, line: SourceLine) -> None:
        text = _without_comment(line.text)
        at = 0
        if text.lstrip().startswith("/"):
            at = text.index("/") + 1  # the lexer has left out skipped lines
        number = _NUMBER.match(text, at)
        if number:
            at = number.end()
            self._label(f"N{int(number.group(1))}", line.place)
        while label := _LABEL.match(text, at):
            self._label(label.group(1).upper(), line.place)
            at = label.end()
        reader = TokenReader(" " * at + text[at:], line.place, line.start, self.names)
        if reader.ended:
            return
        read = _STATEMENTS.get(reader.peek())
        if read is not None:
            reader.next += 1
            read(self, reader)
            if not reader.ended:
                raise reader.fault(f"{reader.peek()} is not expected here")
        elif self._is_call(reader):
            self._call(reader)
        else:
            self._words(reader)

    # --- words ------------------------------------------------------------------------------------------------------------------

    def _words(self, reader: TokenReader) -> None:
        """A row of words, commands that move nothing, and assignments."""
        words: list[Word] = []
        assigned: list[tuple[Parameter, Expression]] = []
        found: set[float] = set()
        wait: list[Word] = []
        stops = moved = False
        while not reader.ended:
            token, at = reader.tokens[reader.next], reader.at()
            reader.next += 1
            if token.kind not in ("name", "word"):
                reader.next -= 1
                raise reader.fault(f"{token.text} starts neither a word nor a command")
            name = token.text
            if name == "SUPA":
                words.append(as_word("G", at, Number(53.0)))
            elif name in drilling.ARGUMENTS or name in ("CYCLE800", "CYCLE832"):
                self._cycle(reader, name)
            elif name in codes.IDLE or (name in codes.IDLE_CALLS and reader.peek() in ("(", "=", "[")):
                _skip(reader)
            elif reader.peek() == "=" and (name in self.names or re.fullmatch(r"R\d+", name)):
                reader.next += 1
                target = reader.parameter(token)
                assert target is not None
                assigned.append((target, reader.expression()))
            elif name == "R" and reader.peek() == "[":
                target = reader.parameter(token)
                reader.expect("=")
                assert target is not None
                assigned.append((target, reader.expression()))
            else:
                for word in self._word(reader, name, at):
                    letter = chr(word.letter)
                    if letter == "G" and isinstance(word.value, Number):
                        found.add(word.value.value)
                        stops |= word.value.value == 9.0
                        if word.value.value == 9.0:
                            continue
                    moved |= letter in "XY"
                    words.append(word)
        if 4.0 in found:
            wait = [word for word in words if chr(word.letter) in "FS"]
            words = [word for word in words if chr(word.letter) not in "FS"]
            words += [Word(ord("P"), word.at, word.value) for word in wait if chr(word.letter) == "F"]
            if not any(chr(word.letter) == "P" for word in words):
                raise reader.fault(
                    "G4 S, a dwell in turns of the spindle, is not read; write G4 F with seconds", 0
                )
        returns = (17.0, *(codes.RETURNS if self.source.file else ()))
        ended = [
            word
            for word in words
            if chr(word.letter) == "M" and isinstance(word.value, Number) and word.value.value in returns
        ]
        words = [word for word in words if word not in ended]
        words += [as_word("M", word.at, Number(30.0)) for word in ended if not self.source.file]
        if words or assigned:
            self.body.append(Line(reader.place, tuple(words), tuple(assigned)))
        if stops:
            self.body.append(
                Line(
                    reader.place,
                    (as_word("G", reader.place.at, Number(4.0)), as_word("P", reader.place.at, ZERO)),
                )
            )
        if moved and self.cycle is not None:
            self.body += self.cycle
        if ended and self.source.file:
            self._return(reader)

    def _word(self, reader: TokenReader, name: str, at: int) -> list[Word]:
        """The words of RS274NGC for one word. Raises ProgramFault."""
        number = float(name[1:]) if reader.tokens[reader.next - 1].kind == "word" else None
        letter = name[0] if number is not None else re.sub(r"\d+\Z", "", name)
        if letter == "G" and number is not None and number == int(number):
            return self._code(reader, int(number), at)
        if name in ("CR", "TURN", "ADIS"):
            reader.expect("=")
            value = reader.expression()
            return [
                as_word(
                    {"CR": "R", "TURN": "P", "ADIS": "P"}[name],
                    at,
                    operation("+", value, ONE) if name == "TURN" else value,
                )
            ]
        if len(letter) != 1 or letter not in "XYZIJKFSTMDHABC" or (number is None and reader.peek() != "="):
            raise reader.fault(f"{name} is not read; {codes.REMEDY}", at - reader.start)
        given = Number(number) if number is not None else self._given(reader, letter, at)
        # Offsets D belong to the control: lengths come from [tools]. A tool by its name has no number.
        return [] if given is None or letter == "D" else [as_word(letter, at, given)]

    def _code(self, reader: TokenReader, code: int, at: int) -> list[Word]:
        if code in (90, 91):
            self.absolute = code == 90
            if reader.peek() == "(":
                raise reader.fault(f"G{code}(...) is not read")
        if code in (70, 71, 700, 710):
            self.unit = MM_PER_INCH if code in (70, 700) else 1.0
        if code == 9:
            return [as_word("G", at, Number(9.0))]
        if code == 641:
            return [as_word("G", at, Number(64.0))]
        if code in codes.CODES:
            return [as_word("G", at, Number(one)) for one in codes.CODES[code]]
        if code in (*codes.SAME_CODES, 4):
            return [as_word("G", at, Number(float(code)))]
        raise reader.fault(f"G{code} of Siemens is not read; {codes.REMEDY}", at - reader.start)


def _skip(reader: TokenReader) -> None:
    """Go past what stands in brackets behind a command, or behind its equals sign."""
    if reader.take("="):
        reader.expression()
        return
    depth = 0
    while reader.peek() in ("(", "[") or depth:
        if reader.ended:
            raise reader.fault(") is missing")
        depth += (reader.peek() in ("(", "[")) - (reader.peek() in (")", "]"))
        reader.next += 1


def _without_comment(text: str) -> str:
    """A line without its comment; a semicolon in a text is none."""
    return re.sub(r'("[^"]*")|;.*', lambda found: found.group(1) or "", text.rstrip("\r\n\x1a"))


_STATEMENTS: dict[str, Callable[[SiemensParser, TokenReader], None]] = {
    "DEF": SiemensParser._define,
    "IF": SiemensParser._if,
    "ELSE": SiemensParser._else,
    "ENDIF": SiemensParser._end_if,
    "WHILE": SiemensParser._while,
    "LOOP": SiemensParser._loop,
    **dict.fromkeys(("ENDWHILE", "ENDLOOP"), SiemensParser._end_loop),
    "FOR": SiemensParser._for,
    "ENDFOR": SiemensParser._end_for,
    "REPEAT": SiemensParser._repeat,
    "UNTIL": SiemensParser._until,
    **dict.fromkeys(("GOTO", "GOTOF", "GOTOB", "GOTOC"), SiemensParser._goto),
    **dict.fromkeys(("TRANS", "ATRANS"), SiemensParser._shift),
    "MCALL": SiemensParser._modal_call,
    **dict.fromkeys(patterns.ARGUMENTS, SiemensParser._pattern),
    "MSG": SiemensParser._message,
    **dict.fromkeys(("EXTERN", "WORKPIECE"), SiemensParser._idle),
    "PROC": SiemensParser._procedure,
    "CALL": SiemensParser._call_text,
    "RET": SiemensParser._return,
    **dict.fromkeys(
        codes.REFUSED,
        SiemensParser._refused,
    ),
}
