"""The file `report.html`: one page with everything in it, plotly's script too, so that it opens without a network.

Columns of numbers are compressed (gzip) and written as base64; the page unpacks them with the browser's own DecompressionStream. Texts
of the program and of names are data as well, and the page shows them as text, so that nothing in a program is ever run.

The first picture needs none of that: it is in the page as SVG (picture.py), and the header is filled before plotly's script, some five
megabytes, is run and the columns are unpacked.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import Array
from planner.base.sizes import SIZES
from planner.job.at_tip import of_axes
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.motion.trajectory import in_degrees
from planner.report.colours import LOW_TO_HIGH, limit_colours
from planner.report.export import json_ready, summary
from planner.report.html.data import lines_of, programmed_path, samples_of
from planner.report.html.parts import page_of
from planner.report.html.picture import path_picture
from planner.report.replace import check_file
from planner.report.rows import plan_rows

if TYPE_CHECKING:
    from planner.job.plan import Plan

REPORT = "report.html"
PICTURE = 900.0  # longer side of the picture that stands there until the path can be turned [px]
CORNERS_MAX = SIZES.page_corners
CALLS_MAX = SIZES.page_calls
MARK = '<meta name="generator" content="feedrate-planner">'
MICROSECONDS_PER_MICROMETRE = 1e3  # of a price [s/mm]


def check_report_place(path: Path, *, force: bool = False) -> None:
    """Raise InputError if a page cannot be written to a file: a directory, or a file that is no report while `force` is not set."""
    check_file(path, (), is_report, force=force)


def is_report(path: Path) -> bool:
    """Whether a file is a page of this package."""
    with path.open("rb") as stream:
        return MARK.encode() in stream.read(500)


def report_page(plan: Plan, text: bytes | None = None, said: dict[str, Any] | None = None) -> str:
    """The page of a plan.

    text : the program as it was read; None where it is not known
    said : the summary to show; None for that of the plan

    Raises InputError if plotly is not installed. Raises ValueError for a plan without a trajectory.
    """
    if plan.trajectory is None:
        raise ValueError("report_page: the plan has no trajectory; see plan.sentence")
    columns, about = _columns(plan)
    columns["program"] = np.frombuffer(text or b"", dtype=np.uint8)
    about["summary"] = {"told": plan_rows(plan)} | (said or summary(plan))
    return page_of(
        "report", "planned", plan.program.source, about, columns, PICTURE=path_picture(plan, PICTURE)
    )


def _columns(plan: Plan) -> tuple[dict[str, Array], dict[str, Any]]:
    """Columns of numbers by name, and what the page has to know of them."""
    samples = samples_of(plan)
    shown, axes = samples.shown, samples.shown.axes
    lines, joints = lines_of(plan, samples), of_axes(plan, shown)
    scale = in_degrees(axes, plan.toolpath.radius)
    columns: dict[str, Array] = {
        "t": shown.t,
        "s": shown.s.astype(np.float32),
        "feed": samples.feed.astype(np.float32),
        "line": shown.line.astype(np.int32),
        "limit": samples.limit.astype(np.uint8),
        "deviation": samples.deviation.astype(np.float32),
        "programmed": np.nan_to_num(samples.programmed, posinf=np.nan).astype(np.float32),
        "path": programmed_path(plan.toolpath).astype(np.float32).ravel(),
        "line_number": lines.line.astype(np.int32),
        "line_planned": lines.planned.astype(np.float32),
        "line_programmed": lines.programmed.astype(np.float32),
        "line_highest": lines.highest.astype(np.float32),
        "line_limit": lines.limit.astype(np.uint8),
        "line_deviation": lines.deviation.astype(np.float32),
    }
    program = plan.program
    if program.frames:
        columns["frame"] = program.frame[shown.block].astype(np.int32)
    for k, axis in enumerate(axes):
        columns[axis] = (shown.position[:, k] * scale[k]).astype(np.float32)
        columns[f"a{axis}"] = (joints.acceleration[:, k] * scale[k]).astype(np.float32)
        columns[f"j{axis}"] = (joints.jerk[:, k] * scale[k]).astype(np.float32)
    if samples.price is not None:
        columns["price"] = (samples.price * MICROSECONDS_PER_MICROMETRE).astype(np.float32)
    if lines.more_feed is not None and lines.more is not None:
        columns["line_more_feed"] = lines.more_feed.astype(np.float32)
        columns["line_more"] = lines.more.astype(np.float32)
    machine = plan.machine
    about = {
        "axes": [*axes],
        "linear": [axis for axis in axes if axis in LINEAR_AXES],
        "rotary": [axis for axis in axes if axis in ROTARY_AXES],
        "limits": list(samples.limits),
        "colours": limit_colours(samples.limits),
        "scales": {ground: list(colours) for ground, colours in LOW_TO_HIGH.items()},
        "step": samples.step,
        "samples": len(plan.trajectory) if plan.trajectory is not None else 0,
        "machine": {axis: machine.axes[axis].model_dump() for axis in axes},
        "corners": json_ready(_corners(plan)),
        "calls": [program.called(frame) for frame in range(min(len(program.frames), CALLS_MAX))],
    }
    return columns, about


def _corners(plan: Plan) -> dict[str, list[Any]]:
    """Eq. 18-20 at the corners that were looked at (verify/corners.py)."""
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
