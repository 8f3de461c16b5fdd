"""Statements that move nothing: the program's units, tool calls, definitions of cycles, M codes.

Source: HEIDENHAIN TNC 640 (34059x), conversational programming, M functions of path behaviour and of rotary
axes.
"""

import re

from planner.base.units import MM_PER_INCH
from planner.nc.codes import M_GROUP
from planner.nc.language import tree
from planner.nc.language.heidenhain import cycles, moves, tables, text
from planner.nc.language.heidenhain.flow import Flow, called_file
from planner.nc.language.heidenhain.moves import Moves
from planner.nc.language.making import Given, Making, assumed_row
from planner.nc.language.source import Source
from planner.nc.language.tree import ZERO, Line, Return, row, word
from planner.nc.settings import TOOL_POINT_OFF, TOOL_POINT_ON, UNKNOWN_M, setting
from planner.nc.state import NAMED

_VALUE = r"\s*(?:[-+]?\s*(?:\d+\.?\d*|\.\d+|Q[LR]?\d+))"
_LENGTHS, _OVERSIZE = r"\s*(L|R)(?=[-+.\dQ\s])", r"\s*(DL|DR2|DR):?(?=[-+.\dQ\s])"
_Q, _TO_THE_TOP = (re.compile(pattern, re.IGNORECASE) for pattern in (r"Q(\d+)\s*=\s*", r"MB\s*MAX"))
_TOOL_DEF = rf"\s*(?:(\d+)(?:\.\d+)?|(\"[^\"]*\"))?((?:\s*[LR]{_VALUE})*)\s*$"
_TOOL_CALL = (
    r"\s*(?:(\d+|Q[LR]?\d+)(?:\.\d+)?|(\"[^\"]*\"))?\s*([XYZ])?\s*(?:S\s*([\d.]+|Q[LR]?\d+))?"
    rf"\s*(?:F\s*([\d.]+|Q[LR]?\d+|MAX))?((?:\s*(?:DL|DR2|DR):?{_VALUE})*)\s*$"
)
READ = (*cycles.CYCLES, *cycles.PATTERNS)
_OLD_PECKING = (200, 201, 202, 211, 206)  # Q parameters that the lines 1.1 to 1.5 of cycle 1 give
_OLD_WORD = r"\s*(?:SET\s?UP|DIST|ABST|DEPTH|TIEFE|PLNGNG|PECKG|ZUSTLG|DWELL|V\.?\s?ZEIT|F)\s*"
# Q parameters that are read where they are 0 only.
_TIP = "is by the angle of the tip, of the control's tool table; write 0, and the depth of the tip as Q201"
_REFUSED = {
    343: f"Q343 1, a depth by the diameter Q344, {_TIP}",
    395: f"Q395 1, a depth of the full diameter, {_TIP}",
    365: "Q365 1, moves between the places on the circle, is not read; write 0",
    439: "Q439, another reference of the feed, is not read; write 0",
}
# Q of the feed out, and the largest feed that cycles take, as the control has it.
_FEED_OUT, _FEED_MAX = 208, 99999.0
REMEDY = "let the CAM system write the moves out as L, C and CC"


def _named(block: text.Block, names: str, start: int, end: int) -> dict[str, tree.Expression]:
    """The values behind names, in a part of a block. Raises ProgramFault for a name that comes twice."""
    found: dict[str, tree.Expression] = {}
    block.column = start
    while block.text[block.column : end].strip():
        at, name = block.column, block.take(names)
        assert name is not None
        if name[1].upper() in found:
            raise block.fault(f"a second {name[1].upper()} in this block", at)
        found[name[1].upper()] = block.value()
    return found


def _oversize(making: Making, given: Given) -> None:
    """DR of a tool call, by which the tool's radius is larger than in its table until the next call."""
    making.travel.oversize = given["DR"] * making.unit


def _not_read(cycle: int) -> str:
    read = sorted({*READ, *tables.SAID_CYCLES, 9, 12, 19, 32, *moves.TITLES})
    why = tables.REFUSED_CYCLES.get(cycle, "what it does is not known here")
    return f"cycle {cycle} is not read: {why}; {REMEDY}; read are {', '.join(map(str, read))}"


def _code_not_read(code: int) -> str:
    return f"M{code} is not read: {tables.REFUSED[code]}; {REMEDY}"


def is_of_the_builder(code: int) -> bool:
    """True if an M code of the builder would be taken for one of RS274NGC or of a printer."""
    found = setting("M", 10 * code, "", "")
    of_printers = found is not None and found.what is not UNKNOWN_M
    of_codes = code < tables.OF_PATHS and code != tables.ORIENTATION and 10 * code in M_GROUP
    return code > tables.OWN_LAST and (of_printers or of_codes)


class Definitions(Flow):
    """Definitions in force in the file `source`."""

    source: Source

    def __init__(self) -> None:
        super().__init__()
        self.moves = Moves(1.0)  # path functions, with the feed of the tool call
        self.unit = 1.0  # mm per unit of the program
        self.cycles: set[int] = set()  # numbers of those that the program defines
        self.compensates = False  # a block of the program has RL, RR, APPR or DEP
        self.modal = False  # M89: the cycle is called at every place
        self.shortest = False  # M126: rotary axes go the shortest way
        self.oversizes = False  # a tool call of the program has DR
        self.tool_names: dict[str, int] = {}  # numbers of tools that have names

    def _begin(self, block: text.Block) -> text.Rows:
        inch = block.text.upper().split()[-1] == "INCH"
        self.unit, self.moves.feed_scale = (MM_PER_INCH, 0.1) if inch else (1.0, 1.0)
        codes = (20.0 if inch else 21.0, 90.0, 17.0, 40.0, 91.1, 94.0)
        row = tree.row(block.place, *(("G", code) for code in codes))
        return [row, text.looked_up(block)] if self.file else [row]

    def _end(self, block: text.Block) -> text.Rows:
        return [tree.Return(block.place) if self.file else tree.row(block.place, ("M", 30.0))]

    def _tool(self, block: text.Block) -> text.Rows:
        match = block.take(_TOOL_CALL)
        if match is None:
            raise block.wrong('TOOL CALL takes a number or "name", the axis Z, S, F, DL and DR')
        tool = self._tool_number(match.group(1), match.group(2))
        axis, feed = match.group(3), match.group(5)
        if axis and axis.upper() != "Z":
            raise block.fault(f"tool axis {axis.upper()}; Z is planned", match.start(3))
        more_of = _named(block, _OVERSIZE, *match.span(6))
        if more_of.pop("DR2", tree.ZERO) != tree.ZERO:
            raise block.fault("DR2, of a tool's corner radius, is not read; write 0", match.start(6))
        if more_of and tool is None:
            raise block.fault("DL and DR need the number of the tool in their TOOL CALL", match.start(6))
        rows: text.Rows = []
        if tool is not None:
            number: tree.Expression = tree.number(tool)
            if match.group(1) and not match.group(1).isdecimal():
                block.column = match.start(1)
                number = block.value()
            change, length = (("T", number), ("M", 6.0)), (("G", 43.0), ("H", number))
            rows += [tree.row(block.place, *change), tree.row(block.place, *length)]
            if more_of.get("DL", tree.ZERO) != tree.ZERO:
                rows.append(tree.row(block.place, ("G", 43.2), ("Z", more_of["DL"])))
            if self.oversizes:
                rows.append(tree.made(block.place, _oversize, DR=more_of.get("DR", tree.ZERO)))
        if match.group(4):
            block.column = match.start(4)
            rows.append(tree.row(block.place, ("S", block.value())))
        self.moves.automatic = None
        if feed and feed.upper() != "MAX":
            block.column = match.start(5)
            self.moves.automatic = block.value()
            rows.append(tree.row(block.place, ("F", self.moves.scaled(self.moves.automatic))))
        if tool is not None:
            rows.append(text.looked_up(block))
        return rows

    def _tool_number(self, number: str | None, name: str | None) -> int | None:
        """The number of a tool, and one above all others for a tool with a name."""
        if number:
            return int(number) if number.isdecimal() else 0
        return None if name is None else self.tool_names.setdefault(name, NAMED + len(self.tool_names))

    def _tool_data(self, block: text.Block) -> text.Rows:
        """TOOL DEF: with L or R data from the next call on; without them the tool to have ready."""
        column, match = block.column, block.take(_TOOL_DEF)
        if match is None:
            raise block.wrong("TOOL DEF takes the number of a tool, its length L and its radius R")
        data = _named(block, _LENGTHS, *match.span(3))
        if not data:
            return []
        tool = self._tool_number(match.group(1), match.group(2))
        if tool is None:
            raise block.fault("TOOL DEF with L or R needs the number of the tool", column)
        words = (({"L": "Z", "R": "R"}[name], given) for name, given in data.items())
        return [tree.row(block.place, ("G", 10.0), ("L", tree.ONE), ("P", float(tool)), *words)]

    def _define(self, block: text.Block) -> text.Rows:
        match = block.take(r"\s*(\d+)(?:\.(\d+))?")
        if match is None:
            raise block.wrong("CYCL DEF needs the number of a cycle")
        cycle = int(match[1])
        if match[2] is not None:
            return self._old_cycle(block, cycle, int(match[2]))
        if cycle in tables.SAID_CYCLES:
            return [assumed_row(block.place, tables.SAID_CYCLES[cycle])]
        if cycle not in READ:
            raise block.wrong(_not_read(cycle))
        self.modal = False
        given: list[tuple[tree.Parameter, tree.Expression]] = []
        for entry in _Q.finditer(block.text, block.column):
            q, block.column = int(entry[1]), entry.end()
            number = self._feed_value(block, q)
            if q in _REFUSED and number != tree.ZERO:
                raise block.fault(_REFUSED[q], entry.start())
            given.append((block.known(q, ""), number))
        if cycle in cycles.PATTERNS:
            self._call_cycle(block)
            return [tree.assign(block.place, *given), tree.made(block.place, cycles.PATTERNS[cycle])]
        return [tree.assign(block.place, *given, (text.variable("cycle"), tree.Number(float(cycle))))]

    def _feed_value(self, block: text.Block, q: int) -> tree.Expression:
        """A value of a cycle, a number or F AUTO, MAX, FMAX; Q208 0 is the rapid out."""
        if block.take(r"\s*F\s*AUTO\b"):
            if self.moves.automatic is None:
                raise block.wrong("FAUTO, and the tool call before has no F")
            return self.moves.automatic
        if block.take(r"\s*F?\s*MAX\b"):
            return tree.ZERO if q == _FEED_OUT else tree.Number(_FEED_MAX)
        return block.value()

    def _old_cycle(self, block: text.Block, cycle: int, part: int) -> text.Rows:
        if cycle in (9, 12, 19, 32, *moves.TITLES) and part == 0:
            return []
        if cycle in tables.SAID_CYCLES:
            return [assumed_row(block.place, tables.SAID_CYCLES[cycle])] if part else []
        if cycle == 12:
            block.take(r"\s*PGM\b")
            return self._call_program(block)
        if cycle == 19:
            return moves.working_plane(block)
        if cycle in moves.TITLES:
            return moves.transformed(block, cycle)
        if cycle == 32:
            tolerance = [("P", block.value())] if block.take(r"\s*T\s*(?=[-+.\dQ])") else []
            # 32.1 without T: the machine's tolerance again; 32.2: filter and rotary axes
            return [tree.row(block.place, ("G", 64.0), *tolerance)] if tolerance or part == 1 else []
        if cycle == 9:
            block.take(r"\s*(?:V\.?\s?ZEIT|DWELL|V\.TIME|DW\.TIME)\s*")
            return [tree.row(block.place, ("G", 4.0), ("P", block.value()))]
        if cycle == 1:
            return self._pecking(block, part)
        raise block.wrong(_not_read(cycle))

    def _pecking(self, block: text.Block, part: int) -> text.Rows:
        """Cycle 1: its lines give parameters of cycle 200, and the surface lies below the tool."""
        if part == 0:
            return [tree.assign(block.place, (text.variable("cycle"), tree.ONE))]
        column, match = block.column, block.take(_OLD_WORD)
        if match is None or not 1 <= part <= len(_OLD_PECKING):
            raise block.fault("DIST, DEPTH, PLNGNG (PECKG), DWELL and F of cycle 1 are expected", column)
        value = tree.op("ABS", block.value())  # older controls had the signs of directions in z
        return [tree.assign(block.place, (text.parameter(_OLD_PECKING[part - 1]), value))]

    def _call_cycle(self, block: text.Block) -> text.Rows:
        if not self.cycles & cycles.CYCLES.keys():
            raise block.fault("there is no drilling or milling cycle to call; write CYCL DEF 200 before")
        return [tree.made(block.place, cycles.called)]

    def _codes(
        self, block: text.Block, given: text.Items, *, straight: bool = False
    ) -> tuple[text.Rows, text.Rows, bool]:
        """Statements of M codes before and after the move, and whether it goes by machine coordinates."""
        before: text.Rows = []
        after: text.Rows = []
        machine, nothing = False, set[int](() if self.compensates else tables.OF_COMPENSATION)
        nothing |= set(() if self.source.rotary else tables.OF_ROTARY)
        for code, column in given.codes:
            at = block.byte(column)
            as_it_is = Line(block.place, (word("M", at, float(code)),))
            if code in (89, 99):
                after += self._call_cycle(block)
                self.modal = code == 89
            elif code == 140 and (given.back is not None or _TO_THE_TOP.search(block.text)):
                before += self._retract(block, given)
            elif code in (126, 127):
                self.shortest = code == 126
            elif code in (136, 137):
                before.append(tree.row(block.place, ("G", 95.0 if code == 136 else 94.0)))
            elif code in nothing:
                continue
            elif code == 91 and not straight:
                raise block.fault("M91, machine coordinates, is read in L", column)
            elif code == 91:
                machine = True
            elif code in (13, 14):
                spindle = word("M", at, 3.0 if code == 13 else 4.0)
                before.append(Line(block.place, (spindle, word("M", at, 8.0))))
            elif code in (*TOOL_POINT_ON, *TOOL_POINT_OFF) and self.source.at_tip:
                before += [as_it_is, text.looked_up(block)]
            elif code in tables.REFUSED:
                raise block.fault(_code_not_read(code), column)
            elif code in tables.NOTHING:
                continue
            elif code in tables.AT_END and self.file:
                after.append(Return(block.place))
            elif code in (0, 1, 5, 6, 9, *tables.AT_END):
                after.append(as_it_is)
            elif is_of_the_builder(code):
                # planned and flat programs do not have it: whoever read them would take it for another
                before.append(assumed_row(block.place, "machine code"))
            else:
                before.append(as_it_is)
        return before, after, machine

    def _retract(self, block: text.Block, given: text.Items) -> text.Rows:
        """M140: back along the tool's axis by MB, or to machine zero."""
        if given.back is None:
            return moves.to_the_top(block)
        items = text.Items(feed=None if given.axes else given.feed, fast=given.feed is None)
        return self.moves.straight(block, items, {"Z": text.POSITION["Z"] + given.back})

    def _call_program(self, block: text.Block) -> text.Rows:
        if not (name := called_file(block.rest)):
            raise block.wrong("CALL PGM is followed by the name of a program")
        units = tree.row(block.place, ("G", 21.0 if self.unit == 1.0 else 20.0))
        called = tree.Call(block.place, name, None, block.rest.strip())
        return [called, units, text.looked_up(block)]

    def _codes_alone(self, block: text.Block) -> tuple[text.Rows, text.Rows]:
        column, given = block.column, text.items(block)
        # F of M128 is the largest feed of the axes that follow the tool: the joints' limits are for that
        own = (*TOOL_POINT_ON, 140)  # with a feed of their own
        feed = given.feed is not None and not any(code in own for code, _ in given.codes)
        if given.axes or given.polar or given.turn or feed or given.side is not None:
            refused = (_code_not_read(code) for code, _ in given.codes if code in tables.REFUSED)
            text_of = "only M codes are read here; write the move and its feed with L"
            raise block.fault(next(refused, text_of), column)
        before, after, _ = self._codes(block, given)
        return before, after

    def _code(self, block: text.Block) -> text.Rows:
        """M codes alone, and STOP with some."""
        stops = block.function == "STOP"
        block.column = block.column if stops else 0
        before, after = self._codes_alone(block)
        return [*before, *([row(block.place, ("M", ZERO))] if stops else []), *after]
