"""Figures (figure.py) in plotly's words, without its package: traces and layouts, which a notebook fills with
numbers and a page in the browser does (html/view.js).

The first view of a path in 3-D is along its thinnest direction if it is flat, and as large as the box allows.
plotly's orthographic camera shows two units of its scene to the height of the box, from any distance; what a
scene measures in those units is its aspect ratio.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MICROMETRE
from planner.machine import LINEAR_AXES
from planner.report.figure import (
    AGAINST,
    COLOURS,
    DIM,
    FLAT,
    GREY,
    LIGHT,
    LOW_TO_HIGH,
    PRICES,
    TINY,
    Panel,
    flat_view,
    highest_feed,
    limit_colours,
)
from planner.report.units import Units
from planner.sensitivity.records import WORDS

if TYPE_CHECKING:
    from planner.report.html.data import Samples

GAP = 0.07  # between panels, of the height of the figure [-]
BEYOND = 112  # what is seen of an axis in per cent of limits [%]
MARGIN = 1.08  # of the axes of a scene over the path [-]
THIN = FLAT / 4  # an axis is as long as this share of the longest at least [-], so that a line has a scene
FILLED = 0.72  # share of the box that the path fills [-]; titles of axes stand in the rest
DISTANCE = 2.0  # of the eye, in units of the scene [-]; it changes nothing in an orthographic view
AWAY = np.array([1.2, -1.3, 0.9])  # where a path that is not flat is seen from
LINE = {"width": 5, "showscale": True}
BAR: dict[str, Any] = {"title": {"text": ""}, "thickness": 12, "len": 0.8, "outlinewidth": 0}
TICKS, LONGEST = 24, 18  # names beside a bar, and letters of each
BARE = {"l": 0, "r": 0, "t": 0, "b": 0}
BEYOND_NOTE = {
    "xanchor": "right",
    "yanchor": "bottom",
    "showarrow": False,
    "font": {"size": 11, "color": DIM},
}
RAPIDS = {"light": LIGHT, "dark": GREY}  # fainter than all feeds on either ground
SLOWER = 0.03  # of the scale of the feed, below zero: rapids [-]
PROGRAMMED = {
    "type": "scatter3d", "mode": "lines", "name": "programmed", "hoverinfo": "skip", "opacity": 0.5,
    "line": {"width": 2, "color": DIM},
}  # fmt: skip


def panel_figure(panels: Sequence[Panel], against: str) -> dict[str, Any]:
    """`data` and `layout` of panels over an axis of `AGAINST`, and in `columns` of each trace what it lacks:
    `y`, the name of its column of numbers, what these are multiplied with, and what is `before` the name of
    the axis for its x."""
    data, columns, shapes, notes, height = [], [], [], [], (1.0 + GAP) / len(panels)
    layout: dict[str, Any] = {"xaxis": {"title": {"text": AGAINST[against]}, "anchor": f"y{len(panels)}"}}
    named: set[str] = set()
    for k, panel in enumerate(panels):
        y, top = "y" if k == 0 else f"y{k + 1}", 1.0 - k * height
        axis: dict[str, Any] = {"domain": [max(top - height + GAP, 0.0), top], "title": {}}
        if panel.limited:
            axis |= {"range": [-BEYOND, BEYOND], "tickvals": [-100, -50, 0, 50, 100]}
            axis["title"]["text"] = f"{panel.title}<br>[% of limit]"
            shapes += [
                {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": y, "y0": at, "y1": at}
                | {"line": {"color": DIM, "width": 1, "dash": "dot"}}
                for at in (100, -100)
            ]
        else:
            axis |= {"rangemode": "tozero"} if math.isnan(panel.top) else {"range": [0.0, panel.top]}
            axis["title"]["text"] = f"{panel.title} [{panel.series[0].unit}]"
            if panel.said:
                notes.append(
                    {"text": panel.said, "xref": "paper", "yref": "paper", "x": 1, "y": top} | BEYOND_NOTE
                )
        layout["yaxis" + y[1:]] = axis
        for one in panel.series:
            line: dict[str, Any] = {"color": one.colour, "width": 1 if one.dashed else 1.4}
            line["dash"] = "dash" if one.dashed else "solid"
            trace: dict[str, Any] = {"type": "scatter", "mode": "lines", "name": one.name, "line": line}
            trace |= {"legendgroup": one.name, "yaxis": y, "showlegend": one.name not in named}
            scale = one.scale
            if one.dashed:
                trace["hoverinfo"] = "skip"
            if panel.limited:
                scale *= 100.0 / one.limit
                said = f"{one.name}: %{{y:.4g}} % of {one.limit:.4g} {one.unit}"
                trace["hovertemplate"] = f"{said}<extra></extra>"
            named.add(one.name)
            data.append(trace)
            columns.append({"before": one.before, "y": one.before + one.column, "scale": scale})
    return {"data": data, "layout": layout | {"shapes": shapes, "annotations": notes}, "columns": columns}


def colourings(samples: Samples, units: Units) -> dict[str, dict[str, Any]]:
    """How a path is coloured, by name: "feed", "limit" (which holds it), "deviation", "price" of the tolerance where
    it is known, and the parts of the program that `Samples.parts` has. Each has its `column` of the samples, what that
    is multiplied with (`scale`), on a "light" and a "dark" ground the `line` of a trace, but for its numbers, and the
    feed the number of `rapid` moves, which are grey."""
    dear = [[0, LIGHT], [PRICES[0][0], LIGHT], *map(list, PRICES)]  # nothing is saved far from joints
    even = {
        ground: [[k / (len(shades) - 1), shade] for k, shade in enumerate(shades)]
        for ground, shades in LOW_TO_HIGH.items()
    }
    feed = highest_feed(samples.feed, samples.programmed)
    found = {}
    dearest = 0.0 if samples.price is None else samples.price.max(initial=0.0)
    for column, title, scale, most, scales in (
        ("feed", f"feed [{units.feed}]", units.per_feed, feed, even),
        ("deviation", "deviation [µm]", 1.0 / MICROMETRE, samples.deviation.max(initial=0.0), even),
        ("price", "saved [µs per µm]", 1e3, dearest, dict.fromkeys(even, dear)),
    ):
        if getattr(samples, column) is None:
            continue
        line: dict[str, Any] = LINE | {"cmin": 0.0, "cmax": scale * float(most)}
        line["colorbar"] = BAR | {"title": {"text": title}}
        found[column] = {"column": column, "scale": scale}
        if column == "feed":
            line["cmin"] = found[column]["rapid"] = -SLOWER * max(line["cmax"], TINY)
            scales = {ground: _with_rapids(colours, RAPIDS[ground]) for ground, colours in scales.items()}
        found[column] |= {ground: line | {"colorscale": colours} for ground, colours in scales.items()}
    named = [WORDS.get(name, name) for name in samples.limits]
    found["limit"] = _of_names("limit", named, limit_colours(samples.limits))
    for column, (names, _) in samples.parts.items():
        shades = [COLOURS[k % len(COLOURS)] for k in range(len(names))]
        found[column] = _of_names(column, names, shades)
    return found


def _with_rapids(colours: list[list[Any]], rapid: str) -> list[list[Any]]:
    """A scale with the colour of rapids below zero."""
    zero = SLOWER / (1.0 + SLOWER)
    return [[0.0, rapid], [zero, rapid], *([zero + (1.0 - zero) * at, colour] for at, colour in colours)]


def _of_names(column: str, names: Sequence[str], shades: Sequence[str]) -> dict[str, Any]:
    """The colouring of a column of indices in names: one shade for each."""
    many = len(names)
    steps = [[(k + end) / many, shade] for k, shade in enumerate(shades) for end in (0, 1)]
    ticks = {"tickvals": list(range(many))[:TICKS], "ticktext": [_short(name) for name in names[:TICKS]]}
    line = LINE | {"cmin": -0.5, "cmax": many - 0.5, "colorscale": steps, "colorbar": BAR | ticks}
    return {"column": column, "scale": 1.0, "light": line, "dark": line}


def _short(name: str) -> str:
    return html.escape(name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…", quote=False)


def fitted_scene(points: FloatArray, titles: Mapping[str, str]) -> tuple[dict[str, Any], float, float]:
    """plotly's `scene` of a path, `points` (n, 3) x, y, z, with `titles` of the axes, without a zoom, and how wide and high the
    path then is on the screen, in units of the scene: `aspectratio`, `camera`, and the ranges of the axes."""
    low, end = points.min(axis=0), points.max(axis=0)
    length = end - low
    size = max(float(length.max()), TINY)
    view = flat_view(length)
    right, up = _view_of_a_body() if view is None else np.eye(3)[view]
    ratio = np.maximum(length / size, THIN)
    middle, half = 0.5 * (low + end), 0.5 * MARGIN * ratio * size
    scene: dict[str, Any] = {
        f"{letter}axis": {
            "title": {"text": titles[letter]},
            "range": [float(middle[k] - half[k]), float(middle[k] + half[k])],
            "visible": view is None or k in view,
        }
        for k, letter in enumerate(LINEAR_AXES)
    }
    scene["camera"] = {
        "projection": {"type": "orthographic"},
        "eye": _named(np.cross(right, up) * DISTANCE),
        "up": _named(np.array([0.0, 0.0, 1.0]) if view is None else up),
    }
    scene |= {"aspectmode": "manual", "aspectratio": _named(MARGIN * ratio)}
    return scene, float(ratio @ np.abs(right)), float(ratio @ np.abs(up))


def scene_in_box(points: FloatArray, titles: Mapping[str, str]) -> dict[str, Any]:
    """The scene of a path, `points` (n, 3), with `titles`, that fills a notebook's column without the colour bar: it is
    as wide as a figure is high, at least."""
    scene, wide, high = fitted_scene(points, titles)
    zoom = FILLED * 2.0 * min(1.0 / wide, 1.0 / high)
    return scene | {"aspectratio": {axis: zoom * ratio for axis, ratio in scene["aspectratio"].items()}}


def _view_of_a_body() -> tuple[FloatArray, FloatArray]:
    eye = AWAY / np.linalg.norm(AWAY)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return right, np.cross(eye, right)


def _named(values: FloatArray) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))
