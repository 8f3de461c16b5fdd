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

    SLOT1, SLOT2               NUM slots from RAD outwards (LENG, WID), and on the circle (AFSL degrees long), each INDA further
    LONGHOLE                   the same, as wide as the tool

Arguments of later controls behind these change the meaning of others, where they are not as in _MORE: refused.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.language import tree
from planner.nc.language.making import (
    Cycle,
    HolePlan,
    Maker,
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
from planner.nc.language.siemens.pockets import depth_of, hole_of, pocket, require_depth, required, slots

_DEPTH = ("RTP", "RFP", "SDIS", "DP", "DPR")
_CUTTING = ("MID", "FAL", "FALD", "FFP1", "FFD", "CDIR", "VARI", "MIDA", "AP1")
_LATER = ("GMODE", "DMODE", "AMODE")
_ON_CIRCLE = ("CPA", "CPO", "RAD", "STA1", "INDA", "FFD", "FFP1", "MID")
_SLOTS = (*_ON_CIRCLE, "CDIR", "FAL", "VARI", "MIDF", "FFP2", "SSF")
ARGUMENTS = {
    **dict.fromkeys(("CYCLE81", "CYCLE82"), (*_DEPTH, "DTB", *_LATER)),
    "CYCLE83": (*_DEPTH, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI", "AXN", "MDEP", "VRT", "DTD", "DIS1", *_LATER),
    "CYCLE84": (*_DEPTH, "DTB", "SDAC", "MPIT", "PIT", "POSS", "SST", "SST1", "AXN", "PITA", "TECHNO", "VARI", "DAM", "VRT", "PITM",
                "PTAB", "PTABA", *_LATER),
    "CYCLE840": (*_DEPTH, "DTB", "SDR", "SDAC", "ENC", "MPIT", "PIT", "AXN", "PITA", "TECHNO", "PITM", "PTAB", "PTABA", *_LATER),
    "CYCLE85": (*_DEPTH, "DTB", "FFR", "RFF", *_LATER),
    "CYCLE86": (*_DEPTH, "DTB", "SDIR", "RPA", "RPO", "RPAP", "POSS", *_LATER),
    "CYCLE87": (*_DEPTH, "SDIR"),
    "CYCLE88": (*_DEPTH, "DTB", "SDIR"),
    "CYCLE89": (*_DEPTH, "DTB", *_LATER),
    "SLOT1": (*_DEPTH, "NUM", "LENG", "WID", *_SLOTS, "FALD", "STA2", "DP1"),
    "SLOT2": (*_DEPTH, "NUM", "AFSL", "WID", *_SLOTS),
    "LONGHOLE": (*_DEPTH, "NUM", "LENG", *_ON_CIRCLE),
    "POCKET3": ("RTP", "RFP", "SDIS", "DP", "LENG", "WID", "CRAD", "PA", "PO", "STA", *_CUTTING, "AP2", "AD", "RAD1", "DP1"),
    "POCKET4": ("RTP", "RFP", "SDIS", "DP", "PRAD", "PA", "PO", *_CUTTING, "AD", "RAD1", "DP1"),
}  # fmt: skip
POCKETS = ("POCKET3", "POCKET4")
# Arguments of later controls, and with which values they change nothing here; AMODE says whether depths are
# DP or DPR and dwells seconds, which their arguments say, too; the tool axis (AXN) is that of the plane.
_MORE = {"GMODE": (0, 1), "DMODE": (0, 1), "AXN": (0, 3), "PITA": (0, 1), "VARI": (0,), "STA2": (0,)}
_DRILLING = ("CYCLE81", "CYCLE82", "CYCLE83")
RADIAL = ("SLOT1", "SLOT2", "LONGHOLE")
_APART = 1.0  # mm by which the tool goes back to break a chip, and above the depth already drilled where feed begins
_SHORT = 1e-9  # an infeed that is none
_LEFT = 4.0  # SDIR, SDAC: M4
_HALT: tuple[Row, Row] = ([("M", 5.0)], [("M", 0.0)])  # the spindle stops, then the program


def check(name: str, given: Mapping[str, tree.Expression]) -> None:
    """Raises ValueError for arguments that CYCLE81 to CYCLE83 lack, and for values of _MORE: they are looked at
    in the text."""
    for key, allowed in _MORE.items():
        value = given.get(key)
        if (
            isinstance(value, tree.Number)
            and value.value not in allowed
            and not (key == "VARI" and name not in ("CYCLE84", *RADIAL))
        ):
            text = f"{key} {value.value:g} of {name} is not read: it changes what the other arguments mean, or how it is cut; "
            raise ValueError(text + f"read is {' or '.join(map(str, allowed))}")
    if name in _DRILLING:
        required(name, given, "RTP", "RFP", "SDIS")
        for pair in (("DP", "DPR"), ("FDEP", "FDPR"))[: 1 + (name == "CYCLE83")]:
            require_depth(name, given, *pair)


def _in_seconds(making: Making, given: Mapping[str, float]) -> Mapping[str, float]:
    """The arguments with dwells in seconds: below 0, or with 2 as their digit of AMODE, they are turns."""
    turns = [key for key in ("DTB", "DTS", "DTD") if given.get(key, 0.0) < 0.0]
    if round(given.get("AMODE", 0.0)) // 10 % 10 == 2 and given.get("DTB", 0.0) > 0.0:
        turns.append("DTB")
    speed = making.interpreter.state.spindle.speed
    if turns and not speed > 0.0:
        raise ValueError(f"{turns[0]} in turns of the spindle needs its speed S before it")
    return {**given, **{key: abs(given[key]) / speed * SECONDS_PER_MINUTE for key in turns}}


def _lead(given: Mapping[str, float], unit: float) -> float:
    size, lead = given.get("MPIT", 0.0), given.get("PIT", 0.0)
    if size and lead:
        raise ValueError("MPIT and PIT both give the lead; write one of them")
    return lead or (coarse_lead(abs(size), unit) * (1.0 if size > 0.0 else -1.0) if size else 0.0)


def _rigid(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = hole_of("CYCLE84", given)
    required("CYCLE84", given, "SST")
    yield from tapped(making, hole, _lead(given, making.unit), given["SST"], back=given.get("SST1", 0.0))
    yield go(hole.retract)


def _chuck(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = hole_of("CYCLE840", given)
    lead, speed = _lead(given, making.unit), making.interpreter.state.spindle.speed
    if lead == 0.0 and speed > 0.0:
        lead = making.interpreter.state.feed * 60.0 / making.unit / speed  # F and S of the program
    yield from tapped(making, hole, lead, speed)
    yield go(hole.retract)


def _reamed(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole = hole_of("CYCLE85", given)
    required("CYCLE85", given, "FFR", "RFF")
    yield from drilled(replace(hole, feed=given["FFR"]))
    yield go(hole.clear, given["RFF"])
    yield go(hole.retract)


def _drilled(hole: HolePlan, given: Mapping[str, float]) -> Iterator[Row]:
    if "SDIR" in given:
        yield [("M", 4.0 if given["SDIR"] == _LEFT else 3.0)]
    yield from drilled(hole)


def _bored(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    hole, (x, y, _) = hole_of("CYCLE86", given), making.here()
    away = [given.get(key, 0.0) for key in ("RPA", "RPO", "RPAP")]
    yield from _drilled(hole, given)
    yield [("M", 5.0)]
    yield [("G", 0.0), ("X", x + away[0]), ("Y", y + away[1]), ("Z", hole.bottom + away[2])]
    yield go(hole.clear)
    yield [("G", 0.0), ("X", x), ("Y", y), ("Z", hole.retract)]


def _straight(name: str, *behind: Row, out: bool = False) -> Cycle:
    """Down at the feed, then what comes `behind`, and with `out` back at the feed, else at rapid speed."""

    def rows(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
        hole = hole_of(name, given)
        yield from _drilled(hole, given)
        yield from behind
        if out:
            yield feed_to(hole.clear, None)
        yield go(hole.retract)

    return rows


def _deep(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
    hole, less = hole_of("CYCLE83", given), given.get("DAM", 0.0)
    if less < 0.0:
        raise ValueError(
            "DAM below 0 of CYCLE83, each infeed a share of the one before, is not read; give their difference"
        )
    last = given.get("DTD", 0.0)
    hole = replace(hole, dwell=last) if last > 0.0 else hole
    first, apart = hole.top - depth_of(given, "FDEP", "FDPR"), _APART / making.unit
    yield from pecked(
        hole,
        Pecks(
            max(first, _SHORT),
            back=given.get("VRT", 0.0) or apart,
            ahead=(given.get("DIS1", 0.0) or apart,) * 2,
            less=less,
            least=given.get("MDEP", 0.0) or less,
            breaks=0 if given.get("VARI", 0.0) else math.inf,
            above=given.get("DTS", 0.0),
            below=max(given.get("DTB", 0.0), 0.0),
        ),
    )
    yield go(hole.retract)


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
    **{name: pocket(name) for name in POCKETS},
    **{name: slots(name) for name in RADIAL},
}


def _keeping_modes(name: str, cycle: Cycle) -> Maker:
    def rows(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
        if making.interpreter.state.normal != 2:
            raise ValueError(f"{name} in G18 or G19 is not read; write G17 before it")
        return around(making, cycle(making, _in_seconds(making, given)), feed=False)

    return rows


MAKERS = {name: _keeping_modes(name, cycle) for name, cycle in _CYCLES.items()}
