"""Cycles of Sinumerik controls, at the present place; their rows are made while the program runs.

    RTP retract plane    RFP reference plane    SDIS distance above it    DP depth, or DPR below the reference plane    DTB dwell

    CYCLE81, CYCLE82    in and, after a dwell, rapid out
    CYCLE83             by infeeds: the first to FDEP (or FDPR below the reference plane), each of the others less by DAM, but not less
                        than DAM; between them a dwell below (DTB), and out to RFP + SDIS with a dwell there
                        (DTS; VARI 1), or back by 1 mm to break the chip (VARI 0)
    CYCLE84, CYCLE840   tapping: SDAC, MPIT (size) or PIT (lead), SST and SST1 speed in and out;  SDR, SDAC, ENC, MPIT, PIT
    CYCLE85             FFR in, RFF out                 CYCLE86   stopped spindle, away by RPA RPO RPAP, rapid out
    CYCLE87, CYCLE88    spindle stop and M0 on the ground (CYCLE88: after a dwell), rapid out
    CYCLE89             in and out at the same feed
    POCKET3             LENG WID CRAD at PA PO, turned by STA    POCKET4    PRAD at PA PO
        MID most per pass, FAL and FALD allowances at the walls and the bottom, FFP1 and FFD feeds in the
        plane and of plunging, CDIR 0 climb, 1 conventional, 2 G2, 3 G3, VARI 1 roughing, 2 finishing, and 0,
        10, 20: plunge at rapid speed, straight, on a helix (RAD1, DP1), MIDA most between two paths (0: 0.8
        tool diameters)

Arguments of later controls behind these (units, modes) change the meaning of the others; they are refused
where they are not 0 or left out.

Patterns of holes, each drilled by the cycle of MCALL:

    HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM)    a row, n = 0 ... NUM - 1:  (SPCA, SPCO) + (FDIS + n DBH) (cos STA1, sin STA1)
    HOLES2(CPA, CPO, RAD, STA1, INDA, NUM)      a circle:  (CPA, CPO) + RAD (cos a, sin a),  a = STA1 + n INDA (0: n 360 / NUM)

Controls may begin a row at its other end, if that is nearer; here it begins at its first hole.
"""

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from planner.nc.language import tree
from planner.nc.language.making import (
    Cycle,
    HolePlan,
    Making,
    Pecks,
    Row,
    around,
    coarse_lead,
    drilled,
    feed_to,
    go,
    pecked,
    tapped,
)
from planner.nc.language.milling import (
    HELIX,
    RAPID,
    STRAIGHT,
    PocketPlan,
    PocketShape,
    RoundedRectangle,
    pocket_rows,
)
from planner.nc.language.siemens.text import variable

_DEPTH = ("RTP", "RFP", "SDIS", "DP", "DPR")
_CUTTING = ("MID", "FAL", "FALD", "FFP1", "FFD", "CDIR", "VARI", "MIDA", "AP1")
ARGUMENTS = {
    "CYCLE81": _DEPTH,
    "CYCLE82": (*_DEPTH, "DTB"),
    "CYCLE83": (*_DEPTH, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI"),
    "CYCLE84": (*_DEPTH, "DTB", "SDAC", "MPIT", "PIT", "POSS", "SST", "SST1"),
    "CYCLE840": (*_DEPTH, "DTB", "SDR", "SDAC", "ENC", "MPIT", "PIT"),
    "CYCLE85": (*_DEPTH, "DTB", "FFR", "RFF"),
    "CYCLE86": (*_DEPTH, "DTB", "SDIR", "RPA", "RPO", "RPAP", "POSS"),
    "CYCLE87": (*_DEPTH, "SDIR"),
    "CYCLE88": (*_DEPTH, "DTB", "SDIR"),
    "CYCLE89": (*_DEPTH, "DTB"),
    "POCKET3": ("RTP", "RFP", "SDIS", "DP", "LENG", "WID", "CRAD", "PA", "PO", "STA", *_CUTTING, "AP2", "AD", "RAD1", "DP1"),
    "POCKET4": ("RTP", "RFP", "SDIS", "DP", "PRAD", "PA", "PO", *_CUTTING, "AD", "RAD1", "DP1"),
}  # fmt: skip
POCKETS = ("POCKET3", "POCKET4")
_DRILLING = ("CYCLE81", "CYCLE82", "CYCLE83")
_APART = 1.0  # mm by which the tool goes back to break a chip, and above the depth already drilled where feed begins
_SHORT = 1e-9  # an infeed that is none
_OVERLAP = 0.8  # of the tool's diameter between two paths, where MIDA is 0
_LEFT = 4.0  # SDIR, SDAC: M4
_HALT: tuple[Row, Row] = ([("M", 5.0)], [("M", 0.0)])  # the spindle stops, then the program
PATTERNS = {
    "HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"),
    "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
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
    missing = [key for key in PATTERNS[name] if key not in known and key != "INDA"]
    if missing:
        raise ValueError(f"{name} needs {missing[0]}")
    n, angle, radius = variable("_hole"), variable("_angle"), variable("_radius")
    if name == "HOLES1":
        along, turned = known["FDIS"] + n * known["DBH"], known["STA1"]
        first = known["SPCA"], known["SPCO"]
    else:
        step = known.get("INDA", tree.ZERO)
        even = tree.op("EQ", step, tree.ZERO)  # 1 where the holes are spread evenly
        along, turned = known["RAD"], known["STA1"] + n * (step + even * (_TURN / known["NUM"]))
        first = known["CPA"], known["CPO"]
    x, y = (start + radius * tree.op(part, angle) for start, part in zip(first, ("COS", "SIN"), strict=True))
    turn: list[tree.Statement] = [
        tree.assign(place, (angle, turned), (radius, along)),
        tree.row(place, ("G", tree.ZERO), ("X", x), ("Y", y)),
        *drilled,
        tree.assign(place, (n, n + tree.ONE)),
    ]
    loop = tree.Loop(place, "while", f"{name} {place.at}", tree.op("LT", n, known["NUM"]), turn)
    return [tree.assign(place, (n, tree.ZERO)), loop]


def check(name: str, given: Container[str]) -> None:
    """Raises ValueError for arguments that CYCLE81 to CYCLE83 lack: they are looked at in the text."""
    if name in _DRILLING:
        _required(name, given, "RTP", "RFP", "SDIS")
        for pair in (("DP", "DPR"), ("FDEP", "FDPR"))[: 1 + (name == "CYCLE83")]:
            _require_depth(name, given, *pair)


def _required(name: str, given: Container[str], *keys: str) -> None:
    for key in keys:
        if key not in given:
            raise ValueError(f"{name} needs {key}")


def _require_depth(name: str, given: Container[str], absolute: str, below: str) -> None:
    if absolute not in given and below not in given:
        raise ValueError(f"{name} needs {absolute} or {below}")


def _depth(given: Mapping[str, float], absolute: str, below: str) -> float:
    return given[absolute] if absolute in given else given["RFP"] - abs(given[below])


def _hole(name: str, given: Mapping[str, float]) -> HolePlan:
    _required(name, given, "RTP", "RFP", "SDIS")
    _require_depth(name, given, "DP", "DPR")
    top = given["RFP"]
    clear, bottom = top + abs(given["SDIS"]), _depth(given, "DP", "DPR")
    return HolePlan(clear, top, bottom, given["RTP"], None, given.get("DTB", 0.0))


def _lead(given: Mapping[str, float], unit: float) -> float:
    size, lead = given.get("MPIT", 0.0), given.get("PIT", 0.0)
    if size and lead:
        raise ValueError("MPIT and PIT both give the lead; write one of them")
    return lead or (coarse_lead(abs(size), unit) * (1.0 if size > 0.0 else -1.0) if size else 0.0)


def _rigid(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = _hole("CYCLE84", given)
    _required("CYCLE84", given, "SST")
    yield from tapped(making, hole, _lead(given, making.unit), given["SST"], back=given.get("SST1", 0.0))
    yield go(hole.retract)


def _chuck(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = _hole("CYCLE840", given)
    lead, speed = _lead(given, making.unit), making.interpreter.state.spindle.speed
    if lead == 0.0 and speed > 0.0:
        lead = making.interpreter.state.feed * 60.0 / making.unit / speed  # F and S of the program
    yield from tapped(making, hole, lead, speed)
    yield go(hole.retract)


def _reamed(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = _hole("CYCLE85", given)
    _required("CYCLE85", given, "FFR", "RFF")
    yield from drilled(replace(hole, feed=given["FFR"]))
    yield go(hole.clear, given["RFF"])
    yield go(hole.retract)


def _drilled(hole: HolePlan, given: Mapping[str, float]) -> Iterator[Row]:
    if "SDIR" in given:
        yield [("M", 4.0 if given["SDIR"] == _LEFT else 3.0)]
    yield from drilled(hole)


def _bored(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole, (x, y, _) = _hole("CYCLE86", given), making.here()
    away = [given.get(key, 0.0) for key in ("RPA", "RPO", "RPAP")]
    yield from _drilled(hole, given)
    yield [("M", 5.0)]
    yield [("G", 0.0), ("X", x + away[0]), ("Y", y + away[1]), ("Z", hole.bottom + away[2])]
    yield go(hole.clear)
    yield [("G", 0.0), ("X", x), ("Y", y), ("Z", hole.retract)]


def _straight(name: str, *behind: Row, out: bool = False) -> Cycle:
    """Down at the feed, then what comes `behind`, and with `out` back at the feed, else at rapid speed."""

    def rows(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
        hole = _hole(name, given)
        yield from _drilled(hole, given)
        yield from behind
        if out:
            yield feed_to(hole.clear, None)
        yield go(hole.retract)

    return rows


def _deep(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
    hole, less = _hole("CYCLE83", given), abs(given.get("DAM", 0.0))
    first, apart = hole.top - _depth(given, "FDEP", "FDPR"), _APART / making.unit
    yield from pecked(
        hole,
        Pecks(
            max(first, _SHORT),
            back=apart,
            ahead=(apart, apart),
            less=less,
            least=less,
            breaks=0 if given.get("VARI", 0.0) else math.inf,
            above=given.get("DTS", 0.0),
            below=hole.dwell,
        ),
    )
    yield go(hole.retract)


def _pocket(name: str) -> Cycle:
    def rows(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
        _required(name, given, "RTP", "RFP", "SDIS", "DP", "PA", "PO", "FFP1", "CDIR", "VARI")
        for key in ("AP1", "AP2", "AD"):
            if given.get(key):
                text = f"{key} of {name}, a pocket that is there already, is not read; leave it out"
                raise ValueError(text)
        if making.interpreter.state.normal != 2:
            raise ValueError(f"{name} in G18 or G19 is not read; write G17 before it")
        radius = making.tool_radius()
        plan = _plan(making, name, given, radius)
        text = f"{name}: passes and allowances are those of the cycle, the single paths this reader's own"
        making.assume(text)
        place = complex(given["PA"], given["PO"])
        return pocket_rows(_shape(name, given, radius), plan, place, given.get("STA", 0.0))

    return rows


def _shape(name: str, given: Mapping[str, float], radius: float) -> PocketShape:
    if name == "POCKET4":
        _required(name, given, "PRAD")
        size = given["PRAD"]
        if size <= 0.0:
            raise ValueError("PRAD, the radius of POCKET4, is to be above 0")
        return RoundedRectangle(size, size, size)
    _required(name, given, "LENG", "WID")
    corner = given.get("CRAD", 0.0) or radius
    if min(given["LENG"], given["WID"]) <= 0.0:
        raise ValueError("LENG and WID of POCKET3 are to be above 0; dimensions from a corner are not read")
    if corner < radius:
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}; the tool has {radius:g}")
    a, b = given["LENG"] / 2.0, given["WID"] / 2.0
    if corner > min(a, b):
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}: more than half its width")
    return RoundedRectangle(a, b, corner)


def _plan(making: Making, name: str, given: Mapping[str, float], radius: float) -> PocketPlan:
    kind, plunge = round(given["VARI"]) % 10, round(given["VARI"]) // 10
    if kind not in (1, 2) or plunge not in (0, 1, 2):
        raise ValueError(f"VARI {given['VARI']:g} of {name} is not read; read are 1, 2, 11, 12, 21 and 22")
    if plunge == 2 and not (given.get("RAD1", 0.0) > 0.0 and given.get("DP1", 0.0) > 0.0):
        raise ValueError("plunging on a helix needs RAD1 and DP1, above 0")
    turn = {0: 1, 1: -1, 2: -1, 3: 1}.get(round(given["CDIR"]))
    if turn is None:
        raise ValueError(f"CDIR {given['CDIR']:g} of {name} is none of 0, 1, 2 and 3")
    if given["CDIR"] in (0.0, 1.0) and making.interpreter.state.spindle.turning < 0:
        turn = -turn  # climb milling with M4
    side = given.get("FAL", 0.0)
    helix = (given.get("RAD1", 0.0), given.get("DP1", 0.0))
    if plunge == 2 and helix[0] > _shape(name, given, radius).room - radius - side:
        raise ValueError(f"the helix of RAD1 {helix[0]:g} has no room beside the tool in {name}")
    top = given["RFP"]
    return PocketPlan(
        depth=HolePlan(top + abs(given["SDIS"]), top, given["DP"], given["RTP"], what="pocket"),
        radius=radius,
        infeed=given.get("MID", 0.0),
        step=given.get("MIDA", 0.0) or _OVERLAP * 2.0 * radius,
        feed=given["FFP1"],
        plunge_feed=given.get("FFD", 0.0),
        finish_feed=given["FFP1"],
        turning=turn,
        side=side,
        floor=given.get("FALD", 0.0),
        rough=kind == 1,
        walls=kind == 2,
        base=kind == 2 and given.get("FALD", 0.0) > 0.0,
        finish_infeed=given.get("MID", 0.0),
        plunge=(RAPID, STRAIGHT, HELIX)[plunge],
        helix=helix,
    )


_CYCLES: dict[str, Cycle] = {
    "CYCLE81": _straight("CYCLE81"),
    "CYCLE82": _straight("CYCLE82"),
    "CYCLE83": _deep,
    "CYCLE84": _rigid,
    "CYCLE840": _chuck,
    "CYCLE85": _reamed,
    "CYCLE86": _bored,
    "CYCLE87": _straight("CYCLE87", *_HALT),
    "CYCLE88": _straight("CYCLE88", *_HALT),
    "CYCLE89": _straight("CYCLE89", out=True),
    **{name: _pocket(name) for name in POCKETS},
}


def _keeping_modes(cycle: Cycle) -> Cycle:
    return lambda making, given: around(making, cycle(making, given), feed=False)


MAKERS = {name: _keeping_modes(cycle) for name, cycle in _CYCLES.items()}
