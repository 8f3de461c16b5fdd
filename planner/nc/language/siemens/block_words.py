"""The words of a line: coordinates, codes, arcs, corners, compensation, and commands that move nothing.

CR= TURN= ADIS=                 radius, further turns, tolerance
CIP X Y I1= J1=                 arc through a point;  CT X Y   arc that goes on in the direction of the last move
RND= CHR= CHF=                  rounding or chamfer at the end of the move
G40 G41 G42                     radius compensation (NORM, G450)
"""

from __future__ import annotations

import re

from planner.base.units import MM_PER_INCH
from planner.nc.language.corner_moves import KINDS as CORNERS
from planner.nc.language.said import assumed_row
from planner.nc.language.siemens import codes, cycles, drilling
from planner.nc.language.siemens.calls import Calls
from planner.nc.language.siemens.commands import as_word
from planner.nc.language.siemens.text import TokenReader, operation, position
from planner.nc.language.source import Source
from planner.nc.language.tree import ONE, TWO, ZERO, Expression, Line, MadeRows, Number, Parameter, Word

# G40, G41, G42: off, left and right of the path; commands of arcs by their makers.
_SIDES = {40: 0.0, 41: 1.0, 42: -1.0}
_ARCS = {"CIP": "arc through", "CT": "tangent arc"}


_ANGLES = "choose a post-processor that writes the angles of the rotary axes (A=, B=, C=)"


class BlockWords(Calls):
    """Rows of words. source : the file; circular : CIP or CT was written, and no other motion code since."""

    source: Source
    circular = False
    centre_feed = False  # the program has CFTCP

    def _words(self, reader: TokenReader) -> None:
        """A row of words, commands that move nothing, and assignments."""
        words: list[Word] = []
        assigned: list[tuple[Parameter, Expression]] = []
        found: set[float] = set()
        wait: list[Word] = []
        stops = moved = False
        made: list[MadeRows] = []  # corners and compensation, before the row
        arc, through = "", {}
        while not reader.ended:
            token, at = reader.tokens[reader.next], reader.at()
            reader.next += 1
            if token.kind not in ("name", "word"):
                reader.next -= 1
                raise reader.fault(f"{token.text} starts neither a word nor a command")
            name = token.text
            if name in _ARCS:
                arc, self.circular = name, True
            elif name in CORNERS:
                reader.expect("=")
                kind = Number(float(CORNERS.index(name)))
                made.append(MadeRows(reader.place, "corner", (("kind", kind), ("size", reader.expression()))))
            elif name in ("I1", "J1", "K1") and arc == "CIP":
                axis = "XYZ"["IJK".index(name[0])]
                value = self._given(reader, axis, at)
                assert value is not None
                through[f"{axis}1"] = self._absolute(axis, value)
            elif name == "SUPA":
                words.append(as_word("G", at, Number(53.0)))
            elif name in drilling.ARGUMENTS or name in cycles.ARGUMENTS or name in ("CYCLE800", "CYCLE832"):
                self._cycle(reader, name)
            elif name == "KONT" and self.compensates:
                raise reader.fault("KONT, another approach to the contour, is not read; write NORM", token.at)
            elif name == "STOPRE":  # the block before it ends in an exact stop, until the control has read on
                stops = True
            elif name in codes.SAID:
                made.append(assumed_row(reader.place, codes.SAID[name]))
                _skip(reader)
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
                        if word.value.value in _SIDES:
                            side = Number(_SIDES[int(word.value.value)])
                            made.insert(0, MadeRows(reader.place, "compensate", (("side", side),)))
                            continue
                        self.circular &= word.value.value not in (0.0, 1.0, 2.0, 3.0)
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
        self.body += made
        if self.circular and any(chr(word.letter) in "XYZ" for word in words):
            words = self._circle(reader, arc, words, through)
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

    def _circle(
        self, reader: TokenReader, arc: str, words: list[Word], through: dict[str, Expression]
    ) -> list[Word]:
        """An arc of CIP or CT with the coordinates among the words; returns the other words."""
        if not arc:
            raise reader.fault(
                "CIP and CT are read in each of their lines; write it again, or G1, G2 or G3", 0
            )
        given = dict(through)
        for word in words:
            if chr(word.letter) in "XYZ":
                given[chr(word.letter)] = self._absolute(chr(word.letter), word.value)
            elif chr(word.letter) == "F":
                given["F"] = word.value
        self.body.append(MadeRows(reader.place, _ARCS[arc], tuple(given.items())))
        return [word for word in words if chr(word.letter) not in "XYZF"]

    def _absolute(self, axis: str, given: Expression) -> Expression:
        return given if self.absolute else operation("+", position(axis), given)

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
        if letter in ("A", "B", "C") and name != letter and number is None:
            raise reader.fault(f"{name}=, a direction of the tool, is not read; {_ANGLES}", at - reader.start)
        if len(letter) != 1 or letter not in "XYZIJKFSTMDHABC" or (number is None and reader.peek() != "="):
            raise reader.fault(f"{name} is not read; {codes.REMEDY}", at - reader.start)
        given = Number(number) if number is not None else self._given(reader, letter, at)
        if letter == "D":
            self.body.append(assumed_row(reader.place, "tool offset"))
        # A tool by its name has no number.
        return [] if given is None or letter == "D" else [as_word(letter, at, given)]

    def _code(self, reader: TokenReader, code: int, at: int) -> list[Word]:
        if code in (90, 91):
            self.absolute = code == 90
            if reader.peek() == "(":
                raise reader.fault(f"G{code}(...) is not read")
        if code in (70, 71, 700, 710):
            self.unit = MM_PER_INCH if code in (70, 700) else 1.0
        if code == 451 and self.compensates:
            raise reader.fault(
                "G451, outer corners by their intersection, is not read; write G450", at - reader.start
            )
        if code == 621:
            self.body.append(assumed_row(reader.place, "corner feed"))
        if code in (41, 42) and not self.centre_feed:
            self.body.append(assumed_row(reader.place, "tool centre feed"))
        if code == 500:
            origin = [as_word("G", at, Number(10.0)), as_word("L", at, TWO), as_word("P", at, Number(9.0))]
            self.body.append(Line(reader.place, (*origin, *(as_word(axis, at, ZERO) for axis in "XYZ")), ()))
        if code in _SIDES:
            return [as_word("G", at, Number(float(code)))]
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
