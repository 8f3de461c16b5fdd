"""What `what-if` and `sweep` share: the options of a job that is planned many times, and how such a command ends."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any, get_args

import typer

from planner.base.errors import InputError
from planner.commands.exit_codes import FAILED, NOT_SOLVED
from planner.commands.options import (
    DEFAULT_MACHINE,
    Job,
    MachineOption,
    ToleranceOption,
    takes_planning,
    takes_reading,
    taking,
)
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.commands.study.variant import StudiedJob
else:
    StudiedJob = Any  # of the commands' arguments: the module is loaded when a command runs

_JOB: dict[str, Any] = {
    "job": get_args(Job),
    "machine": get_args(MachineOption),
    "tolerance": get_args(ToleranceOption),
    "how": (dict, None),  # in the place of these two come the options of planning and of the reader
    "reading": (Reading, None),
}


def takes_studied_job(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of a job, of planning and of the reader; it gets them as one argument, `studied`."""
    usual = dict.fromkeys(_JOB, None) | {"job": inspect.Parameter.empty}
    of_job = taking(command, "studied", _JOB, usual, lambda given: _studied_job(**given))
    return takes_reading(takes_planning(of_job))


def _studied_job(
    *, job: Any, machine: str | None, tolerance: float | None, how: dict[str, Any], reading: Reading
) -> StudiedJob:
    """The job of a command line, read. Raises InputError, for settings that the method does not use too."""
    from planner.commands.study.variant import StudiedJob
    from planner.machine import load_machine
    from planner.nc.reader import read_program
    from planner.planning.methods.registry import check_settings

    check_settings(**how)
    if tolerance is not None and not 0.0 < tolerance < float("inf"):
        raise InputError(f"tolerance {tolerance} mm; it must be positive and finite")
    limits = load_machine(machine or DEFAULT_MACHINE)
    program = read_program(job, limits, reading)
    return StudiedJob(program=program, machine=limits, tolerance=tolerance, how=how)


def title_of(studied: StudiedJob) -> str:
    """The head of a table of its plans."""
    return f"{studied.program.source}: {studied.how['method']}, machine {studied.machine.name}"


def end_with(outcomes: Collection[str]) -> None:
    """End the command with exit code 0 if all plans passed, 1 if one failed its verdict, 3 if one has no motion."""
    if set(outcomes) != {"passed"}:
        raise typer.Exit(FAILED if set(outcomes) <= {"passed", "failed"} else NOT_SOLVED)
