"""Pockets and slots of Sinumerik controls (cycles.py has their arguments), and what their arguments give."""

import cmath
import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import replace

from planner.nc.language import milling
from planner.nc.language.making import HolePlan, Making, Row

_OVERLAP = 0.8  # of the tool's diameter between two paths, where MIDA is 0
_SAID = "{0}: passes and allowances are those of the cycle, the single paths this reader's own"


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


def slots(making: Making, given: Mapping[str, float], *, name: str) -> Iterator[Row]:
    """SLOT1, SLOT2 and LONGHOLE: pockets, each turned about the circle's middle."""
    needed = {"SLOT1": ("LENG", "WID"), "SLOT2": ("AFSL", "WID"), "LONGHOLE": ("LENG",)}[name]
    required(name, given, "NUM", "CPA", "CPO", "RAD", "FFP1", *needed)
    hole, radius, size = hole_of(name, given), making.tool_radius(), given["RAD"]
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


def pocket(making: Making, given: Mapping[str, float], *, name: str) -> Iterator[Row]:
    """POCKET3 and POCKET4. Raises ValueError."""
    required(name, given, "RTP", "RFP", "SDIS", "DP", "PA", "PO", "FFP1", "CDIR", "VARI")
    for key in ("AP1", "AP2", "AD"):
        if given.get(key):
            text = f"{key} of {name}, a pocket that is there already, is not read; leave it out"
            raise ValueError(text)
    radius = making.tool_radius()
    plan = _cutting(making, name, given, radius)
    making.assume(_SAID.format(name))
    shape = _shape(name, given, radius)
    if plan.plunge == milling.HELIX and plan.helix[0] > shape.room - radius - plan.side:
        raise ValueError(f"the helix of RAD1 {plan.helix[0]:g} has no room beside the tool in {name}")
    return milling.pocket_rows(shape, plan, complex(given["PA"], given["PO"]), given.get("STA", 0.0))


def _shape(name: str, given: Mapping[str, float], radius: float) -> milling.PocketShape:
    if name == "POCKET4":
        required(name, given, "PRAD")
        size = given["PRAD"]
        if size <= 0.0:
            raise ValueError("PRAD, the radius of POCKET4, is to be above 0")
        return milling.RoundedRectangle(size, size, size)
    required(name, given, "LENG", "WID")
    corner = given.get("CRAD", 0.0) or radius
    if min(given["LENG"], given["WID"]) <= 0.0:
        raise ValueError("LENG and WID of POCKET3 are to be above 0; dimensions from a corner are not read")
    if corner < radius:
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}; the tool has {radius:g}")
    a, b = given["LENG"] / 2.0, given["WID"] / 2.0
    if corner > min(a, b):
        raise ValueError(f"the corners of POCKET3 have a radius of {corner:g}: more than half its width")
    return milling.RoundedRectangle(a, b, corner)


def _cutting(making: Making, name: str, given: Mapping[str, float], radius: float) -> milling.PocketPlan:
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
        depth=replace(hole_of(name, given), what="pocket"),
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
