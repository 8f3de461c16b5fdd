"""The file `report.html`: one page with everything in it, plotly's script too, so that it opens without a network.

Columns of numbers are compressed and in base64; the browser's DecompressionStream unpacks them. Texts of the program are
data that is shown and never run. The first picture is SVG, seen before plotly's five megabytes are run.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.machine import LINEAR_AXES
from planner.nc.points import own_text
from planner.nc.program import Kind
from planner.report.figure import (
    AGAINST,
    LIGHT,
    LOW_TO_HIGH,
    TOOL,
    MotionColumns,
    highest_feed,
    limit_colours,
    moving_axes,
    profile_panels,
    shown_part,
    three,
    tool_lines,
    travel_box,
)
from planner.report.html.data import lines_of, programmed_path, samples_of
from planner.report.html.parts import page_of
from planner.report.plotly_figure import PROGRAMMED, colourings, fitted_scene, panel_figure
from planner.report.summary import json_ready, summary
from planner.report.units import Units, axis_titles, units_of

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan


REPORT = "report.html"
PICTURE = 900.0  # longer side of the picture that stands there until the path can be turned [px]
CORNERS_MAX = SIZES.page_corners
CALLS_MAX = SIZES.page_calls


def report_page(plan: Plan, said: dict[str, Any] | None = None, units: str | None = None) -> str:
    """The page of a plan.

    said  : the summary to show; None for that of the plan
    units : "mm" or "inch"; None for those of the program

    Raises InputError if plotly is not installed. Raises ValueError for a plan without a trajectory.
    """
    if plan.trajectory is None:
        raise ValueError("report_page: the plan has no trajectory; see plan.sentence")
    columns, about = _columns(plan, units_of(plan.program, units))
    columns["program"] = np.frombuffer(own_text(plan.program) or b"", dtype=np.uint8)
    about["summary"] = told = said or summary(plan)
    names = list(dict.fromkeys([*about["limits"], *(told.get("held_by") or ())]))
    about["colours"] = dict(zip(names, limit_colours(names), strict=True))
    return page_of("report", "planned", told["program"], about, columns, PICTURE=path_picture(plan, PICTURE))


# Columns of samples and of lines with other numbers than float32; `t` tells samples an hour from the start
# apart.
TYPES = {"t": "f8", "limit": "u1", "rapid": "u1", "line_limit": "u1"}
TYPES |= dict.fromkeys(("line", "frame", "line_line", "tool", "operation", "layer"), "i4")


def _columns(plan: Plan, units: Units) -> tuple[dict[str, Array], dict[str, Any]]:
    """Columns of numbers by name, and what the page has to know of them."""
    samples = samples_of(plan)
    shown, program, machine = samples.shown, plan.program, plan.machine
    motion = MotionColumns(plan, shown)
    panels = profile_panels(motion, machine, moving_axes(motion.joints), ["acceleration", "jerk"], units)
    titles = axis_titles(program, units)
    figure, path, places = panel_figure(panels, "t"), programmed_path(plan.toolpath), three(shown)
    everything, part = np.concatenate([places, path]), shown_part(program, shown.block, places)
    beyond = bool((np.ptp(places, axis=0) > np.ptp(part, axis=0)).any())
    names = {"t", "s", "line", *shown.axes, *(of["y"] for of in figure["columns"])}
    columns: dict[str, Array] = {name: motion[name] for name in sorted(names)}
    columns |= {
        "limit": samples.limit,
        "rapid": samples.rapid,
        "deviation": samples.deviation,
        "path": path.ravel(),
    }
    columns |= {name: of for name, (_, of) in samples.parts.items()}
    if samples.price is not None:
        columns["price"] = samples.price
    columns |= {f"line_{name}": column for name, column in lines_of(plan, samples).items()}
    if program.frames:
        columns["frame"] = program.frame[shown.block]
    about = {
        "linear": [axis for axis in shown.axes if axis in LINEAR_AXES],
        "limits": list(samples.limits),
        "colourings": colourings(samples, units),
        "units": dataclasses.asdict(units) | {"per_feed": units.per_feed},
        "axes": ", ".join(titles[axis] for axis in shown.axes if axis in LINEAR_AXES),
        "beyond": "; rapids go on beyond" if beyond else "",
        "travel": _travel(plan, everything, units, titles),
        "layers": samples.parts.get("layer", ([],))[0],
        "programmed": PROGRAMMED,
        "profile": figure,
        "against": AGAINST,
        "view": fitted_scene((part if beyond else everything) / units.mm, titles),
        "step": samples.step,
        "samples": len(plan.trajectory) if plan.trajectory is not None else 0,
        "corners": json_ready(_corners(plan)),
        "calls": [program.called(frame) for frame in range(min(len(program.frames), CALLS_MAX))],
    }
    return {name: column.astype(TYPES.get(name, "f4")) for name, column in columns.items()}, about


def _travel(plan: Plan, points: FloatArray, units: Units, titles: Mapping[str, str]) -> dict[str, Any] | None:
    """The box of the axes' travel, by axis, and the view of it with a path, `points` (n, 3) [mm]; None without one."""
    box = travel_box(plan)
    if box is None:
        return None
    view = fitted_scene(np.concatenate([points, box]) / units.mm, titles)
    return {"box": dict(zip(LINEAR_AXES, (box / units.mm).T.tolist(), strict=True)), "view": view}


def _corners(plan: Plan) -> dict[str, list[Any]]:
    """Eq. 18-20 at the corners that were looked at (verifier/corners.py)."""
    found = plan.corners
    if found is None:
        return {}
    seen, (speed, budget) = np.flatnonzero(found.looked), found.told()
    worst = np.maximum(speed, budget)[seen]
    seen = np.sort(seen[np.argsort(-worst, kind="stable")[:CORNERS_MAX]])
    return {
        "line": found.line[seen].tolist(),
        "angle": np.degrees(found.theta[seen]).tolist(),
        "feed": found.feed_planned[seen].tolist(),
        "eq19": speed[seen].tolist(),
        "eq18": budget[seen].tolist(),
        "eq20": found.feed_paper[seen].tolist(),
        "gain": found.gain[seen].tolist(),
    }


TOOLS = 120  # places at which the tool is drawn
POINTS = 3000  # of the motion: several for each pixel of its width


def path_picture(plan: Plan, size: float) -> str:
    """The motion seen along its thinnest direction, coloured by feed, as SVG, with the tool's direction if it
    is one of the tip. The plan must have a trajectory.

    size : of the longer side [px]
    """
    trajectory = plan.trajectory
    assert trajectory is not None
    rows = np.unique(np.linspace(0, len(trajectory) - 1, min(POINTS, len(trajectory))).astype(np.int64))
    shown = trajectory.rows(rows)
    position = three(shown)
    part = shown_part(plan.program, shown.block, position)
    across = np.sort(np.argsort(-np.ptp(part, axis=0), kind="stable")[:2])
    points = position[:, across] * [1.0, -1.0]  # the picture's y goes down
    tools = tool_lines(plan, TOOLS)
    ends = np.zeros((0, 2, 2)) if tools is None else tools[:, :, across] * [1.0, -1.0]
    everything = np.vstack([part[:, across] * [1.0, -1.0], ends.reshape(-1, 2)])
    low, extent = everything.min(axis=0), np.ptp(everything, axis=0)
    scale = size / max(float(extent.max()), 1e-9)
    points, ends = ((place - low) * scale + 4.0 for place in (points, ends))
    width, height = extent * scale + 8.0
    columns = MotionColumns(plan, shown)
    feed = columns["feed"]
    programmed = columns["programmed"]
    shades = [*LOW_TO_HIGH["light"], LIGHT]
    highest, rapid = highest_feed(feed, programmed), len(shades) - 1
    colour = np.minimum(feed / max(highest, 1e-9) * rapid, rapid - 1).astype(np.int64)
    colour[plan.program.kind[np.clip(shown.block, 0, None)] == Kind.RAPID] = rapid
    lines = "".join(
        f'<polyline points="{_points(pair)}" stroke="{TOOL}" stroke-width="0.5"/>' for pair in ends
    )
    lines += "".join(
        f'<polyline points="{_points(points[first : last + 1])}" stroke="{shades[colour[first]]}"/>'
        for first, last in _runs(colour)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'height="{height:.0f}" role="img" '
        f'aria-label="path coloured by feed" fill="none" stroke-width="2.4" stroke-linecap="round">{lines}</svg>'
    )


def _runs(colour: Array) -> list[tuple[int, int]]:
    """First and last point of the lines of one colour, each up to the first point of the next."""
    starts = np.flatnonzero(np.append(True, np.diff(colour) != 0))
    ends = np.append(starts[1:], len(colour) - 1)
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _points(points: FloatArray) -> str:
    """Points (n, 2) as SVG writes them."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
