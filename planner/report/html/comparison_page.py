"""`compare --report`: several methods on one page, their table, motions and profiles side by side, in one file that opens off-line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import Array
from planner.base.sizes import SIZES
from planner.machine import LINEAR_AXES, Machine
from planner.report.colours import COLOURS
from planner.report.compare import Row, best_of
from planner.report.export import json_ready
from planner.report.html.page import is_report
from planner.report.html.parts import page_of
from planner.report.replace import check_file, replacing_file

if TYPE_CHECKING:
    from planner.nc.program import Program

SAMPLES_MAX = SIZES.compared_samples


def check_page_place(path: Path, inputs: Iterable[Path] = (), *, force: bool = False) -> None:
    """Raise InputError if the page cannot be written to a file: a directory, an input, or a file that is no page of this package while
    `force` is not set."""
    check_file(path, inputs, is_report, force=force)


def write_comparison_page(
    path: Path, rows: list[Row], source: str, machine: Machine, program: Program
) -> None:
    """Write the page of a comparison. Raises InputError if it cannot be written, or if plotly is not installed."""
    page = comparison_page(rows, source, machine, program)
    with replacing_file(path) as new:
        new.write_text(page, encoding="utf-8")


def comparison_page(rows: list[Row], source: str, machine: Machine, program: Program) -> str:
    """The page of rows; those that kept samples of their motion (`Row.shown`) have pictures.

    Raises InputError if plotly is not installed.
    """
    best = best_of(rows)
    columns: dict[str, Array] = {}
    for k, row in enumerate(rows):
        columns |= _columns(row, f"m{k}_", program)
    about = {
        "source": source,
        "machine": machine.name,
        "blocks": len(program),
        "best": None if best is None else best.method,
        "colours": [COLOURS[k % len(COLOURS)] for k in range(len(rows))],
        "rows": json_ready([_said(row, best) for row in rows]),
    }
    return page_of("comparison", "methods side by side", source, about, columns)


def _said(row: Row, best: Row | None) -> dict[str, Any]:
    """A row of the table."""
    known = row.cycle_time is not None and best is not None and best.cycle_time
    return {
        "method": row.method,
        "outcome": row.outcome,
        "sentence": row.sentence,
        "cycle_time": row.cycle_time,
        "ratio": row.cycle_time / best.cycle_time if known else None,  # type: ignore[operator,union-attr]
        "contour_error": row.contour_error,
        "planning_time": row.planning_time,
        "free": list(row.free),
        "worst": {name: ratio for name, (ratio, _) in (row.worst or {}).items()},
        "held_by": (row.summary or {}).get("held_by"),
        "shown": row.shown is not None,
    }


def _columns(row: Row, prefix: str, program: Program) -> dict[str, Array]:
    """The samples of a row's motion: time, length, feed, distance from the path, line, and x, y, z."""
    if row.shown is None:
        return {}
    shown = row.shown.shown
    columns: dict[str, Array] = {
        "t": shown.t.astype(np.float32),
        "s": shown.s.astype(np.float32),
        "feed": row.shown.feed.astype(np.float32),
        "deviation": row.shown.deviation.astype(np.float32),
        "line": shown.line.astype(np.int32),
        "programmed": np.nan_to_num(row.shown.programmed, posinf=np.nan).astype(np.float32),
    }
    for axis in LINEAR_AXES:
        at = shown.position[:, shown.axes.index(axis)] if axis in shown.axes else np.zeros(len(shown))
        columns[axis] = at.astype(np.float32)
    return {prefix + name: column for name, column in columns.items()}
