"""A plan again, from the files that `planner plan -o DIR` wrote: for a report of it."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program
from planner.job.plan import Plan
from planner.machine import machine_from_dict
from planner.nc.points import are_points
from planner.nc.reader import load, parse_program
from planner.nc.reading import Reading
from planner.report.export import program_file
from planner.report.replace import SUMMARY
from planner.report.trajectory_reader import read_trajectory
from planner.verify import verify


def saved_plan(directory: Path) -> tuple[Plan, dict[str, Any], bytes | None]:
    """The plan that a directory holds, judged anew; its summary; and the text of its program, None for points.

    The program is read from where it was planned, or from the directory if it was given as a text or as points. The plan lacks
    what files do not hold: the profile at the grid points and the prices (those are in the summary).

    Raises InputError if a file is missing or damaged, or if the trajectory is not that of the program.
    """
    summary = _summary(directory / SUMMARY)
    found = [directory / f"trajectory.{suffix}" for suffix in ("parquet", "csv", "npz")]
    files = [file for file in found if file.exists()]
    if not files:
        raise InputError(
            "there is no trajectory here; write one with: planner plan JOB -o DIR", source=str(directory)
        )
    read = read_trajectory(files[0])
    if read.metadata.get("run_id") != summary.get("run_id"):
        raise InputError("the trajectory and the summary are of two runs; plan again", source=str(directory))
    source = program_file(directory, summary["program"])
    text = load(source)
    machine = machine_from_dict(read.metadata["machine"], source=f"{files[0]} (its own machine)")
    reading = Reading.saved(read.metadata.get("reading"))
    program = parse_program(text, machine, reading, source=source)
    toolpath = toolpath_from_program(program, machine, read.metadata.get("tolerance_mm"))
    if len(program) != summary["blocks"]:
        raise InputError(
            f"the program has {len(program):,} blocks now, and had {summary['blocks']:,} when it was planned; plan again",
            source=source,
        )
    free = tuple(read.metadata.get("not_limited", ()))
    verdict = verify(read.trajectory, toolpath, machine, given=read.given, not_limited=free)
    stop_time = summary.get("stop_time_s")
    plan = Plan(
        method=summary["method"],
        corner=summary["corner"],
        solver=summary["solver"],
        program=program,
        machine=machine,
        toolpath=toolpath,
        status=Status[summary["status"]],
        sentence=summary["sentence"],
        trajectory=read.trajectory,
        verdict=verdict,
        rounded=None,
        grid=None,
        stop_time=math.inf if stop_time is None else stop_time,
        grid_points=summary["grid_points"],
        notes=tuple(summary["notes"]),
        timings=summary["timings_s"],
    )
    return plan, summary, None if are_points(text) else text


_KEYS = (
    "program",
    "method",
    "corner",
    "solver",
    "status",
    "sentence",
    "blocks",
    "grid_points",
    "notes",
    "timings_s",
)


def _summary(file: Path) -> dict[str, Any]:
    try:
        said = json.loads(file.read_bytes())
    except FileNotFoundError as fault:
        raise InputError(
            "there is no summary here; write one with: planner plan JOB -o DIR", source=str(file.parent)
        ) from fault
    except (OSError, ValueError, RecursionError) as fault:
        raise InputError(f"cannot be read: {fault}", source=str(file)) from fault
    missing = [key for key in _KEYS if not isinstance(said, dict) or key not in said]
    if missing:
        raise InputError(f"no summary of a plan: {', '.join(missing)} missing", source=str(file))
    return dict(said)
