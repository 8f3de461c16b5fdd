"""The words of a line: coordinates, codes, arcs, corners, compensation, and commands that move nothing.

CR= TURN= ADIS=                 radius, further turns, tolerance
CIP X Y I1= J1=                 arc through a point;  CT X Y   arc that goes on in the direction of the last move
RND= CHR= CHF=                  rounding or chamfer at the end of the move
G40 G41 G42                     radius compensation (NORM, G450)
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from planner.base.units import MM_PER_INCH
from planner.nc.language import tree
from planner.nc.language.corner_moves import KINDS as CORNERS
from planner.nc.language.making import assumed_row
from planner.nc.language.siemens import commands, cycles
from planner.nc.language.siemens.commands import Commands
from planner.nc.language.siemens.text import LineTokens, position

# G40, G41, G42: off, left and right of the path; commands of arcs by their makers.
_SIDES = {40: 0.0, 41: 1.0, 42: -1.0}
_ARCS = {"CIP": "arc through", "CT": "tangent arc"}
EACH_LINE = "CIP and CT are read in each of their lines; write it again, or G1, G2 or G3"
_ANGLES = "choose a post-processor that writes the angles of the rotary axes (A=, B=, C=)"


@dataclass
class Row:
    """The words of a line so far."""

    words: list[tree.Word] = field(default_factory=list)
    assigned: list[tuple[tree.Parameter, tree.Expression]] = field(default_factory=list)
    before: list[tree.Statement] = field(default_factory=list)  # corners and compensation, before the row
    codes: set[float] = field(default_factory=set)  # numbers of its G codes
    arc: str = ""  # CIP or CT
    through: dict[str, tree.Expression] = field(default_factory=dict)  # I1 J1 K1 of CIP
    stops: bool = False  # it ends in a full stop

    def has(self, letters: str) -> bool:
        """True if there is a word with one of the letters."""
        return any(word.letter in letters for word in self.words)


class BlockWords(Commands):
    """Rows of words. circular : CIP or CT was written, and no other motion code since."""

    circular = False

    def _words(self, reader: LineTokens) -> None:
        row = Row()
        while not reader.ended:
            if reader.kind() not in ("name", "word"):
                raise reader.fault(f"{reader.peek()} starts neither a word nor a command")
            at, token = reader.at(), reader.pop()
            name = token.text
            if name in _COMMANDS:
                _COMMANDS[name](self, reader, row)
            elif name in ("I1", "J1", "K1") and row.arc == "CIP":
                axis = "XYZ"["IJK".index(name[0])]
                value = self._given(reader, axis, at)
                assert value is not None
                row.through[f"{axis}1"] = self._absolute(axis, value)
            elif name in commands.IDLE_CALLS and reader.peek() in ("(", "=", "["):
                _skip(reader)
            elif reader.peek() == ("[" if name == "R" else "=") and (target := reader.parameter(token)):
                reader.expect("=")
                row.assigned.append((target, reader.expression()))
            else:
                for word in self._word(reader, name, at):
                    self._take(reader, row, word)
        self._append_row(reader, row)

    def _arc(self, reader: LineTokens, row: Row) -> None:
        row.arc, self.circular = reader.peek(-1), True

    def _corner(self, reader: LineTokens, row: Row) -> None:
        kind = CORNERS.index(reader.peek(-1))
        reader.expect("=")
        row.before.append(tree.made(reader.place, "corner", kind=kind, size=reader.expression()))

    def _machine(self, reader: LineTokens, row: Row) -> None:
        """SUPA: machine coordinates."""
        row.words.append(tree.word("G", reader.start + reader.tokens[reader.next - 1].at, 53.0))

    def _soft_approach(self, reader: LineTokens, row: Row) -> None:
        if self.compensates:
            text = "KONT, another approach to the contour, is not read; write NORM"
            raise reader.fault(text, reader.tokens[reader.next - 1].at)
        _skip(reader)

    def _stop_reading(self, reader: LineTokens, row: Row) -> None:
        """STOPRE: the block before it ends in an exact stop, until the control has read on."""
        row.stops = True

    def _assumed(self, reader: LineTokens, row: Row) -> None:
        row.before.append(assumed_row(reader.place, commands.SAID[reader.peek(-1)]))
        _skip(reader)

    def _take(self, reader: LineTokens, row: Row, word: tree.Word) -> None:
        """A word of RS274NGC; G40, G41, G42 and G9 are no words of the row."""
        if word.letter == "G" and isinstance(word.value, tree.Number):
            code = word.value.value
            if code in _SIDES:
                row.before.insert(0, tree.made(reader.place, "compensate", side=_SIDES[int(code)]))
                return
            self.circular &= code not in (0.0, 1.0, 2.0, 3.0)
            row.codes.add(code)
            if code == 9.0:
                row.stops = True
                return
        row.words.append(word)

    def _append_row(self, reader: LineTokens, row: Row) -> None:
        """The statements of the line: what comes before its row, the row, what follows it."""
        moved = row.has("XY")
        if 4.0 in row.codes:
            seconds = [word._replace(letter="P") for word in row.words if word.letter == "F"]
            row.words = [word for word in row.words if word.letter not in "FS"] + seconds
            if not row.has("P"):
                text = "G4 S, a dwell in turns of the spindle, is not read; write G4 F with seconds"
                raise reader.fault(text, 0)
        ends = {f"M{number}" for number in (commands.RETURNS if self.source.file else (17,))}
        ended = [word for word in row.words if word.code in ends]
        row.words = [word for word in row.words if word not in ended]
        row.words += [tree.word("M", word.at, 30.0) for word in ended if not self.source.file]
        self.body += row.before
        if self.circular and row.has("XYZ"):
            self._circle(reader, row)
        if row.words or row.assigned:
            self.body.append(tree.Line(reader.place, tuple(row.words), tuple(row.assigned)))
        if row.stops:
            self.body.append(tree.row(reader.place, ("G", 4.0), ("P", tree.ZERO)))
        if moved and self.cycle is not None:
            self.body += self.cycle
        if ended and self.source.file:
            self._return(reader)

    def _circle(self, reader: LineTokens, row: Row) -> None:
        """The arc of CIP or CT, which takes the row's coordinates and feed."""
        if not row.arc:
            raise reader.fault(EACH_LINE, 0)
        given = dict(row.through)
        for word in row.words:
            if word.letter in "XYZ":
                given[word.letter] = self._absolute(word.letter, word.value)
            elif word.letter == "F":
                given["F"] = word.value
        self.body.append(tree.made(reader.place, _ARCS[row.arc], **given))
        row.words = [word for word in row.words if word.letter not in "XYZF"]

    def _absolute(self, axis: str, given: tree.Expression) -> tree.Expression:
        return given if self.absolute else position(axis) + given

    def _word(self, reader: LineTokens, name: str, at: int) -> list[tree.Word]:
        """The words of RS274NGC for one word. Raises ProgramFault."""
        number = float(name[1:]) if reader.tokens[reader.next - 1].kind == "word" else None
        letter = name[0] if number is not None else re.sub(r"\d+\Z", "", name)
        if letter == "G" and number is not None and number == int(number):
            return self._code(reader, int(number), at)
        if name in ("CR", "TURN", "ADIS"):
            reader.expect("=")
            value = reader.expression()
            letter = "R" if name == "CR" else "P"
            return [tree.word(letter, at, value + tree.ONE if name == "TURN" else value)]
        if letter in ("A", "B", "C") and name != letter and number is None:
            raise reader.fault(f"{name}=, a direction of the tool, is not read; {_ANGLES}", at - reader.start)
        if len(letter) != 1 or letter not in "XYZIJKFSTMDHABC" or (number is None and reader.peek() != "="):
            raise reader.fault(f"{name} is not read; {commands.REMEDY}", at - reader.start)
        given = tree.Number(number) if number is not None else self._given(reader, letter, at)
        if letter == "D":
            self.body.append(assumed_row(reader.place, "tool offset"))
        # A tool by its name has no number.
        return [] if given is None or letter == "D" else [tree.word(letter, at, given)]

    def _code(self, reader: LineTokens, code: int, at: int) -> list[tree.Word]:
        if code in (90, 91):
            self.absolute = code == 90
            if reader.peek() == "(":
                raise reader.fault(f"G{code}(...) is not read")
        if code in (70, 71, 700, 710):
            self.unit = MM_PER_INCH if code in (70, 700) else 1.0
        if code == 451 and self.compensates:
            text = "G451, outer corners by their intersection, is not read; write G450"
            raise reader.fault(text, at - reader.start)
        if code == 621:
            self.body.append(assumed_row(reader.place, "corner feed"))
        if code in (41, 42) and b"CFTCP" not in self.source.words.data:
            self.body.append(assumed_row(reader.place, "tool centre feed"))
        if code == 500:
            origin = (("G", 10.0), ("L", 2.0), ("P", 9.0), ("X", 0.0), ("Y", 0.0), ("Z", 0.0))
            words = tuple(tree.word(letter, at, value) for letter, value in origin)
            self.body.append(tree.Line(reader.place, words))
        if code in (*_SIDES, 9):
            return [tree.word("G", at, float(code))]
        if code == 641:
            return [tree.word("G", at, 64.0)]
        if code in commands.CODES:
            return [tree.word("G", at, one) for one in commands.CODES[code]]
        if code in (*commands.SAME_CODES, 4):
            return [tree.word("G", at, float(code))]
        raise reader.fault(f"G{code} of Siemens is not read; {commands.REMEDY}", at - reader.start)


def _skip(reader: LineTokens) -> None:
    """Go past what stands in brackets behind a command, or behind its equals sign."""
    if reader.take("="):
        reader.expression()
        return
    depth = 0
    while reader.peek() in ("(", "[") or depth:
        if reader.ended:
            raise reader.fault(") is missing")
        found = reader.pop().text
        depth += (found in ("(", "[")) - (found in (")", "]"))


# What is read by its name. A new command is a line here and a method above.
_COMMANDS: dict[str, Callable[[BlockWords, LineTokens, Row], None]] = {
    **dict.fromkeys(commands.IDLE, lambda words, reader, row: _skip(reader)),
    **dict.fromkeys(commands.SAID, BlockWords._assumed),
    **dict.fromkeys(_ARCS, BlockWords._arc),
    **dict.fromkeys(CORNERS, BlockWords._corner),
    **dict.fromkeys(
        (*cycles.ARGUMENTS, "CYCLE800", "CYCLE832"),
        lambda words, reader, row: words._cycle(reader, reader.peek(-1)),
    ),
    "SUPA": BlockWords._machine,
    "KONT": BlockWords._soft_approach,
    "STOPRE": BlockWords._stop_reading,
}
