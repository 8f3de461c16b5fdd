"""The words of a line: coordinates, codes, arcs, corners, compensation, and commands that move nothing.

CR= TURN= ADIS=                 radius, further turns, tolerance
CIP X Y I1= J1=                 arc through a point;  CT X Y   arc that goes on in the direction of the last move
AP= RP=                         polar coordinates about the pole, which G110 (from the tool's place), G111 (from
                                the zero) and G112 (from the pole before) set; arcs with them are about the pole
RND= CHR= CHF= RNDM=            rounding or chamfer at the end of the move; RNDM of each move until RNDM=0
G40 G41 G42                     radius compensation (NORM, G450)
G331 G332 G63                   tapping: in and out at lead times speed, or at F, with full stops
"""

import re
from collections.abc import Callable
from functools import partial

from planner.base.units import MM_PER_INCH
from planner.nc.arcs import PLANES
from planner.nc.language import makers, tree
from planner.nc.language.corner_moves import KINDS as CORNERS
from planner.nc.language.making import assumed_row
from planner.nc.language.siemens import cycles, tables
from planner.nc.language.siemens.commands import AXES, Commands, Row
from planner.nc.language.siemens.text import LineTokens

# G40, G41, G42: off, left and right of the path; commands of arcs by their makers.
_SIDES = {40: 0.0, 41: 1.0, 42: -1.0}
_ARCS = {"CIP": makers.arc_through, "CT": makers.tangent_arc}
EACH_LINE = "CIP and CT are read in each of their lines; write it again, or G1, G2 or G3"
_TAPS = (331, 332, 63)
_WORDS = "XYZIJKFSTMDHABCUVW"
_MAIN = "1"  # S1= and M1= are those of the first spindle, which is planned; others are left out


class BlockWords(Commands):
    """Rows of words.

    circular : CIP or CT was written, and no other motion code since
    rounding : RNDM in force, or None
    """

    circular = False
    rounding: tree.Expression | None = None

    def _words(self, reader: LineTokens) -> None:
        row = Row()
        while not reader.ended:
            if reader.kind() not in ("name", "word"):
                raise reader.fault(f"{reader.peek()} starts neither a word nor a command")
            at, token = reader.at(), reader.pop()
            name = token.text
            if name in COMMANDS and name not in self.names and (token.kind == "name" or reader.peek() == "="):
                COMMANDS[name](self, reader, row)
            elif name in ("I1", "J1", "K1") and row.arc == "CIP":
                axis = AXES["IJK".index(name[0])]
                value = self._given(reader, axis, at)
                assert value is not None
                row.through[f"{axis}1"] = self._absolutes({axis: value})[axis]
            elif name in self.names and self.names[name][1:] == ((0,),):
                self._text_value(reader)
            elif reader.peek() in ("[", "=") and (target := reader.parameter(token)):
                reader.expect("=")
                row.assigned += self._assigned(reader, token.text, target)
            else:
                for word in self._word(reader, name, at):
                    self._take(reader, row, word)
        self._append_row(reader, row)

    def _arc(self, reader: LineTokens, row: Row) -> None:
        row.arc, self.circular = reader.peek(-1), True

    def _corner(self, reader: LineTokens, row: Row) -> None:
        kind, row.corner = reader.peek(-1), True
        reader.expect("=")
        row.before.append(makers.corner(reader.place, kind, reader.expression()))

    def _alone(self, reader: LineTokens, row: Row) -> None:
        """SUPA: machine coordinates; STOPRE: the control reads no further before it is here; OVR=: percent of F
        from here on; DIAMON: X words are diameters, until DIAMOF; RNDM=: a rounding of each move, until RNDM=0."""
        name, place = reader.peek(-1), reader.place
        if name == "SUPA":
            row.words.append(tree.word("G", reader.start + reader.tokens[reader.next - 1].at, 53.0))
        elif name == "STOPRE":
            row.stops = True
        elif name in ("DIAMON", "DIAMOF"):
            row.before.append(tree.row(place, ("G", 7.0 if name == "DIAMON" else 8.0)))
        else:
            reader.expect("=")
            value = reader.expression()
            if name == "OVR":
                row.before.append(tree.row(place, ("M", 220.0), ("S", value)))
            else:
                self.rounding = None if value == tree.ZERO else value

    def _assumed(self, reader: LineTokens, row: Row) -> None:
        row.before.append(assumed_row(reader.place, tables.SAID[reader.peek(-1)]))
        _skip(reader)

    def _idle(self, reader: LineTokens, row: Row) -> None:
        if reader.peek(-1) == "LIMS" and reader.take("="):
            self.fastest = reader.expression()
        else:
            _skip(reader)

    def _feed_axes(self, reader: LineTokens, row: Row) -> None:
        """FGROUP of X, Y and Z, whose speed F is here."""
        at = reader.next - 1
        _skip(reader)
        if {token.text for token in reader.tokens[at + 1 : reader.next]} - {"(", ")", ",", "X", "Y", "Z"}:
            raise reader.fault(tables.refusal("FGROUP"), reader.tokens[at].at)

    def _take(self, reader: LineTokens, row: Row, word: tree.Word) -> None:
        """A word of RS274NGC; G40, G41, G42 and G9 are no words of the row."""
        if word.letter == "G" and isinstance(word.value, tree.Number):
            code = word.value.value
            if code in _SIDES:
                row.before.insert(0, tree.made(reader.place, makers.compensate, side=_SIDES[int(code)]))
                return
            if code in (0.0, 1.0, 2.0, 3.0):
                self.circular, self.turns, self.threading = False, code > 1.0, False
            self.threading |= code == 33.0
            row.codes.add(code)
            if code == 9.0:
                row.stops = True
                return
        row.words.append(word)

    def _append_row(self, reader: LineTokens, row: Row) -> None:
        """The statements of the line: what comes before its row, the row, what follows it."""
        place = reader.place
        if poles := row.codes & {110.0, 111.0, 112.0}:
            self._pole(reader, row, int(min(poles)))
        if row.polar and not poles:
            self._to_polar(reader, row)
        moved = row.has("XY")
        if moved and self.rounding is not None and not row.corner:
            row.before.append(makers.corner(place, "RND", self.rounding, modal=True))
        if row.codes & {25.0, 26.0}:  # limits of the working area and of the spindle
            row.take("GXYZS")
        if 4.0 in row.codes:
            self._dwell(reader, row)
        elif self.feed_factor != 1.0 and not self.inverse_time:
            factor = tree.Number(self.feed_factor)
            row.words = [
                word if word.letter != "F" else tree.word("F", word.at, word.value * factor)
                for word in row.words
            ]
        ends = {f"M{number}" for number in (tables.RETURNS if self.source.file else (17,))}
        ended = [word for word in row.words if word.code in ends]
        row.words = [word for word in row.words if word not in ended]
        row.words += [tree.word("M", word.at, 30.0) for word in ended if not self.source.file]
        self.body += row.before
        if self.circular and row.has("XYZ"):
            self._circle(reader, row)
        if taps := row.codes & set(map(float, _TAPS)):
            row.words = [word for word in row.words if word.code != f"G{min(taps):g}"]
            given = row.take("XYZIJKS" if 63.0 not in taps else "XYZF")
            lead = next((given.pop(one) for one in "IJK" if one in given), tree.ZERO)
            tap = partial(makers.tap_path, code=min(taps))
            self.body.append(tree.made(place, tap, lead=lead, **self._absolutes(given)))
        thread: list[tree.Statement] = []
        if self.threading and row.has("XYZ"):
            given = row.take("XYZIJK")
            along = next((one for one in "KIJ" if one in given), None)
            if along is None:
                raise reader.fault("G33 needs its lead along the axis that moves most: K, I or J", 0)
            lead = given.pop(along)
            row.words = [word for word in row.words if word.code != "G33"]
            thread = [tree.made(place, makers.threaded, K=lead, **self._absolutes(given))]
        if row.words or row.assigned:
            self.body.append(tree.Line(place, tuple(row.words), tuple(row.assigned)))
        self.body += thread
        if row.stops:
            self.body.append(tree.row(place, ("G", 4.0), ("P", tree.ZERO)))
        if moved and self.cycle is not None:
            self.body += self.cycle
        if ended and self.source.file:
            self._return(reader)

    def _circle(self, reader: LineTokens, row: Row) -> None:
        """The arc of CIP or CT, which takes the row's coordinates and feed."""
        reader.require(row.arc, EACH_LINE, 0)
        given = self._absolutes(row.take("XYZF"))
        self.body.append(tree.made(reader.place, _ARCS[row.arc], **row.through, **given))

    def _word(self, reader: LineTokens, name: str, at: int) -> list[tree.Word]:
        """The words of RS274NGC for one word. Raises ProgramFault."""
        number = float(name[1:]) if reader.tokens[reader.next - 1].kind == "word" else None
        letter = name[0] if number is not None else re.sub(r"\d+\Z", "", name)
        if letter == "G" and number is not None and number == int(number):
            return self._code(reader, int(number), at)
        if name in ("CR", "TURN", "ADIS", "ADISPOS"):
            reader.expect("=")
            value = reader.expression()
            letter = "R" if name == "CR" else "P"
            # the last but one is the tolerance of feed moves; ADISPOS is that of rapid ones
            value = value + tree.ONE if name == "TURN" else value
            return [] if name == "ADISPOS" else [tree.word(letter, at, value)]
        if name in tables.REFUSED and (number is None or reader.peek() == "="):  # C5 alone is the axis C at 5
            raise reader.fault(tables.refusal(name), at - reader.start)
        spindle = name[1:] if letter in set("SMHTD") and name != letter and number is None else ""
        if len(letter) != 1 or letter not in _WORDS or (number is None and reader.peek() != "="):
            unknown = tables.OF_CONTROL if name[:1] == "$" else tables.UNKNOWN
            raise reader.fault(f"{name}: {unknown.format(name)}", at - reader.start)
        given = tree.Number(number) if number is not None else self._given(reader, letter, at)
        if letter == "D":
            self.body.append(assumed_row(reader.place, "tool offset"))
        # A tool by its name has no number; other spindles, functions of the machine (H) move nothing.
        nothing = given is None or letter in "DH" or spindle not in ("", _MAIN)
        return [] if nothing else [tree.word(letter, at, given)]  # type: ignore[arg-type]

    def _code(self, reader: LineTokens, code: int, at: int) -> list[tree.Word]:
        if code in (90, 91):
            self.absolute = code == 90
            reader.require(reader.peek() != "(", f"G{code}(...) is not read")
        self.normal = PLANES.get(code, self.normal)
        self.inverse_time = code == 93 or (self.inverse_time and code not in tables.FEED_MODES)
        if code in (70, 71, 700, 710):  # F beside it is in the new unit
            self.body.append(tree.row(reader.place._replace(at=at), ("G", tables.CODES[code][0])))
            unit = MM_PER_INCH if code in (70, 700) else 1.0
            self.feed_factor = self.source.unit / unit if code in (70, 71) else 1.0
            return []
        if f"G{code}" in tables.REFUSED and not (code == 451 and not self.compensates):
            raise reader.fault(tables.refusal(f"G{code}"), at - reader.start)
        if code in (62, 621):
            self.body.append(assumed_row(reader.place, "corner feed"))
        if code in (41, 42) and b"CFTCP" not in self.source.words.data:
            self.body.append(assumed_row(reader.place, "tool centre feed"))
        if code == 500:
            origin = (("G", 10.0), ("L", 2.0), ("P", 9.0), ("X", 0.0), ("Y", 0.0), ("Z", 0.0))
            self.body.append(tree.row(reader.place._replace(at=at), *origin))
        if code in (*_SIDES, 9, *_TAPS, 110, 111, 112, 25, 26):
            return [tree.word("G", at, float(code))]
        if code in (74, 75):
            return self._home(reader, code, at)
        text = f"G{code}: no G code of a Sinumerik that is read; write what it does there in other codes"
        reader.require(code in tables.CODES, text, at - reader.start)
        more = []
        if code >= tables.SYSTEMS_FURTHER + 5 and tables.CODES[code] == (54.1,):
            more = [tree.word("P", at, float(code - tables.SYSTEMS_FURTHER))]
        if code in (96, 961, 962) and self.fastest is not None:
            more = [tree.word("D", at, self.fastest)]
        return [*(tree.word("G", at, one) for one in tables.CODES[code]), *more]


def _skip(reader: LineTokens) -> None:
    """Go past what stands in brackets behind a command, and behind its equals sign."""
    depth = 0
    while reader.peek() in ("(", "[") or depth:
        reader.require(not reader.ended, ") is missing")
        found = reader.pop().text
        depth += (found in ("(", "[")) - (found in (")", "]"))
    if reader.take("="):
        if reader.kind() == "text":
            reader.pop()
        else:
            reader.expression()


# What is read by its name. A new command is a line here and a method above.
COMMANDS: dict[str, Callable[[BlockWords, LineTokens, Row], None]] = {
    **dict.fromkeys(tables.IDLE, BlockWords._idle),
    **dict.fromkeys(tables.SAID, BlockWords._assumed),
    **dict.fromkeys(_ARCS, BlockWords._arc),
    **dict.fromkeys(CORNERS, BlockWords._corner),
    **dict.fromkeys(
        (*cycles.ARGUMENTS, "CYCLE800", "CYCLE832"), lambda words, reader, row: words._cycle(reader)
    ),
    **dict.fromkeys(("AP", "RP"), BlockWords._polar_word),
    **dict.fromkeys(("SUPA", "STOPRE", "DIAMON", "DIAMOF", "OVR", "RNDM"), BlockWords._alone),
    **dict.fromkeys(
        (*makers.FRAMES, *(f"A{one}" for one in makers.FRAMES)),
        lambda words, reader, row: words._frame(reader),
    ),
    "FGROUP": BlockWords._feed_axes,
}
