"""Pictures of a plan, made for paper: fine lines at 200 dpi, units on every axis, colours that colour-blind
readers tell apart. The tool path here, coloured by feed on the scale of the page, over the programmed path; the
profiles over time in profiles_figure.py.

An hour of motion has millions of samples; of them one point is kept for each pixel that the motion passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.nc.program import Kind
from planner.report.figure import LOW_TO_HIGH, TOOL, MotionColumns, flat_view, shown_part, three, tool_lines
from planner.report.html.data import programmed_path
from planner.report.profiles_figure import profiles_figure
from planner.report.units import Units, axis_titles, units_of

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan


STYLE: Any = {
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "out",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 0.9,
    "savefig.dpi": 200,
}


def write_figures(plan: Plan, directory: Path, units: str | None = None) -> None:
    """Write `toolpath.png` and `profiles.png` of a solved plan into a directory, in `units` as of the page."""
    shown_in = units_of(plan.program, units)
    with matplotlib.rc_context(STYLE):
        toolpath_figure(plan, shown_in).savefig(directory / "toolpath.png", bbox_inches="tight")
        profiles_figure(plan, shown_in).savefig(directory / "profiles.png", bbox_inches="tight")


EDGE = 0.01  # of the extent: what is drawn beyond the edge of a picture [-]
PIXELS = 900  # about the extent of a tool path in pixels
POINTS_MAX = SIZES.picture_points
DENSE = SIZES.picture_dense
POINTS_PROGRAMMED = 10_000_000  # of the programmed path before one is kept for each pixel: 240 MB
NAMES = "XYZ"
ELEVATION, AZIMUTH = 32, -62  # where a path that is not flat is seen from [deg]
_SIN, _COS = np.sin(np.deg2rad([ELEVATION, AZIMUTH])), np.cos(np.deg2rad([ELEVATION, AZIMUTH]))
# (2, 3) how wide and how high a box is there, by its edges
SEEN_FROM = np.abs([[_SIN[1], _COS[1], 0.0], [_SIN[0] * _COS[1], _SIN[0] * _SIN[1], _COS[0]]])
FILLS = 0.86  # of its place that the box around a path fills; titles of axes stand in the rest [-]
SCALE = matplotlib.colors.LinearSegmentedColormap.from_list("feed", LOW_TO_HIGH["light"])
TOOLS = 240  # places at which the tool is drawn
GREY, LIGHT = "#8c8c8c", "#b5b5b5"
DASHED = (0, (3, 2))  # of a line: from its start, 3 widths drawn and 2 not


def toolpath_figure(plan: Plan, units: Units) -> Figure:
    """The motion coloured by feed over the programmed path; rapids are dashed. Of a program with the tool
    centre point on the motion is that of the tip, and the tool's direction is drawn at places of its feed
    moves."""
    trajectory = plan.trajectory
    assert trajectory is not None
    motion, titles = three(trajectory) / units.mm, axis_titles(plan.program, units)
    part = shown_part(plan.program, trajectory.block, motion)
    view, extent = flat_view(np.ptp(part, axis=0)), float(np.ptp(part, axis=0).max())
    shown = [0, 1, 2] if view is None else view
    keep = one_per_pixel(motion[:, shown], extent)
    points, columns = _within(part, motion[keep])[:, shown], MotionColumns(plan, trajectory.rows(keep))
    feed = units.per_feed * columns["feed"]
    rapid = plan.program.kind[columns.shown.block] == Kind.RAPID
    figure, axes = _canvas(np.ptp(part[:, shown], axis=0), flat=view is not None)
    collection = Line3DCollection if view is None else LineCollection
    around: Any = {"color": "black", "linestyle": "", "zorder": 5}
    axes.plot(*points[:1].T, label="start", marker="o", markersize=7, markerfacecolor="white", **around)
    axes.plot(*points[-1:].T, label="end", marker="s", markersize=4, **around)
    path = programmed_path(plan.toolpath, most=POINTS_PROGRAMMED) / units.mm
    path = _within(part, path[one_per_pixel(path, extent)])[:, shown]
    axes.plot(*path.T, label="programmed", color=LIGHT, linewidth=0.5, zorder=1)
    if rapid.any():
        broken = np.where((rapid | np.append(rapid[1:], False))[:, None], points, np.nan)
        label = "rapid, also beyond" if np.isnan(points).any() else "rapid"
        axes.plot(*broken.T, label=label, color=GREY, linewidth=0.6, linestyle=DASHED, zorder=2)
    ends, moving = np.stack([points[:-1], points[1:]], axis=1), ~rapid[1:]
    line = collection(ends[moving], cmap=SCALE, linewidths=1.5 if len(keep) < DENSE else 0.5, zorder=3)
    line.set_array(0.5 * (feed[:-1] + feed[1:])[moving])
    if moving.any():
        line.set_clim(0.0, float(feed[1:][moving].max()))
    axes.add_collection(line)
    tools = tool_lines(plan, TOOLS)
    if tools is not None:
        of_tools: Any = {"colors": TOOL, "linewidths": 0.4, "alpha": 0.6, "zorder": 2.5, "label": "tool"}
        tools = tools / units.mm
        axes.add_collection(collection([*tools[:, :, shown]], **of_tools))
    legend: Any = {"handles": axes.get_legend_handles_labels()[0], "columnspacing": 1.6}
    legend["ncols"] = len(legend["handles"])
    if view is not None:
        _flat_axes(axes, motion, view, titles)
        figure.legend(loc="outside upper center", **legend)
        bar = figure.colorbar(line, ax=axes, shrink=0.8, aspect=28, pad=0.02)
    else:
        _solid_axes(axes, part if tools is None else np.vstack([part, *tools]), titles)
        figure.legend(loc="upper center", bbox_to_anchor=(0.45, 1.0), **legend)
        bar = figure.colorbar(line, cax=figure.add_axes((0.95, 0.22, 0.02, 0.5)))
    bar.set_label(f"feed [{units.feed}]")
    outline: Any = bar.outline
    outline.set_linewidth(0.5)
    return figure


def _canvas(extent: FloatArray, *, flat: bool) -> tuple[Figure, Any]:
    """A figure of about the path's proportions, of `extent` (2 or 3,)."""
    if not flat:
        wide, high = SEEN_FROM @ extent
        figure = Figure(figsize=(6.4, min(max(5.4 * high / wide, 2.2), 5.0)))
        return figure, figure.add_axes((0.0, 0.0, 0.88, 0.88), projection="3d", computed_zorder=False)
    across, up = extent / max(float(extent.max()), 1e-9)
    figure = Figure(figsize=(1.5 + max(5.0 * across, 2.4), 1.1 + max(5.0 * up, 2.0)), layout="constrained")
    return figure, figure.add_subplot()


def _within(part: FloatArray, points: FloatArray) -> FloatArray:
    """The points (n, 3), NaN outside of a part (2, 3) of the space."""
    off = EDGE * float(np.ptp(part, axis=0).max())
    inside = ((points >= part[0] - off) & (points <= part[1] + off)).all(axis=1)
    return np.where(inside[:, None], points, np.nan)


def one_per_pixel(points: FloatArray, extent: float) -> Array:
    """Indices (k,) of the first and the last of the points (n, 2 or 3), and of every point that enters
    another pixel (or voxel) of a picture of an `extent`."""
    pixel = max(extent / PIXELS, 1e-9)
    while True:
        pixels = np.floor((points - points.min(axis=0)) / pixel).astype(np.int32)
        keep = np.flatnonzero((np.diff(pixels, axis=0) != 0).any(axis=1)) + 1
        if len(keep) <= POINTS_MAX:
            return np.unique(np.concatenate([[0], keep, [len(points) - 1]]))
        pixel *= 1.5


def _flat_axes(axes: Axes, motion: FloatArray, shown: list[int], titles: Mapping[str, str]) -> None:
    """The axes of a picture, and as its title what it leaves out."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.autoscale_view()
    axes.set_xlabel(_capital(titles["xyz"[shown[0]]]))
    axes.set_ylabel(_capital(titles["xyz"[shown[1]]]))
    (k,) = {0, 1, 2} - {*shown}
    low, high = motion[:, k].min(), motion[:, k].max()
    if high > low:
        title = f"seen along {NAMES[k]} ({NAMES[k]} {low:.4g} to {high:.4g})"
        axes.set_title(title, color="#555555", fontsize=8)


def _capital(title: str) -> str:
    return title[:1].upper() + title[1:]


def _solid_axes(axes: Any, motion: FloatArray, titles: Mapping[str, str]) -> None:
    low, high = motion.min(axis=0), motion.max(axis=0)
    axes.set_proj_type("ortho")
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(np.maximum(high - low, 1e-9))
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1)
    x, y, _ = proj_transform(*corners, axes.get_proj())
    # of the square that a view fills [-]
    wide, tall = np.ptp(axes.transLimits.transform(np.stack([x, y], axis=1)), axis=0)
    box, room = axes.get_position(original=True), axes.figure.get_size_inches()
    across, up = room[0] * box.width, room[1] * box.height  # [inches]
    zoom = FILLS / min(across, up) * min(across / wide, up / tall)
    axes.set_box_aspect(np.maximum(high - low, 1e-9), zoom=zoom)
    for line in (*axes.lines, *axes.collections):
        line.set_clip_on(False)  # at that square, and what is drawn asks for no room of its own
        line.set_in_layout(False)
    for axis, title, size in zip(
        (axes.xaxis, axes.yaxis, axes.zaxis), titles.values(), high - low, strict=True
    ):
        axis.set_pane_color((1, 1, 1, 0))
        axis._axinfo["grid"].update(color="#e4e4e4", linewidth=0.5)
        axis.set_major_locator(
            matplotlib.ticker.MaxNLocator(max(2, min(6, round(6 * size / (high - low).max()))))
        )
        axis.set_label_text(_capital(title))
    axes.tick_params(pad=-1)
