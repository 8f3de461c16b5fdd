"""Table and picture of a sweep: cycle time over the first setting, a line for each value of the second, a panel for the others."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from planner.commands.study.points import FAILED, FIGURE, TABLE
from planner.commands.study.sweep import NUMBERS, TEXTS, Sweep
from planner.report.plots import STYLE
from planner.report.replace import replacing_file

PANELS_MAX = 9  # of a picture; the table has all
LINES_MAX = 12  # of a panel
LOG_FROM = 4.0  # a setting is shown on a logarithmic axis if its largest value is so many times its least [-]
WIDTH, HEIGHT = 3.4, 2.7  # of a panel [inch]


def write_sweep(done: Sweep, directory: Path) -> list[str]:
    """Write table and picture; returns their names. Raises InputError if they cannot be written."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, Any] = {one.name: [row[one.name] for row in done.rows] for one in done.varied}
    columns |= {name: pa.array([row.get(name) for row in done.rows], pa.string()) for name in TEXTS}
    columns |= {name: pa.array([row.get(name) for row in done.rows], pa.float64()) for name in NUMBERS}
    with replacing_file(directory / TABLE) as new, new.open("wb") as file:
        pq.write_table(pa.table(columns), file)
    with replacing_file(directory / FIGURE) as new:
        sweep_figure(done, new)
    return [TABLE, FIGURE]


def sweep_figure(done: Sweep, path: Path) -> None:
    """Write the picture (PNG). Motions that failed the verdict are crosses; where there is no motion the line is broken."""
    first, *others = done.varied
    second = others[0] if others else None
    shape = [len(one.values) for one in done.varied]
    time = np.array([row.get("cycle_time_s") for row in done.rows], dtype=np.float64).reshape(shape)
    failed = np.array([row["outcome"] == FAILED for row in done.rows]).reshape(shape)
    panels = list(itertools.product(*(range(len(one.values)) for one in others[1:])))
    shown = panels[:PANELS_MAX]
    columns = min(3, len(shown))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH * columns, HEIGHT * -(-len(shown) // columns)), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(-(-len(shown) // columns), columns, squeeze=False, sharey=True)
        for axes in grid.flat[len(shown) :]:
            axes.remove()
        for axes, at in zip(grid.flat, shown, strict=False):
            lines = range(len(second.values)) if second is not None else [None]
            for k in _spread(lines, LINES_MAX):
                where = (slice(None), *(() if k is None else (k,)), *at)
                colour = matplotlib.colormaps["viridis"](
                    0.0 if k is None else 0.9 * k / max(len(lines) - 1, 1)
                )
                label = None if k is None or second is None else f"{second.values[k]:.4g}"
                axes.plot(
                    first.values,
                    np.where(failed[where], np.nan, time[where]),
                    ".-",
                    color=colour,
                    label=label,
                )
                axes.plot(first.values, np.where(failed[where], time[where], np.nan), "x", color=colour)
            axes.set_xlabel(f"{first.name} [{first.unit or '-'}]")
            axes.set_ylabel("cycle time [s]")
            if max(first.values) >= LOG_FROM * min(first.values):
                axes.set_xscale("log")
            named = [f"{one.name} = {one.values[n]:.4g}" for one, n in zip(others[1:], at, strict=True)]
            axes.set_title("\n".join(named))
        if second is not None:
            grid[0, 0].legend(title=f"{second.name} [{second.unit or '-'}]")
        if len(shown) < len(panels):
            figure.suptitle(f"{len(shown)} of {len(panels)} panels; the table has all")
        figure.savefig(path, format="png")


def _spread(items: object, most: int) -> list[int | None]:
    """At most so many of some items, the first and the last among them."""
    every = list(items)  # type: ignore[call-overload]
    if len(every) <= most:
        return every
    return [every[k] for k in np.unique(np.linspace(0, len(every) - 1, most).round().astype(int))]
