"""A comparison of methods (report/compare.py) as a table for the terminal, as JSON and as CSV."""

import csv
import functools
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Group
from rich.text import Text

from planner.base.files import readable
from planner.base.units import MICROMETRE
from planner.corners.budget import NORMAL
from planner.machine import Machine
from planner.report.compare import Row, best_of
from planner.report.replace import write_whole
from planner.report.rows import number_text, ratio_text
from planner.report.summary import versions
from planner.report.tables import outcome_text, outcomes_table, titled

SUFFIXES = (".json", ".csv")
NOTES_SHOWN = 3  # of those that all methods have
QUANTITIES = ("velocity", "acceleration", "jerk", "feed", NORMAL)


def comparison_table(rows: list[Row], title: str) -> Group:
    """The table for the terminal, followed by the reason for each method that did not pass."""
    best = best_of(rows)
    columns: list[tuple[str, Callable[[Row], str]]] = [
        ("cycle\ntime s", lambda row: number_text(row.cycle_time, ".4f")),
        ("ratio to\nbest", lambda row: number_text(_to_best(row, best), ".4f")),
    ]
    for name in QUANTITIES:
        if any(name in (row.worst or {}) for row in rows):
            heading = f"{name.replace('_', chr(10), 1)}\n/ limit"
            columns.append((heading, functools.partial(_worst, quantity=name)))
    columns += [
        ("contour\nµm", lambda row: number_text(row.contour_error, ".4g", MICROMETRE)),
        ("corners\nµm", lambda row: number_text(row.vertex_error, ".4g", MICROMETRE)),
    ]
    if any(row.after_filters is not None for row in rows):
        columns.append(("behind\nfilters", lambda row: number_text(row.after_filters, ".4g", MICROMETRE)))
    columns += [
        ("eq. 18-19\nat most", lambda row: "-" if row.corner_ratio is None else ratio_text(row.corner_ratio)),
        ("over\neq. 20", lambda row: number_text(row.gain, ".3f")),
    ]
    if any(row.ringing is not None for row in rows):
        columns.append(("rings\nµm", lambda row: number_text(row.ringing, ".4g", MICROMETRE)))
    columns.append(("planning\ns", lambda row: number_text(row.planning_time, ".3f")))
    table = outcomes_table(["method"], [heading for heading, _ in columns])
    for row in rows:
        table.add_row(row.method, *(text(row) for _, text in columns), outcome_text(row.outcome))
    said = [Text(f"{row.method}: {row.sentence}") for row in rows if not row.passed]
    free = [f"{row.method} does not limit {', '.join(row.free)}" for row in rows if row.free]
    every = [(row.summary or {}).get("notes", []) for row in rows if row.summary]
    shared = [note for note in every[0] if all(note in of for of in every)] if every else []
    notes = [Text(f"note: {note}") for note in shared[:NOTES_SHOWN]]
    notes += [Text(f"(in brackets: not limited; {'; '.join(free)})")] if free else []
    return titled(title, table, *notes, *said)


def comparison_dict(rows: list[Row], about: dict[str, Any]) -> dict[str, Any]:
    """The comparison, ready for JSON; `about` comes first."""
    best = best_of(rows)
    return {
        **about,
        "versions": versions(),
        "best": best.method if best else None,
        "methods": [row_dict(row, best) for row in rows],
    }


def row_dict(row: Row, best: Row | None) -> dict[str, Any]:
    """A row of a comparison in numbers, `summary` last; mm and s."""
    return {
        "method": row.method,
        "outcome": row.outcome,
        "sentence": row.sentence,
        "cycle_time_s": row.cycle_time,
        "ratio_to_best": _to_best(row, best),
        "worst": {q: {"ratio": ratio, "limit": name} for q, (ratio, name) in (row.worst or {}).items()},
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


def comparison_csv(rows: list[Row]) -> str:
    """The comparison as CSV, one row for each method; a field is empty where there is no number."""
    out, best = io.StringIO(), best_of(rows)
    write = csv.writer(out, lineterminator="\n")
    head = ["method", "outcome", "cycle_time_s", "ratio_to_best"]
    tail = ["not_limited", "contour_error_mm", "vertex_error_mm", "corner_ratio", "gain"]
    tail += ["after_filters_mm", "ringing_mm", "planning_time_s", "sentence"]
    limits = [(q, what) for q in QUANTITIES for what in ("ratio", "limit")]
    write.writerow([*head, *(f"{q}_{what}" for q, what in limits), *tail])
    for row in rows:
        made = row_dict(row, best) | {"not_limited": " ".join(row.free)}
        worst = [made["worst"].get(q, {}).get(what) for q, what in limits]
        write.writerow([*(made[name] for name in head), *worst, *(made[name] for name in tail)])
    return out.getvalue()


def write_comparison(path: Path, rows: list[Row], about: dict[str, Any]) -> None:
    """Write the comparison as JSON or CSV, the whole file or nothing. Raises InputError if it cannot be
    written."""
    made = json.dumps(comparison_dict(rows, about), indent=2, allow_nan=False) + "\n"
    write_whole(path, readable(comparison_csv(rows) if path.suffix == ".csv" else made))


def about_job(source: str, machine: Machine, tolerance: float | None) -> dict[str, Any]:
    """The values that all rows have in common. `tolerance` [mm] is None if the program or the machine sets
    it."""
    return {
        "program": source,
        "machine": machine.model_dump(mode="json", exclude_none=True),
        "tolerance_mm": tolerance,
    }


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
