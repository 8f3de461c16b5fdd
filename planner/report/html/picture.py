"""The path of a plan as a small picture (SVG), drawn before any script runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.report.colours import CIVIDIS
from planner.report.figure import MotionColumns, highest_feed, three
from planner.report.tool_lines import TOOL, tool_lines

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

TOOLS = 120  # places at which the tool is drawn
POINTS = 3000  # of the motion: several for each pixel of its width


def path_picture(plan: Plan, size: float) -> str:
    """The motion seen along its thinnest direction, coloured by feed, as SVG, with the tool's direction if it is one of the tip. The
    plan must have a trajectory.

    size : of the longer side [px]
    """
    trajectory = plan.trajectory
    assert trajectory is not None
    rows = np.unique(np.linspace(0, len(trajectory) - 1, min(POINTS, len(trajectory))).astype(np.int64))
    shown = trajectory.rows(rows)
    position = three(shown)
    across = np.sort(np.argsort(-np.ptp(position, axis=0), kind="stable")[:2])
    points = position[:, across] * [1.0, -1.0]  # the picture's y goes down
    tools = tool_lines(plan, TOOLS)
    ends = np.zeros((0, 2, 2)) if tools is None else tools[:, :, across] * [1.0, -1.0]
    everything = np.vstack([points, ends.reshape(-1, 2)])
    low, extent = everything.min(axis=0), np.ptp(everything, axis=0)
    scale = size / max(float(extent.max()), 1e-9)
    points, ends = ((place - low) * scale + 4.0 for place in (points, ends))
    width, height = extent * scale + 8.0
    columns = MotionColumns(plan, shown)
    feed = columns["feed"]
    highest = highest_feed(feed, columns["programmed"])
    colour = np.minimum(feed / max(highest, 1e-9) * len(CIVIDIS), len(CIVIDIS) - 1).astype(np.int64)
    lines = "".join(
        f'<polyline points="{_points(pair)}" stroke="{TOOL}" stroke-width="0.5"/>' for pair in ends
    )
    lines += "".join(
        f'<polyline points="{_points(points[first : last + 1])}" stroke="{CIVIDIS[colour[first]]}"/>'
        for first, last in _runs(colour)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'height="{height:.0f}" role="img" '
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
