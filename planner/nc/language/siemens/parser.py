"""A Sinumerik program as statements (docs/language.md, "Sinumerik", says what is read and refused).

Lines of plain words stay as the lexer split them. The mode of G90 and G91 is that of the text above a line,
for AC and IC.

Patterns of holes, each drilled by the cycle of MCALL:

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)
    CYCLE801(SPCA, SPCO, STA, DIS1, DIS2, NUM1, NUM2, VARI)    a grid, turned by STA, column by column; VARI 1: its frame
    CYCLE802(, , X0, Y0, X1, Y1 ...)            places

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from planner.nc.arcs import PLANES
from planner.nc.language import tree
from planner.nc.language.makers import corner
from planner.nc.language.run import Dialect
from planner.nc.language.siemens import commands, tables
from planner.nc.language.siemens.block_words import COMMANDS, EACH_LINE, BlockWords
from planner.nc.language.siemens.text import LANGUAGE, LineTokens, variable
from planner.nc.language.source import SourceLine
from planner.nc.language.system_variables import PositionVariables

_LABEL = re.compile(r"\s*([A-Z_][A-Z0-9_]+)\s*:(?!=)", re.IGNORECASE)
_TARGETS = re.compile(rb"(?:GOTO[BFC]?|REPEATB?)\s+N(\d{1,9})\b", re.IGNORECASE)
_MODES = (0, 1, 2, 3, 17, 18, 19, 90, 91)
PATTERNS = {
    "HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"),
    "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
    "CYCLE801": ("SPCA", "SPCO", "STA", "DIS1", "DIS2", "NUM1", "NUM2", "VARI"),
    "CYCLE802": ("XA", "YA", *(f"{axis}{k}" for k in range(9) for axis in "XY")),
}
_TURN = tree.Number(360.0)  # [degrees]
_NUMBER = re.compile(r"\s*[N:]\s*(\d+)\s*", re.IGNORECASE)


class SiemensParser(BlockWords):
    """Makes statements of one file, a main program or a subprogram; each line by its first word."""

    def parse(self) -> list[tree.Procedure]:
        """The main program, under the empty name."""
        start = tree.SourcePlace(self.source.file, 1, self.source.begin)
        self.source.lines = self._special()
        self.read(self.source.in_order(messages=False))
        for left in self.open[:1]:
            self.faults.append(tree.ProgramFault(left.place, f"this {left.kind} has no end"))
        first = tree.assign(start, *((variable(f"_count{k}"), tree.ZERO) for k in range(self.counters)))
        return [tree.Procedure("file" if self.source.file else "", start, [first, *self.main])]

    def _special(self) -> list[int]:
        words = self.source.words
        letter, value = words.letter, words.value
        same = np.isin(letter, [ord(c) for c in tables.PLAIN_LETTERS])
        same &= (letter != ord("G")) | np.isin(value, tables.SAME_CODES)
        same &= (letter != ord("M")) | ~np.isin(value, tables.RETURNS if self.source.file else (17,))
        is_code, other = letter == ord("G"), 70.0 if self.source.unit == 1.0 else 71.0
        if (is_code & (value == other)).any():  # F has another unit than lengths
            same &= (letter != ord("F")) & ~(is_code & (value == 94.0))
        if (is_code & (value == 33.0)).any():  # what it cuts has its lead along an axis
            same &= ~np.isin(letter, list(b"XYZ"))
        targets = [int(label) for label in _TARGETS.findall(words.data)]
        same &= ~((letter == ord("N")) & np.isin(value, targets))
        found = words.rows_with(np.flatnonzero(~same))
        return [row for row in found if letter[words.first[row]] != ord("%")]

    def take_plain(self, rows: tree.PlainRows) -> None:
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
            self.normal = PLANES.get(code, self.normal)
            self.turns = code > 1.0 if code <= 3.0 else self.turns
            self.threading &= code > 3.0
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
        self.body += [tree.Label(line.place, self._number_of(name)) for name in labels]
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
            reader.require(reader.ended, f"{reader.peek()} is not expected here")
        elif reader.peek() not in COMMANDS and self._is_call(reader):
            self._call(reader)
        else:
            self._words(reader)

    def _pattern(self, reader: LineTokens) -> None:
        name = reader.peek(-1)
        if self.cycle is None:
            raise reader.fault(f"{name} stands behind MCALL with a drilling cycle, which it repeats", 0)
        given = self._arguments(reader)
        try:
            self.body += _pattern_rows(reader.place, name, given, self.cycle)
        except ValueError as fault:
            raise reader.fault(str(fault), 0) from fault


def _pattern_rows(
    place: tree.SourcePlace,
    name: str,
    given: Sequence[tree.Expression | None],
    drilled: Sequence[tree.Statement],
) -> list[tree.Statement]:
    """Moves to the holes with the statements of their cycle behind each. Raises ValueError for arguments that
    are missing."""
    known = {key: value for key, value in zip(PATTERNS[name], given, strict=False) if value is not None}
    if name == "CYCLE802":
        return _at_places(place, known, drilled)
    missing = [key for key in PATTERNS[name] if key not in known and key not in ("INDA", "VARI")]
    if missing:
        raise ValueError(f"{name} needs {missing[0]}")
    # statements, not a maker's rows: a maker executes what is pending at each hole
    n, angle, radius, across = (variable(f"_{one}") for one in ("hole", "angle", "radius", "across"))
    count = known.get("NUM", tree.ZERO)
    aside: tree.Expression = tree.ZERO
    if name == "HOLES1":
        along, turned = known["FDIS"] + n * known["DBH"], known["STA1"]
        first: Sequence[tree.Expression] = (known["SPCA"], known["SPCO"])
    elif name == "HOLES2":
        step = known.get("INDA", tree.ZERO)
        even = tree.op("EQ", step, tree.ZERO)  # 1 where the holes are spread evenly
        along, turned = known["RAD"], known["STA1"] + n * (step + even * (_TURN / known["NUM"]))
        first = (known["CPA"], known["CPO"])
    else:
        columns, lines = known["NUM1"], known["NUM2"]
        column = tree.op("TRUNC", n / lines)
        line = n - lines * column
        along, turned, aside = column * known["DIS1"], known["STA"], line * known["DIS2"]
        first, count = (known["SPCA"], known["SPCO"]), columns * lines
        edge = [
            tree.op("EQ", one, last)
            for one in (column, line)
            for last in (tree.ZERO, (columns if one is column else lines) - tree.ONE)
        ]
        on_frame = tree.op("OR", tree.op("OR", edge[0], edge[1]), tree.op("OR", edge[2], edge[3]))
        grid = tree.op("EQ", known.get("VARI", tree.ZERO), tree.ZERO)
        wanted = tree.op("OR", grid, on_frame)
    sine, cosine = tree.op("SIN", angle), tree.op("COS", angle)
    x, y = first[0] + radius * cosine - across * sine, first[1] + radius * sine + across * cosine
    hole: list[tree.Statement] = [tree.row(place, ("G", tree.ZERO), ("X", x), ("Y", y)), *drilled]
    if name == "CYCLE801":
        hole = [tree.If(place, ((wanted, hole),), [])]
    turn: list[tree.Statement] = [
        tree.assign(place, (angle, turned), (radius, along), (across, aside)),
        *hole,
        tree.assign(place, (n, n + tree.ONE)),
    ]
    loop = tree.Loop(place, "while", f"{name} {place.at}", tree.op("LT", n, count), turn)
    return [tree.assign(place, (n, tree.ZERO)), loop]


def _at_places(
    place: tree.SourcePlace, known: Mapping[str, tree.Expression], drilled: Sequence[tree.Statement]
) -> list[tree.Statement]:
    """CYCLE802; the digits of XA and YA are 1 for absolute coordinates. Raises ValueError for others."""
    for mask in ("XA", "YA"):
        value = known.get(mask, tree.ZERO)
        if not isinstance(value, tree.Number) or set(f"{value.value:.0f}") - {"0", "1"}:
            raise ValueError(f"{mask} of CYCLE802, incremental places, is not read; write absolute ones")
    rows: list[tree.Statement] = []
    for k in range(9):
        words = [(axis, known[f"{axis}{k}"]) for axis in "XY" if f"{axis}{k}" in known]
        rows += [tree.row(place, ("G", tree.ZERO), *words), *drilled] if words else []
    return rows


_STATEMENTS: dict[str, Callable[[SiemensParser, LineTokens], object]] = {
    "DEF": SiemensParser._define,
    "IF": SiemensParser._if,
    "ELSE": SiemensParser._else,
    "ENDIF": SiemensParser._end_if,
    "WHILE": lambda parser, reader: parser._begin("WHILE", reader, reader.expression()),
    "LOOP": lambda parser, reader: parser._begin("LOOP", reader, tree.ONE),
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
    **dict.fromkeys(PATTERNS, SiemensParser._pattern),
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
