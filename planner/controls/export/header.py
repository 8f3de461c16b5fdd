"""The head of a program that is written for a control: from what, for what, with which assumptions; and the modes that the program
does not say itself before its first move."""

from __future__ import annotations

from pathlib import PurePath

from planner.controls.export.controls import Control
from planner.controls.export.output import comment
from planner.controls.export.rows import Source
from planner.nc import codes
from planner.nc.program import plain
from planner.nc.state import system_name
from planner.planning.job.plan import Plan

FIRST_RUN = "First run: above the work, a hand on feed hold."
_MODES = {
    "units": (210, "G21"),
    "plane": (170, "G17"),
    "distance mode": (900, "G90"),
    "feed mode": (940, "G94"),
}


def head_of(source: Source, control: Control, plan: Plan, tolerance: float, what: str) -> list[str]:
    """The first lines of the file."""
    said = [
        f"{PurePath(plan.program.source).name}: {what}",
        f"for {control.name}, machine {plan.machine.name}, within {plain(tolerance)} mm of the program",
        *assumptions(source),
        FIRST_RUN,
    ]
    return [*(comment(text, control) for text in said), *_modes(source, control)]


def assumptions(source: Source, *, as_it_is: bool = False) -> list[str]:
    """What holds for coordinates and start, in words; `as_it_is` where all lines are the program's own."""
    program = source.program
    used = sorted({code for row in source.rows for code in row.g() if codes.G_GROUP[code] == "work offset"})
    system = " ".join(system_name(code) for code in used) or "the work offset in force"
    first = 0 if as_it_is else next((row.line for row in source.rows if row.plain), 0)
    own = (
        f"up to line {first - 1} the moves are the program's own"
        if first
        else "all lines are the program's own"
    )
    start = " ".join(
        f"{axis.upper()}{plain(float(at))}" for axis, at in zip(program.axes, program.start, strict=True)
    )
    return [
        f"Coordinates are the program's, in {system}; G53, G28, G30 stay as they are.",
        f"Planned from machine position {start}; {own}, from any start.",
    ]


def _modes(source: Source, control: Control) -> list[str]:
    """Units, plane, distance and feed mode, as far as no line says them before or beside the first that moves."""
    said: set[str] = set()
    for row in source.rows:
        said |= {codes.G_GROUP[code] for code in row.g() if code in control.g}
        if row.moves or row.text:
            break
    said -= {"distance mode"}  # which waits for a move
    words = [text for group, (code, text) in _MODES.items() if group not in said and code in control.g]
    return words if control.one_command else [" ".join(words)] * bool(words)
