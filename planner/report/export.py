"""The files of a plan, and the plan in numbers.

`trajectory.parquet`, `.csv` or `.npz` (`planner.report.trajectory_file`), `planned.ngc` if the program is an
NC text (`planner.report.planned`), the program itself with what it calls, `summary.json`, and pictures if
asked for. They take their places together (`planner.report.replace`), and trajectory and summary carry the
same `run_id`.
"""

from __future__ import annotations

import datetime
import json
import uuid
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.base.errors import InputError
from planner.motion.on_demand import TrajectoryOnDemand
from planner.nc.points import are_points, is_points, points_file
from planner.report.planned import LeftOut, planned_program
from planner.report.replace import (
    CSV_METADATA,
    FEED_CAPS,
    OUTPUTS,
    PROGRAM,
    SUMMARY,
    check_output,
    checksums,
    is_ours,
    refuse_inputs,
    replacing,
)
from planner.report.summary import json_ready, summary, tool_point_summary, versions
from planner.report.trajectory_file import Format, PlanColumns, write_trajectory
from planner.report.word_feed import BlockWatch, PlannedBlocks

if TYPE_CHECKING:
    from planner.nc.program import Program
    from planner.planning.job.plan import Plan

PLANNED = "planned.ngc"
KEPT = "program"  # the program in the directory of its plan, with the suffix of its file
OF_FILES = ("run_id", "files", "sha256")  # what `summary.json` has besides the summary of the plan


def write_plan(
    plan: Plan,
    directory: str | Path,
    *,
    file_format: Format = "parquet",
    plots: bool = False,
    report: bool = False,
    force: bool = False,
    units: str | None = None,
) -> list[str]:
    """Write the files of a solved plan into a directory, all of them or none.

    file_format : of the trajectory
    plots       : write pictures too
    report      : write a page that opens in a browser, too (report/html/page.py)
    force       : replace files of these names even if no run wrote them
    units       : of pictures and page, "mm" or "inch"; None for those of the program

    Returns the names of the files. The `notes` of the summary are those of the plan, followed by what was
    left out and why.

    Raises InputError if the directory cannot be written, or if a file is in the way that no run wrote. Raises
    ValueError for a plan without a trajectory.
    """
    if plan.trajectory is None:
        raise ValueError("write_plan: the plan has no trajectory; see plan.sentence")
    directory = Path(directory)
    run_id = uuid.uuid4().hex
    beside = files_to_keep(plan.program)
    kept = {name for name in (PLANNED, *beside) if _is_source(plan, directory / name)}
    for name, text in beside.items():  # the user's own, which no run wrote
        there = directory / name
        kept |= {name} if there.is_file() and there.read_bytes() == text and not is_ours(there) else set()
    with replacing(directory, kept=kept, force=force) as new:
        about, columns = trajectory_metadata(plan, run_id), PlanColumns(plan)
        trajectory, blocks, file = plan.trajectory, None, new / f"trajectory.{file_format}"
        if isinstance(trajectory, TrajectoryOnDemand):  # evaluated once for both files
            watch = BlockWatch(plan.toolpath)
            write_trajectory(file, trajectory.heard_by(watch.take), about, columns)
            blocks = watch.planned(trajectory)
        else:
            write_trajectory(file, trajectory, about, columns)
        program, notes = _planned(plan, directory, blocks)
        if program is not None:
            (new / PLANNED).write_bytes(program)
        for name in beside.keys() - kept:
            (new / name).write_bytes(beside[name])
        if plots:
            from planner.report.plots import write_figures

            write_figures(plan, new, units)
        said = {**summary(plan), "notes": [*plan.notes, *notes]}
        if report:
            from planner.report.html.page import REPORT, report_page

            page = report_page(plan, said, units)
            (new / REPORT).write_text(page, encoding="utf-8")
        sums = checksums(new)
        names = sorted([SUMMARY, *sums])
        said |= dict(zip(OF_FILES, (run_id, names, sums), strict=True))
        (new / SUMMARY).write_text(json.dumps(said, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return names


def files_to_keep(program: Program) -> dict[str, bytes]:
    """A program, and the files that it calls, by their names in the directory of its plan: what reads the plan
    again needs no others. The program is the first; there is none that Python made of more than points and
    curves.

    Raises InputError for a called file whose name is that of another file of the directory.
    """
    if program.text is None:
        return {f"{KEPT}.json": points_file(program)} if is_points(program) else {}
    files = {kept_name(program.source, program.text): program.text}
    for called in {frame.source for frame in program.frames} - {program.source}:
        name = Path(called).name
        if name in (*OUTPUTS, SUMMARY, *files):
            what = f"the program calls {name}, and a plan's directory has a file of that name of its own; rename it"
            raise InputError(what, source=called)
        with suppress(OSError):
            files[name] = Path(called).read_bytes()
    if program.reading.caps is not None:
        files[FEED_CAPS] = program.reading.caps.text
    return files


def kept_name(source: str, text: bytes = b"") -> str:
    """What the program of that file, or of that text, is called in the directory of its plan: "program.mpf"
    of "part.MPF"."""
    suffix = ".json" if are_points(text) else Path(source).suffix.lower()
    named = PROGRAM.fullmatch(KEPT + suffix) and not source.startswith("<")
    return KEPT + (suffix if named else ".ngc")


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

    That is so if one of its files is among the `inputs` (program and machine), or exists and no run wrote it.
    A file that is the program itself stays as it is and is no reason.
    """
    names = [f"trajectory.{file_format}", SUMMARY]
    names += [CSV_METADATA] * (file_format == "csv") + ["toolpath.png", "profiles.png"] * plots
    names += ["report.html"] * report
    refuse_inputs([directory / name for name in names], inputs)
    for name in (PLANNED, kept_name(str(inputs[0]))):
        with suppress(InputError):
            refuse_inputs([directory / name], inputs[:1])
            names.append(name)
    check_output(directory, names, force=force)


def trajectory_metadata(plan: Plan, run_id: str) -> dict[str, Any]:
    """The metadata of a trajectory file. `planner verify` reads machine, tolerance and `not_limited` from
    it."""
    trajectory = plan.trajectory
    assert trajectory is not None
    return json_ready(
        {
            "format": 1,
            "run_id": run_id,
            "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "program": plan.program.source,
            "kept": next(iter(files_to_keep(plan.program)), None),
            "assumptions": plan.program.assumptions,
            "method": plan.method,
            "geometry": plan.geometry,
            "corner": plan.corner,
            "dt_s": trajectory.dt,
            "tolerance_mm": plan.toolpath.same_tolerance,
            "reading": plan.program.reading.changed(),
            "not_limited": plan.verdict.not_limited if plan.verdict is not None else (),
            "units": PlanColumns(plan).units,
            "tool_point": tool_point_summary(plan.program.tool_point),
            "machine": plan.machine.model_dump(mode="json", exclude_none=True),
            "versions": versions(),
        }
    )


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
