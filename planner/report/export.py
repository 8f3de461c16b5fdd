"""The files of a plan, and the plan in numbers.

`trajectory.parquet`, `.csv` or `.npz` (`planner.report.trajectory_file`), `planned.ngc` if the program is an NC text
(`planner.report.planned`), the program itself if no other file has it, `summary.json`, and pictures if asked for. They take their
places together (`planner.report.replace`), and trajectory and summary carry the same `run_id`.
"""

from __future__ import annotations

import dataclasses
import datetime
import json
import math
import platform
import uuid
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.job.at_tip import joints_of
from planner.motion.on_demand import TrajectoryOnDemand
from planner.nc.info import PLACES_SHOWN
from planner.nc.points import SOURCE, points_file
from planner.nc.program import ToolPoint
from planner.report.beside import beside_summary
from planner.report.block_feeds import BlockWatch, PlannedBlocks
from planner.report.optimum import optimum_summary
from planner.report.planned import LeftOut, planned_program, source_text
from planner.report.replace import CSV_METADATA, SUMMARY, check_output, checksums, refuse_inputs, replacing
from planner.report.rows import plan_rows
from planner.report.trajectory_file import Format, units, write_trajectory
from planner.report.word_feed import WordFeed

if TYPE_CHECKING:
    from planner.job.plan import Plan
    from planner.nc.info import ProgramInfo
    from planner.verify import CornerCheck, Verdict

PLANNED = "planned.ngc"
KEPT = (KEPT_TEXT, KEPT_POINTS) = ("program.ngc", "program.json")  # programs that no other file has
NO_CORNERS = {"count": 0, "worst_speed_ratio": None}  # of a plan without a motion
PACKAGES = ("numpy", "scipy", "numba", "toppra", "pyarrow")


def write_plan(
    plan: Plan,
    directory: str | Path,
    *,
    file_format: Format = "parquet",
    plots: bool = False,
    report: bool = False,
    force: bool = False,
) -> list[str]:
    """Write the files of a solved plan into a directory, all of them or none.

    file_format : of the trajectory
    plots       : write pictures too
    report      : write a page that opens in a browser, too (report/html/page.py)
    force       : replace files of these names even if no run wrote them

    Returns the names of the files. The `notes` of the summary are those of the plan, followed by what was left out and why.

    Raises InputError if the directory cannot be written, or if a file is in the way that no run wrote. Raises ValueError for a plan
    without a trajectory.
    """
    if plan.trajectory is None:
        raise ValueError("write_plan: the plan has no trajectory; see plan.sentence")
    directory = Path(directory)
    run_id = uuid.uuid4().hex
    kept = {name for name in (PLANNED, *KEPT) if _is_source(plan, directory / name)}
    with replacing(directory, kept=kept, force=force) as new:
        about = trajectory_metadata(plan, run_id)
        trajectory, blocks, joints = plan.trajectory, None, joints_of(plan)
        feed_of = WordFeed(plan.toolpath).of
        if isinstance(trajectory, TrajectoryOnDemand):  # evaluated once for both files
            watch = BlockWatch(plan.toolpath)
            write_trajectory(
                new / f"trajectory.{file_format}", trajectory.heard_by(watch.take), about, joints, feed_of
            )
            blocks = watch.planned(trajectory)
        else:
            write_trajectory(new / f"trajectory.{file_format}", trajectory, about, joints, feed_of)
        program, notes = _planned(plan, directory, blocks)
        if program is not None:
            (new / PLANNED).write_bytes(program)
        for name, text in program_to_keep(plan).items():
            (new / name).write_bytes(text)
        if plots:
            from planner.report.plots import write_figures

            write_figures(plan, new)
        if report:
            from planner.report.html.page import REPORT, report_page

            page = report_page(plan, source_text(plan), {**summary(plan), "notes": [*plan.notes, *notes]})
            (new / REPORT).write_text(page, encoding="utf-8")
        sums = checksums(new)
        names = sorted([SUMMARY, *sums])
        said = {
            **summary(plan),
            "run_id": run_id,
            "files": names,
            "sha256": sums,
            "notes": [*plan.notes, *notes],
        }
        _write_json(new / SUMMARY, said)
    return names


def program_to_keep(plan: Plan) -> dict[str, bytes]:
    """The program of a plan as a file, by name, if it was given as a text or as points: no other file has it. Empty otherwise."""
    if plan.program.text is not None:
        return {KEPT_TEXT: plan.program.text}
    return {KEPT_POINTS: points_file(plan.program)} if plan.program.source == SOURCE else {}


def program_file(directory: Path, source: str) -> str:
    """Where a plan's program is: its `source`, or in the plan's directory if it was given as a text or as points."""
    kept = [directory / name for name in KEPT if (directory / name).exists()]
    return str(kept[0]) if kept and source.startswith("<") else source


def check_places(
    directory: Path,
    inputs: Sequence[Path],
    *,
    file_format: Format,
    plots: bool,
    force: bool,
    report: bool = False,
) -> None:
    """Raise InputError if `write_plan` could not write into a directory.

    That is so if one of its files is among the `inputs` (program and machine), or exists and no run wrote it. A `planned.ngc` that is
    the program itself stays as it is and is no reason.
    """
    names = [f"trajectory.{file_format}", SUMMARY]
    names += [CSV_METADATA] * (file_format == "csv") + ["toolpath.png", "profiles.png"] * plots
    names += ["report.html"] * report
    refuse_inputs([directory / name for name in names], inputs)
    with suppress(InputError):
        refuse_inputs([directory / PLANNED], inputs[:1])
        names.append(PLANNED)
    check_output(directory, names, force=force)


def summary(plan: Plan) -> dict[str, Any]:
    """The plan in numbers, ready for JSON: what `planner plan --json` prints."""
    verdict = plan.verdict
    return json_ready(
        {
            "program": plan.program.source,
            "assumptions": plan.program.assumptions,
            "machine": plan.machine.name,
            "method": plan.method,
            "geometry": plan.geometry,
            "corner": plan.corner,
            "solver": plan.solver,
            "status": plan.status.name,
            "sentence": plan.sentence,
            "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
            "beside_motion": beside_summary(plan),
            "stop_time_s": plan.stop_time,
            "tolerance_mm": _uniform(plan.toolpath.tolerance),
            "verdict": verdict_summary(verdict) if verdict is not None else None,
            "corners": corner_summary(plan.corners) if plan.corners is not None else NO_CORNERS,
            **optimum_summary(plan.grid, plan.prices),
            "reading": plan.program.reading.changed(),
            "blocks": len(plan.program),
            "tool_point": _tool_point(plan.program.tool_point),
            "grid_points": plan.grid_points,
            "notes": plan.notes,
            "timings_s": plan.timings,
            "versions": versions(),
            "told": plan_rows(plan),
        }
    )


def verdict_summary(verdict: Verdict) -> dict[str, Any]:
    """A verdict in numbers: the largest ratio to each limit, errors, faults."""
    return json_ready(
        {**verdict.summary(), "not_limited": _not_limited(verdict), "faults": verdict.sentences}
    )


def corner_summary(corners: CornerCheck) -> dict[str, Any]:
    """Eq. 18-20 at the programmed corners in numbers."""
    return json_ready(corners.summary())


def _not_limited(verdict: Verdict) -> list[str]:
    """Quantities that are reported only: "jerk" for jerk.x, jerk.y ..."""
    return sorted({name.partition(".")[0] for name, check in verdict.limits.items() if not check.limited})


def info_summary(info: ProgramInfo) -> dict[str, Any]:
    """The figures of a program, ready for JSON. Keys and units are those of the fields of `ProgramInfo`.

    Of `unsupported` the first `PLACES_SHOWN` are listed; `unsupported_places` counts them all.
    """
    fields = {field.name: getattr(info, field.name) for field in dataclasses.fields(info)}
    fields["tool_point"] = _tool_point(info.tool_point)
    fields["expansion"] = None if info.expansion is None else dataclasses.asdict(info.expansion)
    fields["unsupported"] = [dataclasses.asdict(fault) for fault in info.unsupported[:PLACES_SHOWN]]
    fields["unsupported_places"] = len(info.unsupported)
    return json_ready(fields)


def trajectory_metadata(plan: Plan, run_id: str) -> dict[str, Any]:
    """The metadata of a trajectory file. `planner verify` reads machine, tolerance and `not_limited` from it."""
    trajectory = plan.trajectory
    assert trajectory is not None
    return json_ready(
        {
            "format": 1,
            "run_id": run_id,
            "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "program": plan.program.source,
            "assumptions": plan.program.assumptions,
            "method": plan.method,
            "geometry": plan.geometry,
            "corner": plan.corner,
            "dt_s": trajectory.dt,
            "tolerance_mm": _uniform(plan.toolpath.tolerance),
            "reading": plan.program.reading.changed(),
            "not_limited": _not_limited(plan.verdict) if plan.verdict is not None else [],
            "units": units(
                trajectory.axes,
                extruder=plan.toolpath.extrusion is not None,
                tip=plan.joints is not None,
                feed=WordFeed(plan.toolpath).units,
            ),
            "tool_point": _tool_point(plan.program.tool_point),
            "machine": plan.machine.model_dump(mode="json", exclude_none=True),
            "versions": versions(),
        }
    )


def _tool_point(point: ToolPoint | None) -> dict[str, Any] | None:
    """Where the tool centre point is on, and the tool's length; None where x, y and z are those of the joints."""
    return None if point is None else dataclasses.asdict(point)


def versions() -> dict[str, str]:
    """Versions of this package, of Python, and of the packages that compute."""
    found = {"planner": metadata.version("feedrate-planner"), "python": platform.python_version()}
    return found | {name: metadata.version(name) for name in PACKAGES}


def _planned(plan: Plan, directory: Path, blocks: PlannedBlocks | None) -> tuple[bytes | None, list[str]]:
    """The re-timed program, or None, and notes on it; `blocks` if their times are known already."""
    if _is_source(plan, directory / PLANNED):
        return None, [f"{PLANNED} is the program that was planned, and stays as it is"]
    try:
        return planned_program(plan, blocks)
    except LeftOut as why:
        return None, [f"{PLANNED} is left out: {why}"]


def _is_source(plan: Plan, file: Path) -> bool:
    """Whether the plan's program was read from that file, which must then not be replaced."""
    return file.exists() and Path(plan.program.source).resolve() == file.resolve()


def _uniform(tolerance: FloatArray) -> float | None:
    """The contour tolerance if it is the same at every joint; None where the program changes it (G64 P)."""
    return float(tolerance[0]) if len(tolerance) and (tolerance == tolerance[0]).all() else None


def json_ready(value: Any) -> Any:
    """Numbers, strings, lists and dictionaries only; NaN and infinity, which JSON lacks, become None."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [json_ready(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=2, allow_nan=False) + "\n", encoding="utf-8")
