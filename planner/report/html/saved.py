"""A plan again, from the files that `planner plan -o DIR` wrote: for a report of it."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from planner.base.errors import InputError
from planner.feedrate.solution import Status
from planner.machine import machine_from_dict
from planner.motion.chain_setpoints import tip_of_setpoints
from planner.nc.reader import read_program
from planner.planning.job.at_tip import chain_of
from planner.planning.job.plan import Plan
from planner.report.judging import FileSays, is_number, judge
from planner.report.replace import SUMMARY
from planner.report.summary import json_ready
from planner.report.trajectory_reader import read_trajectory, trajectory_file
from planner.report.word_feed import WordFeed


def saved_plan(directory: Path) -> tuple[Plan, dict[str, Any]]:
    """The plan that a directory holds, judged anew, and its summary.

    The program is that in the directory. The plan lacks what files do not hold: the profile at the grid
    points and the prices (those are in the summary).

    Raises InputError if a file is missing or damaged, or if the trajectory is not that of the program.
    """
    summary = _summary(directory / SUMMARY)
    file = trajectory_file(directory)
    read = read_trajectory(file)
    if read.metadata.get("run_id") != summary.get("run_id"):
        raise InputError("the trajectory and the summary are of two runs; plan again", source=str(directory))
    says = FileSays.of(read.metadata)
    if says.wrong or says.machine is None:
        wrong = ", ".join(f"{name} is {str(read.metadata.get(name))[:40]}" for name in says.wrong[:1])
        raise InputError(f"its metadata are not those of a plan: {wrong}; plan again", source=str(file))
    machine = machine_from_dict(says.machine, source=f"{file} (its own machine)")
    program = read_program(says.program_at(file), machine, says.reading_at(file))
    if len(program) != summary["blocks"]:
        raise InputError(
            f"the program has {len(program):,} blocks now, and had {summary['blocks']:,} when it was planned; plan again",
            source=program.source,
        )
    found = judge(read, program, machine, tolerance=says.tolerance, not_limited=says.not_limited)
    motion, toolpath, machine = found.motion, found.toolpath, found.machine
    chain = chain_of(program, machine)
    trajectory = motion if chain is None else tip_of_setpoints(motion, chain)
    if WordFeed(toolpath).mixed:  # files have the feed that F means
        trajectory = dataclasses.replace(trajectory, feed=np.linalg.norm(trajectory.velocity, axis=1))
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
        trajectory=trajectory,
        joints=None if chain is None else motion,
        verdict=found.verdict,
        grid=None,
        stop_time=math.inf if stop_time is None else stop_time,
        grid_points=summary["grid_points"],
        notes=tuple(summary["notes"]),
        timings=summary["timings_s"],
    )
    return plan, summary


# What the summary of a plan has, and of which kind.
_KINDS: dict[str, Callable[[Any], bool]] = {
    "run_id": lambda value: isinstance(value, str),
    "program": lambda value: isinstance(value, str),
    "method": lambda value: isinstance(value, str),
    "corner": lambda value: value is None or isinstance(value, str),
    "solver": lambda value: isinstance(value, str),
    "status": lambda value: isinstance(value, str) and value in Status.__members__,
    "sentence": lambda value: isinstance(value, str),
    "blocks": lambda value: isinstance(value, int),
    "grid_points": lambda value: isinstance(value, int),
    "notes": lambda value: isinstance(value, list) and all(isinstance(note, str) for note in value),
    "timings_s": lambda value: isinstance(value, dict) and all(map(is_number, value.values())),
    "stop_time_s": lambda value: value is None or is_number(value),
}


def _summary(file: Path) -> dict[str, Any]:
    try:
        said = json.loads(file.read_bytes())
    except FileNotFoundError as fault:
        raise InputError(
            "there is no summary here; write one with: planner plan JOB -o DIR", source=str(file.parent)
        ) from fault
    except (OSError, ValueError, RecursionError) as fault:
        raise InputError(f"cannot be read: {fault}", source=str(file)) from fault
    missing = [key for key in _KINDS if not isinstance(said, dict) or key not in said]
    if missing:
        raise InputError(f"no summary of a plan: {', '.join(missing)} missing", source=str(file))
    for key, right in _KINDS.items():
        if not right(said[key]):
            raise InputError(f"no summary of a plan: {key} is {str(said[key])[:40]}", source=str(file))
    return dict(json_ready(said))
