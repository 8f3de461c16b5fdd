"""How the figures of a verdict are known, and how much that leaves open: one record, of which terminal, report and `summary.json` tell.

    exact      the extreme itself, but for rounding
    certified  a bound: the figure is at most that, or the error at most so much larger (`open_mm`)
    sampled    the largest that was seen; between the times that were looked at it may be larger
    assumed    as `sampled`, and true of the motion only if it runs from row to row as the machine file says; `open_mm` is by how much
               a motion within the limits of the axes may leave that, |a| h^2 / 8 at rows h apart

The motion of a plan is looked at between its setpoints (between.py): where it runs on cubics that is exact or certified. What a file
says nothing of between its rows is the motion itself.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any

import numpy as np

from planner.base.units import MICROMETRE
from planner.verifier.between import BENT, OPEN, UNKNOWN
from planner.verifier.given import DERIVATIVES
from planner.verifier.stream import Observed
from planner.verifier.worst import Limits

CONTOUR, VERTEX = "contour error", "corners"
WAYS = {"linear": "straight lines", "cubic": "cubics", "hold": "steps"}


class Known(StrEnum):
    """How a figure is known (module text)."""

    EXACT = "exact"
    CERTIFIED = "certified"
    SAMPLED = "sampled"
    ASSUMED = "assumed"


@dataclass(frozen=True, kw_only=True)
class Claims:
    """How each figure of a verdict is known.

    known   : by the name of a limit, `CONTOUR` or `VERTEX`
    open_mm : by how much the errors of contour and vertices may be larger than was seen [mm]; None if unknown
    between : what is assumed between the rows of a file; "" for the motion of a plan
    """

    known: Mapping[str, Known]
    open_mm: float | None
    between: str = ""

    def sentence(self) -> str:
        """All in one line: "exact: velocity, acceleration, jerk; certified: feed, contour error, ..."."""
        said = []
        for how in Known:
            names = [name for name, known in self.known.items() if known is how]
            if not names:
                continue
            text = f"{how}: {', '.join(_together(names))}"
            if how is Known.ASSUMED:
                text += f", for {self.between}"
            if self.open_mm is not None and CONTOUR in names:
                text += f" to {self.open_mm / MICROMETRE:.2g} µm more"
            said.append(text)
        return "; ".join(said)

    def summary(self) -> dict[str, Any]:
        """The part `known` of `summary.json`."""
        return {
            "figures": {name: str(how) for name, how in self.known.items()},
            "open_mm": self.open_mm,
            "between": self.between,
        }


def claims_of(readings: list[Observed], limits: Limits, names: Iterable[str], interpolation: str) -> Claims:
    """Of a motion that was read, with limits of these names; of samples alone where there is one reading."""
    if len(readings) == 1:
        known = dict.fromkeys(names, Known.SAMPLED) | dict.fromkeys((CONTOUR, VERTEX), Known.ASSUMED)
        bow = float(np.linalg.norm(limits.per_axis[1])) * readings[0].gap_max ** 2 / 8.0
        way = f"{WAYS[interpolation]} from row to row"
        return Claims(known=MappingProxyType(known), open_mm=bow, between=way)
    left_open, unknown, bent = readings[1].known[[OPEN, UNKNOWN, BENT]]
    # where jerk is not limited acceleration may jump, and the jerk is what periods show of that
    quantities = DERIVATIVES if limits.jerk_limited else DERIVATIVES[:2]
    of_axes = {f"{quantity}.{letter}" for quantity in quantities for letter in limits.axes}
    known = {name: Known.EXACT if name in of_axes and not unknown else Known.SAMPLED for name in names}
    if not unknown:
        known |= {name: Known.CERTIFIED for name in known if name == "feed"}
    errors = Known.SAMPLED if unknown or bent else Known.CERTIFIED
    known |= dict.fromkeys((CONTOUR, VERTEX), errors)
    open_mm = float(left_open) if errors is Known.CERTIFIED else None
    return Claims(known=MappingProxyType(known), open_mm=open_mm)


def _together(names: list[str]) -> list[str]:
    """Names of axes as one: velocity.x and velocity.y as velocity."""
    parts = [(name, *name.split(".", 1), "")[:3] for name in names]
    return list(dict.fromkeys(what.replace("_", " ") if len(of) <= 1 else name for name, what, of in parts))
