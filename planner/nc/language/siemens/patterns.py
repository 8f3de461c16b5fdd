"""Patterns of holes, each drilled by the cycle of MCALL.

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.nc.language.siemens.text import variable
from planner.nc.language.tree import (
    ONE,
    ZERO,
    Expression,
    Loop,
    Number,
    SourcePlace,
    Statement,
    assign,
    op,
    row,
)

ARGUMENTS = {
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
    known = {key: value for key, value in zip(ARGUMENTS[name], given, strict=False) if value is not None}
    missing = [key for key in ARGUMENTS[name] if key not in known and key != "INDA"]
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
