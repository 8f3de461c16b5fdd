"""The tool path coloured by feed (viridis), over the programmed path.

An hour of motion has millions of samples; of them one point is kept for each pixel that the motion passes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.geometry.chords import points_on
from planner.machine import LINEAR_AXES
from planner.nc.program import Kind
from planner.report.tool_lines import TOOL, tool_lines
from planner.report.word_feed import WordFeed

if TYPE_CHECKING:
    from planner.job.plan import Plan

PIXELS = 900  # about the extent of a tool path in pixels
POINTS_MAX = SIZES.picture_points
DENSE = SIZES.picture_dense
FLAT = 0.12  # third extent over the largest below which a path is shown from the side it is thinnest on
TOOLS = 240  # places at which the tool is drawn
GREY, LIGHT = "#8c8c8c", "#b5b5b5"
DASHED = (0, (3, 2))  # of a line: from its start, 3 widths drawn and 2 not


def toolpath_figure(plan: Plan) -> Figure:
    """The motion coloured by feed over the programmed path; rapids are dashed. Of a program with the tool centre point on the motion is
    that of the tip, and the tool's direction is drawn at places of its
    feed moves."""
    trajectory = plan.trajectory
    assert trajectory is not None
    linear = [k for k, axis in enumerate(trajectory.axes) if axis in LINEAR_AXES]
    names = [trajectory.axes[k].upper() for k in linear]
    motion = trajectory.position[:, linear]
    extent = np.ptp(motion, axis=0)
    view = _flat_view(extent)
    shown = view if view is not None else list(range(len(linear)))
    keep = one_per_pixel(motion[:, shown])
    points, feed = motion[keep][:, shown], WordFeed(plan.toolpath).of(trajectory.rows(keep))
    rapid = plan.program.kind[trajectory.block[keep]] == Kind.RAPID
    figure, axes = _canvas(np.ptp(points, axis=0), flat=view is not None)
    ends = np.stack([points[:-1], points[1:]], axis=1)
    moving = ~rapid[1:]
    make = LineCollection if view is not None else Line3DCollection
    axes.plot(*_programmed(plan, linear)[:, shown].T, color=LIGHT, linewidth=0.5, zorder=1)
    if rapid.any():
        broken = np.where((rapid | np.append(rapid[1:], False))[:, None], points, np.nan)
        axes.plot(*broken.T, color=GREY, linewidth=0.6, linestyle=DASHED, zorder=2)
    line = make(ends[moving], cmap="viridis", linewidths=1.5 if len(keep) < DENSE else 0.5, zorder=3)
    line.set_array(0.5 * (feed[:-1] + feed[1:])[moving])
    if moving.any():
        line.set_clim(0.0, float(feed[1:][moving].max()))
    axes.add_collection(line)
    tools = tool_lines(plan, TOOLS)
    if tools is not None:
        axes.add_collection(make([*tools[:, :, shown]], colors=TOOL, linewidths=0.4, alpha=0.6, zorder=2.5))
    start: Any = {"marker": "o", "markersize": 7, "markerfacecolor": "white", "zorder": 5}
    end: Any = {"marker": "s", "markersize": 4, "markerfacecolor": "black", "zorder": 5}
    axes.plot(*points[:1].T, color="black", linestyle="", **start)
    axes.plot(*points[-1:].T, color="black", linestyle="", **end)
    handles = [
        Line2D([], [], color="black", linestyle="", label="start", **start),
        Line2D([], [], color="black", linestyle="", label="end", **end),
        Line2D([], [], color=LIGHT, linewidth=0.8, label="programmed"),
    ]
    if rapid.any():
        handles.append(Line2D([], [], color=GREY, linewidth=0.8, linestyle=DASHED, label="rapid"))
    if tools is not None:
        handles.append(Line2D([], [], color=TOOL, linewidth=0.8, label="tool"))
    legend: Any = {"handles": handles, "ncols": len(handles), "columnspacing": 1.6}
    if view is not None:
        _flat_axes(axes, [names[k] for k in shown], _unseen(names, motion, shown))
        figure.legend(loc="outside upper center", **legend)
        bar = figure.colorbar(line, ax=axes, shrink=0.8, aspect=28, pad=0.02)
    else:
        _solid_axes(axes, names, motion if tools is None else np.vstack([motion, tools[:, 1]]))
        figure.legend(loc="upper center", bbox_to_anchor=(0.45, 1.0), **legend)
        bar = figure.colorbar(line, cax=figure.add_axes((0.95, 0.22, 0.02, 0.5)))
    bar.set_label("feed [mm/s]")
    outline: Any = bar.outline
    outline.set_linewidth(0.5)
    return figure


def _canvas(extent: FloatArray, *, flat: bool) -> tuple[Figure, Any]:
    """A figure of about the path's proportions."""
    if not flat:
        figure = Figure(figsize=(6.4, 5.0))
        return figure, figure.add_axes((0.0, 0.0, 0.88, 0.96), projection="3d", computed_zorder=False)
    across, up = extent / max(float(extent.max()), 1e-9)
    figure = Figure(figsize=(1.5 + max(5.0 * across, 2.4), 1.1 + max(5.0 * up, 2.0)), layout="constrained")
    return figure, figure.add_subplot()


def _flat_view(extent: FloatArray) -> list[int] | None:
    """The two axes that show a nearly flat path best; None for a path that needs three."""
    if len(extent) == 2:
        return [0, 1]
    thin = int(extent.argmin())
    if extent[thin] > FLAT * extent.max():
        return None
    return [k for k in range(len(extent)) if k != thin]


def one_per_pixel(points: FloatArray) -> Array:
    """Indices (k,) of the first and the last of the points (n, 2 or 3), and of every point that enters another pixel (or voxel)."""
    pixel = max(float(np.ptp(points, axis=0).max()) / PIXELS, 1e-9)
    while True:
        pixels = np.floor((points - points.min(axis=0)) / pixel).astype(np.int32)
        keep = np.flatnonzero((np.diff(pixels, axis=0) != 0).any(axis=1)) + 1
        if len(keep) <= POINTS_MAX:
            return np.unique(np.concatenate([[0], keep, [len(points) - 1]]))
        pixel *= 1.5


def _programmed(plan: Plan, linear: list[int]) -> FloatArray:
    """The programmed path as a polyline; arcs and curves in steps of a few degrees."""
    path = plan.toolpath
    pieces = []
    straight = np.flatnonzero(path.straight)
    at = np.concatenate([straight, np.flatnonzero(~path.straight)])
    pieces.append((straight, path.start[straight]))
    for i in at[len(straight) :]:
        x = np.linspace(0.0, path.length[i], 49)[:-1]
        on = np.full(len(x), i)
        pieces.append((on, points_on(path, on, x)))
    order = np.argsort(np.concatenate([index for index, _ in pieces]), kind="stable")
    points = np.concatenate([piece for _, piece in pieces])[order]
    points = np.vstack([points, path.end[-1:]])[:, linear]
    return points[one_per_pixel(points)]


def _unseen(names: list[str], motion: FloatArray, shown: list[int]) -> str:
    """What a flat picture leaves out, as a title; empty for a path without a third extent."""
    for k, name in enumerate(names):
        if k not in shown and np.ptp(motion[:, k]) > 0:
            return f"seen along {name} ({name} {motion[:, k].min():.4g} to {motion[:, k].max():.4g} mm)"
    return ""


def _flat_axes(axes: Axes, names: list[str], title: str) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.autoscale_view()
    axes.set_xlabel(f"{names[0]} [mm]")
    axes.set_ylabel(f"{names[1]} [mm]")
    axes.set_title(title, color="#555555", fontsize=8)


def _solid_axes(axes: Any, names: list[str], motion: FloatArray) -> None:
    low, high = motion.min(axis=0), motion.max(axis=0)
    axes.set_proj_type("ortho")
    axes.view_init(elev=32, azim=-62)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(np.maximum(high - low, 1e-9), zoom=1.08)
    for axis, name, size in zip((axes.xaxis, axes.yaxis, axes.zaxis), names, high - low, strict=True):
        axis.set_pane_color((1, 1, 1, 0))
        axis._axinfo["grid"].update(color="#e4e4e4", linewidth=0.5)
        axis.set_major_locator(
            matplotlib.ticker.MaxNLocator(max(2, min(6, round(6 * size / (high - low).max()))))
        )
        axis.set_label_text(f"{name} [mm]")
    axes.tick_params(pad=-1)
