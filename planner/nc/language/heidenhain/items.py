"""Words behind a path function: coordinates, directions, feeds and M codes; and the names of what a running program keeps."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from planner.nc.language.heidenhain.text import ConversationalBlock, own, value
from planner.nc.language.system_variables import FIRST_POSITION
from planner.nc.language.tree import Expression, Line, Number, Numbered, assign

_ITEM = re.compile(
    r"\s*(?:(?P<axis>I?[XYZABCUVW])(?=\s*[-+.\dQ])|(?P<polar>I?P[AR])|DR(?P<turn>[-+])|(?P<comp>R[0LR])(?![\d.])|"
    r"(?P<radius>R)(?=\s*[-+.\dQ])|F\s*(?P<fast>MAX|AUTO)|(?P<unit>F[ZUT])|(?P<feed>F)|M\s*(?P<code>\d+)|"
    r"(?P<ahead>LA)(?=\s*\d))",
    re.IGNORECASE,
)
_ROTARY = ("A", "B", "C")
X, Y, Z = own("x"), own("y"), own("z")
POSITION = {"X": X, "Y": Y, "Z": Z}
POLE = own("cx"), own("cy"), own("cz")
PLANE = own("plane")  # the normal of the pole's plane, 0 to 2
DIRECTION = own("dx"), own("dy")
POLAR = own("pr"), own("pa")


@dataclass
class Items:
    """The words behind a path function.

    axes    : absolute or incremental ("I") coordinates by letter
    polar   : PA, PR, IPA, IPR
    turn    : -1 for DR-, 1 for DR+, 0 where it is not given
    radius  : R of CR
    feed    : F with a number;  fast : FMAX;  automatic : F AUTO
    codes   : M codes, each with its column
    side    : 1 for RL, -1 for RR, 0 for R0, None where none is given
    """

    axes: dict[str, tuple[Expression, bool]] = field(default_factory=dict)
    polar: dict[str, Expression] = field(default_factory=dict)
    turn: int = 0
    radius: Expression | None = None
    feed: Expression | None = None
    fast: bool = False
    automatic: bool = False
    codes: list[tuple[int, int]] = field(default_factory=list)
    side: int | None = None


def items(block: ConversationalBlock, column: int, turning: bool = False) -> Items:
    """Read what stands behind the function; `turning`: absolute coordinates of A, B and C, too. Raises ProgramFault for what a path
    function does not take here."""
    found, text = Items(), block.text
    while text[column:].strip():
        item = _ITEM.match(text, column)
        if item is None:
            raise block.fault(
                f"{text[column:].split()[0]} is not read here",
                column + len(text[column:]) - len(text[column:].lstrip()),
            )
        at, column = item.start() + len(item.group()) - len(item.group().lstrip()), item.end()
        if item["axis"]:
            name = item["axis"].upper()
            if name[-1] not in "XYZ" and not (turning and name in _ROTARY):
                raise block.fault(f"axis {name[-1]} is not planned; X, Y and Z are", at)
            given, column = value(block, column)
            if name[-1] in found.axes:
                raise block.fault(f"a second {name[-1]} in this block", at)
            found.axes[name[-1]] = (given, name[0] == "I")
        elif item["polar"]:
            found.polar[item["polar"].upper()], column = value(block, column)
        elif item["turn"]:
            found.turn = 1 if item["turn"] == "+" else -1
        elif item["comp"]:
            found.side = {"R0": 0, "RL": 1, "RR": -1}[item["comp"].upper()]
        elif item["radius"]:
            found.radius, column = value(block, column)
        elif item["fast"]:
            found.fast, found.automatic = item["fast"].upper() == "MAX", item["fast"].upper() == "AUTO"
        elif item["ahead"]:  # of M120, blocks that the control looks ahead
            _, column = value(block, column)
        elif item["unit"]:
            raise block.fault(
                f"{item['unit'].upper()}, a feed per tooth, turn or time, is not read; write F in mm/min", at
            )
        elif item["feed"]:
            found.feed, column = value(block, column)
        else:
            found.codes.append((int(item["code"]), at))
    return found


def absolute(axis: str, given: tuple[Expression, bool]) -> Expression:
    """The absolute coordinate."""
    return POSITION[axis] + given[0] if given[1] else given[0]


def looked_up(block: ConversationalBlock) -> Line:
    """The position is asked of the interpreter: after an offset has changed, or a move in machine coordinates."""
    where = [Numbered(Number(float(FIRST_POSITION + k))) for k in range(3)]
    return assign(block.place, *zip((X, Y, Z), where, strict=True))


def refuse_arc_axes(block: ConversationalBlock, given: Items) -> None:
    """Arcs of CR and CT lie in the working plane, and so do those of C where all poles do. Raises ProgramFault."""
    if "Z" in given.axes:
        raise block.fault("an arc with Z; a helix is written as CP with IPA")
