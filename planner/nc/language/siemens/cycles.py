"""Cycles of Sinumerik controls, at the present place; their rows are made while the program runs.

    RTP retract plane    RFP reference plane    SDIS distance above it    DP depth, or DPR below the reference plane    DTB dwell

    CYCLE81, CYCLE82    in and, after a dwell, rapid out
    CYCLE83             by infeeds: the first to FDEP (or FDPR below the reference plane) at the share FRF of F, each of the
                        others less by DAM, but not less than DAM, and the last two equal; between them a dwell
                        below (DTB), and out to RFP + SDIS with a dwell there (DTS; VARI 1), or back by 1 mm to
                        break the chip (VARI 0)
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

import cmath
import math
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import replace
from functools import partial

from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.language import milling, tree
from planner.nc.language.making import (
    Cycle,
    Given,
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
from planner.nc.language.rows import require

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
_OVERLAP = 0.8  # of the tool's diameter between two paths, where MIDA is 0
_SAID = "{0}: passes and allowances are those of the cycle, the single paths this reader's own"


def _required(name: str, given: Container[str], *keys: str) -> None:
    """Raises ValueError for arguments that a cycle lacks."""
    for key in keys:
        require(key in given, f"{name} needs {key}")


def _require_depth(name: str, given: Container[str], absolute: str, below: str) -> None:
    """Raises ValueError where neither of two arguments gives a depth."""
    require(absolute in given or below in given, f"{name} needs {absolute} or {below}")


def _depth_of(given: Given, absolute: str, below: str) -> float:
    """A depth, absolute or below the reference plane."""
    return given[absolute] if absolute in given else given["RFP"] - abs(given[below])


def _hole_of(name: str, given: Given) -> HolePlan:
    """The depths of a cycle. Raises ValueError."""
    _required(name, given, "RTP", "RFP", "SDIS")
    _require_depth(name, given, "DP", "DPR")
    top = given["RFP"]
    clear, bottom = top + abs(given["SDIS"]), _depth_of(given, "DP", "DPR")
    return HolePlan(clear, top, bottom, given["RTP"], None, given.get("DTB", 0.0))


def check(name: str, given: Mapping[str, tree.Expression]) -> None:
    """Raises ValueError for arguments that CYCLE81 to CYCLE83 lack, and for values of _MORE: they are looked at
    in the text."""
    for key, allowed in _MORE.items():
        value, counts = given.get(key), key != "VARI" or name in ("CYCLE84", *RADIAL)
        if counts and isinstance(value, tree.Number) and value.value not in allowed:
            text = f"{key} {value.value:g} of {name} is not read: it changes what the other arguments mean, or how it is cut; "
            raise ValueError(text + f"read is {' or '.join(map(str, allowed))}")
    if name in _DRILLING:
        _required(name, given, "RTP", "RFP", "SDIS")
        for pair in (("DP", "DPR"), ("FDEP", "FDPR"))[: 1 + (name == "CYCLE83")]:
            _require_depth(name, given, *pair)


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
    require(not size or not lead, "MPIT and PIT both give the lead; write one of them")
    return lead or (coarse_lead(abs(size), unit) * (1.0 if size > 0.0 else -1.0) if size else 0.0)


def _tapped(making: Making, given: Given, hole: HolePlan, *, rigid: bool) -> Iterator[Row]:
    """CYCLE84, and CYCLE840 with a chuck, at the speed of the program and without a lead at its F."""
    state = making.interpreter.state
    lead, speed = _lead(given, making.unit), state.spindle.speed
    if rigid:
        _required("CYCLE84", given, "SST")
        return tapped(making, hole, lead, given["SST"], back=given.get("SST1", 0.0))
    if lead == 0.0 and speed > 0.0:
        lead = state.word_feed / (speed if state.feed_mode == "per minute" else 1.0)
    return tapped(making, hole, lead, speed)


def _reamed(making: Making, given: Given, hole: HolePlan) -> Iterator[Row]:
    _required("CYCLE85", given, "FFR", "RFF")
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
    require(less >= 0.0, "DAM below 0 of CYCLE83, infeeds as shares, is not read; give their difference")
    share = given.get("FRF", 0.0) or 1.0
    feed = making.interpreter.state.word_feed if share != 1.0 else None
    require(feed is None or 0.0 < share < 1.0, "FRF of CYCLE83, a share of F, is to be above 0 and up to 1")
    pecks = Pecks(
        max(hole.top - _depth_of(given, "FDEP", "FDPR"), _SHORT),
        back=given.get("VRT", 0.0) or apart,
        ahead=(given.get("DIS1", 0.0) or apart,) * 2,
        less=less,
        least=given.get("MDEP", 0.0) or less,
        breaks=0 if given.get("VARI", 0.0) else math.inf,
        above=given.get("DTS", 0.0),
        below=max(given.get("DTB", 0.0), 0.0),
        halves=not given.get("MDEP", 0.0),
        first=None if feed is None else share * feed,
    )
    yield from pecked(replace(hole, dwell=last if last > 0.0 else hole.dwell, feed=feed), pecks)
    if feed is not None:
        yield [("F", feed)]


def _slots(making: Making, given: Given, *, name: str) -> Iterator[Row]:
    """SLOT1, SLOT2 and LONGHOLE: pockets, each turned about the circle's middle."""
    needed = {"SLOT1": ("LENG", "WID"), "SLOT2": ("AFSL", "WID"), "LONGHOLE": ("LENG",)}[name]
    _required(name, given, "NUM", "CPA", "CPO", "RAD", "FFP1", *needed)
    hole, radius, size = _hole_of(name, given), making.tool_radius(), given["RAD"]
    half = given["WID"] / 2.0 if "WID" in needed else radius
    making.assume(_SAID.format(name))
    if name != "SLOT2":
        making.assume(f"{name}: LENG is the whole length of the slot, which begins at RAD")
    kind, turn = given.get("VARI", 0.0), given.get("CDIR", 2.0)
    plan = replace(
        _cutting(making, name, {**given, "VARI": kind % 10 + 1.0, "CDIR": turn}, radius),
        depth=replace(hole, what="slot"),
        finish_infeed=given.get("MIDF", 0.0),
        finish_feed=given.get("FFP2", 0.0) or given["FFP1"],
    )
    if not kind and plan.side:
        plan = replace(plan, walls=True)
    count = round(given["NUM"])
    step = given.get("INDA", 0.0) or 360.0 / count
    shape: milling.PocketShape = milling.ArcSlot(size, half, 0.0, math.radians(given.get("AFSL", 0.0)))
    if name != "SLOT2":
        shape = milling.RoundedRectangle(given["LENG"] / 2.0, half, half)
    for k in range(count):
        angle = given.get("STA1", 0.0) + k * step
        middle = cmath.rect(size + given["LENG"] / 2.0, math.radians(angle)) if name != "SLOT2" else 0.0
        yield from milling.pocket_rows(shape, plan, complex(given["CPA"], given["CPO"]) + middle, angle)


def _pocket(making: Making, given: Given, *, name: str) -> Iterator[Row]:
    """POCKET3 and POCKET4. Raises ValueError."""
    _required(name, given, "RTP", "RFP", "SDIS", "DP", "PA", "PO", "FFP1", "CDIR", "VARI")
    for key in ("AP1", "AP2", "AD"):
        text = f"{key} of {name}, a pocket that is there already, is not read; leave it out"
        require(not given.get(key), text)
    radius = making.tool_radius()
    plan = _cutting(making, name, given, radius)
    making.assume(_SAID.format(name))
    shape = _shape(name, given, radius)
    if plan.plunge == milling.HELIX and plan.helix[0] > shape.room - radius - plan.side:
        raise ValueError(f"the helix of RAD1 {plan.helix[0]:g} has no room beside the tool in {name}")
    return milling.pocket_rows(shape, plan, complex(given["PA"], given["PO"]), given.get("STA", 0.0))


def _shape(name: str, given: Given, radius: float) -> milling.PocketShape:
    if name == "POCKET4":
        _required(name, given, "PRAD")
        size = given["PRAD"]
        require(size > 0.0, "PRAD, the radius of POCKET4, is to be above 0")
        return milling.RoundedRectangle(size, size, size)
    _required(name, given, "LENG", "WID")
    corner = given.get("CRAD", 0.0) or radius
    if min(given["LENG"], given["WID"]) <= 0.0:
        raise ValueError("LENG and WID of POCKET3 are to be above 0; dimensions from a corner are not read")
    require(corner >= radius, f"the corners of POCKET3 have a radius of {corner:g}; the tool has {radius:g}")
    a, b = given["LENG"] / 2.0, given["WID"] / 2.0
    if corner > min(a, b):
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}: more than half its width")
    return milling.RoundedRectangle(a, b, corner)


def _cutting(making: Making, name: str, given: Given, radius: float) -> milling.PocketPlan:
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
    return milling.PocketPlan(
        depth=replace(_hole_of(name, given), what="pocket"),
        radius=radius,
        infeed=given.get("MID", 0.0),
        step=given.get("MIDA", 0.0) or _OVERLAP * 2.0 * radius,
        feed=given["FFP1"],
        plunge_feed=given.get("FFD", 0.0),
        finish_feed=given["FFP1"],
        turning=turn,
        side=given.get("FAL", 0.0),
        floor=given.get("FALD", 0.0),
        rough=kind == 1,
        walls=kind == 2,
        base=kind == 2 and given.get("FALD", 0.0) > 0.0,
        finish_infeed=given.get("MID", 0.0),
        plunge=(milling.RAPID, milling.STRAIGHT, milling.HELIX)[plunge],
        helix=(given.get("RAD1", 0.0), given.get("DP1", 0.0)),
    )


def _drilling(name: str, rows: Callable[[Making, Given, HolePlan], Iterator[Row]]) -> Cycle:
    """The cycle of a hole: its rows, then up to the retract plane."""

    def cycle(making: Making, given: Given) -> Iterator[Row]:
        hole = _hole_of(name, given)
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
    "CYCLE86": lambda making, given: _bored(making, given, _hole_of("CYCLE86", given)),
    **{name: partial(_pocket, name=name) for name in POCKETS},
    **{name: partial(_slots, name=name) for name in RADIAL},
}


def cycle_rows(making: Making, given: Given, *, name: str) -> Iterator[Row]:
    """The rows of a cycle in G17, with G90 and the feed as before. Raises ValueError."""
    require(making.interpreter.state.normal == 2, f"{name} in G18 or G19 is not read; write G17 before it")
    return around(making, _CYCLES[name](making, _in_seconds(making, given)), feed=False)
