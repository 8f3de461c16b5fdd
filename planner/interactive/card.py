"""A plan as a small table with a picture, as a notebook shows it: the figures of `planner plan`, the path coloured by feed (SVG), and
what holds the motion. No script, nothing from a network, and every text of a program escaped.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import MICROMETRE
from planner.machine import LINEAR_AXES
from planner.report.colours import CIVIDIS, LIGHT, limit_colours
from planner.report.optimum import price_rows

if TYPE_CHECKING:
    from planner.job.plan import Plan

POINTS = 1500  # of the motion in the picture: two for each pixel of its width
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
        f"{path_picture(plan)}<div style='flex:1;min-width:340px'>"
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


def path_picture(plan: Plan) -> str:
    """The motion seen along its thinnest direction, coloured by feed, as SVG; empty for a plan without a motion."""
    if plan.trajectory is None:
        return ""
    trajectory = plan.trajectory
    rows = np.unique(np.linspace(0, len(trajectory) - 1, min(POINTS, len(trajectory))).astype(np.int64))
    shown = trajectory.rows(rows)
    position = shown.position[:, [k for k, axis in enumerate(shown.axes) if axis in LINEAR_AXES]]
    across = np.sort(np.argsort(-np.ptp(position, axis=0), kind="stable")[:2])
    points = position[:, across] * [1.0, -1.0]  # the picture's y goes down
    extent = np.ptp(points, axis=0)
    scale = SIZE / max(float(extent.max()), 1e-9)
    points = (points - points.min(axis=0)) * scale + 4.0
    width, height = extent * scale + 8.0
    asked = np.isfinite(
        plan.program.feed[shown.block]
    )  # rapids have the colour of the fastest move with a feed
    highest = float(shown.feed[asked].max() if asked.any() else shown.feed.max())
    colour = np.minimum(shown.feed / max(highest, 1e-9) * len(CIVIDIS), len(CIVIDIS) - 1).astype(np.int64)
    lines = "".join(
        f'<polyline points="{_points(points[first : last + 1])}" stroke="{CIVIDIS[colour[first]]}"/>'
        for first, last in _runs(colour)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" role="img" '
        f'aria-label="path coloured by feed" fill="none" stroke-width="1.6" stroke-linecap="round">{lines}</svg>'
    )


def _runs(colour: Array) -> list[tuple[int, int]]:
    """First and last point of the lines of one colour, each up to the first point of the next."""
    starts = np.flatnonzero(np.append(True, np.diff(colour) != 0))
    ends = np.append(starts[1:], len(colour) - 1)
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _points(points: FloatArray) -> str:
    """Points (n, 2) as SVG writes them."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
