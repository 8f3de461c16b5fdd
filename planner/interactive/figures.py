"""Figures of a plan to turn and to zoom (plotly), for notebooks: `plan.plot`.

Of long motions a figure has `POINTS_MAX` samples, and the fastest between them (report/html/data.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.names import known_name
from planner.base.sizes import SIZES
from planner.base.units import MICROMETRE
from planner.interactive.scene import fitted_scene
from planner.job.at_tip import of_axes
from planner.machine import LINEAR_AXES
from planner.report.colours import COLOURS, GREY, limit_colours
from planner.report.html.data import Samples, programmed_path, samples_of

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from planner.job.plan import Plan

POINTS_MAX = SIZES.figure_samples
FLAT = 0.12  # third extent over the largest below which a path is seen from above
COLOURINGS = ("feed", "limit", "deviation")
AGAINST = {"t": "time [s]", "s": "length along the path [mm]"}
QUANTITIES = ("velocity", "acceleration", "jerk")


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
        samples, shown = self._samples, self._samples.shown
        xyz = _three(shown.position, shown.axes)
        programmed = programmed_path(self._plan.toolpath)
        line = {"width": 5, **self._coloured(color)}
        named = np.array(samples.limits)[samples.limit]
        go = _graph_objects()
        figure = go.Figure(
            [
                go.Scatter3d(
                    **_xyz(programmed),
                    mode="lines",
                    name="programmed",
                    hoverinfo="skip",
                    line={"width": 2, "color": GREY},
                    opacity=0.5,
                ),
                go.Scatter3d(
                    **_xyz(xyz),
                    mode="lines",
                    name="motion",
                    line=line,
                    customdata=np.stack([shown.line, samples.feed, named, shown.t], axis=1).tolist(),
                    hovertemplate="line %{customdata[0]}<br>feed %{customdata[1]:.4~g} mm/s<br>held by %{customdata[2]}"
                    "<br>t %{customdata[3]:.4f} s<extra></extra>",
                ),
            ]
        )
        figure.update_layout(
            scene=fitted_scene(np.concatenate([xyz, programmed])), margin={"l": 0, "r": 0, "t": 30, "b": 0}
        )
        figure.update_layout(showlegend=False, title={"text": self._title()}, height=560)
        return figure

    def feed(self, against: Literal["t", "s"] = "t") -> Figure:
        """The feed, over time ("t") or over the length of the path ("s"), with the programmed feed.

        Raises InputError for another horizontal axis.
        """
        known_name("horizontal axis", against, AGAINST)
        go = _graph_objects()
        figure = go.Figure(self._feed_traces(against))
        figure.update_layout(
            title={"text": self._title()},
            height=340,
            xaxis={"title": {"text": AGAINST[against]}},
            yaxis={"title": {"text": "feed [mm/s]"}, "rangemode": "tozero"},
        )
        return figure

    def profiles(self, against: Literal["t", "s"] = "t") -> Figure:
        """Velocity, acceleration and jerk of the axes in per cent of their limits, below the feed.

        Raises InputError for another horizontal axis.
        """
        known_name("horizontal axis", against, AGAINST)
        figure = import_module("plotly.subplots").make_subplots(
            rows=4, cols=1, shared_xaxes=True, vertical_spacing=0.04
        )
        for trace in self._feed_traces(against):
            figure.add_trace(trace, row=1, col=1)
        figure.update_yaxes(title_text="feed [mm/s]", rangemode="tozero", row=1, col=1)
        shown, machine, go = of_axes(self._plan, self._samples.shown), self._plan.machine, _graph_objects()
        for row, quantity in enumerate(QUANTITIES, start=2):
            shares = 100.0 * getattr(shown, quantity) / machine.limits(quantity, shown.axes)  # type: ignore[arg-type]
            for k, axis in enumerate(shown.axes):
                line = {"color": COLOURS[k % len(COLOURS)], "width": 1.2}
                of_axis = go.Scattergl(
                    x=getattr(shown, against),
                    y=shares[:, k],
                    name=axis,
                    legendgroup=axis,
                    showlegend=row == 2,
                    line=line,
                )
                figure.add_trace(of_axis, row=row, col=1)
            figure.update_yaxes(title_text=f"{quantity}<br>[% of limit]", range=[-112, 112], row=row, col=1)
        figure.update_xaxes(title_text=AGAINST[against], row=4, col=1)
        figure.update_layout(title={"text": self._title()}, height=820)
        return figure

    @cached_property
    def _samples(self) -> Samples:
        return samples_of(self._plan, POINTS_MAX)

    def _title(self) -> str:
        return f"{self._plan.method} on {self._plan.machine.name}: {self._plan.cycle_time:.4f} s"

    def _feed_traces(self, against: str) -> list[Any]:
        shown, go = self._samples.shown, _graph_objects()
        x = getattr(shown, against)
        asked = self._samples.programmed
        dashed = {"color": GREY, "width": 1, "dash": "dash"}
        return [
            go.Scattergl(
                x=x,
                y=np.where(np.isfinite(asked), asked, np.nan),
                name="programmed",
                line=dashed,
                hoverinfo="skip",
            ),
            go.Scattergl(x=x, y=self._samples.feed, name="feed", line={"color": COLOURS[0], "width": 1.6}),
        ]

    def _coloured(self, color: str) -> Mapping[str, Any]:
        """Colours of the samples, as plotly's `line` has them."""
        samples = self._samples
        if color == "limit":
            many = len(samples.limits)
            scale = []
            for k, shade in enumerate(limit_colours(samples.limits)):
                scale += [[k / many, shade], [(k + 1) / many, shade]]
            bar = {"tickvals": list(range(many)), "ticktext": list(samples.limits)}
            return {
                "color": samples.limit,
                "colorscale": scale,
                "cmin": -0.5,
                "cmax": many - 0.5,
                "showscale": True,
                "colorbar": bar,
            }
        values = samples.feed if color == "feed" else samples.deviation / MICROMETRE
        counts = np.isfinite(samples.programmed)
        if (
            color == "deviation" or not counts.any()
        ):  # else rapids have the colour of the fastest move with a feed
            counts = np.ones(len(values), dtype=bool)
        title = {"text": "feed [mm/s]" if color == "feed" else "deviation [µm]"}
        return {
            "color": values,
            "colorscale": "Cividis",
            "cmin": 0,
            "cmax": float(values[counts].max()),
            "showscale": True,
            "colorbar": {"title": title},
        }


def _three(position: FloatArray, axes: tuple[str, ...]) -> FloatArray:
    """(n, 3) x, y, z of positions (n, A); 0 for those that are not among the axes."""
    scaled = position
    columns = [scaled[:, axes.index(axis)] if axis in axes else np.zeros(len(scaled)) for axis in LINEAR_AXES]
    return np.stack(columns, axis=1)


def _xyz(points: FloatArray) -> dict[str, FloatArray]:
    """The coordinates of points (n, 3), as plotly has them."""
    return {axis: points[:, k] for k, axis in enumerate(LINEAR_AXES)}


def _graph_objects() -> Any:
    try:
        return import_module("plotly.graph_objects")
    except ImportError as fault:
        raise InputError(
            "figures need the package plotly: pip install 'feedrate-planner[notebook]'"
        ) from fault
