"""The units of what is shown: lengths in mm or inch and feeds in their number per minute, as F words have
them. Inside the package and in files everything stays in mm and s."""

from __future__ import annotations

import re
from dataclasses import dataclass

from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.nc.language.detect import LATHE_NOTE
from planner.nc.points import in_inches, own_text
from planner.nc.program import Program

DIAMETERS = re.compile(rb"^[^(;\n]*?[Gg]0?7(?![\d.])", re.MULTILINE)  # LinuxCNC's word for them


@dataclass(frozen=True, kw_only=True)
class Units:
    """A unit of length [mm], its name, and that of feeds: each number per minute."""

    length: str = "mm"
    feed: str = "mm/min"
    mm: float = 1.0

    @property
    def per_feed(self) -> float:
        """What a feed [mm/s] is multiplied with."""
        return SECONDS_PER_MINUTE / self.mm

    def length_text(self, length: float) -> str:
        """A length [mm] with its unit."""
        return f"{length / self.mm:.4g} {self.length}"


UNITS = {"mm": Units(), "inch": Units(length="in", feed="in/min", mm=MM_PER_INCH)}


def units_of(program: Program, asked: str | None = None) -> Units:
    """The units that are `asked` for by their name in `UNITS`, or those of a program: of its first G20 or G21, mm
    without one."""
    if asked is not None:
        return UNITS[asked]
    return UNITS["inch" if in_inches(program, own_text(program) or b"") else "mm"]


def axis_titles(program: Program, units: Units) -> dict[str, str]:
    """A title for x, y and z [mm], that of x with what it is where the program writes diameters."""
    text = None if program.pen else own_text(program)
    turned = (
        any(LATHE_NOTE in note for note in program.assumptions) or DIAMETERS.search(text or b"") is not None
    )
    return {axis: f"{axis} {'radius ' if turned and axis == 'x' else ''}[{units.length}]" for axis in "xyz"}
