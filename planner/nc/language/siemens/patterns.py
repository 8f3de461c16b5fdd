"""Patterns of holes, each drilled by the cycle of MCALL:

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)
    CYCLE801(SPCA, SPCO, STA, DIS1, DIS2, NUM1, NUM2, VARI)    a grid, turned by STA, column by column; VARI 1: its frame
    CYCLE802(, , X0, Y0, X1, Y1 ...)            places

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

import math
from collections.abc import Mapping, Sequence
from functools import partial

from planner.nc.language import tree
from planner.nc.language.making import Making, Row
from planner.nc.language.siemens.text import variable

PATTERNS = {
    "HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"),
    "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
    "CYCLE801": ("SPCA", "SPCO", "STA", "DIS1", "DIS2", "NUM1", "NUM2", "VARI"),
    "CYCLE802": ("XA", "YA", *(f"{axis}{k}" for k in range(9) for axis in "XY")),
}
_WANTED = tree.Named("_wanted", True)  # 1 where the hole is to be drilled


def pattern_rows(
    place: tree.SourcePlace,
    name: str,
    given: Sequence[tree.Expression | None],
    drilled: Sequence[tree.Statement],
) -> list[tree.Statement]:
    """Moves to the holes with the statements of their cycle behind each. Raises ValueError for arguments that
    are missing."""
    known = {key: value for key, value in zip(PATTERNS[name], given, strict=False) if value is not None}
    if name == "CYCLE802":
        return _at_places(place, known, drilled)
    missing = [key for key in PATTERNS[name] if key not in known and key not in ("INDA", "VARI")]
    if missing:
        raise ValueError(f"{name} needs {missing[0]}")
    n, on_grid = variable("_hole"), name == "CYCLE801"
    count = known["NUM1"] * known["NUM2"] if on_grid else known["NUM"]
    hole: list[tree.Statement] = [tree.made(place, partial(_to_hole, name=name), n=n, **known), *drilled]
    if on_grid:
        hole[1:] = [tree.If(place, ((_WANTED, list(drilled)),), [])]
    turn: list[tree.Statement] = [*hole, tree.assign(place, (n, n + tree.ONE))]
    loop = tree.Loop(place, "while", f"{name} {place.at}", tree.op("LT", n, count), turn)
    return [tree.assign(place, (n, tree.ZERO)), loop]


def _to_hole(making: Making, given: Mapping[str, float], *, name: str) -> list[Row]:
    """The move to hole n; of a grid's frame only those that lie on it are wanted."""
    n, step, across, wanted = given["n"], given.get("INDA", 0.0), 0.0, True
    if name == "HOLES1":
        (x, y), along, angle = (given["SPCA"], given["SPCO"]), given["FDIS"] + n * given["DBH"], given["STA1"]
    elif name == "HOLES2":
        (x, y), along = (given["CPA"], given["CPO"]), given["RAD"]
        angle = given["STA1"] + n * (step or 360.0 / given["NUM"])
    else:
        columns, lines = given["NUM1"], given["NUM2"]
        column = float(math.trunc(n / lines))
        line = n - lines * column
        wanted = given.get("VARI", 0.0) == 0.0 or column in (0.0, columns - 1.0) or line in (0.0, lines - 1.0)
        (x, y), along, angle = (given["SPCA"], given["SPCO"]), column * given["DIS1"], given["STA"]
        across = line * given["DIS2"]
    making.shared[_WANTED.name] = float(wanted)
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    place = ("X", x + along * cosine - across * sine), ("Y", y + along * sine + across * cosine)
    return [[("G", 0.0), *place]] if wanted else []


def _at_places(
    place: tree.SourcePlace, known: Mapping[str, tree.Expression], drilled: Sequence[tree.Statement]
) -> list[tree.Statement]:
    """CYCLE802; the digits of XA and YA are 1 for absolute coordinates. Raises ValueError for others."""
    for mask in ("XA", "YA"):
        value = known.get(mask, tree.ZERO)
        if not isinstance(value, tree.Number) or set(f"{value.value:.0f}") - {"0", "1"}:
            raise ValueError(f"{mask} of CYCLE802, incremental places, is not read; write absolute ones")
    rows: list[tree.Statement] = []
    for k in range(9):
        words = [(axis, known[f"{axis}{k}"]) for axis in "XY" if f"{axis}{k}" in known]
        rows += [tree.row(place, ("G", tree.ZERO), *words), *drilled] if words else []
    return rows
