"""Feed, acceleration and jerk over time against their limits, and which constraint limits when. A picture has some 1500
columns: a profile keeps the least and the largest value of each, so that no peak of millions of samples is lost.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from planner.base.arrays import Array, FloatArray
from planner.report.figure import (
    COLOURS,
    GREY,
    LIGHT,
    MotionColumns,
    Panel,
    limit_colours,
    moving_axes,
    profile_panels,
)
from planner.report.html.data import used_limits
from planner.report.rows import held_by_rows
from planner.report.units import Units
from planner.sensitivity.records import WORDS

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

COLUMNS = 1500  # about the width of a profile in pixels
FAR = 4.0  # peaks beyond this multiple of the limit are drawn on a scale that is logarithmic beyond the limit
BLUE, VERMILION = COLOURS[0], COLOURS[5]
HELD = 7  # limits with the largest shares of the time, which the legend has
QUANTITIES = ("acceleration", "jerk")


def profiles_figure(plan: Plan, units: Units) -> Figure:
    """Feed with the active limit below it, then acceleration and jerk of each moving axis with their limits,
    over time; the feed in `units`."""
    trajectory = plan.trajectory
    assert trajectory is not None
    motion = MotionColumns(plan, trajectory, plan.joints)
    moving = moving_axes(motion.joints)
    first, *below = profile_panels(motion, plan.machine, moving, QUANTITIES, units)
    band = plan.grid is not None and len(plan.grid.t) > 1
    heights = [2.4, *([0.28] if band else []), *([1.0] * len(below) * len(moving))]
    figure = Figure(figsize=(6.8, 0.55 + 0.85 * sum(heights)), layout="constrained")
    layout: Any = figure.get_layout_engine()
    layout.set(h_pad=0.03, hspace=0.02)
    rows = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0])
    scale, unit = _time_unit(trajectory.cycle_time)
    t = motion["t"] * scale

    _feed_row(rows[0], motion, t, first)
    if band:
        handles = _band_row(rows[1], plan, scale)
        title = "held by (share of the time, and what more of it saves)"
        spacing: Any = {"title_fontsize": 8, "handlelength": 1.2, "columnspacing": 1.4}
        figure.legend(
            handles=handles, title=title, loc="outside upper center", ncols=min(len(handles), 2), **spacing
        )
    free = () if plan.verdict is None else plan.verdict.not_limited
    row = iter(rows[2 if band else 1 :])
    for quantity in below:
        for one in quantity.series:
            panel = next(row)
            per, length = (1e-3, one.unit[1:]) if one.unit.startswith("mm") else (1.0, one.unit)
            values = motion[one.column] * per
            draw_profile(panel, t, values, BLUE)
            panel.set_ylabel(f"{one.column[0]}$_{{\\rm {one.name.upper()}}}$\n[{length}]")
            _limit_lines(panel, values, one.limit * per)
            if one.name == moving[0] and quantity.title in free:
                said = f"{quantity.title} is not limited by this method"
                panel.set_title(said, loc="right", fontsize=7.5, color=VERMILION, pad=2)
    rows[-1].set_xlabel(f"time [{unit}]")
    rows[-1].set_xlim(t[0], t[-1])
    figure.align_ylabels(rows)
    return figure


def _feed_row(panel: Axes, motion: MotionColumns, t: FloatArray, said: Panel) -> None:
    per, unit = said.series[0].scale, said.series[0].unit
    feed, programmed = per * motion["feed"], per * motion["programmed"]
    asked = programmed[np.isfinite(programmed)]
    if np.count_nonzero(np.diff(asked)) < COLUMNS:  # a feed for each block says nothing at this size
        panel.plot(t, programmed, color="black", linestyle=(0, (4, 3)), linewidth=0.7, zorder=1)
    draw_profile(panel, t, feed, said.series[1].colour)
    top = 1.08 * max(float(feed.max()), 1e-9) if math.isnan(said.top) else said.top
    panel.set_ylim(0.0, top)
    if asked.min(initial=np.inf) > top and len(asked):
        beyond = f"programmed feed {asked.min():.4g} {unit} is never reached"
    else:
        beyond = said.said
    if beyond:
        panel.text(0.995, 1.01, beyond, transform=panel.transAxes, ha="right", va="bottom", fontsize=7.5)
    panel.set_ylabel(f"feed\n[{unit}]")


def _band_row(panel: Axes, plan: Plan, scale: float) -> list[Patch]:
    """A strip whose colour names what is active, of several the dearest; returns the legend, the largest
    share first."""
    grid, trajectory = plan.grid, plan.trajectory
    assert grid is not None
    assert trajectory is not None
    names, active = used_limits(grid.active_names, grid.active)
    held = held_by_rows(grid, plan.prices)[:HELD]
    shades = limit_colours(names)
    colour = {WORDS.get(name, name): one for name, one in zip(names, shades, strict=True)}
    told = {name for name, _, _ in held}
    colours = [matplotlib.colors.to_rgb(one if name in told else LIGHT) for name, one in colour.items()]
    end = trajectory.cycle_time
    winner = majority(np.asarray(grid.t, dtype=float), active[:-1], len(names), end)
    extent = (0.0, end * scale, 0.0, 1.0)
    panel.imshow(np.array(colours)[winner][None], aspect="auto", interpolation="nearest", extent=extent)
    panel.set_yticks([])
    panel.spines[:].set_visible(False)
    panel.tick_params(bottom=False)
    return [
        Patch(color=colour.get(name, GREY), label=f"{name} {percent} %" + (f" ({saves})" if saves else ""))
        for name, percent, saves in held
    ]


def majority(t: FloatArray, kind: Array, kinds: int, end: float) -> Array:
    """For each of C = `COLUMNS` columns over [0, end] the kind that fills most of it (C,).

    t     : (n,) starts of the intervals [s], ascending
    kind  : (n,) kind of each, below `kinds`
    end   : of the last interval [s]
    """
    cuts = np.union1d(t, np.linspace(0.0, end, COLUMNS + 1))
    middle = 0.5 * (cuts[1:] + cuts[:-1])
    of = kind[np.clip(np.searchsorted(t, middle, side="right") - 1, 0, len(kind) - 1)]
    column = np.clip((middle / end * COLUMNS).astype(int), 0, COLUMNS - 1)
    filled = np.bincount(column * kinds + of, weights=np.diff(cuts), minlength=COLUMNS * kinds)
    return filled.reshape(COLUMNS, kinds).argmax(axis=1)


def draw_profile(panel: Axes, t: FloatArray, values: FloatArray, colour: str) -> None:
    """Draw values (T,) over t (T,) [s] as a curve; of many the band between the least and the largest value
    of each column."""
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


def _time_unit(seconds: float) -> tuple[float, str]:
    """Factor from seconds, and unit: ms below 0.5 s, min from 5 min on."""
    if seconds < 0.5:
        return 1e3, "ms"
    return (1.0 / 60.0, "min") if seconds > 300.0 else (1.0, "s")
