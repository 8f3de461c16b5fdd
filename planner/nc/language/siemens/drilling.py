"""Drilling cycles CYCLE81, CYCLE82 and CYCLE83, at the present place.

    RTP retract plane    RFP reference plane    SDIS distance above it    DP depth, or DPR depth below the reference plane
    DTB dwell at the bottom    FDEP first depth, or FDPR    DAM decrement    DTS dwell above    VARI 1: retract to above the part

The tool goes to RFP + SDIS at rapid speed, drills, stands at the bottom and goes back to RTP. CYCLE83 drills by infeeds: the first to
FDEP, each of the others less by DAM, but not less than DAM, until the depth is reached; between them it goes back to RFP + SDIS
(VARI 1), or by 1 mm to break the chip (VARI 0).
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.nc.language.siemens.text import operation, variable
from planner.nc.language.tree import ZERO, Expression, If, Line, Loop, Number, SourcePlace, Statement, Word

ARGUMENTS = {
    "CYCLE81": ("RTP", "RFP", "SDIS", "DP", "DPR"),
    "CYCLE82": ("RTP", "RFP", "SDIS", "DP", "DPR", "DTB"),
    "CYCLE83": ("RTP", "RFP", "SDIS", "DP", "DPR", "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI"),
}
_BREAK = 1.0  # mm by which the tool goes back to break a chip
_BEFORE = 1.0  # mm above the depth already drilled, where feed begins again


def drilled_rows(
    place: SourcePlace, name: str, given: Sequence[Expression | None], unit: float
) -> list[Statement]:
    """A cycle with its arguments.

    unit : mm per unit of the program

    Raises ValueError for arguments that are missing.
    """
    arguments = dict(zip(ARGUMENTS[name], given, strict=False))
    known = {key: value for key, value in arguments.items() if value is not None}
    for key in ("RTP", "RFP", "SDIS"):
        if key not in known:
            raise ValueError(f"{name} needs {key}")
    clear = operation("+", known["RFP"], operation("ABS", known["SDIS"]))
    if "DP" in known:
        bottom: Expression = known["DP"]
    elif "DPR" in known:
        bottom = operation("-", known["RFP"], operation("ABS", known["DPR"]))
    else:
        raise ValueError(f"{name} needs DP or DPR")

    def go(z: Expression, code: float) -> Line:
        return Line(place, (Word(ord("G"), place.at, Number(code)), Word(ord("Z"), place.at, z)))

    def dwell(key: str) -> list[Statement]:
        if key not in known:
            return []
        row = Line(place, (Word(ord("G"), place.at, Number(4.0)), Word(ord("P"), place.at, known[key])))
        return [If(place, ((operation(">", known[key], ZERO), [row]),), [])]

    found: list[Statement] = [go(clear, 0.0)]
    if name == "CYCLE83":
        found += _by_infeeds(place, known, clear, bottom, unit, go, dwell)
    else:
        found += [go(bottom, 1.0), *dwell("DTB")]
    return [*found, go(known["RTP"], 0.0)]


def _by_infeeds(place, known, clear, bottom, unit, go, dwell) -> list[Statement]:
    depth, step = variable("_depth"), variable("_step")
    if "FDEP" in known:
        first = known["FDEP"]
    elif "FDPR" in known:
        first = operation("-", known["RFP"], operation("ABS", known["FDPR"]))
    else:
        raise ValueError("CYCLE83 needs FDEP or FDPR")
    less = operation("ABS", known.get("DAM", ZERO))
    out = known.get("VARI", ZERO)
    above = [go(clear, 0.0), *dwell("DTS"), go(operation("+", depth, Number(_BEFORE / unit)), 0.0)]
    chip = [go(operation("+", depth, Number(_BREAK / unit)), 0.0)]
    smaller = operation("MAX", operation("-", step, less), less)
    return [
        Line(
            place, (), ((depth, operation("MAX", first, bottom)), (step, operation("-", known["RFP"], first)))
        ),
        go(depth, 1.0),
        Loop(
            place,
            "while",
            f"holes {place.at}",
            operation(">", depth, bottom),
            [
                *dwell("DTB"),
                If(place, ((operation("<>", out, ZERO), above),), chip),
                If(place, ((operation(">", less, ZERO), [Line(place, (), ((step, smaller),))]),), []),
                Line(place, (), ((depth, operation("MAX", operation("-", depth, step), bottom)),)),
                go(depth, 1.0),
            ],
        ),
        *dwell("DTB"),
    ]
