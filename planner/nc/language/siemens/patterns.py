"""Patterns of holes, each drilled by the cycle of MCALL.

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.nc.language.siemens.text import operation, variable
from planner.nc.language.tree import ONE, ZERO, Expression, Line, Loop, Number, SourcePlace, Statement, Word

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
    along = (
        operation("+", known["FDIS"], operation("*", n, known["DBH"])) if name == "HOLES1" else known["RAD"]
    )
    step = known.get("INDA", ZERO)
    if name == "HOLES1":
        turned: Expression = known["STA1"]
    else:
        even = operation("==", step, ZERO)  # 1 where the holes are spread evenly
        by = operation("+", step, operation("*", even, operation("/", _TURN, known["NUM"])))
        turned = operation("+", known["STA1"], operation("*", n, by))
    first = ("SPCA", "SPCO") if name == "HOLES1" else ("CPA", "CPO")
    words = [Word(ord("G"), place.at, ZERO)]
    for letter, start, part in zip("XY", first, ("COS", "SIN"), strict=True):
        reach = operation("*", radius, operation(part, angle))
        words.append(Word(ord(letter), place.at, operation("+", known[start], reach)))
    turn: list[Statement] = [
        Line(place, (), ((angle, turned), (radius, along))),
        Line(place, tuple(words)),
        *drilled,
        Line(place, (), ((n, operation("+", n, ONE)),)),
    ]
    begin = Line(place, (), ((n, ZERO),))
    return [begin, Loop(place, "while", f"{name} {place.at}", operation("<", n, known["NUM"]), turn)]
