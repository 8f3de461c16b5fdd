"""PATTERN DEF: places by their numbers.

    POSn (X Y Z)                                         a place;  Z is added to the cycle's surface (Q203)
    ROWn (X Y D NUM ROT Z)                               a row:  (X, Y) + k D (cos ROT, sin ROT)
    PATn (X Y DX DY NUMX NUMY ROT ROTX ROTY Z)           a grid, line by line, to and fro; FRAMEn its frame
    CIRCn (X Y D START NUM Z), PITCHCIRCn (.. STEP ..)   a circle of diameter D

Source: HEIDENHAIN TNC 640, cycle programming, PATTERN DEF. Grids with ROTX or ROTY other than 0 are refused.
"""

import math

from planner.nc.language import tree
from planner.nc.language.heidenhain.text import Block

Place = tuple[tree.Expression, tree.Expression, tree.Expression]
_ITEM = r"\s*(POS|ROW|PAT|FRAME|CIRC|PITCHCIRC)(\d+)\s*\("
_WORD = r"\s*(NUMX|NUMY|NUM|ROTX|ROTY|ROT|DX|DY|START|STEP|X|Y|Z|D)\s*(?=[-+.\dQ])"


def places(block: Block) -> list[Place]:
    """The places of a PATTERN DEF. Raises ProgramFault."""
    found: list[Place] = []
    while block.rest.strip():
        item = block.take(_ITEM)
        if item is None:
            raise block.wrong("POS1 ( ... ), ROW1, PAT1, FRAME1, CIRC1 or PITCHCIRC1 is expected here")
        given = block.named(_WORD)
        if not block.take(r"\s*\)"):
            raise block.wrong("a value of the pattern is expected here, such as X+25")
        found += _of(block, item[1].upper(), given)
    return found


def _of(block: Block, kind: str, given: dict[str, tree.Expression]) -> list[Place]:
    first = [given.get(axis, tree.ZERO) for axis in "XYZ"]

    def number(name: str) -> float:
        value = given.get(name, tree.ZERO)
        if not isinstance(value, tree.Number):
            raise block.fault(f"{name} of {kind} is a number here; Q parameters stand for X, Y, Z")
        return value.value

    def at(x: float, y: float) -> Place:
        return first[0] + tree.Number(x), first[1] + tree.Number(y), first[2]

    if kind == "POS":
        return [(first[0], first[1], first[2])]
    if kind in ("CIRC", "PITCHCIRC"):
        count = round(number("NUM"))
        step = number("STEP") if kind == "PITCHCIRC" else 360.0 / max(count, 1)
        angles = [math.radians(number("START") + k * step) for k in range(count)]
        return [at(number("D") / 2.0 * math.cos(a), number("D") / 2.0 * math.sin(a)) for a in angles]
    if number("ROTX") or number("ROTY"):
        raise block.fault(f"{kind} with ROTX or ROTY is not read; write its places as POS1 (X Y Z)")
    turn = complex(math.cos(math.radians(number("ROT"))), math.sin(math.radians(number("ROT"))))
    if kind == "ROW":
        spots = [complex(k * number("D"), 0.0) for k in range(round(number("NUM")))]
    else:
        columns, lines = round(number("NUMX")), round(number("NUMY"))
        spots = []
        for line in range(lines):
            for column in range(columns)[:: -1 if line % 2 else 1]:
                edge = column in (0, columns - 1) or line in (0, lines - 1)
                if kind == "PAT" or edge:
                    spots.append(complex(column * number("DX"), line * number("DY")))
    return [at((turn * spot).real, (turn * spot).imag) for spot in spots]
