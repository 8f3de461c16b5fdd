"""Drilling cycles CYCLE81, CYCLE82 and CYCLE83, at the present place.

    RTP retract plane    RFP reference plane    SDIS distance above it    DP depth, or DPR depth below the reference plane
    DTB dwell at the bottom    FDEP first depth, or FDPR    DAM decrement    DTS dwell above    VARI 1: retract to above the part

The tool goes to RFP + SDIS at rapid speed, drills, stands at the bottom and goes back to RTP. CYCLE83 drills by infeeds: the first to
FDEP, each of the others less by DAM, but not less than DAM, until the depth is reached; between them it goes back to RFP + SDIS
(VARI 1), or by 1 mm to break the chip (VARI 0).

Patterns of holes, each drilled by the cycle of MCALL.

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from planner.nc.language.siemens.text import variable
from planner.nc.language.tree import (
    ONE,
    ZERO,
    Expression,
    If,
    Line,
    Loop,
    Number,
    SourcePlace,
    Statement,
    assign,
    op,
    row,
)

PATTERNS = {
    "HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"),
    "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
}
_TURN = Number(360.0)  # [degrees]


def pattern_rows(
    place: SourcePlace, name: str, given: Sequence[Expression | None], drilled: Sequence[Statement]
) -> list[Statement]:
    """Moves to the holes with the statements of their cycle behind each.

    Raises ValueError for arguments that are missing.
    """
    known = {key: value for key, value in zip(PATTERNS[name], given, strict=False) if value is not None}
    missing = [key for key in PATTERNS[name] if key not in known and key != "INDA"]
    if missing:
        raise ValueError(f"{name} needs {missing[0]}")
    n, angle, radius = variable("_hole"), variable("_angle"), variable("_radius")
    if name == "HOLES1":
        along, turned = known["FDIS"] + n * known["DBH"], known["STA1"]
        first = known["SPCA"], known["SPCO"]
    else:
        step = known.get("INDA", ZERO)
        even = op("EQ", step, ZERO)  # 1 where the holes are spread evenly
        along, turned = known["RAD"], known["STA1"] + n * (step + even * (_TURN / known["NUM"]))
        first = known["CPA"], known["CPO"]
    x, y = (start + radius * op(part, angle) for start, part in zip(first, ("COS", "SIN"), strict=True))
    turn: list[Statement] = [
        assign(place, (angle, turned), (radius, along)),
        row(place, ("G", ZERO), ("X", x), ("Y", y)),
        *drilled,
        assign(place, (n, n + ONE)),
    ]
    loop = Loop(place, "while", f"{name} {place.at}", op("LT", n, known["NUM"]), turn)
    return [assign(place, (n, ZERO)), loop]


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
    clear = known["RFP"] + op("ABS", known["SDIS"])
    bottom = _depth(known, name, "DP", "DPR")

    def go(z: Expression, code: float) -> Line:
        return row(place, ("G", code), ("Z", z))

    def dwell(key: str) -> list[Statement]:
        if key not in known:
            return []
        return [If(place, ((op("GT", known[key], ZERO), [row(place, ("G", 4.0), ("P", known[key]))]),), [])]

    if name != "CYCLE83":
        return [go(clear, 0.0), go(bottom, 1.0), *dwell("DTB"), go(known["RTP"], 0.0)]
    depth, step = variable("_depth"), variable("_step")
    first, less = _depth(known, name, "FDEP", "FDPR"), op("ABS", known.get("DAM", ZERO))
    above = [go(clear, 0.0), *dwell("DTS"), go(depth + Number(_BEFORE / unit), 0.0)]
    chip: list[Statement] = [go(depth + Number(_BREAK / unit), 0.0)]
    smaller = assign(place, (step, op("MAX", step - less, less)))
    turn: list[Statement] = [
        *dwell("DTB"),
        If(place, ((op("NE", known.get("VARI", ZERO), ZERO), above),), chip),
        If(place, ((op("GT", less, ZERO), [smaller]),), []),
        assign(place, (depth, op("MAX", depth - step, bottom))),
        go(depth, 1.0),
    ]
    return [
        go(clear, 0.0),
        assign(place, (depth, op("MAX", first, bottom)), (step, known["RFP"] - first)),
        go(depth, 1.0),
        Loop(place, "while", f"holes {place.at}", op("GT", depth, bottom), turn),
        *dwell("DTB"),
        go(known["RTP"], 0.0),
    ]


def _depth(known: Mapping[str, Expression], name: str, absolute: str, below: str) -> Expression:
    """A depth from the argument that has it, or the one that has it below the reference plane. Raises ValueError without either."""
    if absolute in known:
        return known[absolute]
    if below not in known:
        raise ValueError(f"{name} needs {absolute} or {below}")
    return known["RFP"] - op("ABS", known[below])
