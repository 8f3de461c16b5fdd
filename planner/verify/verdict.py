"""The records of a judgement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from planner.base.arrays import FloatArray, freeze
from planner.verify.corners import CornerCheck
from planner.verify.pieces import RATIO_ROUNDING
from planner.verify.ringing import Ringing


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitCheck:
    """The worst place of one quantity.

    ratio    : worst value / limit; the limit holds up to 1 + RATIO_ROUNDING
    value    : the quantity there, in `unit`
    limit    : what is allowed there, in `unit`; inf where nothing limits
    time     : when [s]
    position : (A,) where [mm]
    line     : NC line of the block there
    limited  : False if it is reported only ("not limited by this method")
    note     : how it was seen: "column", "differences of position", and "between the samples" for the dense motion
    """

    name: str
    unit: str
    ratio: float
    value: float
    limit: float
    time: float
    position: FloatArray
    line: int
    limited: bool = True
    note: str = ""

    def __post_init__(self) -> None:
        freeze(self, "position", float, (None,))

    @property
    def broken(self) -> bool:
        """The quantity is limited and beyond its limit."""
        return self.limited and self.ratio > 1.0 + RATIO_ROUNDING

    def sentence(self, axes: tuple[str, ...]) -> str:
        """What is there, of what is allowed, when and where: "velocity.x: 101 mm/s, 1.01 of the limit 100 mm/s at ..."."""
        where = " ".join(f"{letter}{value:.6g}" for letter, value in zip(axes, self.position, strict=True))
        said = f"{self.name}: {self.value:.7g} {self.unit}, {self.ratio:.6g} of the limit {self.limit:.6g} {self.unit}"
        return f"{said} at t = {self.time:.6g} s, {where}, line {self.line}" + (
            f" ({self.note})" if self.note else ""
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class AfterFilters:
    """What the machine's own filters leave of the tolerance (filtered.py); fields as in `Verdict`."""

    contour: LimitCheck
    vertex: LimitCheck
    contour_error_mm: float | None
    vertex_error_mm: float | None
    faults: tuple[str, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Verdict:
    """What `verify` found.

    passed           : every check holds (those "not limited" aside)
    limits           : by name: velocity.x, acceleration.x, jerk.x ..., feed, the normal acceleration if the machine limits it
    contour          : the motion's worst distance from the path as far as it could be followed, against the budget there
    vertex           : the worst distance of a programmed vertex from the motion, of those that are known, against the budget there
    corners          : eq. 18-20 at the programmed corners
    contour_error_mm : largest distance of the motion (samples, their chords, places between) from the path [mm]; None if it
                       could not be followed
    vertex_error_mm  : largest distance of a programmed vertex from the motion [mm]; None if one is not known
    lost_after       : NC line of the last block along which the motion could be followed; None if it ran the whole program
    end_error_mm     : distance of the first or last sample from the program's start or end, the larger [mm]
    chord_error_mm   : largest bound |normal acceleration| dt^2 / 8 of the bow over one period [mm]; contained in the contour
    order            : the blocks are run in the program's order, none is lost
    lost             : indices of the program's blocks that the motion never visits
    lost_lines       : their NC lines
    faults           : one sentence per failure: what, by how much, when, where, NC line
    after_filters    : the motion behind the machine's filters, judged likewise; None for a machine without
    ringing          : what each vibration mode of the machine does; reported, not judged
    notes            : what could not be judged sharply, and why
    """

    passed: bool
    limits: dict[str, LimitCheck]
    contour: LimitCheck
    vertex: LimitCheck
    corners: CornerCheck
    contour_error_mm: float | None
    vertex_error_mm: float | None
    end_error_mm: float
    chord_error_mm: float
    order: bool
    lost: tuple[int, ...]
    lost_lines: tuple[int, ...]
    faults: tuple[str, ...]
    after_filters: AfterFilters | None = None
    ringing: tuple[Ringing, ...] = ()
    lost_after: int | None = None
    notes: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """The part of `summary.json` that is called `verdict`."""
        after = self.after_filters
        behind = (
            {}
            if after is None
            else {
                "contour_error_after_filters_mm": after.contour_error_mm,
                "vertex_error_after_filters_mm": after.vertex_error_mm,
            }
        )
        return behind | {
            "passed": self.passed,
            "limits": {name: check.ratio for name, check in self.limits.items()},
            "contour_error_mm": self.contour_error_mm,
            "vertex_error_mm": self.vertex_error_mm,
            "end_error_mm": self.end_error_mm,
            "ringing": [mode.summary() for mode in self.ringing],
            "lost_after_line": self.lost_after,
        }
