"""The report of a plan (report/html) as an object: a notebook shows it, `save` writes it, `open` shows it in the browser."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Iterable
from functools import cached_property
from importlib import import_module
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from planner.base.errors import InputError
from planner.planning.job.at_tip import joints_of
from planner.report.colours import COLOURS
from planner.report.export import check_places, write_plan
from planner.report.html.page import REPORT, path_picture, report_page
from planner.report.planned import source_text
from planner.report.replace import check_file, write_whole
from planner.report.rows import VERDICT, plan_rows
from planner.report.trajectory_file import trajectory_columns, units
from planner.report.trajectory_reader import Format
from planner.report.word_feed import WordFeed

if TYPE_CHECKING:
    import pandas

    from planner.planning.job.plan import Plan


HEIGHT = 900  # of the page in a notebook [px]


class ReportPage:
    """The page of a plan. Raises NotSolvedError for a plan without a trajectory."""

    def __init__(self, plan: Plan):
        self._plan = plan.require()

    @cached_property
    def text(self) -> str:
        """The page, HTML with all that it needs."""
        return report_page(self._plan, source_text(self._plan))

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
    place = Path(directory)
    source = Path(plan.program.source)
    check_places(
        place,
        [source] if source.is_file() else [],
        file_format=trajectory,
        plots=plots,
        report=report,
        force=force,
    )
    names = write_plan(plan, place, file_format=trajectory, plots=plots, report=report, force=force)
    return [place / name for name in names]


def plan_frame(plan: Plan) -> pandas.DataFrame:
    """`Plan.to_pandas`: a row for each setpoint."""
    try:
        pd = import_module("pandas")
    except ImportError as fault:
        raise InputError(
            "a table needs the package pandas: pip install 'feedrate-planner[notebook]'"
        ) from fault
    trajectory = plan.require().trajectory
    assert trajectory is not None
    joints = joints_of(plan)
    word = WordFeed(plan.toolpath)
    table: pandas.DataFrame = pd.DataFrame(trajectory_columns(trajectory, joints, word.of))
    table.attrs["units"] = units(
        trajectory.axes,
        extruder=plan.toolpath.extrusion is not None,
        tip=joints is not None,
        feed=word.units,
    )
    return table


SIZE = 320.0  # of the picture, its longer side [px]
BAR = COLOURS[0]
# Rows of the table of a plan that are shown, besides what more of the limits saves.
SHOWN = (
    "cycle time",
    "stopping at every block",
    "beside the motion",
    "total",
    "contour error",
    "corners missed by",
    VERDICT,
    "",
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
        if label in SHOWN or "saves" in label or label.endswith("more tolerance"):
            shown = html.escape(text)
            yield html.escape(label), f"<b>{shown}</b>" if label in ("cycle time", VERDICT) else shown


def _held(plan: Plan) -> str:
    """What holds the motion, each with its share of the cycle time as a bar."""
    if plan.grid is None:
        return ""
    rows = "".join(
        f'<div style="display:flex;align-items:center;gap:6px"><span style="flex:0 0 120px">{html.escape(name)} {percent} %</span>'
        f'<span style="background:{BAR};height:8px;width:{2 * percent}px"></span></div>'
        for name, percent in plan.grid.percents()[:HELD]
    )
    return f"<small>held by{rows}</small>"
