"""`planner export`: the setpoints of a plan as files that a control plays."""

from __future__ import annotations

import os
import shutil
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands.terminal import guarded, say


class For(StrEnum):
    """What the files are for."""

    stream = "linuxcnc-stream"
    pvt = "pvt"


class Unit(StrEnum):
    """Length units of the files."""

    mm = "mm"
    inch = "inch"


@guarded
def export_command(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="directory that 'plan -o' wrote, or a trajectory file")
    ],
    for_: Annotated[
        For,
        typer.Option(
            "--for",
            help="linuxcnc-stream: setpoints for the streamer of LinuxCNC's HAL, with the HAL files; pvt: positions, velocities, times",
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="new directory for the files")
    ],
    unit: Annotated[Unit, typer.Option("--unit", help="length unit of the files")] = Unit.mm,
    within: Annotated[
        float | None,
        typer.Option(
            "--within",
            metavar="MM",
            help="pvt: how far the cubics between rows may be from the setpoints [mm] (default 0.001)",
        ),
    ] = None,
) -> None:
    """Write the setpoints of a plan for a control that plays them."""
    from planner.control_files.pvt import WITHIN, write_pvt
    from planner.control_files.stream import write_stream
    from planner.report.trajectory_reader import read_trajectory

    if within is not None and for_ is not For.pvt:
        raise InputError(f"--within is for pvt; --for {for_} takes every setpoint as it is")
    if os.path.lexists(output):
        raise InputError("exists already and is not overwritten; give another name", source=str(output))
    trajectory = read_trajectory(_trajectory(plan)).trajectory
    new = output.with_name(f".{output.name}.{os.getpid()}")
    try:
        new.mkdir(parents=True)
        if for_ is For.stream:
            write_stream(new, trajectory, unit)
            said = f"{len(trajectory):,} rows, one every {trajectory.dt * 1e3:g} ms; try them with: halrun -f try.hal"
        else:
            periods, miss = write_pvt(new, trajectory, unit, WITHIN if within is None else within)
            said = f"a row every {periods * trajectory.dt * 1e3:g} ms, cubics between them within {miss * 1e3:.2g} um of the setpoints"
        new.rename(output)
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror}", source=str(output)) from fault
    finally:
        shutil.rmtree(new, ignore_errors=True)
    say(f"{output}: {said}")


def _trajectory(plan: Path) -> Path:
    """The trajectory file of a plan. Raises InputError if its directory has none."""
    if not plan.is_dir():
        return plan
    found = [plan / f"trajectory.{suffix}" for suffix in ("parquet", "csv", "npz")]
    for file in found:
        if file.exists():
            return file
    raise InputError(
        "no trajectory in this directory; write one with: planner plan JOB -o DIR", source=str(plan)
    )
