"""Tables of a study for the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner.base.units import MICROMETRE
from planner.commands.study.points import PASSED, TABLE
from planner.commands.study.settings import unit_of, value_of
from planner.commands.study.variant import StudiedJob
from planner.report.summary import json_ready

if TYPE_CHECKING:
    from planner.commands.study.sweep import Sweep
    from planner.commands.study.what_if import Forecast, WhatIf

REASONS_SHOWN = 5  # why points did not pass


def what_if_table(job: StudiedJob, rows: Sequence[WhatIf], title: str) -> Group:
    """Rows of `what_if` side by side, followed by the reason for each one that did not pass."""
    table = Table(box=None, pad_edge=False)
    table.add_column("change", no_wrap=True)
    table.add_column("from", no_wrap=True)
    for name in ("cycle\ntime s", "change\ns", "foretold\ns", "change\n%", "contour\nµm"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    said = []
    time = rows[0].row.cycle_time
    for it in rows:
        row = it.row
        table.add_row(
            _changes(job, it),
            _present(job, it),
            "-" if row.cycle_time is None else f"{row.cycle_time:.4f}",
            "-" if it.change is None or not it.settings else f"{it.change:+.4f}",
            foretold_text(it.foretold),
            "-" if it.change is None or not it.settings or not time else f"{100.0 * it.change / time:+.2f}",
            "-" if row.contour_error is None else f"{row.contour_error / MICROMETRE:.4g}",
            Text(row.outcome, style="green" if row.passed else "bold red"),
        )
        if not row.passed:
            said.append(Text(f"{it.label}: {row.sentence}"))
    return Group(Text(title, style="bold"), table, *said)


def foretold_text(foretold: Forecast | None) -> str:
    """A forecast as a number, or as a range where its ends are more than their rounding apart."""
    if foretold is None:
        return "-"
    least, most = f"{foretold.least:+.3g}", f"{foretold.most:+.3g}"
    return least if least == most else f"{least} to {most}"


def _changes(job: StudiedJob, it: WhatIf) -> str:
    if len(it.settings) != 1:
        return it.label
    (setting,) = it.settings
    return f"{setting} {unit_of(setting.name, job.machine)}".rstrip()


def _present(job: StudiedJob, it: WhatIf) -> str:
    if len(it.settings) != 1:
        return ""
    value = value_of(it.settings[0].name, job.machine, job.present_tolerance)
    return "-" if value is None else "several" if value != value else f"{value:g}"


def sweep_table(done: Sweep, title: str) -> Group:
    """A sweep in a few lines: how many points, their outcomes, the fastest that passed, and why the others did not."""
    outcomes = Counter(row["outcome"] for row in done.rows)
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    before = f", {done.reused:,} of them planned before" if done.reused else ""
    told = ", ".join(f"{count:,} {outcome}" for outcome, count in outcomes.most_common())
    table.add_row("points", f"{len(done.rows):,}{before}: {told}")
    passed = [row for row in done.rows if row["outcome"] == PASSED]
    for name, pick in (("fastest", min), ("slowest", max)):
        if passed:
            row = pick(passed, key=lambda each: each["cycle_time_s"])
            at = ", ".join(f"{one.name}={row[one.name]:g}" for one in done.varied)
            table.add_row(name, f"{row['cycle_time_s']:.4f} s at {at}")
    reasons = Counter((row["outcome"], row["sentence"]) for row in done.rows if row["outcome"] != PASSED)
    said = [
        Text(f"{count:,} {outcome}: {sentence}")
        for (outcome, sentence), count in reasons.most_common(REASONS_SHOWN)
    ]
    if len(reasons) > REASONS_SHOWN:
        said.append(Text(f"and {len(reasons) - REASONS_SHOWN:,} more reasons; {TABLE} has them all"))
    return Group(Text(title, style="bold"), table, *said)


def what_if_dict(job: StudiedJob, rows: Sequence[WhatIf]) -> dict[str, Any]:
    """Rows of `what_if`, ready for JSON."""
    return json_ready(
        {
            "program": job.program.source,
            "machine": job.machine.name,
            "rows": [
                {
                    "change": {setting.name: setting.value for setting in it.settings},
                    "outcome": it.row.outcome,
                    "sentence": it.row.sentence,
                    "cycle_time_s": it.row.cycle_time,
                    "change_s": it.change,
                    "foretold_s": None if it.foretold is None else list(it.foretold),
                    "contour_error_mm": it.row.contour_error,
                    "planning_time_s": it.row.planning_time,
                }
                for it in rows
            ],
        }
    )
