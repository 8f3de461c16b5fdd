"""A plan in eight lines for the people at the machine: time, tools, what is saved, what limits, tolerance,
verdict, notes, files. report/rows.py has all the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.controls.timing.times import by_name, tools_of
from planner.feedrate.constraints.limits import TANGENTIAL
from planner.planning.job.notes import tolerance_notes
from planner.report.rows import (
    FAILED,
    PASSED,
    SAVED,
    VERDICT,
    Rows,
    beside_rows,
    first_of,
    hours_text,
    saved_rows,
)
from planner.report.units import Units
from planner.report.word_feed import planned_blocks

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

NOTES, LIMITS, TOOLS, FAULTS = 3, 4, 6, 2  # that are told
DIGITS = 6  # behind the point of lengths: what is less is rounding
QUANTITIES = {"velocity": "speed", "acceleration": "acceleration", "jerk": "jerk", "power": "drive power"}
FURTHER = {"feed": "the programmed feed", TANGENTIAL.name: "acceleration along the path"}


def brief_rows(plan: Plan, units: Units, summed: Rows | None = None) -> Rows:
    """Labels and texts of time, tools, what is saved and what limits, tolerance and verdict; `summed` are the rows of the
    plan's summary, if there is one: the control's planner is not asked again."""
    if plan.trajectory is None or plan.verdict is None:
        return [("time", "-"), (VERDICT, f"not solved: {plan.sentence}")]
    rows: Rows = [("time", _time(plan))]
    tools = tool_times(plan)
    if tools:
        said = first_of([f"{name or 'before'} {seconds:.4g} s" for name, seconds in tools.items()], TOOLS)
        rows.append(("tools", ", ".join(said)))
    rows += saved_rows(plan) if summed is None else [(name, text) for name, text in summed if name == SAVED]
    if plan.grid is not None:
        told = [f"{limit_text(name)} {percent} %" for name, percent in plan.grid.percents()[:LIMITS]]
        of = f"{', '.join(told)} of the time" if told else "no limit for a hundredth of the time"
        rows.append(("limited by", of + ", some together" * (len(told) > 1)))
    rows.append(("tolerance used", _used(plan, units)))
    failed = "; ".join([FAILED, *first_of(plan.verdict.sentences, FAULTS)])
    return [*rows, (VERDICT, PASSED if plan.verdict.passed else failed)]


def note_lines(plan: Plan, notes: Sequence[str]) -> tuple[list[str], list[str]]:
    """Lines above the others: what may make it another part, a tolerance that is large beside it and what was
    assumed; and lines below them: the first of the other `notes`. Each with how many more there are."""
    large, assumed = tolerance_notes(plan.toolpath), list(plan.program.assumptions)
    above = [*(f"note: {note}" for note in large), *(f"assumed: {note}" for note in assumed)]
    below = [f"note: {note}" for note in notes if note not in large and note not in assumed]
    return _first(above), _first(below)


def _first(lines: list[str]) -> list[str]:
    more = len(lines) - NOTES
    return lines[:NOTES] + ([f"and {more} more, with -v"] if more > 0 else [])


def tool_times(plan: Plan) -> dict[str, float]:
    """Seconds of the motion by tool, "T1", and "" before the first; empty where the program has not several."""
    names = tools_of(plan.program)
    if plan.trajectory is None or len({*(names or ())}) < 2:
        return {}
    lasting = planned_blocks(plan.trajectory, plan.toolpath).duration
    blocks = np.bincount(plan.toolpath.block, lasting, len(plan.program)) + plan.program.dwell
    found = by_name(blocks, names)
    return found if len(found) > 1 else {}


def limit_text(name: str) -> str:
    """A limit's name in words: "jerk.x" is "jerk of X"."""
    quantity, _, axis = name.partition(".")
    if name in FURTHER or quantity not in QUANTITIES or not axis:
        return FURTHER.get(name, name)
    return f"{QUANTITIES[quantity]} of {axis[:-1]}{axis[-1].upper()}"


def _time(plan: Plan) -> str:
    assert plan.trajectory is not None
    motion = plan.trajectory.cycle_time
    beside = dict(beside_rows(plan.beside, motion, 0.0))
    total = motion + sum(it.seconds for it in plan.beside)
    missing = beside.get("not in the total") or beside.get("not in the cycle time")
    of = f": motion {motion:.4f} s, {beside['beside the motion']}" if "beside the motion" in beside else ""
    return f"{total:.4f} s{hours_text(total)}{of}" + (f"; without {missing}" if missing else "")


def _used(plan: Plan, units: Units) -> str:
    assert plan.verdict is not None
    errors = [plan.verdict.contour_error_mm, plan.verdict.vertex_error_mm]
    known = [error for error in errors if error is not None]
    if not known:
        return "not known"
    least, most = float(plan.toolpath.tolerance.min()), float(plan.toolpath.tolerance.max())
    of = f"{least / units.mm:.4g} to " if least < most else ""
    used = round(max(known) / units.mm, DIGITS)
    return f"{used:.4g} of {of}{units.length_text(most)}"
