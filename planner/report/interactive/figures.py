"""Figures of a plan to turn and to zoom (plotly), for notebooks: `plan.plot`.

Of long motions a figure has `POINTS_MAX` samples, and the fastest between them (report/html/data.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.base.sizes import SIZES
from planner.machine import LINEAR_AXES
from planner.report.figure import (
    FEED,
    QUANTITIES,
    MotionColumns,
    Panel,
    profile_panels,
    three,
)
from planner.report.html.data import Samples, programmed_path, samples_of
from planner.report.plotly_figure import BARE, PROGRAMMED, colourings, panel_figure, scene_in_box

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from planner.planning.job.plan import Plan

POINTS_MAX = SIZES.figure_samples
COLOURINGS = ("feed", "limit", "deviation")
OVER = ("t", "s")  # of `AGAINST`
ROOM = 1.0  # width of a notebook's column without the colour bar over the height of a figure [-], at least


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
        xyz, programmed = three(samples.shown), programmed_path(self._plan.toolpath)
        how = colourings(samples)[color]
        named = np.array(samples.limits)[samples.limit]
        motion = {
            **{"type": "scatter3d", "mode": "lines", "name": "motion"},
            **dict(zip(LINEAR_AXES, xyz.T, strict=True)),
            "line": how["light"] | {"color": how["scale"] * getattr(samples, how["column"])},
            "customdata": np.stack(
                [samples.shown.line, samples.feed, named, samples.shown.t], axis=1
            ).tolist(),
            "hovertemplate": "line %{customdata[0]}<br>feed %{customdata[1]:.4~g} mm/s<br>held by %{customdata[2]}"
            "<br>t %{customdata[3]:.4f} s<extra></extra>",
        }
        scene = scene_in_box(np.concatenate([xyz, programmed]), ROOM)
        behind = PROGRAMMED | dict(zip(LINEAR_AXES, programmed.T, strict=True))
        return self._figure(
            [behind, motion], {"scene": scene, "margin": BARE | {"t": 30}, "showlegend": False}, 560
        )

    def feed(self, against: Literal["t", "s"] = "t") -> Figure:
        """The feed, over time ("t") or over the length of the path ("s"), with the programmed feed.

        Raises InputError for another horizontal axis.
        """
        return self._panels([FEED], against, 340)

    def profiles(self, against: Literal["t", "s"] = "t") -> Figure:
        """Velocity, acceleration and jerk of the axes in per cent of their limits, below the feed.

        Raises InputError for another horizontal axis.
        """
        axes = self._columns.joints.axes
        return self._panels(profile_panels(self._plan.machine, axes, [*QUANTITIES]), against, 820)

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
        try:
            go = import_module("plotly.graph_objects")
        except ImportError as fault:
            raise InputError(
                "figures need the package plotly: pip install 'feedrate-planner[notebook]'"
            ) from fault
        text = f"{self._plan.method} on {self._plan.machine.name}: {self._plan.cycle_time:.4f} s"
        figure: Figure = go.Figure(data, {**layout, "title": {"text": text}, "height": height})
        return figure
