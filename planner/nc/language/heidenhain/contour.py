"""Radius compensation, approach to and departure from a contour, and the frame: what `planner.nc.language.travel` does.

RL RR R0                                    compensation, in any move
APPR LT LN CT LCT  X Y Z LEN R CCA RL F     approach, also without compensation (R0)
DEP LT LN CT LCT  X Y Z LEN R CCA F         departure
CYCL DEF 7 datum shift, 8 mirror image, 10 rotation, 11 scale, 26 scale of single axes; TRANS DATUM AXIS, TRANS DATUM RESET
"""

from __future__ import annotations

import re
from dataclasses import replace

from planner.nc.language.approach import KINDS
from planner.nc.language.heidenhain.text import (
    POSITION,
    ConversationalBlock,
    Items,
    absolute,
    items,
    looked_up,
    value,
)
from planner.nc.language.tree import ZERO, Expression, MadeRows, Number, Statement, assign

_KIND = re.compile(r"\s*(P?)(LT|LN|CT|LCT)\b", re.IGNORECASE)
_EXTRA = re.compile(r"\s*\b(LEN|CCA)\s*(?=[-+.\dQ])", re.IGNORECASE)
_COMPENSATES = re.compile(r"\bR[LR]\b|\bAPPR\b|\bDEP\b", re.IGNORECASE)
_DATUM = re.compile(r"\s*(AXIS|RESET)\b", re.IGNORECASE)
_AXIS = re.compile(r"\s*(CC[XYZ]|[XYZ])\s*(?=[-+.\dQ])", re.IGNORECASE)
TITLES = (7, 8, 10, 11, 26)  # cycles of the frame


def compensates(text: str) -> bool:
    """True if a block may switch compensation on or off."""
    return bool(_COMPENSATES.search(text))


def approach_rows(
    block: ConversationalBlock, column: int, feed: Expression | None
) -> tuple[list[Statement], Items]:
    """APPR or DEP, with its M codes among the items. Raises ProgramFault.

    feed : what F AUTO means
    """  # fmt: skip
    departs = block.text[:column].strip().upper() == "DEP"
    kind = _KIND.match(block.text, column)
    if kind is None:
        raise block.fault(f"{'DEP' if departs else 'APPR'} is followed by LT, LN, CT or LCT", column)
    if kind.group(1):
        raise block.fault(
            f"{kind.group().strip()}, with polar coordinates, is not read; write {kind.group(2)} with X and Y",
            column,
        )
    given: list[tuple[str, Expression]] = [("kind", Number(float(KINDS.index(kind.group(2).upper()))))]
    text = block.text
    for extra in _EXTRA.finditer(block.text, kind.end()):
        number, end = value(block, extra.end())
        given.append((extra.group(1).upper(), number))
        text = text[: extra.start()] + " " * (end - extra.start()) + text[end:]
    found = items(replace(block, text=text), kind.end())
    ends = {axis: absolute(axis, number) for axis, number in found.axes.items()}
    given += list(ends.items())
    if found.polar or found.turn or found.fast:
        raise block.fault("APPR and DEP take X Y Z, LEN, R, CCA, RL or RR, and F", column)
    if found.radius is not None:
        given.append(("R", found.radius))
    fed = feed if found.automatic else found.feed
    if fed is not None:
        given.append(("F", fed))
    if departs:
        if found.side:
            raise block.fault("DEP switches radius compensation off; RL and RR do not belong to it", column)
        return [MadeRows(block.place, "depart", tuple(given)), looked_up(block)], found
    given.append(("side", Number(float(found.side or 0))))
    rows: list[Statement] = [MadeRows(block.place, "approach", tuple(given))]
    rows.append(assign(block.place, *((POSITION[axis], end) for axis, end in ends.items())))
    return rows, found


def frame_rows(
    block: ConversationalBlock, given: list[tuple[str, Expression]], cycle: int
) -> list[Statement]:
    """A part of the frame; the position is asked for behind it, since it has other coordinates then."""  # fmt: skip
    values = (("cycle", Number(float(cycle))), *given)
    return [MadeRows(block.place, "heidenhain frame", values), MadeRows(block.place, "frame in force"), looked_up(block)]  # fmt: skip


def datum_rows(block: ConversationalBlock, column: int) -> list[Statement]:
    """TRANS DATUM AXIS X Y Z, and TRANS DATUM RESET. Raises ProgramFault."""
    match = _DATUM.match(block.text, column)
    if match is None:
        raise block.fault("TRANS DATUM is followed by AXIS and coordinates, or by RESET", column)
    if match.group(1).upper() == "RESET":
        return frame_rows(block, [(axis, ZERO) for axis in "XYZ"], 7)
    return frame_rows(block, _shifts(block, match.end()), 7)


def transformed(block: ConversationalBlock, cycle: int, column: int) -> list[Statement]:
    """The line n.1 (or n.2 ...) of a cycle of the frame. Raises ProgramFault."""
    text = block.text[column:]
    if cycle == 7:
        return frame_rows(block, _shifts(block, column), 7)
    if cycle == 8:
        axes = text.upper().split()
        if any(axis not in ("X", "Y", "Z") for axis in axes):
            raise block.fault("a mirror image takes the axes X, Y and Z, or none to end it", column)
        return frame_rows(block, [(axis, ZERO) for axis in axes], cycle)
    if cycle == 26:
        given, at = [], column
        while block.text[at:].strip():
            axis = _AXIS.match(block.text, at)
            if axis is None:
                raise block.fault("cycle 26 takes factors X Y Z and their centre CCX CCY CCZ", at)
            number, at = value(block, axis.end())
            given.append((axis.group(1).upper(), number))
        return frame_rows(block, given, cycle)
    word = re.match(r"\s*(I?ROT|SCL)\s*", text, re.IGNORECASE)
    if word is None or (word.group(1).upper() == "SCL") != (cycle == 11):
        raise block.fault("ROT or IROT of cycle 10, or SCL of cycle 11 is expected here", column)
    number, at = value(block, column + word.end())
    if block.text[at:].strip():
        raise block.fault("nothing may follow here", at)
    return frame_rows(block, [(word.group(1).upper(), number)], cycle)


def _shifts(block: ConversationalBlock, column: int) -> list[tuple[str, Expression]]:
    given = items(block, column)
    if not given.axes or given.codes or given.polar or given.feed is not None:
        raise block.fault("a datum shift by X, Y or Z is read, not from a table", column)
    return [("I" * relative + axis, end) for axis, (end, relative) in given.axes.items()]
