"""The table of several planned programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner.base.units import MICROMETRE
from planner.report.times import hours_text

PASSED = "passed"
SAID_LINES = 3  # of what a program that did not pass says


def programs_table(rows: Sequence[tuple[str, str, Mapping[str, Any], str]]) -> Group:
    """Programs side by side, the sum of those that passed, and why the others did not.

    rows : name, outcome, the content of `summary.json` (empty where there is none), and what was said of it
    """
    table = Table(box=None, pad_edge=False)
    table.add_column("program", overflow="fold")
    for name in ("blocks", "cycle\ntime s", "total\ntime s", "contour\nµm", "computing\ns"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    time, total, incomplete, said = 0.0, 0.0, False, []
    for name, outcome, summary, text in rows:
        cycle = summary.get("cycle_time_s")
        beside = summary.get("beside_motion") or {}
        contour = (summary.get("verdict") or {}).get("contour_error_mm")
        table.add_row(
            name,
            f"{summary['blocks']:,}" if "blocks" in summary else "-",
            _number(cycle, ".4f"),
            _number(beside.get("total_s"), ".4f"),
            _number(contour, ".4g", MICROMETRE),
            _number(sum(summary["timings_s"].values()) if summary.get("timings_s") else None, ".2f"),
            Text(outcome, style="green" if outcome == PASSED else "bold red"),
        )
        if outcome == PASSED:
            time += cycle or 0.0
            total += beside.get("total_s") or 0.0
            incomplete |= not beside.get("complete", True)
        elif text or summary:
            told = (text or _why(summary)).splitlines()
            reason = "\n".join(told[-SAID_LINES:])
            said.append(Text(reason if reason.startswith(f"{name}:") else f"{name}: {reason}"))
    passed = sum(outcome == PASSED for _, outcome, _, _ in rows)
    words = f"{passed} of {len(rows)} programs passed: {time:.4f} s of motion{hours_text(time)}, {total:.4f} s in all"
    words += "; some of what they do beside the motion has no time in the machine file" if incomplete else ""
    return Group(table, Text(words), *said)


def _why(summary: Mapping[str, Any]) -> str:
    faults = (summary.get("verdict") or {}).get("faults") or [
        summary.get("sentence") or "no reason was given"
    ]
    return str(faults[0])


def _number(value: float | None, form: str, unit: float = 1.0) -> str:
    return "-" if value is None else format(value / unit, form)
