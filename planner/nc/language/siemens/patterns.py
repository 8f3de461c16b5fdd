"""Patterns of holes, each drilled by the cycle of MCALL:

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)
    CYCLE801(SPCA, SPCO, STA, DIS1, DIS2, NUM1, NUM2, VARI)    a grid, turned by STA, column by column; VARI 1: its frame
    CYCLE802(, , X0, Y0, X1, Y1 ...)            places

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

from collections.abc import Mapping, Sequence

from planner.nc.language import tree
from planner.nc.language.siemens.text import variable

PATTERNS = {
    "HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"),
    "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
    "CYCLE801": ("SPCA", "SPCO", "STA", "DIS1", "DIS2", "NUM1", "NUM2", "VARI"),
    "CYCLE802": ("XA", "YA", *(f"{axis}{k}" for k in range(9) for axis in "XY")),
}
_TURN = tree.Number(360.0)  # [degrees]


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
    # statements, not a maker's rows: a maker executes what is pending at each hole
    n, angle, radius, across = (variable(f"_{one}") for one in ("hole", "angle", "radius", "across"))
    count = known.get("NUM", tree.ZERO)
    aside: tree.Expression = tree.ZERO
    if name == "HOLES1":
        along, turned = known["FDIS"] + n * known["DBH"], known["STA1"]
        first: Sequence[tree.Expression] = (known["SPCA"], known["SPCO"])
    elif name == "HOLES2":
        step = known.get("INDA", tree.ZERO)
        even = tree.op("EQ", step, tree.ZERO)  # 1 where the holes are spread evenly
        along, turned = known["RAD"], known["STA1"] + n * (step + even * (_TURN / known["NUM"]))
        first = (known["CPA"], known["CPO"])
    else:
        columns, lines = known["NUM1"], known["NUM2"]
        column = tree.op("TRUNC", n / lines)
        line = n - lines * column
        along, turned, aside = column * known["DIS1"], known["STA"], line * known["DIS2"]
        first, count = (known["SPCA"], known["SPCO"]), columns * lines
        edge = [
            tree.op("EQ", one, last)
            for one in (column, line)
            for last in (tree.ZERO, (columns if one is column else lines) - tree.ONE)
        ]
        on_frame = tree.op("OR", tree.op("OR", edge[0], edge[1]), tree.op("OR", edge[2], edge[3]))
        grid = tree.op("EQ", known.get("VARI", tree.ZERO), tree.ZERO)
        wanted = tree.op("OR", grid, on_frame)
    sine, cosine = tree.op("SIN", angle), tree.op("COS", angle)
    x, y = first[0] + radius * cosine - across * sine, first[1] + radius * sine + across * cosine
    hole: list[tree.Statement] = [tree.row(place, ("G", tree.ZERO), ("X", x), ("Y", y)), *drilled]
    if name == "CYCLE801":
        hole = [tree.If(place, ((wanted, hole),), [])]
    turn: list[tree.Statement] = [
        tree.assign(place, (angle, turned), (radius, along), (across, aside)),
        *hole,
        tree.assign(place, (n, n + tree.ONE)),
    ]
    loop = tree.Loop(place, "while", f"{name} {place.at}", tree.op("LT", n, count), turn)
    return [tree.assign(place, (n, tree.ZERO)), loop]


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
