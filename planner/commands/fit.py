"""`planner machine fit`: a machine file from how long test programs took."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.terminal import guarded, say


@guarded
def fit_command(
    times: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="PROGRAM=SECONDS", help="a program and how long the control took for it [s]; all five"
        ),
    ] = None,
    machine: options.MachineOption = None,
    control: Annotated[
        str | None, typer.Option("--control", metavar="NAME", help="linuxcnc, grbl, klipper or marlin")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option("--write", metavar="DIR", help="write the test programs into a new directory"),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="machine file to write (.toml)")
    ] = None,
) -> None:
    """Find accelerations, the speed at corners and a factor from the times of five test programs, which --write makes."""
    from planner.controls.timing.fit import fitted, machine_text, programs_to_time
    from planner.controls.timing.times import control_named, control_times
    from planner.nc.reader import read_program
    from planner.report.replace import write_new

    if (write is None) == (not times):
        raise InputError("give --write DIR to get the test programs, or PROGRAM=SECONDS of each of them")
    limits = machine_named(machine)
    name = control_named(control, limits)
    if write is not None:
        try:
            write.mkdir(parents=True)
        except OSError as fault:
            raise InputError(f"cannot be made: {fault.strerror}", source=str(write)) from fault
        for file, text in programs_to_time(limits, name).items():
            write_new(write / file, text.encode())
            took = control_times(read_program(text=text), limits, name).seconds
            say(f"{write / file}: about {took:.0f} s, from X0 Y0 Z0; measure how long it takes")
        return
    found = fitted(
        {file: (read_program(file, limits), took) for file, took in map(_time, times or [])}, limits, name
    )
    for what, before, value in found.settings:
        say(f"{what}: {value:.6g}, before {before:.6g}")
    for file, took, predicted in found.residuals:
        say(
            f"{file}: {took:.3f} s measured, {predicted:.3f} s predicted ({100.0 * (predicted / took - 1.0):+.2f} %)"
        )
    if output is not None:
        write_new(output, machine_text(found, name).encode())
        say(f"{output} written")


def _time(text: str) -> tuple[str, float]:
    file, _, number = text.rpartition("=")
    try:
        seconds = float(number)
    except ValueError:
        seconds = 0.0
    if not file or not 0.0 < seconds < float("inf"):
        raise InputError(f"'{text}': write a program and its seconds above 0, as in x.nc=61.2")
    return file, seconds
