"""The makers of rows by their names in `tree.Made`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from planner.nc.language import frames
from planner.nc.language.approach import KINDS, Approach, Departure
from planner.nc.language.making import Maker, Making, Row


def compensate(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """Radius compensation: side 1 left, -1 right, 0 off."""
    making.travel.compensate(round(given["side"]))
    return []


def approach(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """APPR of a kind (index in KINDS), with X Y Z of the first contour point, LEN, R, CCA, F and side."""
    unit, first = making.unit, np.array(making.here())
    for axis, letter in enumerate("XYZ"):
        first[axis] = given.get(letter, first[axis])
    found = Approach(
        kind=KINDS[round(given["kind"])],
        line=making.line,
        at=making.at,
        frame=making.frame,
        length=given.get("LEN", 0.0) * unit,
        radius=given.get("R", 0.0) * unit,
        angle=given.get("CCA", 0.0),
        feed=given.get("F"),
        first=first * unit,
        side=round(given["side"]) or -1,
        compensated=given["side"] != 0.0,
    )
    found.check("APPR")
    making.travel.approach(found)
    return []


def depart(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """DEP of a kind (index in KINDS), with X Y Z, LEN, R, CCA and F."""
    unit, end = making.unit, np.array(making.here())
    for axis, letter in enumerate("XYZ"):
        end[axis] = given.get(letter, end[axis])
    found = Departure(
        kind=KINDS[round(given["kind"])],
        line=making.line,
        at=making.at,
        frame=making.frame,
        length=given.get("LEN", 0.0) * unit,
        radius=given.get("R", 0.0) * unit,
        angle=given.get("CCA", 0.0),
        feed=given.get("F"),
        end=end * unit,
        raised="Z" in given,
    )
    found.check("DEP")
    if found.kind == "LCT" and not {"X", "Y"} & set(given):
        raise ValueError("DEP LCT needs its end as X and Y")
    making.travel.depart(found)
    return []


MAKERS: dict[str, Maker] = {
    "compensate": compensate,
    "approach": approach,
    "depart": depart,
    "siemens frame": frames.siemens,
    "heidenhain frame": frames.heidenhain,
    "frame in force": frames.in_force,
}
