"""Radius compensation, approach to and departure from a contour, and the frame: what
`planner.nc.language.travel` does.

RL RR R0                                    compensation, in any move
APPR LT LN CT LCT  X Y Z LEN R CCA RL F     approach, also without compensation (R0)
DEP LT LN CT LCT  X Y Z LEN R CCA F         departure
CYCL DEF 7 datum shift, 8 mirror image, 10 rotation, 11 scale, 26 scale of single axes; TRANS DATUM AXIS,
TRANS DATUM RESET
"""

from __future__ import annotations

import re
from dataclasses import replace

from planner.nc.language.approach import KINDS
from planner.nc.language.heidenhain.text import POSITION, Block, Items, Rows, absolute, items, looked_up
from planner.nc.language.tree import ZERO, Expression, MadeRows, Number, assign

_EXTRA = re.compile(r"\s*\b(LEN|CCA)\s*(?=[-+.\dQ])", re.IGNORECASE)
COMPENSATES = re.compile(r"\bR[LR]\b|\bAPPR\b|\bDEP\b", re.IGNORECASE)
TITLES = (7, 8, 10, 11, 26)  # cycles of the frame


def approach_rows(block: Block, feed: Expression | None) -> tuple[Rows, Items]:
    """APPR or DEP, with its M codes among the items; `feed` is what F AUTO means. Raises ProgramFault."""
    departs, column = block.function == "DEP", block.column
    kind = block.take(r"\s*(P?)(LT|LN|CT|LCT)\b")
    if kind is None:
        raise block.wrong(f"{block.function} is followed by LT, LN, CT or LCT")
    if kind[1]:
        what = f"{kind[0].strip()}, with polar coordinates, is not read; write {kind[2]} with X and Y"
        raise block.fault(what, column)
    given: list[tuple[str, Expression]] = [("kind", Number(float(KINDS.index(kind.group(2).upper()))))]
    text = block.text
    for extra in _EXTRA.finditer(block.text, kind.end()):
        block.column = extra.end()
        given.append((extra.group(1).upper(), block.value()))
        text = text[: extra.start()] + " " * (block.column - extra.start()) + text[block.column :]
    found = items(replace(block, text=text, column=kind.end()))
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
    rows: Rows = [MadeRows(block.place, "approach", tuple(given))]
    rows.append(assign(block.place, *((POSITION[axis], end) for axis, end in ends.items())))
    return rows, found


def frame_rows(block: Block, given: list[tuple[str, Expression]], cycle: int) -> Rows:
    """A part of the frame; the position is asked for behind it, since it has other coordinates then."""  # fmt: skip
    values = (("cycle", Number(float(cycle))), *given)
    return [MadeRows(block.place, "heidenhain frame", values), MadeRows(block.place, "frame in force"), looked_up(block)]  # fmt: skip


def datum_rows(block: Block) -> Rows:
    """TRANS DATUM AXIS X Y Z, and TRANS DATUM RESET. Raises ProgramFault."""
    match = block.take(r"\s*(AXIS|RESET)\b")
    if match is None:
        raise block.wrong("TRANS DATUM is followed by AXIS and coordinates, or by RESET")
    if match[1].upper() == "RESET":
        return frame_rows(block, [(axis, ZERO) for axis in "XYZ"], 7)
    return frame_rows(block, _shifts(block), 7)


def transformed(block: Block, cycle: int) -> Rows:
    """The line n.1 (or n.2 ...) of a cycle of the frame. Raises ProgramFault."""
    if cycle == 7:
        return frame_rows(block, _shifts(block), 7)
    if cycle == 8:
        axes = block.rest.upper().split()
        if any(axis not in ("X", "Y", "Z") for axis in axes):
            raise block.wrong("a mirror image takes the axes X, Y and Z, or none to end it")
        return frame_rows(block, [(axis, ZERO) for axis in axes], cycle)
    if cycle == 26:
        given = []
        while block.rest.strip():
            axis = block.take(r"\s*(CC[XYZ]|[XYZ])\s*(?=[-+.\dQ])")
            if axis is None:
                raise block.wrong("cycle 26 takes factors X Y Z and their centre CCX CCY CCZ")
            given.append((axis[1].upper(), block.value()))
        return frame_rows(block, given, cycle)
    column, word = block.column, block.take(r"\s*(I?ROT|SCL)\s*")
    if word is None or (word[1].upper() == "SCL") != (cycle == 11):
        raise block.fault("ROT or IROT of cycle 10, or SCL of cycle 11 is expected here", column)
    number = block.value()
    block.end()
    return frame_rows(block, [(word[1].upper(), number)], cycle)


def _shifts(block: Block) -> list[tuple[str, Expression]]:
    column, given = block.column, items(block)
    if not given.axes or given.codes or given.polar or given.feed is not None:
        raise block.fault("a datum shift by X, Y or Z is read, not from a table", column)
    return [("I" * relative + axis, end) for axis, (end, relative) in given.axes.items()]
