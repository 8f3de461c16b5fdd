"""Pockets and slots of Sinumerik controls (cycles.py has their arguments), and what their arguments give."""

import cmath
import math
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import replace

from planner.nc.language.making import Cycle, HolePlan, Making, Row
from planner.nc.language.milling import (
    HELIX,
    RAPID,
    STRAIGHT,
    ArcSlot,
    PocketPlan,
    PocketShape,
    RoundedRectangle,
    pocket_rows,
)

_OVERLAP = 0.8  # of the tool's diameter between two paths, where MIDA is 0


def required(name: str, given: Container[str], *keys: str) -> None:
    """Raises ValueError for arguments that a cycle lacks."""
    for key in keys:
        if key not in given:
            raise ValueError(f"{name} needs {key}")


def require_depth(name: str, given: Container[str], absolute: str, below: str) -> None:
    """Raises ValueError where neither of two arguments gives a depth."""
    if absolute not in given and below not in given:
        raise ValueError(f"{name} needs {absolute} or {below}")


def depth_of(given: Mapping[str, float], absolute: str, below: str) -> float:
    """A depth, absolute or below the reference plane."""
    return given[absolute] if absolute in given else given["RFP"] - abs(given[below])


def hole_of(name: str, given: Mapping[str, float]) -> HolePlan:
    """The depths of a cycle. Raises ValueError."""
    required(name, given, "RTP", "RFP", "SDIS")
    require_depth(name, given, "DP", "DPR")
    top = given["RFP"]
    clear, bottom = top + abs(given["SDIS"]), depth_of(given, "DP", "DPR")
    return HolePlan(clear, top, bottom, given["RTP"], None, given.get("DTB", 0.0))


def slots(name: str) -> Cycle:
    """SLOT1, SLOT2 and LONGHOLE: pockets, each turned about the circle's middle."""

    def rows(making: Making, given: Mapping[str, float]) -> Iterator[Row]:
        needed = ("AFSL", "WID") if name == "SLOT2" else ("LENG", "WID")[: 1 + (name == "SLOT1")]
        required(name, given, "NUM", "CPA", "CPO", "RAD", "FFP1", *needed)
        hole, radius, size = hole_of(name, given), making.tool_radius(), given["RAD"]
        half = given["WID"] / 2.0 if "WID" in needed else radius
        making.assume(
            f"{name}: passes and allowances are those of the cycle, the single paths this reader's own"
        )
        if name != "SLOT2":
            making.assume(f"{name}: LENG is the whole length of the slot, which begins at RAD")
        plan = replace(
            _cutting(
                making,
                name,
                dict(given) | {"VARI": given.get("VARI", 0.0) % 10 + 1.0, "CDIR": given.get("CDIR", 2.0)},
                radius,
            ),
            depth=replace(hole, feed=0.0, what="slot"),
            side=given.get("FAL", 0.0),
            finish_infeed=given.get("MIDF", 0.0),
            finish_feed=given.get("FFP2", 0.0) or given["FFP1"],
        )
        if not given.get("VARI", 0.0) and plan.side:
            plan = replace(plan, walls=True)
        count = round(given["NUM"])
        step = given.get("INDA", 0.0) or 360.0 / count
        shape: PocketShape = ArcSlot(size, half, 0.0, math.radians(given.get("AFSL", 0.0)))
        centre = complex(given["CPA"], given["CPO"])
        if name != "SLOT2":
            shape = RoundedRectangle(given["LENG"] / 2.0, half, half)
        for k in range(count):
            angle = given.get("STA1", 0.0) + k * step
            middle = cmath.rect(size + given["LENG"] / 2.0, math.radians(angle)) if name != "SLOT2" else 0.0
            yield from pocket_rows(shape, plan, centre + middle, angle)

    return rows


def pocket(name: str) -> Cycle:
    """The maker of POCKET3 or POCKET4."""

    def rows(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
        required(name, given, "RTP", "RFP", "SDIS", "DP", "PA", "PO", "FFP1", "CDIR", "VARI")
        for key in ("AP1", "AP2", "AD"):
            if given.get(key):
                text = f"{key} of {name}, a pocket that is there already, is not read; leave it out"
                raise ValueError(text)
        radius = making.tool_radius()
        plan = _plan(making, name, given, radius)
        text = f"{name}: passes and allowances are those of the cycle, the single paths this reader's own"
        making.assume(text)
        place = complex(given["PA"], given["PO"])
        return pocket_rows(_shape(name, given, radius), plan, place, given.get("STA", 0.0))

    return rows


def _shape(name: str, given: Mapping[str, float], radius: float) -> PocketShape:
    if name == "POCKET4":
        required(name, given, "PRAD")
        size = given["PRAD"]
        if size <= 0.0:
            raise ValueError("PRAD, the radius of POCKET4, is to be above 0")
        return RoundedRectangle(size, size, size)
    required(name, given, "LENG", "WID")
    corner = given.get("CRAD", 0.0) or radius
    if min(given["LENG"], given["WID"]) <= 0.0:
        raise ValueError("LENG and WID of POCKET3 are to be above 0; dimensions from a corner are not read")
    if corner < radius:
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}; the tool has {radius:g}")
    a, b = given["LENG"] / 2.0, given["WID"] / 2.0
    if corner > min(a, b):
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}: more than half its width")
    return RoundedRectangle(a, b, corner)


def _cutting(making: Making, name: str, given: Mapping[str, float], radius: float) -> PocketPlan:
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
    return PocketPlan(
        depth=replace(hole_of(name, given), feed=0.0, what="pocket"),
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
        helix=(given.get("RAD1", 0.0), given.get("DP1", 0.0)),
    )


def _plan(making: Making, name: str, given: Mapping[str, float], radius: float) -> PocketPlan:
    plan = _cutting(making, name, given, radius)
    if plan.plunge == HELIX and plan.helix[0] > _shape(name, given, radius).room - radius - plan.side:
        raise ValueError(f"the helix of RAD1 {plan.helix[0]:g} has no room beside the tool in {name}")
    return plan
