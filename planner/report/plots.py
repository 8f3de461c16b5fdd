"""Pictures of a plan: the tool path coloured by feed, and the profiles over time against their limits.

Made for paper: fine lines at 200 dpi, units on every axis, colours that colour-blind readers tell apart
(viridis; Okabe and Ito, "Color universal design", 2008). A job of an hour has millions of samples and a
picture some 1500 columns: the tool path keeps one point per pixel it passes, a profile the least and the
largest value of each column, so that no peak is lost.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from planner.arrays import Array, FloatArray
from planner.machine import LINEAR_AXES, RAD_PER_DEG
from planner.nc.program import Kind

if TYPE_CHECKING:
    from planner.methods.plan import Plan

COLUMNS = 1500  # about the width of a profile in pixels
PIXELS = 900  # about the extent of a tool path in pixels
POINTS_MAX = 150_000  # points of a tool path; the pixel grows until there are no more
DENSE = 60_000  # points from which on thick lines would hide each other
FAR = 4.0  # peaks beyond this multiple of the limit are drawn on a scale that is logarithmic beyond the limit
FLAT = 0.12  # third extent over the largest below which a path is shown from the side it is thinnest on
BLUE, VERMILION, GREY, LIGHT = "#0072B2", "#D55E00", "#8c8c8c", "#b5b5b5"
# Okabe and Ito without black (limits) and grey (others)
BANDS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442")
OTHERS = "#d0d0d0"
SHARE_MIN = 0.005  # constraints that limit a smaller share of the time are shown together
DASHED = (0, (3, 2))
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


def write_figures(plan: Plan, directory: Path) -> None:
    """Write `toolpath.png` and `profiles.png` of a solved plan into `directory`."""
    with matplotlib.rc_context(STYLE):
        toolpath_figure(plan).savefig(directory / "toolpath.png", bbox_inches="tight")
        profiles_figure(plan).savefig(directory / "profiles.png", bbox_inches="tight")


# ----------------------------------------------------------------------------------------- tool path


def toolpath_figure(plan: Plan) -> Figure:
    """The motion coloured by feed over the programmed path; rapids dashed."""
    trajectory = plan.trajectory
    assert trajectory is not None
    linear = [k for k, axis in enumerate(trajectory.axes) if axis in LINEAR_AXES]
    names = [trajectory.axes[k].upper() for k in linear]
    motion = trajectory.position[:, linear]
    extent = np.ptp(motion, axis=0)
    view = _flat_view(extent)
    shown = view if view is not None else list(range(len(linear)))
    keep = _one_per_pixel(motion[:, shown])
    points, feed = motion[keep][:, shown], trajectory.feed[keep]
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
    legend: Any = {"handles": handles, "ncols": len(handles), "columnspacing": 1.6}
    if view is not None:
        _flat_axes(axes, [names[k] for k in shown], _unseen(names, motion, shown))
        figure.legend(loc="outside upper center", **legend)
        bar = figure.colorbar(line, ax=axes, shrink=0.8, aspect=28, pad=0.02)
    else:
        _solid_axes(axes, names, motion)
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


def _one_per_pixel(points: FloatArray) -> Array:
    """Indices of the first and the last point and of every point that enters another pixel (or voxel)."""
    pixel = max(float(np.ptp(points, axis=0).max()) / PIXELS, 1e-9)
    while True:
        cell = np.floor((points - points.min(axis=0)) / pixel).astype(np.int32)
        keep = np.flatnonzero((np.diff(cell, axis=0) != 0).any(axis=1)) + 1
        if len(keep) <= POINTS_MAX:
            return np.unique(np.concatenate([[0], keep, [len(points) - 1]]))
        pixel *= 1.5


def _programmed(plan: Plan, linear: list[int]) -> FloatArray:
    """The programmed path as a polyline; arcs in steps of a few degrees."""
    path = plan.toolpath
    pieces, arc = [], path.arc
    straight = np.flatnonzero(arc < 0)
    at = np.concatenate([straight, np.flatnonzero(arc >= 0)])
    pieces.append((straight, path.start[straight]))
    for i in at[len(straight) :]:
        x = np.linspace(0.0, path.length[i], 49)[:-1]
        k, arcs = arc[i], path.arcs
        angle = (arcs.rate[k] * x)[:, None]
        pieces.append(
            (
                np.full(len(x), i),
                arcs.center[k]
                + arcs.radius[k] * (np.cos(angle) * arcs.e1[k] + np.sin(angle) * arcs.e2[k])
                + arcs.drift[k] * x[:, None],
            )
        )
    order = np.argsort(np.concatenate([index for index, _ in pieces]), kind="stable")
    points = np.concatenate([piece for _, piece in pieces])[order]
    points = np.vstack([points, path.end[-1:]])[:, linear]
    return points[_one_per_pixel(points)]


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


# ------------------------------------------------------------------------------------------ profiles


def profiles_figure(plan: Plan) -> Figure:
    """Feed over the limiting constraint, then acceleration and jerk of each moving axis with their limits."""
    trajectory = plan.trajectory
    assert trajectory is not None
    moving = [k for k in range(len(trajectory.axes)) if np.ptp(trajectory.position[:, k]) > 0]
    band = plan.grid is not None and len(plan.grid.t) > 1
    heights = [2.4, *([0.28] if band else []), *([1.0] * 2 * len(moving))]
    figure = Figure(figsize=(6.8, 0.55 + 0.85 * sum(heights)), layout="constrained")
    layout: Any = figure.get_layout_engine()
    layout.set(h_pad=0.03, hspace=0.02)
    rows = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
    scale, unit = _time_unit(trajectory.cycle_time)
    t = trajectory.t * scale

    _feed_row(rows[0], plan, t)
    if band:
        handles = _band_row(rows[1], plan, scale)
        figure.legend(
            handles=handles,
            loc="outside upper center",
            ncols=min(len(handles), 4),
            title="limited by (share of the time)",
            title_fontsize=8,
            handlelength=1.2,
            columnspacing=1.4,
        )
    free = _free_quantities(plan)
    row = iter(rows[2 if band else 1 :])
    quantities: tuple[tuple[Literal["acceleration", "jerk"], str, str], ...]
    quantities = (("acceleration", "a", "²"), ("jerk", "j", "³"))
    for quantity, symbol, power in quantities:
        values = getattr(trajectory, quantity)
        limits = plan.machine.limits(quantity, trajectory.axes)
        for k in moving:
            axis = trajectory.axes[k]
            rotary = axis not in LINEAR_AXES
            per = 1.0 / RAD_PER_DEG if rotary else 1e-3
            panel = next(row)
            _profile(panel, t, values[:, k] * per, BLUE)
            length = "°" if rotary else "m"
            panel.set_ylabel(f"{symbol}$_{{\\rm {axis.upper()}}}$\n[{length}/s{power}]")
            _limit_lines(panel, values[:, k] * per, limits[k] * per)
            if k == moving[0] and quantity in free:
                said = f"{quantity} is not limited by this method"
                panel.set_title(said, loc="right", fontsize=7.5, color=VERMILION, pad=2)
    rows[-1].set_xlabel(f"time [{unit}]")
    rows[-1].set_xlim(t[0], t[-1])
    figure.align_ylabels(rows)
    return figure


def _feed_row(panel: Axes, plan: Plan, t: FloatArray) -> None:
    trajectory = plan.trajectory
    assert trajectory is not None
    programmed = plan.program.feed[np.clip(trajectory.block, 0, None)]
    finite = np.isfinite(programmed)
    if finite.any():
        edges = np.flatnonzero(programmed[1:] != programmed[:-1])
        if len(edges) < COLUMNS:  # a feed for each block says nothing at this size
            panel.plot(
                t,
                np.where(finite, programmed, np.nan),
                color="black",
                linestyle=(0, (4, 3)),
                linewidth=0.7,
                zorder=1,
            )
    _profile(panel, t, trajectory.feed, BLUE)
    panel.set_ylim(0.0, 1.08 * max(float(trajectory.feed.max()), 1e-9))
    top = panel.get_ylim()[1]
    if finite.any() and programmed[finite].min() > top:
        said = f"programmed feed {programmed[finite].min():.4g} mm/s is never reached"
        panel.text(0.995, 0.96, said, transform=panel.transAxes, ha="right", va="top", fontsize=7.5)
    panel.set_ylabel("feed\n[mm/s]")


def _band_row(panel: Axes, plan: Plan, scale: float) -> list[Patch]:
    """A strip whose colour names the limiting constraint; returns the legend, the most frequent first."""
    grid = plan.grid
    assert grid is not None
    assert plan.trajectory is not None
    t = np.asarray(grid.t, dtype=float)
    duration = np.maximum(np.diff(t), 0.0)
    active = np.asarray(grid.active)[:-1]
    share = np.bincount(active, weights=duration, minlength=len(grid.active_names))
    ranked = [int(k) for k in np.argsort(-share, kind="stable") if share[k] > 0]
    shown = [k for k in ranked if share[k] >= SHARE_MIN * share.sum()][: len(BANDS)]
    colour_of = np.full(len(share), len(shown))
    colour_of[shown] = np.arange(len(shown))
    winner = _majority(t, colour_of[active], len(shown) + 1, plan.trajectory.cycle_time)
    colours = [matplotlib.colors.to_rgb(c) for c in (*BANDS[: len(shown)], OTHERS)]
    panel.imshow(
        np.array(colours)[winner][None],
        aspect="auto",
        interpolation="nearest",
        extent=(0.0, plan.trajectory.cycle_time * scale, 0.0, 1.0),
    )
    panel.set_yticks([])
    panel.spines[:].set_visible(False)
    panel.tick_params(bottom=False)
    total = max(float(share.sum()), 1e-12)
    entries = [(grid.active_names[k], share[k], BANDS[i]) for i, k in enumerate(shown)]
    if len(shown) < len(ranked):
        entries.append(("others", float(sum(share[k] for k in ranked[len(shown) :])), OTHERS))
    return [
        Patch(color=colour, label=f"{_words(name)} ({_percent(time / total)})")
        for name, time, colour in entries
    ]


def _majority(t: FloatArray, kind: Array, kinds: int, end: float) -> Array:
    """For each of COLUMNS columns over [0, end], the kind (of intervals from t[i]) that fills most of it."""
    cuts = np.union1d(t, np.linspace(0.0, end, COLUMNS + 1))
    middle = 0.5 * (cuts[1:] + cuts[:-1])
    of = kind[np.clip(np.searchsorted(t, middle, side="right") - 1, 0, len(kind) - 1)]
    column = np.clip((middle / end * COLUMNS).astype(int), 0, COLUMNS - 1)
    filled = np.bincount(column * kinds + of, weights=np.diff(cuts), minlength=COLUMNS * kinds)
    return filled.reshape(COLUMNS, kinds).argmax(axis=1)


def _profile(panel: Axes, t: FloatArray, values: FloatArray, colour: str) -> None:
    """A curve; with many samples the band between the least and the largest value of each column."""
    if len(t) <= 4 * COLUMNS:
        panel.plot(t, values, color=colour)
        return
    starts = np.linspace(0, len(t), COLUMNS + 1).astype(int)[:-1]
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    # each column reaches its neighbour, so that the band has no gaps where the curve is steep
    before = values[starts[1:] - 1]
    low[1:], high[1:] = np.minimum(low[1:], before), np.maximum(high[1:], before)
    panel.fill_between(t[starts], low, high, color=colour, linewidth=0.5)


def _limit_lines(panel: Axes, values: FloatArray, limit: float) -> None:
    peak = float(np.abs(values).max())
    far = peak > FAR * limit  # a linear scale would show the peak only
    if far:
        panel.set_yscale("symlog", linthresh=limit, linscale=0.4 + 0.6 * np.log10(peak / limit))
        decade = 10.0 ** np.floor(np.log10(peak))
        named = [0.0, decade] if decade < 10.0 * limit else [0.0, limit, decade]
        panel.set_yticks([-value for value in named[:0:-1]] + named)
        panel.yaxis.set_major_formatter("{x:g}")
        panel.minorticks_off()
    reach = max(peak, limit) * (1.6 if far else 1.18)
    panel.set_ylim(-reach, reach)
    panel.axhline(0.0, color="#cccccc", linewidth=0.5, zorder=0)
    for side in (limit, -limit):
        panel.axhline(side, color=VERMILION, linewidth=0.8, linestyle=(0, (4, 2)))


def _free_quantities(plan: Plan) -> set[str]:
    if plan.verdict is None:
        return set()
    return {name.partition(".")[0] for name, check in plan.verdict.limits.items() if not check.limited}


def _time_unit(seconds: float) -> tuple[float, str]:
    """Factor from seconds, and unit: ms below 0.5 s, min from 5 min on."""
    if seconds < 0.5:
        return 1e3, "ms"
    return (1.0 / 60.0, "min") if seconds > 300.0 else (1.0, "s")


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= SHARE_MIN else "< 1 %"


def _words(name: str) -> str:
    """acceleration.x -> acceleration X"""
    what, _, axis = name.partition(".")
    return f"{what} {axis.upper()}".strip().replace("_", " ")
