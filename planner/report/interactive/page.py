"""The report of a plan (report/html) as an object: a notebook shows it, `save` writes it, `open` shows it in
the browser.

Figures of a plan to turn and to zoom (plotly), for notebooks: `plan.plot`. Of long motions a figure has `POINTS_MAX`
samples, and the fastest between them (report/html/data.py).
"""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.base.errors import import_needed
from planner.base.names import known_name
from planner.base.sizes import SIZES
from planner.machine import LINEAR_AXES
from planner.report.export import check_places, write_plan
from planner.report.figure import (
    QUANTITIES,
    MotionColumns,
    Panel,
    feed_panel,
    limit_colours,
    profile_panels,
    three,
)
from planner.report.html.data import Samples, programmed_path, samples_of
from planner.report.html.page import REPORT, path_picture, report_page
from planner.report.plotly_figure import BARE, PROGRAMMED, colourings, panel_figure, scene_in_box
from planner.report.replace import check_file, write_whole
from planner.report.rows import VERDICT, plan_rows
from planner.report.trajectory_file import PlanColumns
from planner.report.trajectory_reader import Format
from planner.report.units import Units, axis_titles, units_of
from planner.sensitivity.records import WORDS

if TYPE_CHECKING:
    import pandas
    from plotly.graph_objects import Figure

    from planner.planning.job.plan import Plan


HEIGHT = 900  # of the page in a notebook [px]


class ReportPage:
    """The page of a plan. Raises NotSolvedError for a plan without a trajectory."""

    def __init__(self, plan: Plan):
        self._plan = plan.require()

    @cached_property
    def text(self) -> str:
        """The page, HTML with all that it needs."""
        return report_page(self._plan)

    def save(self, file: str | Path = REPORT, *, force: bool = False) -> Path:
        """Write the page to a file.

        force : replace a file that is no report

        Raises InputError if it cannot be written, or if a file is in the way that is no report.
        """
        place = Path(file)
        check_file(place, force=force)
        write_whole(place, self.text)
        return place

    def open(self) -> Path:
        """Show the page in the system's browser, from a new temporary file; returns the file."""
        place = Path(tempfile.mkdtemp(prefix="planner-")) / REPORT
        self.save(place)
        webbrowser.open(place.as_uri())
        return place

    def __repr__(self) -> str:
        return f"<report of {self._plan!r}; .save(FILE) writes it, .open() shows it in the browser>"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.text)}" style="width:100%;height:{HEIGHT}px;border:0"></iframe>'


def save(
    plan: Plan, directory: str | Path, *, trajectory: Format, plots: bool, report: bool, force: bool
) -> list[Path]:
    """`Plan.save`."""
    plan.require()
    place, source = Path(directory), Path(plan.program.source)
    check_places(place, [source], file_format=trajectory, plots=plots, report=report, force=force)
    names = write_plan(plan, place, file_format=trajectory, plots=plots, report=report, force=force)
    return [place / name for name in names]


def plan_frame(plan: Plan) -> pandas.DataFrame:
    """`Plan.to_pandas`: a row for each setpoint."""
    pd = import_needed("pandas", "a table", "notebook")
    trajectory = plan.require().trajectory
    assert trajectory is not None
    columns = PlanColumns(plan)
    table: pandas.DataFrame = pd.DataFrame(columns(trajectory))
    table.attrs["units"] = columns.units
    return table


SIZE = 320.0  # of the picture, its longer side [px]
# Rows of the table of a plan that are shown, besides what more of the limits saves.
SHOWN = (
    *("cycle time", "saved", "beside the motion", "total"),
    *("contour error", "corners missed by", VERDICT, ""),
)
NOTES, HELD = 4, 5  # notes, and limits with the largest shares of the time, that are shown


def plan_card(plan: Plan) -> str:
    """The plan as HTML: `Plan._repr_html_`."""
    name = html.escape(PurePath(plan.program.source).name)
    head = f"<b>{name}</b> on <b>{html.escape(plan.machine.name)}</b>, method {html.escape(plan.method)}"
    rows = "".join(
        f'<tr><td style="text-align:left;opacity:.65">{html.escape(label)}</td><td style="text-align:left">{text}</td></tr>'
        for label, text in _rows(plan)
    )
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in plan.notes[:NOTES])
    more = len(plan.notes) - NOTES
    notes += f"<li>and {more} more: <code>.notes</code></li>" if more > 0 else ""
    listed = f'<ul style="opacity:.65;margin:4px 0;padding-left:18px">{notes}</ul>' if notes else ""
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:20px;align-items:center">'
        f"{path_picture(plan, SIZE) if plan.solved else ''}<div style='flex:1;min-width:340px'>"
        f"<div>{head}</div><table>{rows}</table>{_held(plan)}{listed}</div></div>"
    )


def _rows(plan: Plan) -> Iterable[tuple[str, str]]:
    """Labels and texts of the table, the texts as HTML."""
    if plan.trajectory is None or plan.verdict is None:
        yield "not solved", html.escape(plan.sentence)
        return
    for label, text in plan_rows(plan):
        if label in SHOWN or "saves" in label or label.endswith(("more tolerance", "sensitive corners")):
            shown = html.escape(text)
            yield html.escape(label), f"<b>{shown}</b>" if label in ("cycle time", VERDICT) else shown


def _held(plan: Plan) -> str:
    """The active limits, each with its share of the cycle time as a bar."""
    if plan.grid is None:
        return ""
    colour = dict(zip(plan.grid.active_names, limit_colours(plan.grid.active_names), strict=True))
    colour |= {word: colour[name] for name, word in WORDS.items() if name in colour}
    rows = "".join(
        f'<div style="display:flex;align-items:center;gap:6px"><span style="flex:0 0 120px">{html.escape(name)} {percent} %</span>'
        f'<span style="background:{colour[name]};height:8px;width:{2 * percent}px"></span></div>'
        for name, percent in plan.grid.percents()[:HELD]
    )
    return f"<small>held by{rows}</small>"


POINTS_MAX = SIZES.figure_samples
COLOURINGS = ("feed", "limit", "deviation")
OVER = ("t", "s")  # of `AGAINST`


class PlanFigures:
    """The figures of a plan: `Plan.plot`. Raises NotSolvedError for a plan without a trajectory."""

    def __init__(self, plan: Plan):
        self._plan = plan.require()

    def __repr__(self) -> str:
        return f"<figures of {self._plan!r}: .path(color={'|'.join(COLOURINGS)}), .feed(), .profiles()>"

    def __call__(self) -> Figure:
        """The path, coloured by feed."""
        return self.path()

    def path(self, color: str = "feed") -> Figure:
        """The motion over the programmed path, to turn and to zoom.

        color : "feed", "limit" (what holds the motion) or "deviation" (distance from the programmed path)

        Raises InputError for another colouring.
        """
        known_name("colouring", color, COLOURINGS)
        samples = self._samples
        units = self._units
        xyz, programmed = three(samples.shown) / units.mm, programmed_path(self._plan.toolpath) / units.mm
        how = colourings(samples, units)[color]
        shade = how["scale"] * getattr(samples, how["column"])
        if "rapid" in how:
            shade = np.where(samples.rapid, how["rapid"], shade)
        named = np.array(samples.limits)[samples.limit]
        motion = {
            **{"type": "scatter3d", "mode": "lines", "name": "motion"},
            **dict(zip(LINEAR_AXES, xyz.T, strict=True)),
            "line": how["light"] | {"color": shade},
            "customdata": np.stack(
                [samples.shown.line, units.per_feed * samples.feed, named, samples.shown.t], axis=1
            ).tolist(),
            "hovertemplate": f"line %{{customdata[0]}}<br>feed %{{customdata[1]:.4~g}} {units.feed}<br>held by %{{customdata[2]}}"
            "<br>t %{customdata[3]:.4f} s<extra></extra>",
        }
        scene = scene_in_box(np.concatenate([xyz, programmed]), axis_titles(self._plan.program, units))
        behind = PROGRAMMED | dict(zip(LINEAR_AXES, programmed.T, strict=True))
        return self._figure(
            [behind, motion], {"scene": scene, "margin": BARE | {"t": 30}, "showlegend": False}, 560
        )

    def feed(self, against: Literal["t", "s"] = "t") -> Figure:
        """The feed, over time ("t") or over the length of the path ("s"), with the programmed feed.

        Raises InputError for another horizontal axis.
        """
        return self._panels([feed_panel(self._columns, self._units)], against, 340)

    def profiles(self, against: Literal["t", "s"] = "t") -> Figure:
        """Velocity, acceleration and jerk of the axes in per cent of their limits, below the feed.

        Raises InputError for another horizontal axis.
        """
        axes = self._columns.joints.axes
        panels = profile_panels(self._columns, self._plan.machine, axes, [*QUANTITIES], self._units)
        return self._panels(panels, against, 820)

    @cached_property
    def _units(self) -> Units:
        return units_of(self._plan.program)

    @cached_property
    def _samples(self) -> Samples:
        return samples_of(self._plan, POINTS_MAX)

    @cached_property
    def _columns(self) -> MotionColumns:
        return MotionColumns(self._plan, self._samples.shown)

    def _panels(self, panels: Sequence[Panel], against: str, height: int) -> Figure:
        known_name("horizontal axis", against, OVER)
        made, columns = panel_figure(panels, against), self._columns
        data = [
            trace | {"x": columns[against], "y": of["scale"] * columns[of["y"]]}
            for trace, of in zip(made["data"], made["columns"], strict=True)
        ]
        return self._figure(data, made["layout"], height)

    def _figure(self, data: list[Any], layout: dict[str, Any], height: int) -> Figure:
        go = import_needed("plotly.graph_objects", "a figure", "notebook")
        text = f"{self._plan.method} on {self._plan.machine.name}: {self._plan.cycle_time:.4f} s"
        figure: Figure = go.Figure(data, {**layout, "title": {"text": text}, "height": height})
        return figure
