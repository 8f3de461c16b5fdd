"""M codes of conversational programs: which are left out, and which are refused, with what they do.

Source: HEIDENHAIN TNC 640 (34059x), conversational programming, M functions of path behaviour and of rotary axes.
"""

from __future__ import annotations

from planner.nc.codes import M_GROUP
from planner.nc.language.heidenhain.definitions import Definitions
from planner.nc.language.heidenhain.items import Items, items, looked_up
from planner.nc.language.heidenhain.text import ConversationalBlock
from planner.nc.language.making import assumed_row
from planner.nc.language.source import Source
from planner.nc.language.tree import ZERO, Line, Return, Statement, row, word
from planner.nc.settings import TOOL_POINT_OFF, TOOL_POINT_ON, UNKNOWN_M, setting

REMEDY = "let the CAM system write the moves out as L, C and CC"
AT_END = (2, 30)  # M codes that end the program
# They move nothing and last nothing: constant speed at corners in lag operation (90), lag and servo gain (105 106), messages about
# replacement tools (107 108), the end of what is refused below (102 111 113 117 127 129 137 145), look-ahead of radius compensation
# (120; gouges are refused), the touch probe's monitoring (141), modal information (142), what happens at an NC stop (148 149), messages
# of limit switches (150).
NOTHING = frozenset(
    (90, 102, 105, 106, 107, 108, 111, 113, 117, 120, 127, 129, 137, 141, 142, 145, 148, 149, 150)
)
OWN_LAST, OF_PATHS = 9, 89  # codes between them belong to the machine's builder, but for 13, 14, 19 and 30
_ORIENTATION = 19  # of the spindle
_MOVES = "it changes how the axes move"
_FEED = "it changes feeds"
REFUSED = {
    89: "it calls a cycle at every place",
    92: "its coordinates refer to a point of the machine",
    94: "it turns rotary axes by whole turns",
    97: "it changes the corners of contours",
    98: "it changes the corners of contours",
    101: "it changes tools by itself",
    103: _FEED,
    104: "it brings an older datum back",
    109: _FEED,
    110: _FEED,
    112: "it puts arcs between lines",
    114: _MOVES,
    115: _MOVES,
    116: _FEED,
    118: "a handwheel moves the axes, too",
    124: "it leaves points out",
    126: _MOVES,
    128: _MOVES,
    130: "its coordinates are not those of the tilted plane",
    136: _FEED,
    138: _MOVES,
    140: "it retracts the tool",
    143: "it changes the datum",
    144: _MOVES,
}


def is_of_the_builder(code: int) -> bool:
    """True if an M code, which is none of this control's, would be taken for one of RS274NGC or of a printer."""
    found = setting("M", 10 * code, "", "")
    of_printers = code > OWN_LAST and found is not None and found.what is not UNKNOWN_M
    return of_printers or (OWN_LAST < code < OF_PATHS and code != _ORIENTATION and 10 * code in M_GROUP)


class Codes(Definitions):
    """Statements of M codes. source : the file"""

    source: Source

    def _codes(
        self, block: ConversationalBlock, given: Items, *, straight: bool = False
    ) -> tuple[list[Statement], list[Statement], bool]:
        """Statements of the M codes of a block before and after its move, and whether it goes in machine coordinates, as `straight`
        moves may."""
        before: list[Statement] = []
        after: list[Statement] = []
        machine = False
        for code, column in given.codes:
            at = block.byte(column)
            own = Line(block.place, (word("M", at, float(code)),))
            if code == 99:
                after += self._call_cycle(block)
            elif code == 91 and not straight:
                raise block.fault("M91, machine coordinates, is read in L", column)
            elif code == 91:
                machine = True
            elif code in (13, 14):
                spindle = word("M", at, 3.0 if code == 13 else 4.0)
                before.append(Line(block.place, (spindle, word("M", at, 8.0))))
            elif code in (*TOOL_POINT_ON, *TOOL_POINT_OFF) and self.source.at_tip:
                before += [own, looked_up(block)]
            elif code in REFUSED:
                raise block.fault(f"M{code} is not read: {REFUSED[code]}; {REMEDY}", column)
            elif code in NOTHING:
                continue
            elif code in AT_END and self.file:
                after.append(Return(block.place))
            elif code in (0, 1, 5, 9, *AT_END):
                after.append(own)
            else:
                # planned and flat programs do not have it: whoever read them would take it for another
                before.append(assumed_row(block.place, "machine code") if is_of_the_builder(code) else own)
        return before, after, machine

    def _codes_alone(
        self, block: ConversationalBlock, column: int
    ) -> tuple[list[Statement], list[Statement]]:
        given = items(block, column)
        # M128 F: the largest feed of what the axes do to follow the tool, which the limits of the joints are for
        feed = given.feed is not None and not any(code in TOOL_POINT_ON for code, _ in given.codes)
        if given.axes or given.polar or given.turn or feed or given.side is not None:
            raise block.fault("only M codes are read here; write the move and its feed with L", column)
        before, after, _ = self._codes(block, given)
        return before, after

    def _code(self, block: ConversationalBlock, column: int) -> list[Statement]:
        before, after = self._codes_alone(block, 0)
        return [*before, *after]

    def _stop(self, block: ConversationalBlock, column: int) -> list[Statement]:
        before, after = self._codes_alone(block, column)
        return [*before, row(block.place, ("M", ZERO)), *after]
