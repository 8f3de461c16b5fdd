"""A comparison of methods (report/compare.py) as a table for the terminal, as JSON and as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner.base.errors import InputError
from planner.base.files import readable
from planner.base.units import MICROMETRE
from planner.feedrate.constraints import normal_limit
from planner.machine import Machine
from planner.report.replace import check_file, replacing_file, starts_with
from planner.report.summary import versions
from planner.report.tables import ratio_text

if TYPE_CHECKING:
    pass
from planner.report.compare import Row, best_of

SUFFIXES = (".json", ".csv")
QUANTITIES = ("velocity", "acceleration", "jerk", "feed", normal_limit.NAME)


def comparison_table(rows: list[Row], title: str) -> Group:
    """The table for the terminal, followed by the reason for each method that did not pass."""
    best = best_of(rows)
    shown = [name for name in QUANTITIES if any(name in (row.worst or {}) for row in rows)]
    table = Table(box=None, pad_edge=False)
    table.add_column("method", no_wrap=True)
    for name in (
        "cycle\ntime s",
        "ratio to\nbest",
        *(f"{q.replace('_', chr(10), 1)}\n/ limit" for q in shown),
    ):
        table.add_column(name, justify="right", no_wrap=True)
    rings = any(row.ringing is not None for row in rows)
    filters = any(row.after_filters is not None for row in rows)
    law = ("eq. 18-19\nat most", "over\neq. 20")
    more = (["behind\nfilters"] if filters else []), (["rings\nµm"] if rings else [])
    for name in ("contour\nµm", "corners\nµm", *more[0], *law, *more[1], "planning\ns"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    said = []
    for row in rows:
        table.add_row(
            row.method,
            _number(row.cycle_time, ".4f"),
            _number(_to_best(row, best), ".4f"),
            *(_worst(row, quantity) for quantity in shown),
            _number(row.contour_error, ".4g", MICROMETRE),
            _number(row.vertex_error, ".4g", MICROMETRE),
            *([_number(row.after_filters, ".4g", MICROMETRE)] if filters else []),
            "-" if row.corner_ratio is None else ratio_text(row.corner_ratio),
            _number(row.gain, ".3f"),
            *([_number(row.ringing, ".4g", MICROMETRE)] if rings else []),
            _number(row.planning_time, ".3f"),
            Text(row.outcome, style="green" if row.passed else "bold red"),
        )
        if not row.passed:
            said.append(Text(f"{row.method}: {row.sentence}"))
    free = [f"{row.method} does not limit {', '.join(row.free)}" for row in rows if row.free]
    notes = [Text(f"(in brackets: not limited; {'; '.join(free)})")] if free else []
    return Group(Text(title, style="bold"), table, *notes, *said)


def comparison_dict(rows: list[Row], about: dict[str, Any]) -> dict[str, Any]:
    """The comparison, ready for JSON; `about` comes first."""
    best = best_of(rows)
    return {
        **about,
        "versions": versions(),
        "best": best.method if best else None,
        "methods": [
            {
                "method": row.method,
                "outcome": row.outcome,
                "sentence": row.sentence,
                "cycle_time_s": row.cycle_time,
                "ratio_to_best": _to_best(row, best),
                "worst": {
                    q: {"ratio": ratio, "limit": name} for q, (ratio, name) in (row.worst or {}).items()
                },
                "not_limited": list(row.free),
                "contour_error_mm": row.contour_error,
                "vertex_error_mm": row.vertex_error,
                "corner_ratio": row.corner_ratio,
                "gain": row.gain,
                "after_filters_mm": row.after_filters,
                "ringing_mm": row.ringing,
                "planning_time_s": row.planning_time,
                "summary": row.summary,
            }
            for row in rows
        ],
    }


def comparison_csv(rows: list[Row]) -> str:
    """The comparison as CSV, one row for each method; a cell is empty where there is no number."""
    best = best_of(rows)
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n")
    limits = [column for q in QUANTITIES for column in (f"{q}_ratio", f"{q}_limit")]
    head = ["method", "outcome", "cycle_time_s", "ratio_to_best"]
    tail = ["not_limited", "contour_error_mm", "vertex_error_mm", "corner_ratio", "gain"]
    tail += ["after_filters_mm", "ringing_mm", "planning_time_s", "sentence"]
    write.writerow([*head, *limits, *tail])
    for row in rows:
        worst = [value for q in QUANTITIES for value in (row.worst or {}).get(q, (None, None))]
        first = [row.method, row.outcome, row.cycle_time, _to_best(row, best)]
        errors = [
            row.contour_error,
            row.vertex_error,
            row.corner_ratio,
            row.gain,
            row.after_filters,
            row.ringing,
        ]
        last = [" ".join(row.free), *errors, row.planning_time, row.sentence]
        write.writerow([*first, *worst, *last])
    return out.getvalue()


def check_comparison_place(path: Path, inputs: Iterable[Path] = (), *, force: bool = False) -> None:
    """Raise InputError if a comparison cannot be written to a file.

    That is so for a suffix other than .json and .csv, for a directory, for one of the `inputs`, and for a file that is no comparison,
    unless `force` is set.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(SUFFIXES)}", source=str(path))
    check_file(path, inputs, _is_comparison, force=force)


def _is_comparison(path: Path) -> bool:
    if path.suffix == ".csv":
        return starts_with(path, comparison_csv([]).rstrip())
    try:
        return {"best", "methods", "versions"} <= set(json.loads(path.read_bytes()))
    except (ValueError, RecursionError, TypeError):
        return False


def write_comparison(path: Path, rows: list[Row], about: dict[str, Any]) -> None:
    """Write the comparison as JSON or CSV, the whole file or nothing. Raises InputError if it cannot be written."""
    text = comparison_csv(rows) if path.suffix == ".csv" else _json(comparison_dict(rows, about))
    with replacing_file(path) as new:
        new.write_text(readable(text), encoding="utf-8")


def about_job(source: str, machine: Machine, tolerance: float | None) -> dict[str, Any]:
    """What all rows have in common. `tolerance` [mm] is None if the program or the machine sets it."""
    return {
        "program": source,
        "machine": machine.model_dump(mode="json", exclude_none=True),
        "tolerance_mm": tolerance,
    }


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def _to_best(row: Row, best: Row | None) -> float | None:
    if row.cycle_time is None or best is None or not best.cycle_time:
        return None
    return row.cycle_time / best.cycle_time


def _worst(row: Row, quantity: str) -> str:
    if not row.worst or quantity not in row.worst:
        return "-"
    ratio, name = row.worst[quantity]
    text = f"{ratio_text(ratio)} {name.partition('.')[2]}".rstrip()
    return f"({text})" if quantity in row.free else text


def _number(value: float | None, form: str, unit: float = 1.0) -> str:
    return "-" if value is None else format(value / unit, form)
