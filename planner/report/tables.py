"""Tables for the terminal: a plan, its corners, a verdict, a program, the machines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.base.names import SINGLE_CORNERS
from planner.base.sizes import SIZES
from planner.base.units import MICROMETRE, SECONDS_PER_MINUTE
from planner.machine import LINEAR_AXES, Machine
from planner.nc.info import PLACES_SHOWN
from planner.report.beside import beside_rows
from planner.report.optimum import held_by_text, price_rows
from planner.report.times import hours_text

if TYPE_CHECKING:
    from planner.base.arrays import FloatArray
    from planner.job.plan import Plan
    from planner.nc.faults import Fault
    from planner.nc.info import ProgramInfo
    from planner.nc.program import Expansion
    from planner.verify import CornerCheck, Ringing, Verdict

CALLS_SHOWN = 10  # subprograms that `info` names
CORNERS_SHOWN = SIZES.table_corners
# Lines of each, so that a table fits a terminal of 24 rows.
FAULTS_SHOWN = 8
NOTES_SHOWN = 8
ASSUMED_SHOWN = 8


def plan_table(plan: Plan, notes: Sequence[str] | None = None) -> Group:
    """The plan in a dozen lines: times, largest ratios, errors, corners, active limits, savings, computing time, how it was solved.

    notes : printed below, without what `assumed_lines` says first; None for those of the plan
    """
    title = f"{plan.program.source}: {plan.method}{_smoothing(plan)}, machine {plan.machine.name}"
    table = _pairs()
    if plan.trajectory is not None:
        time = plan.trajectory.cycle_time
        table.add_row("cycle time", f"{time:.4f} s{hours_text(time)}")
        if plan.method != "stop" and np.isfinite(plan.stop_time):
            table.add_row(
                "stopping at every block",
                f"{plan.stop_time:.4f} s, {plan.stop_time / time:.2f} times as long",
            )
        for row in beside_rows(plan.beside, time, float(plan.program.dwell.sum())):
            table.add_row(row[0], Text(row[1]))
    if plan.verdict is not None:
        _add_verdict(table, plan.verdict)
    if plan.grid is not None:
        table.add_row("held by", held_by_text(plan.grid))
    if plan.prices is not None and plan.trajectory is not None:
        for row in price_rows(plan.prices, plan.trajectory.cycle_time):
            table.add_row(*row)
    table.add_row("blocks, grid points", f"{len(plan.program):,}, {plan.grid_points:,}")
    stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in plan.timings.items())
    table.add_row("computing time [s]", f"{sum(plan.timings.values()):.2f}: {stages}" if stages else "-")
    table.add_row("solution", plan.sentence)
    first = set(plan.program.assumptions)
    said = [note for note in (plan.notes if notes is None else notes) if note not in first]
    return _titled(title, table, *(Text(f"note: {note}") for note in _first(said, NOTES_SHOWN)))


def assumed_lines(assumptions: Sequence[str], most: int = ASSUMED_SHOWN) -> list[Text]:
    """What was assumed of a program and may change geometry or time: the first lines of what a command prints; at most so many."""
    return [Text(f"assumed: {text}", style="yellow") for text in _first(assumptions, most)]


def _smoothing(plan: Plan) -> str:
    """How the path was smoothed, where the method's name does not say it."""
    if plan.corner in (None, plan.method):
        return ""
    return f" on {plan.corner} corners" if plan.geometry == SINGLE_CORNERS else f", geometry {plan.geometry}"


def verdict_table(verdict: Verdict, title: str, asked: dict[str, str] | None = None) -> Group:
    """A verdict by itself.

    asked : name and text of the lines before it
    """
    table = _pairs()
    for name, text in (asked or {}).items():
        table.add_row(name, text)
    _add_verdict(table, verdict)
    return _titled(title, table)


def corners_table(corners: CornerCheck) -> Table | None:
    """Eq. 18-20 at every programmed corner; of many corners those closest to the limits. None without corners."""
    if not len(corners):
        return None
    closest = np.maximum(corners.speed_ratio, corners.budget_ratio)
    worst = np.argsort(-closest, kind="stable")[:CORNERS_SHOWN]  # NaN, not looked at, comes last
    shown = f"the {len(worst):,} closest to eq. 18-19 of " if len(worst) < len(corners) else ""
    table = Table(title=f"{shown}{len(corners):,} corners", title_justify="left", box=None, pad_edge=False)
    for name in (
        "line",
        "angle\ndeg",
        "feed\nmm/s",
        "eq. 19\nfeed / its own",
        "eq. 18\nerror / budget",
        "eq. 20\nmm/s",
        "feed /\neq. 20",
    ):
        table.add_column(name, justify="right")
    for k in sorted(worst):
        known = (
            f"{corners.feed_planned[k]:.3f}",
            ratio_text(corners.speed_ratio[k]),
            ratio_text(corners.budget_ratio[k]),
            f"{corners.feed_paper[k]:.3f}",
            f"{corners.gain[k]:.3f}",
        )
        angle = f"{np.rad2deg(corners.theta[k]):.2f}"
        unknown = ("not looked at", "-", "-", known[3], "-")
        table.add_row(str(corners.line[k]), angle, *(known if corners.looked[k] else unknown))
    return table


def info_table(info: ProgramInfo) -> Group:
    """What the reader assumed, what a program contains, and every construct that is not supported."""
    blocks = sum(info.blocks.values())
    title = f"{info.source}: {info.lines:,} lines, {blocks:,} blocks"
    table = _pairs()
    table.add_row("blocks", _counts(info.blocks))
    if info.full_circles or info.helices:
        table.add_row(
            "arcs among them", _counts({"full circles": info.full_circles, "helices": info.helices})
        )
    ends = zip("xyz", info.extent_min, info.extent_max, strict=False)
    table.add_row("extent [mm]", ", ".join(f"{axis} {low:.3f} to {high:.3f}" for axis, low, high in ends))
    table.add_row(
        "length [mm]", ", ".join(f"{kind} {length:,.3f}" for kind, length in info.length.items() if length)
    )
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
        table.add_row(
            "tool centre point", f"on by {point.word}, line {point.line}; a tool of {point.length:g} mm"
        )
    others = info.notes[len(info.assumptions) :]
    below = [Text(f"note: {note}") for note in others]
    if info.unsupported:
        below += _unsupported(info.unsupported)
    elif info.assumptions:
        below.append(
            Text("nothing is refused; geometry and time hold if what is assumed above is so", style="yellow")
        )
    else:
        below.append(Text("every construct is supported", style="green"))
    return Group(*assumed_lines(info.assumptions, PLACES_SHOWN), Text(title, style="bold"), table, *below)


def _expanded(expansion: Expansion) -> str:
    """What was expanded, most called subprograms first."""
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
    for name in (
        "machine",
        "dt\nms",
        "tolerance\nmm",
        "axes",
        "velocity\nmm/s",
        "acceleration\nmm/s²",
        "jerk\nm/s³",
    ):
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


def _add_verdict(table: Table, verdict: Verdict) -> None:
    for quantity, checks in _by_quantity(verdict).items():
        said = ", ".join(
            f"{name.partition('.')[2] or ''} {ratio_text(check.ratio)}".strip() for name, check in checks
        )
        free = "" if all(check.limited for _, check in checks) else "  (not limited by this method)"
        table.add_row(f"{quantity.replace('_', ' ')} / limit", said + free)
    table.add_row("contour error", _micrometres(verdict.contour_error_mm, verdict))
    if verdict.linear_error_mm is not None:
        both = f"{verdict.linear_error_mm / MICROMETRE:.3f} µm in linear axes, {verdict.angle_error_deg:.4g}° in rotary ones"
        table.add_row("of it", both)
    table.add_row("corners missed by", _micrometres(verdict.vertex_error_mm, verdict))
    if (after := verdict.after_filters) is not None:
        table.add_row("contour error after the filters", _micrometres(after.contour_error_mm, verdict))
        table.add_row("corners missed after the filters by", _micrometres(after.vertex_error_mm, verdict))
    table.add_row("end error", f"{verdict.end_error_mm / MICROMETRE:.3g} µm")
    table.add_row("corners", verdict.corners.sentence())
    for mode in verdict.ringing:
        table.add_row(f"rings at {mode.frequency:g} Hz", _ringing_text(mode))
    if verdict.passed:
        table.add_row("verdict", Text("passed", style="green"))
        return
    table.add_row("verdict", Text("FAILED", style="bold red"))
    for fault in _first(verdict.faults, FAULTS_SHOWN):
        table.add_row("", Text(fault))


def _ringing_text(mode: Ringing) -> str:
    """Amplitudes after the motion and peaks during it, axis by axis."""

    def said(values: FloatArray) -> str:
        return ", ".join(
            f"{axis} {value / MICROMETRE:.4g} µm" for axis, value in zip(mode.axes, values, strict=True)
        )

    return f"after the motion {said(mode.after)}; at most {said(mode.during)} during it"


def _micrometres(distance: float | None, verdict: Verdict) -> str:
    """A distance [mm], or why it is not known."""
    if distance is None:
        return f"not known: lost after line {verdict.lost_after}" if verdict.lost_after else "not known"
    return f"{distance / MICROMETRE:.3f} µm"


def _by_quantity(verdict: Verdict) -> dict[str, list]:
    """Limits grouped by what stands before the dot: velocity.x, velocity.y -> velocity."""
    groups: dict[str, list] = {}
    for name, check in verdict.limits.items():
        groups.setdefault(name.partition(".")[0], []).append((name, check))
    return groups


def ratio_text(value: float) -> str:
    """A ratio to a limit as text; near 1 with six digits, to which the verdict rounds."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.6f}" if 0.999 < value < 1.01 else f"{value:.4g}"


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{count:,} {name}" for name, count in counts.items() if count) or "none"


def _first(items: Sequence[str], count: int) -> list[str]:
    more = len(items) - count
    return [*items[:count], *([f"and {more} more"] if more > 0 else [])]


def _pairs() -> Table:
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    return table


def _titled(title: str, *parts: RenderableType) -> Group:
    # not the table's own title, which is folded to the table's width
    return Group(Text(title, style="bold"), *parts)
