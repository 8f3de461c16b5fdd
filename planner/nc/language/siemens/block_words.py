"""The words of a line: coordinates, codes, arcs, corners, compensation, and commands that move nothing.

CR= TURN= ADIS=                 radius, further turns, tolerance
CIP X Y I1= J1=                 arc through a point;  CT X Y   arc that goes on in the direction of the last move
RND= CHR= CHF=                  rounding or chamfer at the end of the move
G40 G41 G42                     radius compensation (NORM, G450)
"""

import re

from planner.base.units import MM_PER_INCH
from planner.nc.language import tree
from planner.nc.language.corner_moves import KINDS as CORNERS
from planner.nc.language.making import assumed_row
from planner.nc.language.siemens import commands, cycles
from planner.nc.language.siemens.commands import Commands
from planner.nc.language.siemens.text import LineTokens, position
from planner.nc.language.source import Source

# G40, G41, G42: off, left and right of the path; commands of arcs by their makers.
_SIDES = {40: 0.0, 41: 1.0, 42: -1.0}
_ARCS = {"CIP": "arc through", "CT": "tangent arc"}
_ANGLES = "choose a post-processor that writes the angles of the rotary axes (A=, B=, C=)"


class BlockWords(Commands):
    """Rows of words. source : the file; circular : CIP or CT was written, and no other motion code since."""

    source: Source
    circular = False
    centre_feed = False  # the program has CFTCP

    def _words(self, reader: LineTokens) -> None:
        words: list[tree.Word] = []
        assigned: list[tuple[tree.Parameter, tree.Expression]] = []
        found: set[float] = set()
        stops = moved = False
        before: list[tree.MadeRows] = []  # corners and compensation, before the row
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
                corner = tree.made(reader.place, "corner", kind=CORNERS.index(name), size=reader.expression())
                before.append(corner)
            elif name in ("I1", "J1", "K1") and arc == "CIP":
                axis = "XYZ"["IJK".index(name[0])]
                value = self._given(reader, axis, at)
                assert value is not None
                through[f"{axis}1"] = self._absolute(axis, value)
            elif name == "SUPA":
                words.append(tree.word("G", at, 53.0))
            elif name in cycles.ARGUMENTS or name in ("CYCLE800", "CYCLE832"):
                self._cycle(reader, name)
            elif name == "KONT" and self.compensates:
                raise reader.fault("KONT, another approach to the contour, is not read; write NORM", token.at)
            elif name == "STOPRE":  # the block before it ends in an exact stop, until the control has read on
                stops = True
            elif name in commands.SAID:
                before.append(assumed_row(reader.place, commands.SAID[name]))
                _skip(reader)
            elif name in commands.IDLE or (name in commands.IDLE_CALLS and reader.peek() in ("(", "=", "[")):
                _skip(reader)
            elif reader.peek() == ("[" if name == "R" else "=") and (target := reader.parameter(token)):
                reader.expect("=")
                assigned.append((target, reader.expression()))
            else:
                for one in self._word(reader, name, at):
                    letter, code = one.letter, one.value
                    if letter == "G" and isinstance(code, tree.Number):
                        if code.value in _SIDES:
                            side = _SIDES[int(code.value)]
                            before.insert(0, tree.made(reader.place, "compensate", side=side))
                            continue
                        self.circular &= code.value not in (0.0, 1.0, 2.0, 3.0)
                        found.add(code.value)
                        stops |= code.value == 9.0
                        if code.value == 9.0:
                            continue
                    moved |= letter in "XY"
                    words.append(one)
        if 4.0 in found:
            seconds = [one._replace(letter="P") for one in words if one.letter == "F"]
            words = [one for one in words if one.letter not in "FS"] + seconds
            if not any(one.letter == "P" for one in words):
                text = "G4 S, a dwell in turns of the spindle, is not read; write G4 F with seconds"
                raise reader.fault(text, 0)
        returns = commands.RETURNS if self.source.file else (17,)
        ended = [one for one in words if one.code in {f"M{number}" for number in returns}]
        words = [one for one in words if one not in ended]
        words += [tree.word("M", one.at, 30.0) for one in ended if not self.source.file]
        self.body += before
        if self.circular and any(one.letter in "XYZ" for one in words):
            words = self._circle(reader, arc, words, through)
        if words or assigned:
            self.body.append(tree.Line(reader.place, tuple(words), tuple(assigned)))
        if stops:
            self.body.append(tree.row(reader.place, ("G", 4.0), ("P", tree.ZERO)))
        if moved and self.cycle is not None:
            self.body += self.cycle
        if ended and self.source.file:
            self._return(reader)

    def _circle(
        self, reader: LineTokens, arc: str, words: list[tree.Word], through: dict[str, tree.Expression]
    ) -> list[tree.Word]:
        if not arc:
            text = "CIP and CT are read in each of their lines; write it again, or G1, G2 or G3"
            raise reader.fault(text, 0)
        given = dict(through)
        for one in words:
            letter = one.letter
            if letter in "XYZ":
                given[letter] = self._absolute(letter, one.value)
            elif letter == "F":
                given["F"] = one.value
        self.body.append(tree.made(reader.place, _ARCS[arc], **given))
        return [one for one in words if one.letter not in "XYZF"]

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
        if code in (41, 42) and not self.centre_feed:
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
        depth += (reader.peek() in ("(", "[")) - (reader.peek() in (")", "]"))
        reader.next += 1
