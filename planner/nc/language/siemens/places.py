"""Where a line of a Sinumerik program leads: its words so far, poles, polar coordinates, reference points, dwells."""

import re
from dataclasses import dataclass, field

from planner.nc.arcs import IN_PLANE
from planner.nc.language import tree
from planner.nc.language.makers import dwell_turns
from planner.nc.language.siemens.commands import Commands
from planner.nc.language.siemens.text import LineTokens
from planner.nc.language.system_variables import position

AXES = "XYZ"


def _polar(name: str) -> tree.Named:
    """The pole (x, y, z), the radius and the angle of the last polar coordinates."""
    return tree.Named(f"_polar {name}", True)


@dataclass
class Row:
    """The words of a line so far."""

    words: list[tree.Word] = field(default_factory=list)
    assigned: list[tuple[tree.Parameter, tree.Expression]] = field(default_factory=list)
    before: list[tree.Statement] = field(default_factory=list)  # corners and compensation, before the row
    codes: set[float] = field(default_factory=set)  # numbers of its G codes
    arc: str = ""  # CIP or CT
    through: dict[str, tree.Expression] = field(default_factory=dict)  # I1 J1 K1 of CIP
    polar: list[tuple[tree.Parameter, tree.Expression]] = field(default_factory=list)  # AP and RP
    stops: bool = False  # it ends in a full stop
    corner: bool = False  # it ends in a rounding or chamfer

    def has(self, letters: str) -> bool:
        """True if there is a word with one of the letters."""
        return any(word.letter in letters for word in self.words)

    def take(self, letters: str) -> dict[str, tree.Expression]:
        """The values of words by their letters, which are taken out of the row."""
        found = {word.letter: word.value for word in self.words if word.letter in letters}
        self.words = [word for word in self.words if word.letter not in letters]
        return found


class Places(Commands):
    """normal : of the plane that the text has chosen;  turns : the motion code in force in it is G2 or G3"""

    normal = 2
    turns = False

    def _polar_word(self, reader: LineTokens, row: Row) -> None:
        name = reader.peek(-1)
        reader.expect("=")
        kind = reader.peek() if reader.peek() in ("AC", "IC") and reader.peek(1) == "(" else ""
        reader.next += bool(kind)
        value, target = reader.expression(), _polar(name.lower())
        if not kind and not self.absolute and name == "AP":
            raise reader.fault("AP under G91 is not read; write AP=IC(angle) or AP=AC(angle)", 0)
        row.polar.append((target, target + value if kind == "IC" else value))

    def _pole(self, reader: LineTokens, row: Row, code: int) -> None:
        """G110, G111, G112 with coordinates in the plane, or AP and RP."""
        plane = [AXES[k] for k in IN_PLANE[self.normal]]
        base = [{110: position(axis), 111: tree.ZERO, 112: _polar(axis)}[code] for axis in plane]
        given = row.take("XYZG")
        if row.polar:
            self.body.append(tree.assign(reader.place, *row.polar))
            way = [_polar("rp") * tree.op(part, _polar("ap")) for part in ("COS", "SIN")]
        else:
            way = [given.get(axis, tree.ZERO) for axis in plane]
        if set(given) - {*plane, "G"}:
            raise reader.fault("a pole lies in the plane (G17, G18, G19)", 0)
        pairs = ((_polar(axis), one + step) for axis, one, step in zip(plane, base, way, strict=True))
        self.body.append(tree.assign(reader.place, *pairs))

    def _to_polar(self, reader: LineTokens, row: Row) -> None:
        """The row's end by AP and RP, and an arc's centre, which is the pole."""
        plane = IN_PLANE[self.normal]
        if row.has("".join(AXES[k] for k in plane)):
            raise reader.fault("AP and RP stand instead of coordinates in the plane", 0)
        self.body.append(tree.assign(reader.place, *row.polar))
        for k, part in zip(plane, ("COS", "SIN"), strict=True):
            end = _polar(AXES[k]) + _polar("rp") * tree.op(part, _polar("ap"))
            end = end if self.absolute else end - position(AXES[k])
            row.words.append(tree.word(AXES[k], reader.place.at, end))
            if self.turns and not row.has("R"):
                row.words.append(tree.word("IJK"[k], reader.place.at, _polar(AXES[k]) - position(AXES[k])))

    def _home(self, reader: LineTokens, code: int, at: int) -> list[tree.Word]:
        """G74 X1=0: to the reference point of axes; G75: to their fixed point, G28 and G30 here."""
        axes = []
        while reader.kind() and (match := re.fullmatch(r"([XYZABC])1?0?", reader.peek())):
            axes.append(match[1])
            token = reader.pop()
            if token.kind != "word":
                reader.expect("=")
                reader.expression()
        if reader.take("FP"):
            reader.expect("=")
            if reader.expression() != tree.ONE:
                text = "G75 FP other than 1 is not read; write its position with SUPA"
                raise reader.fault(text, at - reader.start)
        words = [(axis, tree.ZERO) for axis in axes]
        self.body.append(tree.row(reader.place, ("G", 91.0), ("G", 28.0 if code == 74 else 30.0), *words))
        return [tree.word("G", at, 90.0 if self.absolute else 91.0)]

    def _dwell(self, reader: LineTokens, row: Row) -> None:
        """G4 F seconds, or S turns of the spindle."""
        given = row.take("FS")
        row.words = [word for word in row.words if word.code != "G4"]
        if "F" in given:
            row.before.append(tree.row(reader.place, ("G", 4.0), ("P", given["F"])))
        elif "S" in given:
            row.before.append(tree.made(reader.place, dwell_turns, turns=given["S"]))
        else:
            raise reader.fault("G4 is followed by F and seconds, or S and turns of the spindle", 0)

    def _absolutes(self, given: dict[str, tree.Expression]) -> dict[str, tree.Expression]:
        """The values with those of axes as absolute ones."""
        relative = "" if self.absolute else AXES
        return {c: position(c) + value if c in relative else value for c, value in given.items()}
