"""Makers of rows.

A maker is a function of the running program's state and the values of a command; it gives rows of words in the program's coordinates
and units, each a list of letters and numbers, and raises ValueError for values that make no sense.

What programs of the languages mean that is planned otherwise, and may change geometry or time: sentences that are said first, by the
names under which statements carry them (`assumed_row`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from planner.nc.interpreter import Interpreter
from planner.nc.language.travel import Travel
from planner.nc.language.tree import ZERO, MadeRows, SourcePlace, made

ASSUMED = {
    "acceleration": "BRISK and DRIVE are not followed: acceleration and jerk are those of the machine file",
    "corner feed": "G621, slower feeds at corners, is not followed",
    "machine code": "an M code that the machine's builder defines is assumed not to move anything",
    "orientation": "the angles of rotary axes change evenly on a block (ORIAXES), not as the tool's direction turns",
    "rapid axes": "rapid moves are straight lines, as with RTLION",
    "spindle position": "positioning the spindle (SPOS) takes no time in this plan",
    "tool offset": "offsets of tools (D) are not added: z is that of the tool's tip",
    "tool centre feed": "F holds for the tool's centre (CFTCP); CFC and CFIN, the control's default, have it on the contour of arcs",
}


def assumed_row(place: SourcePlace, name: str) -> MadeRows:
    """The statement that says a sentence of ASSUMED, and is refused by strict reading."""
    assert name in ASSUMED
    return made(place, "assume", **{name: ZERO})


Row = list[tuple[str, float]]
Maker = Callable[["Making", Mapping[str, float]], Iterable[Row]]
ROWS_MAX = 200_000  # of one cycle: an infeed that small is a mistake


@dataclass(frozen=True)
class Making:
    """interpreter, travel : of the running program
    shared             : its variables that all calls share
    line, at, frame    : line, byte offset and call of the command
    """

    interpreter: Interpreter
    travel: Travel
    shared: dict[str, float]
    line: int
    at: int
    frame: int

    @property
    def unit(self) -> float:
        """mm per unit of the program."""
        return self.interpreter.state.unit

    def here(self) -> tuple[float, float, float]:
        """The position in the program's coordinates and unit."""
        x, y, z = self.travel.position() / self.unit
        return float(x), float(y), float(z)

    def tool_radius(self) -> float:
        """Radius of the loaded tool in the program's unit. Raises ValueError where the machine file gives no diameter."""
        found = self.travel.radius()
        if found == 0.0:
            number = self.interpreter.state.tool_loaded
            raise ValueError(
                f"the cycle needs the diameter of tool {number}; write it into [tools] of the machine file"
            )
        return found / self.unit

    def assume(self, text: str) -> None:
        """Keep what is assumed of the command and may change geometry or time. Raises ValueError where nothing may be assumed."""
        if self.interpreter.findings.strict:
            raise ValueError(f"{text} (assumed without --strict)")
        self.interpreter.findings.assume(text, self.line)


def equal_steps(whole: float, most: float) -> int:
    """The number of equal steps of at most `most` that a length is divided into; 1 where `most` is 0. Raises ValueError."""
    if whole <= 0.0 or most <= 0.0:
        return 1
    count = whole / most
    if count > ROWS_MAX:
        raise ValueError(f"{most:g} is too small an infeed for {whole:g}: more than {ROWS_MAX:,} passes")
    return max(1, -int(-(count - _ROUNDING) // 1))


_ROUNDING = 1e-9  # of a number of steps
