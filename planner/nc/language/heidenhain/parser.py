"""A conversational program as statements (docs/language.md, "Heidenhain", says what is read and refused).

LBL n ... LBL 0 is a subprogram where CALL LBL n calls it, and runs where the program comes to it, too. CALL
LBL n REP m goes back to LBL n m times. The tool axis is Z. FMAX is rapid for its block only.
"""

import re
from collections.abc import Callable

from planner.nc.language import tree
from planner.nc.language.heidenhain import cycles, moves, patterns, text
from planner.nc.language.heidenhain.definitions import REMEDY, Definitions
from planner.nc.language.heidenhain.flow import files, procedure_name
from planner.nc.language.makers import compensate, corner
from planner.nc.language.making import Cycle, assumed_row
from planner.nc.language.run import Dialect
from planner.nc.language.source import Source
from planner.nc.language.system_variables import PositionVariables, position

_FUNCTION = re.compile(
    r"BEGIN PGM|END PGM|BLK FORM|TOOL CALL|TOOL DEF|CALL LBL|CALL PGM|CYCLE? DEF|CYCL CALL|LBL|APPR|DEP|FN|IF(?=[-+Q\d.]|\b)|STOP|"
    r"PLANE RESET|I?[XYZ](?=[-+]?[\d.Q])|RND|CHF|LN|LP|CP|CC|CR|CTP|CT|C|L|"
    r"Q(?=[LRS]?\d+\s*=)|M(?=\s*\d)|\*|FUNCTION RESET|FUNCTION \w+|TRANS \w+|PLANE \w+|PATTERN DEF|DECLARE STRING|\w+",
    re.IGNORECASE,
)
_MOVES = ("L", "LP", "C", "CR", "CT", "CP", "CTP")  # that RND and CHF may follow
_WHY = {
    "LN": "moves with a normal of the surface or a direction of the tool need its compensation in space; angles A, B, C are read",
    **dict.fromkeys(
        ("FL", "FLT", "FC", "FCT", "FPOL", "FSELECT"), "free contours (FK) are completed by the control"
    ),
    **dict.fromkeys(("APPR", "DEP"), "it is followed by LT, LN, CT or LCT"),
}


class HeidenhainParser(Definitions):
    """Statements of a conversational program. Faults of all its blocks are kept in `faults`."""

    def __init__(self, source: Source):
        super().__init__()
        self.source, self.file = source, source.file
        self.faults: list[tree.ProgramFault] = []
        self.places: list[patterns.Place] = []  # of the pattern defined last
        self.skip = False  # the block was read with the one before
        self.poles = False  # a block of it, or of a program beside it, may set a pole

    def parse(self) -> list[tree.Procedure]:
        """The main program under the empty name, and the subprograms that are called, under their labels."""
        self.blocks = tuple(text.blocks(self.source))
        self._find_labels()
        self.compensates = any(moves.COMPENSATES.search(block.text) for block in self.blocks)
        self.oversizes = any(re.match(r"TOOL CALL.*\bDR", b.text, re.IGNORECASE) for b in self.blocks)
        poles = [block.text.upper() for block in self.blocks if re.match(r"CC\b", block.text, re.IGNORECASE)]
        shared = bool(self.file) or any(re.match("CALL PGM", b.text, re.IGNORECASE) for b in self.blocks)
        self.poles = bool(poles) or shared
        self.moves.tilted = shared or any("Z" in pole for pole in poles)
        start = tree.SourcePlace(self.file, 1, self.source.begin)
        main = self._body(0, len(self.blocks))
        procedures = []
        done: set[int] = set()
        while todo := self.called - done:
            done |= todo
            for label in sorted(todo):
                first = self.known[label]
                rest = range(first + 1, len(self.blocks))
                ends = (k for k in rest if re.match(r"LBL\s*0\b", self.blocks[k].text, re.IGNORECASE))
                body = self._body(first, next(ends, len(self.blocks)), True)
                name = procedure_name(label, self.file)
                procedures.append(tree.Procedure(name, self.blocks[first].place, body))
        zeros: list[tree.Parameter] = [text.variable(f"rep{self.file}_{k}") for k in range(self.repeats)]
        if not self.file:
            zeros += [*text.POSITION.values(), *text.POLE, *text.POLAR, text.variable("cycle")]
        set_up = [(one, tree.ZERO) for one in zeros] + [(text.PLANE, tree.number(2))] * (not self.file)
        name = "file" if self.file else ""
        return [tree.Procedure(name, start, [tree.assign(start, *set_up), *main]), *procedures]

    def _find_labels(self) -> None:
        for k, block in enumerate(self.blocks):
            if not block.text.upper().startswith("LBL"):
                if number := block.take(r"CYCLE? DEF\s+(\d+)"):
                    self.cycles.add(int(number[1]))
                continue
            try:
                block.column = 3
                label = self._label(block)
            except tree.ProgramFault:
                continue
            if label:
                self.known.setdefault(label, k)

    def _body(self, first: int, last: int, called: bool = False) -> text.Rows:
        """Statements of blocks `first` to `last` - 1; faults of `called` subprograms are known already."""
        body: text.Rows = []
        faults, self.skip = len(self.faults), False
        for k in range(first, last):
            try:
                if not self.skip:
                    body += self._block(k, last)
                else:
                    self.skip = False
            except tree.ProgramFault as fault:
                self.faults.append(fault)
        if called:
            del self.faults[faults:]
            body.append(tree.Return(self.blocks[last - 1].place))
        return body

    def _block(self, k: int, last: int) -> text.Rows:
        block = self.blocks[k]
        match = _FUNCTION.match(block.text)
        name = " ".join(match.group().upper().split()) if match else ""
        along = name[-1:] in set("XYZ") and name.lstrip("I") == name[-1:]  # an axis alone, without L
        name = "L" if along else name
        read = _READ.get(name)
        block.require(name not in ("RND", "CHF"), "RND and CHF stand behind a move: L, LP, C, CR, CT or CP")
        if match is None or read is None:
            why = f" ({_WHY[name]})" if name in _WHY else ""
            if name[:1] == "G" and name[1:].isdigit():
                why = "; a program in G codes is read without --dialect heidenhain"
            what = f"{name or block.text[:20]} of the conversational language"
            raise block.fault(f"{what} is not read{why}; {REMEDY}")
        block.function, block.column = name, 0 if along else match.end()
        if name not in _MOVES:
            return read(self, block)
        corner = self._corner(k + 1, last)
        self.skip = bool(corner)
        return [*corner, *read(self, block)]

    def _ends(self, block: text.Block, given: text.Items) -> dict[str, tree.Expression]:
        block.require(not given.polar, "polar coordinates belong to LP and CP")
        ends = {axis: text.absolute(axis, found) for axis, found in given.axes.items()}
        for axis in ends.keys() & set("ABC") if self.shortest else ():
            ends[axis] = position(axis) + tree.op("WRAPPED", ends[axis] - position(axis))
        return ends

    def _straight(self, block: text.Block) -> text.Rows:
        given, name = text.items(block, self.source.rotary), block.function
        before, after, machine = self._codes(block, given, straight=name == "L")
        if machine and any(relative for _, relative in given.axes.values()):
            raise block.fault("an incremental coordinate with M91 is not read; write the machine coordinate")
        lines: text.Rows = [*before, *self._side(block, given)]
        mixed = given.axes.keys() & set("XYZ") and given.axes.keys() - set("XYZ")
        if mixed and not given.fast and not self.source.at_tip:
            lines.append(assumed_row(block.place, "feed of linear axes"))
        if name == "LP":
            self._need_pole(block)
            lines += self.moves.to_polar(block, given)
        else:
            lines += self.moves.straight(block, given, self._ends(block, given), machine)
        calls = any(code in (89, 99) for code, _ in given.codes)
        if self.modal and {"X", "Y"} & given.axes.keys() and not calls:
            after = [*self._call_cycle(block), *after]
        return [*lines, *([text.looked_up(block)] if machine else []), *after]

    def _corner(self, k: int, last: int) -> text.Rows:
        """RND or CHF in block k, which the move before it ends with."""
        block = self.blocks[k] if k < last else None
        if block is None or not (match := re.match(r"(RND|CHF)\b", block.text, re.IGNORECASE)):
            return []
        block.column, rounded = match.end(), match[1].upper() == "RND"
        if rounded:
            block.take(r"\s*R(?=\s*[-+.\dQ])")
        number = block.value()
        feed = None
        if block.take(r"\s*F\s*(?=[-+.\dQA])"):
            feed = self.moves.automatic if block.take(r"AUTO\b") else block.value()
        block.end("nothing but a feed may follow the number of RND and CHF")
        feed = None if feed is None else self.moves.scaled(feed)
        return [corner(block.place, "RND" if rounded else "CHR", number, feed=feed)]

    def _arc(self, block: text.Block) -> text.Rows:
        name, given = block.function, text.items(block)
        before, after, _ = self._codes(block, given)
        before += self._side(block, given)
        if name == "CTP":
            self._need_pole(block)
            rows = self.moves.to_polar(block, given)
        elif name == "CP":
            rows = self.moves.polar_arc(block, given)
        elif (name != "C" or not self.moves.tilted) and "Z" in given.axes:
            raise block.fault("an arc with Z; a helix is written as CP with IPA")
        else:
            how = {"C": self.moves.circle, "CR": self.moves.radius_arc, "CT": self.moves.tangent_arc}[name]
            rows = how(block, given, self._ends(block, given))
        if name in ("C", "CP"):
            self._need_pole(block)
        return [*before, *rows, *after]

    def _need_pole(self, block: text.Block) -> None:
        block.require(self.poles, "there is no pole: write CC before")

    def _side(self, block: text.Block, given: text.Items) -> text.Rows:
        if given.side is None or not self.compensates:
            return []
        return [tree.made(block.place, compensate, side=given.side)]

    def _approach(self, block: text.Block) -> text.Rows:
        rows, given = moves.approach_rows(block, self.moves)
        before, after, _ = self._codes(block, given)
        return [*before, *rows, *after]

    def _pole(self, block: text.Block) -> text.Rows:
        column, given = block.column, text.items(block)
        ends = self._ends(block, given) if given.axes else {axis: text.POSITION[axis] for axis in "XY"}
        why = "the plane of a pole is that of its two coordinates; write CC with both of them"
        block.require(len(ends) != 3 and (len(ends) != 1 or not self.moves.tilted), why, column)
        named = [(text.POLE["XYZ".index(axis)], end) for axis, end in ends.items()]
        normal = 2 if len(ends) == 1 else next(k for k in range(3) if "XYZ"[k] not in ends)
        return [tree.assign(block.place, *named, (text.PLANE, normal))]

    def _cycle_call(self, block: text.Block) -> text.Rows:
        if block.take(r"\s*PAT\b"):
            return self._at_pattern(block)
        if not block.take(r"\s*POS\b"):
            block.take(r"\s*M\s*$")  # of older controls
            before, after = self._codes_alone(block)
            return [*before, *self._call_cycle(block), *after]
        given = text.items(block)
        before, after, _ = self._codes(block, given)
        ends = {axis: end for axis, end in self._ends(block, given).items() if axis != "Z"}
        shift = given.axes.get("Z", (tree.ZERO, False))[0]
        return [*before, *self._at_place(block, given, ends, shift, cycles.freed), *after]

    def _at_place(
        self, block: text.Block, given: text.Items, ends: moves.Ends, shift: tree.Expression, up: Cycle
    ) -> text.Rows:
        """The cycle at a place, its surface (Q203) moved by a shift; `up` leads to the height of the way there."""
        surface = text.parameter(203)
        return [
            tree.assign(block.place, (surface, surface + shift)),
            tree.made(block.place, up),
            *self.moves.straight(block, given, ends),
            *self._call_cycle(block),
            tree.assign(block.place, (surface, surface - shift)),
        ]

    def _pattern(self, block: text.Block) -> text.Rows:
        self.places = patterns.places(block)
        return []

    def _at_pattern(self, block: text.Block) -> text.Rows:
        """CYCL CALL PAT: the cycle at each place of the PATTERN DEF before, at rapid between them."""
        before, after, _ = self._codes(block, text.items(block))
        if not self.places:
            raise block.fault("CYCL CALL PAT, and no PATTERN DEF before it; tables of points are not read")
        rows: text.Rows = [*before]
        for x, y, z in self.places:
            rows += self._at_place(block, text.Items(fast=True), {"X": x, "Y": y}, z, cycles.raised)
        return [*rows, tree.made(block.place, cycles.raised), text.looked_up(block), *after]

    def _tool_point(self, block: text.Block) -> text.Rows:
        """FUNCTION TCPM and FUNCTION RESET TCPM, as M128 and M129."""
        ends, others = block.function == "FUNCTION RESET", "AXIS SPAT, F CONT or PATHCTRL VECTOR"
        if not ends and re.search(r"AXIS\s+SPAT|F\s+CONT|PATHCTRL\s+VECTOR", block.text, re.IGNORECASE):
            raise block.fault(f"FUNCTION TCPM with {others} is not read; write F TCP AXIS POS PATHCTRL AXIS")
        if ends and not self.source.at_tip:
            return []
        return self._codes(block, text.Items(codes=[(129 if ends else 128, 0)]))[0]


_READ: dict[str, Callable[[HeidenhainParser, text.Block], text.Rows]] = {
    "BEGIN PGM": HeidenhainParser._begin,
    "END PGM": HeidenhainParser._end,
    **dict.fromkeys(("BLK FORM", "*", "FUNCTION MODE", "DECLARE STRING"), lambda parser, block: []),
    **dict.fromkeys(("FUNCTION TCPM", "FUNCTION RESET"), HeidenhainParser._tool_point),
    **dict.fromkeys(moves.PLANES, lambda parser, block: moves.plane_rows(block)),
    "PATTERN DEF": HeidenhainParser._pattern,
    "TOOL DEF": HeidenhainParser._tool_data,
    "TOOL CALL": HeidenhainParser._tool,
    **dict.fromkeys(("L", "LP"), HeidenhainParser._straight),
    **dict.fromkeys(("C", "CR", "CT", "CP", "CTP"), HeidenhainParser._arc),
    **dict.fromkeys(("APPR", "DEP"), HeidenhainParser._approach),
    **dict.fromkeys(("TRANS DATUM", *moves.TRANSFORMED), lambda parser, block: moves.datum_rows(block)),
    "CC": HeidenhainParser._pole,
    "LBL": HeidenhainParser._label_here,
    "CALL LBL": HeidenhainParser._call,
    "CALL PGM": HeidenhainParser._call_program,
    "Q": HeidenhainParser._parameter,
    "FN": HeidenhainParser._fn,
    "IF": HeidenhainParser._jump,
    **dict.fromkeys(("CYCL DEF", "CYCLE DEF"), HeidenhainParser._define),
    "CYCL CALL": HeidenhainParser._cycle_call,
    **dict.fromkeys(("STOP", "M"), HeidenhainParser._code),
}


DIALECT = Dialect(text.LANGUAGE, PositionVariables, HeidenhainParser, files)
