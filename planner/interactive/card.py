"""A plan as a small table with a picture, as a notebook shows it: the figures of `planner plan`, the path coloured by feed (SVG), and
what holds the motion. No script, nothing from a network, and every text of a program escaped.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from planner.base.units import MICROMETRE
from planner.report.colours import LIGHT, limit_colours
from planner.report.html.picture import path_picture
from planner.report.optimum import price_rows

if TYPE_CHECKING:
    from planner.job.plan import Plan

SIZE = 320.0  # of the picture, its longer side [px]
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
    time, verdict = plan.trajectory.cycle_time, plan.verdict
    yield "cycle time", f"<b>{time:.4f} s</b>"
    if plan.method != "stop" and np.isfinite(plan.stop_time):
        yield "stopping at every block", f"{plan.stop_time:.4f} s, {plan.stop_time / time:.2f} times as long"
    yield "verdict", "<b>passed</b>" if verdict.passed else f"<b>failed</b>: {html.escape(verdict.faults[0])}"
    if verdict.contour_error_mm is not None:
        yield "contour error", f"{verdict.contour_error_mm / MICROMETRE:.3f} µm"
    if plan.prices is not None:
        for label, text in price_rows(plan.prices, time)[:2]:
            yield label, html.escape(text)


def _held(plan: Plan) -> str:
    """A bar of the cycle time by what holds the motion, and its legend."""
    if plan.grid is None:
        return ""
    ranked = plan.grid.ranked()
    shown = ranked[:HELD]
    colours = limit_colours([name for name, _ in shown])
    if len(ranked) > HELD:
        shown.append(("others", sum(share for _, share in ranked[HELD:])))
        colours.append(LIGHT)
    parts, words = [], []
    for (name, share), colour in zip(shown, colours, strict=True):
        parts.append(f'<span style="background:{colour};width:{100 * share:.2f}%"></span>')
        words.append(f'<span style="color:{colour}">■</span> {html.escape(name)} {100 * share:.0f} %')
    bar = f'<div style="display:flex;height:8px;max-width:420px;margin:6px 0 2px">{"".join(parts)}</div>'
    return f"{bar}<small>held by {' &nbsp; '.join(words)}</small>"
