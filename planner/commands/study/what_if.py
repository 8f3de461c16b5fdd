"""A job as it is, with each of some settings changed alone, and with all of them, planned again; beside what
the prices of the first plan foretold, without planning again.

The price p = dT/d(ln L) of a limit, of the feed or of the tolerance is known, and what more of it saves,
between a least and a most. Other values follow by the power law of sensitivity/prices.py: less of it costs p/n
(1 - r^-n) at r times the value, more of it saves in proportion to 1 - r^-n. Settings without a price have no
forecast, and changes at once are added up.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Group
from rich.text import Text

from planner.base.errors import InputError
from planner.base.units import MICROMETRE
from planner.commands.study.points import PASSED, TABLE
from planner.commands.study.settings import FEED, TOLERANCE, Setting, StudiedJob, unit_of, value_of
from planner.feedrate.constraints.limits import LIMITS
from planner.machine import Machine
from planner.report.compare import Row, row_of_plan, tried
from planner.report.rows import number_text
from planner.report.summary import json_ready
from planner.report.tables import outcome_text, outcomes_table, pairs_table, titled
from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE, POWER
from planner.sensitivity.records import PriceList

if TYPE_CHECKING:
    from planner.commands.study.sweep import Sweep


AS_PLANNED, TOGETHER = "as it is", "all together"


@dataclass(frozen=True, kw_only=True)
class WhatIf:
    """One row: a change, and what came of it."""

    label: str  # the change in words
    settings: tuple[Setting, ...]  # the changed settings, none for the job as it is
    row: Row  # how the plan ended (report/compare.py)
    change: float | None  # of the cycle time against the job as it is [s]; None without a motion
    foretold: Forecast | None  # the same by prices; None where there are none


def what_if(
    job: StudiedJob, settings: Sequence[Setting], progress: Callable[[str, str, float], None] | None = None
) -> list[WhatIf]:
    """Plan a job as it is, with each setting alone, and with all of them if there is more than one.

    progress : called with the label of the row, the stage and the fraction of it that is done

    Raises InputError if a setting is there twice, and for a job that cannot be planned as it is;
    NotSolvedError if it has no motion. What cannot be planned with another setting is its row.
    """
    names = [setting.name for setting in settings]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name} is set twice; `planner sweep` plans with several values of one setting")
    choices = [(AS_PLANNED, ()), *((str(setting), (setting,)) for setting in settings)]
    if len(settings) > 1:
        choices.append((TOGETHER, tuple(settings)))
    changed = [(label, chosen, job.changed(chosen)) for label, chosen in choices]
    rows: list[WhatIf] = []
    time, prices = None, None
    for label, chosen, variant in changed:
        make = partial(variant.plan, None if progress is None else partial(progress, label))
        if chosen:
            row, _ = tried(label, make)
        else:
            plan = make().require()
            row, prices = row_of_plan(label, plan), plan.prices
            time = row.cycle_time
        assert time is not None
        rows.append(
            WhatIf(
                label=label,
                settings=chosen,
                row=row,
                change=None if row.cycle_time is None else row.cycle_time - time,
                foretold=forecast(prices, chosen, job.machine, job.present_tolerance) if chosen else None,
            )
        )
    return rows


class Forecast(NamedTuple):
    """A change of the cycle time, between a least and a most [s]; negative where time is saved."""

    least: float
    most: float


def forecast(
    prices: PriceList | None, settings: Sequence[Setting], machine: Machine, tolerance: float
) -> Forecast | None:
    """The change of the cycle time by all `settings` at once; None where one of them has no price.

    tolerance : the present one [mm], NaN if there are several
    """
    found = [None if prices is None else _of_one(prices, setting, machine, tolerance) for setting in settings]
    known = [one for one in found if one is not None]
    return Forecast(*map(sum, zip(*known, strict=True))) if len(known) == len(found) else None


def _of_one(prices: PriceList, setting: Setting, machine: Machine, tolerance: float) -> Forecast | None:
    axis, _, quantity = setting.name.removeprefix("axes.").partition(".")
    of_key = {limit.key: limit.name for limit in LIMITS if limit.key} | {FEED: FEED, TOLERANCE: TOLERANCE}
    name = of_key.get(setting.name, f"{quantity}.{axis}")
    price = {FEED: prices.feed, TOLERANCE: prices.tolerance, **prices.limits}.get(name)
    present = value_of(setting.name, machine, tolerance)
    if present is None or price is None or not math.isfinite(present):
        return None
    slope = price
    if setting.name not in of_key:  # in the unit of the price: mm or rad, and s
        slope *= float(machine.limits(quantity, (axis,))[0])  # type: ignore[arg-type]
    elif name != FEED:
        slope *= present
    n = POWER[name.partition(".")[0]]
    gain = 1.0 - (setting.value / present) ** -n
    if gain <= 0.0 or name not in prices.ranges:
        return Forecast(slope / n * gain, slope / n * gain)
    more = MORE_TOLERANCE / present if name == TOLERANCE else MORE_LIMIT
    least, most = (saved * gain / (1.0 - (1.0 + more) ** -n) for saved in prices.ranges[name])
    return Forecast(-most, -least if name == TOLERANCE else min(-least, 0.0))  # more of a limit costs no time


REASONS_SHOWN = 5  # why points did not pass
NOTES_SHOWN = 2  # that a change brings


def what_if_table(job: StudiedJob, rows: Sequence[WhatIf], title: str) -> Group:
    """Rows of `what_if` side by side, followed by the reason for each one that did not pass."""
    headings = ("cycle\ntime s", "change\ns", "estimate\ns", "change\n%", "contour\nµm")
    table = outcomes_table(["change", "from"], headings)
    said: list[Text] = []
    time, as_it_is = rows[0].row.cycle_time, _notes(rows[0].row)
    for it in rows:
        row, change = it.row, it.change if it.settings else None
        table.add_row(
            *_change_and_present(job, it),
            number_text(row.cycle_time, ".4f"),
            number_text(change, "+.4f"),
            foretold_text(it.foretold),
            "-" if change is None or not time else f"{100.0 * change / time:+.2f}",
            number_text(row.contour_error, ".4g", MICROMETRE),
            outcome_text(row.outcome),
        )
        if not row.passed:
            said.append(Text(f"{it.label}: {row.sentence}"))
        said += [Text(f"note: {it.label}: {note}") for note in _notes(row) if note not in as_it_is][
            :NOTES_SHOWN
        ]
    return titled(title, table, *said)


def _notes(row: Row) -> list[str]:
    notes: list[str] = (row.summary or {}).get("notes", [])
    return notes


def foretold_text(foretold: Forecast | None) -> str:
    """A forecast as a number, or as a range where its ends are more than their rounding apart."""
    if foretold is None:
        return "-"
    least, most = f"{foretold.least:+.3g}", f"{foretold.most:+.3g}"
    return least if least == most else f"{least} to {most}"


def _change_and_present(job: StudiedJob, it: WhatIf) -> tuple[str, str]:
    """What is changed in words, and the value that it has now."""
    if len(it.settings) != 1:
        return it.label, ""
    (setting,) = it.settings
    value = value_of(setting.name, job.machine, job.present_tolerance)
    present = "-" if value is None else "several" if value != value else f"{value:g}"
    return f"{setting} {unit_of(setting.name, job.machine)}".rstrip(), present


def sweep_table(done: Sweep, title: str) -> Group:
    """A sweep in a few lines: how many points, their outcomes, the fastest that passed, and why the others
    did not."""
    outcomes = Counter(row["outcome"] for row in done.rows)
    table = pairs_table()
    before = f", {done.reused:,} of them planned before" if done.reused else ""
    told = ", ".join(f"{count:,} {outcome}" for outcome, count in outcomes.most_common())
    table.add_row("points", f"{len(done.rows):,}{before}: {told}")
    passed = [row for row in done.rows if row["outcome"] == PASSED]
    for name, pick in (("fastest", min), ("slowest", max)):
        if passed:
            row = pick(passed, key=lambda each: each["cycle_time_s"])
            at = ", ".join(f"{one.name}={row[one.name]:g}" for one in done.varied)
            table.add_row(name, f"{row['cycle_time_s']:.4f} s at {at}")
    reasons = Counter(f"{row['outcome']}: {row['sentence']}" for row in done.rows if row["outcome"] != PASSED)
    said = [f"{count:,} {reason}" for reason, count in reasons.most_common(REASONS_SHOWN)]
    if len(reasons) > REASONS_SHOWN:
        said.append(f"and {len(reasons) - REASONS_SHOWN:,} more reasons; {TABLE} has them all")
    return titled(title, table, *map(Text, said))


def what_if_dict(job: StudiedJob, rows: Sequence[WhatIf]) -> dict[str, Any]:
    """Rows of `what_if`, ready for JSON."""
    said = [
        {
            "change": {setting.name: setting.value for setting in it.settings},
            "outcome": it.row.outcome,
            "sentence": it.row.sentence,
            "cycle_time_s": it.row.cycle_time,
            "change_s": it.change,
            "foretold_s": it.foretold,
            "contour_error_mm": it.row.contour_error,
            "planning_time_s": it.row.planning_time,
        }
        for it in rows
    ]
    return json_ready({"program": job.program.source, "machine": job.machine.name, "rows": said})
