"""A plan as a small table with a picture, as a notebook shows it: the figures of `planner plan`, the path coloured by feed (SVG), and
what holds the motion. No script, nothing from a network, and every text of a program escaped.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING

from planner.report.colours import COLOURS
from planner.report.html.picture import path_picture
from planner.report.rows import VERDICT, plan_rows

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

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
