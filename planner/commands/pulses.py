"""`planner pulses`: step and direction pulses of a trajectory file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError
from planner.commands.options import ForceOption, JsonOption
from planner.commands.terminal import FAILED, guarded, say

if TYPE_CHECKING:
    from planner.motion.pulses import AxisPulses


@guarded
def pulses_command(
    trajectory: Annotated[
        Path,
        typer.Argument(
            metavar="TRAJECTORY",
            help="trajectory file (.parquet, .csv, .npz), or directory that 'plan -o' wrote",
        ),
    ],
    steps: Annotated[
        str, typer.Option(metavar="x=400,y=400", help="pulses per mm of each axis (rotary axes: per degree)")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="file for the pulses (.parquet, .csv)"),
    ] = None,
    max_frequency: Annotated[
        float | None, typer.Option(metavar="HZ", help="highest pulse rate that the drives can take [1/s]")
    ] = None,
    pulse_width: Annotated[
        float | None, typer.Option(metavar="US", help="shortest high and low time of the step signal [us]")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Make step and direction pulses of a trajectory, at every instant within one pulse of it.

    If the pulses follow each other faster than the drives can take, nothing is written and the exit code is 1.
    """
    from planner.motion.pulses import Drive, overrun, pulses_of
    from planner.report.pulse_file import SUFFIXES, write_pulses
    from planner.report.replace import check_file
    from planner.report.trajectory_reader import read_trajectory, trajectory_file

    wanted = parse_steps(steps)
    if output is not None:
        check_file(output, [trajectory], suffixes=SUFFIXES, force=force)
    drive = Drive(frequency_max=max_frequency, width=None if pulse_width is None else pulse_width * 1e-6)
    trajectory = trajectory_file(trajectory)
    read = read_trajectory(trajectory)
    trains = pulses_of(read.trajectory, wanted)
    faults = overrun(trains, drive)
    if output is not None and not faults:
        about: dict[str, Any] = {
            name: value for name, value in read.metadata.items() if name in ("run_id", "program")
        }
        write_pulses(output, trains, about)
    if as_json:
        say(json.dumps({"axes": _figures(trains), "faults": faults}, indent=2, allow_nan=False))
    else:
        for axis, figures in _figures(trains).items():
            rate = figures["highest_frequency_hz"]
            say(
                f"{axis}: {figures['pulses']:,} pulses, {figures['direction_changes']:,} changes of direction"
                + (f", at most {rate:,.0f} per second" if rate is not None else "")
            )
        for fault in faults:
            say(fault, err=True)
        if output is not None and not faults:
            say(str(output))
    if faults:
        raise typer.Exit(FAILED)


def parse_steps(text: str) -> dict[str, float]:
    """Axes and numbers of `x=400,y=400`. Raises InputError naming the part that is not one."""
    found: dict[str, float] = {}
    for part in text.split(","):
        axis, equals, value = (word.strip() for word in part.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        if not equals or len(axis) != 1 or not number > 0 or axis.lower() in found:
            raise InputError(f"--steps: '{part}'; write each axis once, as in x=400,y=400")
        found[axis.lower()] = number
    return found


def _figures(trains: tuple[AxisPulses, ...]) -> dict[str, dict[str, Any]]:
    return {
        train.axis: {
            "steps": train.steps,
            "pulses": len(train),
            "direction_changes": train.changes,
            "highest_frequency_hz": train.frequency_max,
        }
        for train in trains
    }
