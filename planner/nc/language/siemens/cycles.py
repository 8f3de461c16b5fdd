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
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

from planner.base.units import SECONDS_PER_MINUTE
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
Given = Mapping[str, float]


def check(name: str, given: Mapping[str, tree.Expression]) -> None:
    """Raises ValueError for arguments that CYCLE81 to CYCLE83 lack, and for values of _MORE: they are looked at
    in the text."""
    for key, allowed in _MORE.items():
        value, counts = given.get(key), key != "VARI" or name in ("CYCLE84", *RADIAL)
        if counts and isinstance(value, tree.Number) and value.value not in allowed:
            text = f"{key} {value.value:g} of {name} is not read: it changes what the other arguments mean, or how it is cut; "
            raise ValueError(text + f"read is {' or '.join(map(str, allowed))}")
    if name in _DRILLING:
        required(name, given, "RTP", "RFP", "SDIS")
        for pair in (("DP", "DPR"), ("FDEP", "FDPR"))[: 1 + (name == "CYCLE83")]:
            require_depth(name, given, *pair)


def _in_seconds(making: Making, given: Given) -> Given:
    """The arguments with dwells in seconds: below 0, or with 2 as their digit of AMODE, they are turns."""
    turns = [key for key in ("DTB", "DTS", "DTD") if given.get(key, 0.0) < 0.0]
    if round(given.get("AMODE", 0.0)) // 10 % 10 == 2 and given.get("DTB", 0.0) > 0.0:
        turns.append("DTB")
    speed = making.interpreter.state.spindle.speed
    if turns and not speed > 0.0:
        raise ValueError(f"{turns[0]} in turns of the spindle needs its speed S before it")
    return {**given, **{key: abs(given[key]) / speed * SECONDS_PER_MINUTE for key in turns}}


def _lead(given: Given, unit: float) -> float:
    size, lead = given.get("MPIT", 0.0), given.get("PIT", 0.0)
    if size and lead:
        raise ValueError("MPIT and PIT both give the lead; write one of them")
    return lead or (coarse_lead(abs(size), unit) * (1.0 if size > 0.0 else -1.0) if size else 0.0)


def _tapped(making: Making, given: Given, hole: HolePlan, *, rigid: bool) -> Iterator[Row]:
    """CYCLE84, and CYCLE840 with a chuck, at the speed of the program and without a lead at its F."""
    lead, speed = _lead(given, making.unit), making.interpreter.state.spindle.speed
    if rigid:
        required("CYCLE84", given, "SST")
        return tapped(making, hole, lead, given["SST"], back=given.get("SST1", 0.0))
    if lead == 0.0 and speed > 0.0:
        lead = making.interpreter.state.feed * SECONDS_PER_MINUTE / making.unit / speed
    return tapped(making, hole, lead, speed)


def _reamed(making: Making, given: Given, hole: HolePlan) -> Iterator[Row]:
    required("CYCLE85", given, "FFR", "RFF")
    yield from drilled(replace(hole, feed=given["FFR"]))
    yield go(hole.clear, given["RFF"])


def _drilled(
    making: Making, given: Given, hole: HolePlan, *, halts: bool = False, back: bool = False
) -> Iterator[Row]:
    """Down at the feed; then the spindle `halts`, and the program, or the tool goes `back` at the feed."""
    if "SDIR" in given:
        yield [("M", 4.0 if given["SDIR"] == _LEFT else 3.0)]
    yield from drilled(hole)
    if halts:
        yield from ([("M", 5.0)], [("M", 0.0)])
    if back:
        yield feed_to(hole.clear, None)


def _bored(making: Making, given: Given, hole: HolePlan) -> Iterator[Row]:
    x, y, _ = making.here()
    away = [given.get(key, 0.0) for key in ("RPA", "RPO", "RPAP")]
    yield from _drilled(making, given, hole)
    yield [("M", 5.0)]
    yield [("G", 0.0), ("X", x + away[0]), ("Y", y + away[1]), ("Z", hole.bottom + away[2])]
    yield go(hole.clear)
    yield [("G", 0.0), ("X", x), ("Y", y), ("Z", hole.retract)]


def _deep(making: Making, given: Given, hole: HolePlan) -> Iterator[Row]:
    less, last, apart = given.get("DAM", 0.0), given.get("DTD", 0.0), _APART / making.unit
    if less < 0.0:
        raise ValueError("DAM below 0 of CYCLE83, infeeds as shares, is not read; give their difference")
    pecks = Pecks(
        max(hole.top - depth_of(given, "FDEP", "FDPR"), _SHORT),
        back=given.get("VRT", 0.0) or apart,
        ahead=(given.get("DIS1", 0.0) or apart,) * 2,
        less=less,
        least=given.get("MDEP", 0.0) or less,
        breaks=0 if given.get("VARI", 0.0) else math.inf,
        above=given.get("DTS", 0.0),
        below=max(given.get("DTB", 0.0), 0.0),
    )
    return pecked(replace(hole, dwell=last) if last > 0.0 else hole, pecks)


def _drilling(name: str, rows: Callable[[Making, Given, HolePlan], Iterator[Row]]) -> Cycle:
    """The cycle of a hole: its rows, then up to the retract plane."""

    def cycle(making: Making, given: Given) -> Iterator[Row]:
        hole = hole_of(name, given)
        yield from rows(making, given, hole)
        yield go(hole.retract)

    return cycle


_HOLES: dict[str, Callable[[Making, Given, HolePlan], Iterator[Row]]] = {
    **dict.fromkeys(("CYCLE81", "CYCLE82"), _drilled),
    "CYCLE83": _deep,
    "CYCLE84": partial(_tapped, rigid=True),
    "CYCLE840": partial(_tapped, rigid=False),
    "CYCLE85": _reamed,
    **dict.fromkeys(("CYCLE87", "CYCLE88"), partial(_drilled, halts=True)),
    "CYCLE89": partial(_drilled, back=True),
}
_CYCLES: dict[str, Cycle] = {
    **{name: _drilling(name, rows) for name, rows in _HOLES.items()},
    "CYCLE86": lambda making, given: _bored(making, given, hole_of("CYCLE86", given)),
    **{name: partial(pocket, name=name) for name in POCKETS},
    **{name: partial(slots, name=name) for name in RADIAL},
}


def cycle_rows(making: Making, given: Given, *, name: str) -> Iterator[Row]:
    """The rows of a cycle in G17, with G90 and the feed as before. Raises ValueError."""
    if making.interpreter.state.normal != 2:
        raise ValueError(f"{name} in G18 or G19 is not read; write G17 before it")
    return around(making, _CYCLES[name](making, _in_seconds(making, given)), feed=False)
