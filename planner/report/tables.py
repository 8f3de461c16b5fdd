"""Tables for the terminal: a plan, its corners, a verdict, a program, the machines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.base.sizes import SIZES
from planner.base.units import MICROMETRE, SECONDS_PER_MINUTE
from planner.machine import LINEAR_AXES, Machine
from planner.nc.info import PLACES_SHOWN
from planner.report.brief import brief_rows, note_lines
from planner.report.rows import (
    FAILED,
    PASSED,
    VERDICT,
    extent_rows,
    first_of,
    hours_text,
    number_text,
    plan_rows,
    ratio_text,
    smoothing,
    verdict_rows,
)
from planner.report.units import UNITS, Units

if TYPE_CHECKING:
    from planner.nc.faults import Fault
    from planner.nc.info import ProgramInfo
    from planner.nc.program import Expansion
    from planner.planning.job.plan import Plan
    from planner.verifier import CornerCheck, Verdict


CALLS_SHOWN = 10  # subprograms that `info` names
CORNERS_SHOWN = SIZES.table_corners
# Lines of each, so that a table fits a terminal of 24 rows.
NOTES_SHOWN = 8
ASSUMED_SHOWN = 8


def plan_table(plan: Plan, summary: Mapping[str, Any] | None = None) -> Group:
    """The plan in a dozen lines: times, largest ratios, errors, corners, active limits, savings, computing
    time, how it was solved.

    summary : of the plan, if there is one: its rows are printed, and below its notes without what `assumed_lines` says first
    """
    first = set(plan.program.assumptions)
    notes, told = (plan.notes, plan_rows(plan)) if summary is None else (summary["notes"], summary["told"])
    below = [Text(f"note: {note}") for note in first_of([n for n in notes if n not in first], NOTES_SHOWN)]
    return titled(_title(plan), _pairs(told), *below)


def brief_table(plan: Plan, units: Units, summary: Mapping[str, Any] | None = None) -> Group:
    """The plan in eight lines, as report/brief.py says; notes and what is saved as in `plan_table`."""
    notes, told = (plan.notes, None) if summary is None else (summary["notes"], summary["told"])
    table = _pairs(brief_rows(plan, units, told))
    above, below = note_lines(plan, notes)
    first = [Text(line, style="yellow") for line in above]
    return Group(*first, titled(_title(plan), table, *map(Text, below)))


def _title(plan: Plan) -> str:
    return f"{plan.program.source}: {plan.method}{smoothing(plan)}, machine {plan.machine.name}"


def assumed_lines(assumptions: Sequence[str], most: int = ASSUMED_SHOWN) -> list[Text]:
    """The assumptions about a program that may change geometry or time: the first lines of what a command
    prints; at most so many."""
    return [Text(f"assumed: {text}", style="yellow") for text in first_of(assumptions, most)]


def verdict_table(verdict: Verdict, title: str, asked: dict[str, str] | None = None) -> Group:
    """A verdict by itself.

    asked : name and text of the lines before it
    """
    return titled(title, _pairs([*(asked or {}).items(), *verdict_rows(verdict)]))


def corners_table(corners: CornerCheck | None, units: Units = UNITS["mm"]) -> Table | None:
    """Eq. 18-20 at every programmed corner, feeds in `units`; of many corners those closest to the limits. None
    without corners."""
    if corners is None or not len(corners):
        return None
    speed, budget = corners.told()
    closest = np.maximum(speed, budget)
    worst = np.argsort(-closest, kind="stable")[:CORNERS_SHOWN]  # NaN, not looked at, comes last
    shown = f"the {len(worst):,} closest to eq. 18-19 of " if len(worst) < len(corners) else ""
    table = Table(title=f"{shown}{len(corners):,} corners", title_justify="left", box=None, pad_edge=False)
    of_corner = ("line", "angle\ndeg", f"feed\n{units.feed}")
    ratios = ("eq. 19\nfeed / its own", "eq. 18\nerror / budget", f"eq. 20\n{units.feed}", "feed /\neq. 20")
    for name in (*of_corner, *ratios):
        table.add_column(name, justify="right")
    for k in sorted(worst):
        known = (
            f"{units.per_feed * corners.feed_planned[k]:.4g}",
            ratio_text(speed[k]),
            ratio_text(budget[k]),
            f"{units.per_feed * corners.feed_paper[k]:.4g}",
            f"{corners.gain[k]:.3f}" if np.isfinite(corners.gain[k]) else "-",
        )
        angle = f"{np.rad2deg(corners.theta[k]):.2f}"
        unknown = ("not looked at", "-", "-", known[3], "-")
        table.add_row(str(corners.line[k]), angle, *(known if corners.looked[k] else unknown))
    return table


def info_table(info: ProgramInfo) -> Group:
    """The reader's assumptions, what a program contains, and every construct that is not supported."""
    blocks = sum(info.blocks.values())
    title = f"{info.source}: {info.lines:,} lines, {blocks:,} blocks"
    table = pairs_table()
    table.add_row("blocks", _counts(info.blocks))
    if info.full_circles or info.helices:
        arcs = {"full circles": info.full_circles, "helices": info.helices}
        table.add_row("arcs among them", _counts(arcs))
    for row in extent_rows(info.extent_min, info.extent_max, info.work_extent):
        table.add_row(*row)
    lengths = ", ".join(f"{kind} {length:,.3f}" for kind, length in info.length.items() if length)
    table.add_row("length [mm]", lengths)
    if not np.isnan(info.feed[0]):
        low, high = (feed * SECONDS_PER_MINUTE for feed in info.feed)
        given = f"{low:g} to {high:g}, {info.feed_changes:,} changes"
        table.add_row("feed [mm/min]", given if np.isfinite(low) else "as fast as the machine allows")
        least, _, median, _, largest = info.segment_length
        table.add_row("feed moves [mm]", f"{least:.4g} to {largest:.4g} long, median {median:.4g}")
    turns = ", ".join(f"{count:,} over {angle:g}°" for angle, count in info.corners.items() if count)
    table.add_row("corners", turns or "none")
    if info.zero_moves:
        table.add_row("moves of length zero", f"{info.zero_moves:,}")
    if info.dwell:
        table.add_row("dwells", f"{info.dwell:g} s")
    if info.tools:
        table.add_row("tools", ", ".join(f"T{tool}" for tool in info.tools))
    if info.events:
        table.add_row("other words", _counts(info.events))
    if info.expansion is not None:
        table.add_row("expanded", _expanded(info.expansion))
    if (point := info.tool_point) is not None:
        said = f"on by {point.word}, line {point.line}; a tool of {point.length:g} mm"
        table.add_row("tool centre point", said)
    below = [Text(f"note: {note}") for note in info.notes[len(info.assumptions) :]]
    if info.unsupported:
        below += _unsupported(info.unsupported)
    elif info.assumptions:
        said = "nothing is refused; geometry and time hold if what is assumed above is so"
        below.append(Text(said, style="yellow"))
    else:
        below.append(Text("every construct is supported", style="green"))
    return Group(*assumed_lines(info.assumptions, PLACES_SHOWN), Text(title, style="bold"), table, *below)


def _expanded(expansion: Expansion) -> str:
    """The subprograms that were expanded, most called first."""
    calls = sorted(expansion.calls, key=lambda call: -call[1])
    shown = ", ".join(f"{name} {times:,} times" for name, times in calls[:CALLS_SHOWN])
    more = f" and {len(calls) - CALLS_SHOWN:,} more" if len(calls) > CALLS_SHOWN else ""
    called = f"called {shown}{more}; " if calls else ""
    turns = f"{expansion.turns:,} turns of loops, jumps and calls; " if expansion.turns else ""
    return f"as {expansion.dialect}: {called}{turns}{expansion.rows:,} lines executed"


def _unsupported(faults: Sequence[Fault]) -> list[Text]:
    """The places of the faults, gathered by message, `PLACES_SHOWN` in all; the others are counted."""
    places: dict[str, list[str]] = {}
    for fault in faults[:PLACES_SHOWN]:
        places.setdefault(fault.message, []).append(f"{fault.line}:{fault.column} {fault.word}")
    more = len(faults) - PLACES_SHOWN
    shown = f", the first {PLACES_SHOWN}" if more > 0 else ""
    said = [Text(f"not supported, {len(faults):,} places{shown} (line:column word):", style="bold red")]
    for message, where in places.items():
        said += [Text(f"{message} ({len(where):,})"), Text("    " + ", ".join(where), style="dim")]
    return [*said, *([Text(f"and {more:,} more")] if more > 0 else [])]


def machines_table(machines: Iterable[Machine]) -> Table:
    """Built-in machines and their main limits, axis by axis."""
    table = Table(box=None, pad_edge=False)
    limits = ("velocity\nmm/s", "acceleration\nmm/s²", "jerk\nm/s³")
    for name in ("machine", "dt\nms", "tolerance\nmm", "axes", *limits):
        table.add_column(name, justify="left" if name in ("machine", "axes") else "right")
    for machine in machines:
        axes = [machine.axes[letter] for letter in machine.axes if letter in LINEAR_AXES]
        table.add_row(
            machine.name,
            f"{machine.dt * 1e3:g}",
            f"{machine.tolerance:g}",
            " ".join(machine.axes),
            " ".join(f"{axis.velocity:g}" for axis in axes),
            " ".join(f"{axis.acceleration:g}" for axis in axes),
            " ".join(f"{axis.jerk * MICROMETRE:g}" for axis in axes),
        )
    return table


def _pairs(rows: Iterable[tuple[str, str]]) -> Table:
    """A table of rows as they are, the verdict in its colour."""
    table, styles = pairs_table(), {PASSED: "green", FAILED: "bold red"}
    for label, text in rows:
        style = styles.get(text.partition(";")[0], "") if label == VERDICT else ""
        table.add_row(Text(label), Text(text, style=style))
    return table


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{count:,} {name}" for name, count in counts.items() if count) or "none"


def outcomes_table(things: Iterable[str], numbers: Iterable[str]) -> Table:
    """An empty table of plans: columns of what they are, of numbers, and the verdict."""
    table = Table(box=None, pad_edge=False)
    for name in things:
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    return table


def outcome_text(outcome: str) -> Text:
    """The outcome of a plan, in its colour."""
    return Text(outcome, style="green" if outcome == PASSED else "bold red")


def pairs_table() -> Table:
    """An empty table of names and what there is to say of them."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    return table


def titled(title: str, *parts: RenderableType) -> Group:
    """Parts under a title, which is not the table's own: that is folded to the table's width."""
    return Group(Text(title, style="bold"), *parts)


SAID_LINES = 3  # of what a program that did not pass says


def programs_table(rows: Sequence[tuple[str, str, Mapping[str, Any], str]]) -> Group:
    """Programs side by side, the sum of those that passed, and why the others did not.

    rows : name, outcome, the content of `summary.json` (empty where there is none), and what was said of it
    """
    headings = ("blocks", "cycle\ntime s", "total\ntime s", "contour\nµm", "computing\ns")
    table = outcomes_table(["program"], headings)
    time, total, incomplete, said = 0.0, 0.0, False, []
    for name, outcome, summary, text in rows:
        cycle = summary.get("cycle_time_s")
        beside = summary.get("beside_motion") or {}
        contour = (summary.get("verdict") or {}).get("contour_error_mm")
        table.add_row(
            name,
            f"{summary['blocks']:,}" if "blocks" in summary else "-",
            number_text(cycle, ".4f"),
            number_text(beside.get("total_s"), ".4f"),
            number_text(contour, ".4g", MICROMETRE),
            number_text(sum(summary["timings_s"].values()) if summary.get("timings_s") else None, ".2f"),
            outcome_text(outcome),
        )
        if outcome == PASSED:
            time += cycle or 0.0
            total += beside.get("total_s") or 0.0
            incomplete |= not beside.get("complete", True)
        elif text or summary:
            faults = (summary.get("verdict") or {}).get("faults") or [summary.get("sentence")]
            told = (text or str(faults[0] or "no reason was given")).splitlines()
            reason = "\n".join(told[-SAID_LINES:])
            said.append(Text(reason if reason.startswith(f"{name}:") else f"{name}: {reason}"))
    passed = sum(outcome == PASSED for _, outcome, _, _ in rows)
    words = f"{passed} of {len(rows)} programs passed: {time:.4f} s of motion{hours_text(time)}, {total:.4f} s in all"
    words += "; some of what they do beside the motion has no time in the machine file" if incomplete else ""
    return Group(table, Text(words), *said)
