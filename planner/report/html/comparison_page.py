"""`compare --report`: several methods on one page, their table, motions and profiles side by side, in one
file that opens off-line."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import Array
from planner.base.sizes import SIZES
from planner.base.units import MICROMETRE
from planner.machine import LINEAR_AXES, Machine
from planner.report.compare import Row, best_of
from planner.report.comparison import row_dict
from planner.report.figure import AGAINST, COLOURS, Panel, Series, three
from planner.report.html.parts import page_of
from planner.report.plotly_figure import fitted_scene, panel_figure
from planner.report.summary import json_ready
from planner.report.units import axis_titles, units_of

if TYPE_CHECKING:
    from planner.nc.program import Program
    from planner.report.html.data import Samples

SAMPLES_MAX = SIZES.compared_samples


def comparison_page(rows: list[Row], source: str, machine: Machine, program: Program) -> str:
    """The page of rows; those that kept samples of their motion (`Row.shown`) have pictures.

    Raises InputError if plotly is not installed.
    """
    best, units = best_of(rows), units_of(program)
    columns: dict[str, Array] = {}
    colours = [COLOURS[k % len(COLOURS)] for k in range(len(rows))]
    shown = {k: row.shown for k, row in enumerate(rows) if row.shown is not None}
    for k, samples in shown.items():
        columns |= _columns(samples, f"m{k}_")

    def panel(title: str, column: str, unit: str, scale: float) -> Panel:
        series = (
            Series(
                name=rows[k].method, column=column, unit=unit, scale=scale, colour=colours[k], before=f"m{k}_"
            )
            for k in shown
        )
        return Panel(title=title, series=tuple(series))

    feed = panel("feed", "feed", units.feed, units.per_feed)
    panels = [feed, panel("distance", "deviation", "µm", 1.0 / MICROMETRE)]
    points = (
        np.concatenate([three(samples.shown) for samples in shown.values()] or [np.zeros((0, 3))]) / units.mm
    )
    about = {
        "machine": machine.name,
        "blocks": len(program),
        "best": None if best is None else best.method,
        "colours": colours,
        "rows": json_ready([_row(row, best) for row in rows]),
        "against": AGAINST,
        "units": dataclasses.asdict(units),
        "profile": panel_figure(panels, "t") if shown else None,
        "view": fitted_scene(points, axis_titles(program, units)) if shown else None,
    }
    return page_of("comparison", "methods side by side", source, about, columns)


def _row(row: Row, best: Row | None) -> dict[str, Any]:
    made = row_dict(row, best)
    held_by = (made.pop("summary") or {}).get("held_by")
    return {**made, "held_by": held_by, "shown": row.shown is not None}


def _columns(samples: Samples, prefix: str) -> dict[str, Array]:
    """The samples of a motion: time, length, feed, distance from the path, line, and x, y, z."""
    shown = samples.shown
    columns = {"t": shown.t, "s": shown.s, "feed": samples.feed, "deviation": samples.deviation}
    columns |= dict(zip(LINEAR_AXES, three(shown).T, strict=True))
    floats = {prefix + name: column.astype(np.float32) for name, column in columns.items()}
    return {**floats, prefix + "line": shown.line.astype(np.int32)}
